"""The shipped models in words, by name: what `dva-sim list` says of them.

They stand here since the models themselves bring all that simulates.
"""

from typing import Final

WORDS: Final = {
    "full": "Robots, people, phones and every byte on the network.",
    "timed": "Whole shifts of the DVA, responders as travel and service times.",
    "task": "A block of trials of one person at a task of the literature.",
    "transports": (
        "A session beside TCP flows on a congested link, and one drive of one person over it."
    ),
    "middleware": "Commands over real middleware and an emulated link, in real time.",
}
