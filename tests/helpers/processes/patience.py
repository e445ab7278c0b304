"""Time limits of tests, generous enough that no test fails on a busy machine."""

import functools
import subprocess
import time
from collections.abc import Callable
from typing import Any

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


class Patient:
    """Test subject with its own clock, which lets time pass."""

    clock: Any
    step_s = 0.01

    def until(self, true: Callable[[], object]) -> None:
        """Let time pass until a condition holds."""
        end = self.clock.now + PATIENCE_S
        while not true():
            assert self.clock.now < end, "has not come true"
            self.clock.run(self.clock.now + self.step_s)

    def pause(self, seconds: float) -> None:
        self.clock.run(self.clock.now + seconds)
