"""`python -m dva_sim` is `dva-sim`: what has to be done before all else, and then the program."""

import gc
from typing import NoReturn

from dva_sim.kernel import early_stop

NEW_OBJECTS = 20_000
"""So many are made before Python looks for reference cycles among them; by itself it looks at 700.

What is loaded stays: looking at it again and again took a twelfth of the time to begin.
"""


def main() -> NoReturn:
    """Entry point: `dva-sim`."""
    early_stop.end_at_once()
    gc.set_threshold(NEW_OBJECTS)
    from dva_sim.cli import main as program  # late: start-up, so that Ctrl-C is heard meanwhile

    program()


if __name__ == "__main__":
    main()
