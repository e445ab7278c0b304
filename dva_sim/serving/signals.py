"""The signals that ask a program to end, as something to wait for."""

from __future__ import annotations

import signal
import socket
from collections.abc import Iterator
from contextlib import contextmanager

ENDING = signal.SIGINT, signal.SIGTERM, signal.SIGHUP


@contextmanager
def caught_signals() -> Iterator[socket.socket]:
    """Give a socket that yields the number of each signal that would end this process, as a byte.

    Signals that are ignored, as SIGHUP by `nohup`, stay so.
    """
    reads, writes = socket.socketpair()
    writes.setblocking(False)
    # A handler of Python's own may run too late: another thread may have got the signal.
    woken = signal.set_wakeup_fd(writes.fileno())
    heard = [n for n in ENDING if signal.getsignal(n) is not signal.SIG_IGN]
    before = {number: signal.signal(number, lambda *_: None) for number in heard}
    with reads, writes:
        try:
            yield reads
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)
            signal.set_wakeup_fd(woken)
