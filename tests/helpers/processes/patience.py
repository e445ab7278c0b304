"""Time limits of tests, generous enough that no test fails on a busy machine."""

import functools
import subprocess
import time
from collections.abc import Callable

PATIENCE_S = 240.0
"""Less than the time-out of a test, so that who waits in vain can tell what for."""

LOOK_S = 0.02

run = functools.partial(subprocess.run, timeout=PATIENCE_S)
"""`subprocess.run`; who has not ended when patience does is killed."""


def becomes(true: Callable[[], object]) -> bool:
    """True if something becomes true before patience ends."""
    end = time.monotonic() + PATIENCE_S
    while not true():
        if time.monotonic() > end:
            return False
        time.sleep(LOOK_S)
    return True
