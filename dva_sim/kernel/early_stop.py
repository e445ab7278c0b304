"""Ctrl-C and SIGTERM during start-up: one line instead of an import traceback.

This module imports almost nothing, so that it takes effect early.
"""

import os
import signal
from typing import Final, NoReturn

STOPS: Final = signal.SIGINT, signal.SIGTERM
STOPPED: Final = "stopped; run the same command again"


def end_at_once() -> None:
    """Let Ctrl-C and SIGTERM end the process at once: nothing needs cleaning up yet."""
    for number in STOPS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _end)


def raise_again() -> None:
    """Let Ctrl-C and SIGTERM raise `KeyboardInterrupt` from now on."""
    for number in STOPS:
        if signal.getsignal(number) is _end:
            signal.signal(number, signal.default_int_handler)


def _end(*_: object) -> NoReturn:
    os.write(2, f"error: {STOPPED}\n".encode())
    os._exit(130)
