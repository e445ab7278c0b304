"""Ctrl-C before a command has begun: one line instead of a traceback of loading.

It loads next to nothing itself, so that it is there first.
"""

import os
import signal
from typing import NoReturn


def end_at_once() -> None:
    """Let Ctrl-C end the process from now on: nothing has begun that must be put in order."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # nobody ignores it
        signal.signal(signal.SIGINT, _end)


def raise_again() -> None:
    """Let Ctrl-C raise `KeyboardInterrupt` again from now on."""
    if signal.getsignal(signal.SIGINT) is _end:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _end(*_: object) -> NoReturn:
    os.write(2, b"error: stopped by Ctrl-C\n")
    os._exit(130)
