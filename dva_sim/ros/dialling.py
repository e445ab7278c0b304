"""TCP connections, made without blocking the thread of a run."""

from __future__ import annotations

import os
import select
import socket
from collections.abc import Callable
from typing import Final

from dva_sim.network.realtime import LiveClock

LOOK: Final = 0.01  # design: interval of checks whether it is connected [s]
OPENS_WITHIN: Final = 5.0  # design: time to connect [s]


class Dialling:
    """One attempt to connect.

    Args:
        clock: Clock that schedules the checks.
        host: Name or address.
        port: TCP port.
        connected: Callback for the connected, non-blocking socket.
        failed: Callback with the reason of a failure.
    """

    def __init__(
        self,
        clock: LiveClock,
        host: str,
        port: int,
        connected: Callable[[socket.socket], object],
        failed: Callable[[str], object],
    ) -> None:
        self._clock = clock
        self._connected = connected
        self._failed = failed
        self._deadline = clock.now + OPENS_WITHIN
        self._sock: socket.socket | None = None
        try:
            place = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
            self._sock = socket.socket(place[0], place[1])
            self._sock.setblocking(False)
            self._sock.connect_ex(place[4])
        except OSError as error:
            clock.call_after(0.0, failed, error.strerror or str(error))
            return
        clock.every(LOOK, self._look)

    def _look(self) -> bool:
        """Return True while TCP is connecting."""
        sock = self._sock
        if sock is None:
            return False
        if not select.select([], [sock], [], 0.0)[1]:
            if self._clock.now <= self._deadline:
                return True
            self.cancel()
            self._failed("does not answer")
            return False
        code = sock.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        if code:
            self.cancel()
            self._failed(os.strerror(code))
        else:
            self._sock = None
            self._connected(sock)
        return False

    def cancel(self) -> None:
        """Give up the attempt."""
        if self._sock is not None:
            self._sock.close()
            self._sock = None
