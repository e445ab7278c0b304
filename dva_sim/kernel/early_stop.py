"""Ctrl-C and SIGTERM before a command has begun: one line instead of a traceback of loading.

It loads next to nothing itself, so that it is there first.
"""

import os
import signal
from typing import Final, NoReturn

STOPS: Final = signal.SIGINT, signal.SIGTERM
STOPPED: Final = "stopped; run the same command again"


def end_at_once() -> None:
    """Let a stop end the process from now on: nothing has begun that must be put in order."""
    for number in STOPS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _end)


def raise_again() -> None:
    """Let a stop raise `KeyboardInterrupt` from now on."""
    for number in STOPS:
        if signal.getsignal(number) is _end:
            signal.signal(number, signal.default_int_handler)


def _end(*_: object) -> NoReturn:
    os.write(2, f"error: {STOPPED}\n".encode())
    os._exit(130)
