"""Ending signals of a program, received through a socket that can be waited for."""

from __future__ import annotations

import signal
import socket
from collections.abc import Iterator
from contextlib import contextmanager

ENDING = signal.SIGINT, signal.SIGTERM, signal.SIGHUP


@contextmanager
def caught_signals() -> Iterator[socket.socket]:
    """Receive ending signals on a socket, as one byte each with the signal's number.

    Signals that are ignored, such as SIGHUP under `nohup`, stay ignored.
    """
    reads, writes = socket.socketpair()
    writes.setblocking(False)
    # A Python handler may run too late: it waits for the main thread, which may be blocked.
    earlier_fd = signal.set_wakeup_fd(writes.fileno())
    caught = [n for n in ENDING if signal.getsignal(n) is not signal.SIG_IGN]
    earlier_handlers = {number: signal.signal(number, lambda *_: None) for number in caught}
    with reads, writes:
        try:
            yield reads
        finally:
            for number, handler in earlier_handlers.items():
                signal.signal(number, handler)
            signal.set_wakeup_fd(earlier_fd)
