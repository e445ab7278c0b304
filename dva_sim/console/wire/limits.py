"""Limits of a console's links: how much may wait, for how long, and how often something comes."""

from __future__ import annotations

from typing import Final

# --- from pages ----------------------------------------------------------------------------
MAX_BYTES: Final = 16 * 1024  # of a message or a body
LOOKS_RATE, LOOKS_BURST = 20.0, 60  # messages of a page that looks [1/s]
DRIVES_RATE, DRIVES_BURST = 150.0, 300  # of one that drives [1/s]

# --- from the web process to what is shown -------------------------------------------------
MAX_ACTIONS: Final = 64  # that may wait
MAX_URGENT: Final = 4096  # emergency stops and ends of drives, if the simulation hangs
MAX_BATCHES: Final = 8  # of samples of a phone: at 40 ms each, as long as a drive lasts
MAX_PENDING: Final = 256  # questions without an answer; an emergency stop is always asked for
MAX_ASKING: Final = 4  # who wait for the same answer
ANSWER_WAIT_S: Final = 5.0  # longest wait for an answer [s]
LONG: Final = 60.0  # for one that a robot or the DVA gives, or does not give after all attempts [s]
SILENCE: Final = 10.0  # after which a simulation that has begun counts as hung [s]
SILENT_AFTER: Final = 0.3  # without a word while something is held: it is let go [s]

# --- to pages ------------------------------------------------------------------------------
LOG_BATCH: Final = 200  # exchanges of a log that are told at once
LOG_BYTES: Final = 96_000  # of them, so that other lines do not wait for long
LOG_PERIOD: Final = 0.2  # from one batch to the next, real time [s]
OWN_KEPT: Final = 64  # lines for one page alone that may wait
STORY_KEPT: Final = 1000  # lines of the story, for pages that come later
