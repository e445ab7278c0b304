"""A limit for one run: a run that stalls ends as a failure, whatever it is doing."""

from __future__ import annotations

import ctypes
import faulthandler
import math
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

GRACE = 1.5  # times the limit: then the whole process ends, if nothing else helps
INSIST = 1.0  # pause before a run that took no notice is told again [s]


class RunTooLong(BaseException):
    """A run has taken too long. No `Exception`, so that no policy takes it for its own."""


@contextmanager
def limited(seconds: float, may_exit: bool) -> Iterator[None]:
    """Let the block take so long at most [s], by the wall clock.

    Time in which the whole process was stopped (Ctrl-Z) does not count. Python code is ended by
    an exception, again and again until it gives in. Code that never comes back to Python cannot
    be ended so; its process is ended if `may_exit`, which takes no part in Python at all and so
    works in every case.

    Raises:
        RunTooLong: from inside the block.
    """
    is_main = threading.current_thread() is threading.main_thread()
    with open(os.devnull, "w") as nowhere:  # noqa: PTH123
        if may_exit:
            faulthandler.dump_traceback_later(GRACE * seconds + INSIST, exit=True, file=nowhere)
        try:
            with _by_signal(seconds) if is_main else _by_thread(seconds):
                yield
        finally:
            if may_exit:
                faulthandler.cancel_dump_traceback_later()


@contextmanager
def _by_signal(seconds: float) -> Iterator[None]:
    """Signals at each of several ticks, since a process that is stopped misses all but one."""
    ticks = math.ceil(seconds)
    left = ticks

    def tick(*_: object) -> None:
        nonlocal left
        left -= 1
        if left <= 0:
            raise RunTooLong(f"took more than its {seconds:g} s")

    before = signal.signal(signal.SIGALRM, tick)
    signal.setitimer(signal.ITIMER_REAL, seconds / ticks, seconds / ticks)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


@contextmanager
def _by_thread(seconds: float) -> Iterator[None]:
    """Signals reach the main thread only; another thread has to be told by a third."""
    told, over = threading.get_ident(), threading.Event()
    lock, raised = threading.Lock(), False

    def insist() -> None:
        nonlocal raised
        pause = seconds
        while not over.wait(pause):
            with lock:
                if not over.is_set():
                    raised = True
                    _raise_in(told)
            pause = INSIST

    watch = threading.Thread(target=insist, daemon=True)
    watch.start()
    try:
        yield
    except RunTooLong:
        raise RunTooLong(f"took more than its {seconds:g} s") from None
    finally:
        while not over.is_set():
            with suppress(RunTooLong), lock:  # it may come as late as here
                over.set()
                if raised:
                    _raise_in(told)  # in place of one that may still be under way
                    while True:  # until it comes
                        pass


def _raise_in(thread: int) -> None:
    """At the next step of Python code there.

    It has to come, and is not taken back: taken back, it leaves the interpreter looking for it for
    ever, and a profiler or debugger there never gets past its first step (CPython 3.11).
    """
    what = ctypes.py_object(RunTooLong)
    ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), what)
