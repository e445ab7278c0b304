"""A network between a browser and a console that falls silent, and closes no connection."""

from __future__ import annotations

import selectors
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

LOOK_S = 0.05  # interval of checks for the end [s]


class StoppableNetwork:
    """A proxy on a port of its own.

    Args:
        port: Port of the console, on this machine.

    Attributes:
        is_cut: True to drop all data in both directions.
    """

    def __init__(self, port: int) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._target = ("127.0.0.1", port)
        self.port: int = self._listener.getsockname()[1]
        self.is_cut = self._is_over = False
        self._others: dict[socket.socket, socket.socket] = {}
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def cut(self) -> None:
        """Forward nothing from now on."""
        self.is_cut = True

    def close(self) -> None:
        """End it, with all its connections."""
        self._is_over = True
        self._thread.join()
        for each in (self._listener, *self._others):
            each.close()
        self._selector.close()

    def _run(self) -> None:
        while not self._is_over:
            for key, _ in self._selector.select(LOOK_S):
                if key.fileobj is self._listener:
                    self._accept()
                elif isinstance(key.fileobj, socket.socket):
                    self._forward(key.fileobj)

    def _accept(self) -> None:
        near, _ = self._listener.accept()
        far = socket.create_connection(self._target)
        for near_end, far_end in ((near, far), (far, near)):
            self._others[near_end] = far_end
            self._selector.register(near_end, selectors.EVENT_READ)

    def _forward(self, source: socket.socket) -> None:
        data = b""
        with suppress(OSError):
            data = source.recv(1 << 16)
        if self.is_cut:
            if not data:
                self._selector.unregister(source)
            return
        with suppress(OSError):
            if data:
                self._others[source].sendall(data)
                return
            self._others[source].shutdown(socket.SHUT_WR)
        self._selector.unregister(source)


@contextmanager
def network_to(port: int) -> Iterator[StoppableNetwork]:
    """A network to a console, until the test is over."""
    network = StoppableNetwork(port)
    try:
        yield network
    finally:
        network.close()
