"""A limit for one run: a run that stalls ends as a failure, whatever it is doing."""

from __future__ import annotations

import faulthandler
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

GRACE = 1.5  # times the limit: then the whole process ends, if nothing else helps
INSIST = 1.0  # pause before a run that took no notice is told again [s]


class RunTooLong(BaseException):
    """A run has taken too long. No `Exception`, so that no policy takes it for its own."""


@contextmanager
def limited(seconds: float, may_exit: bool) -> Iterator[None]:
    """Let the block take so long at most [s], by the wall clock.

    Python code is stopped by an exception, again and again until it gives in. Code that never
    comes back to Python cannot be stopped so; its process is ended if `may_exit`, which takes
    no part in Python at all and so works in every case.

    Raises:
        RunTooLong: from inside the block.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(*_: object) -> None:
        raise RunTooLong(f"took more than its {seconds:g} s")

    before = signal.signal(signal.SIGALRM, stop)
    with open(os.devnull, "w") as nowhere:  # noqa: PTH123
        if may_exit:
            faulthandler.dump_traceback_later(GRACE * seconds + INSIST, exit=True, file=nowhere)
        signal.setitimer(signal.ITIMER_REAL, seconds, INSIST)
        try:
            yield
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0)
            signal.signal(signal.SIGALRM, before)
            if may_exit:
                faulthandler.cancel_dump_traceback_later()
