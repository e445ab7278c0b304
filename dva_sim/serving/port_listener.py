"""Accepts the connections of a port, a few at a time, and cuts those that stay silent.

The event loop also carries the requests of open pages, including emergency stops, so a flood of new
connections must not occupy it for long: a silent connection costs almost nothing, and only a few
TLS handshakes are computed in a row.
"""

from __future__ import annotations

import asyncio
import resource
import socket
import ssl
import time
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Final

from dva_sim.serving.connection import HttpProtocol
from dva_sim.serving.port_connections import (
    MAX_CONNECTIONS,
    MAX_SERVED,
    SILENT,
    PortConnection,
    PortConnections,
)

ACCEPTS_PER_TURN: Final = 32  # maximum connections accepted before the loop serves others again
SERVED_AT_ONCE: Final = 32  # maximum connections with first bytes that are served in a turn
HANDSHAKES_AT_ONCE: Final = 4  # the same with TLS: a handshake takes 1 to 2 ms
SWEEP: Final = 1.0  # interval of checks for silent connections [s]
PAUSE: Final = 0.2  # pause when no file can be opened [s]
SPARE_FILES: Final = 128  # files other than connections: pipes, pages' files, the audit log
SHUTDOWN: Final = 1.0  # time for the end of a TLS connection [s]


def fitting_places(listeners: int) -> PortConnections:
    """Make the connections of one of `listeners` ports; few open files allow fewer."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    needed = listeners * MAX_CONNECTIONS + SPARE_FILES
    if soft != resource.RLIM_INFINITY and soft < needed:
        limit = needed if hard == resource.RLIM_INFINITY else min(hard, needed)
        resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, limit), hard))
        needed = max(soft, limit)
    limit = min(MAX_CONNECTIONS, max(16, (needed - SPARE_FILES) // listeners))
    return PortConnections(limit, MAX_SERVED * limit // MAX_CONNECTIONS)


class PortListener:
    """Accepts connections of one port.

    Args:
        sock: A listening socket that does not block.
        make: Function that makes the protocol of a connection.
        context: TLS settings; None: no TLS.
        places: The connections of the port.
    """

    def __init__(
        self,
        sock: socket.socket,
        make: Callable[[PortConnection], HttpProtocol],
        context: ssl.SSLContext | None,
        places: PortConnections,
    ) -> None:
        self._sock = sock
        self._make = make
        self._context = context
        self._places = places
        self._at_once = SERVED_AT_ONCE if context is None else HANDSHAKES_AT_ONCE
        self._speaking: deque[tuple[socket.socket, PortConnection]] = deque()
        self._connecting: set[asyncio.Task[None]] = set()

    async def run(self) -> None:
        """Accept until cancelled."""
        loop = asyncio.get_running_loop()
        loop.add_reader(self._sock, self._accept)
        try:
            while True:
                await asyncio.sleep(SWEEP)
                self._places.sweep(time.monotonic())
        finally:
            loop.remove_reader(self._sock)
            self._sock.close()
            for slot in list(self._places.connections):
                if not slot.is_served:
                    slot.drop()

    def _accept(self) -> None:
        for _ in range(ACCEPTS_PER_TURN):
            wait = self._places.wait(time.monotonic())
            if wait > 0.0:
                self._pause(wait)
                return
            try:
                connection, _ = self._sock.accept()
            except (BlockingIOError, InterruptedError, ConnectionAbortedError):
                return
            except OSError:  # no file descriptor is left, in this process or the whole system
                self._pause(PAUSE)
                return
            slot = self._places.enter(time.monotonic())
            slot.drop = partial(self._close, connection)
            asyncio.get_running_loop().add_reader(connection, self._queue, connection, slot)

    def _close(self, connection: socket.socket) -> None:
        asyncio.get_running_loop().remove_reader(connection)
        connection.close()

    def _queue(self, connection: socket.socket, slot: PortConnection) -> None:
        """Queue a connection whose first bytes have arrived."""
        loop = asyncio.get_running_loop()
        loop.remove_reader(connection)
        if not self._speaking:
            loop.call_soon(self._serve_some)
        self._speaking.append((connection, slot))

    def _serve_some(self) -> None:
        served = 0
        while self._speaking and served < self._at_once:
            connection, slot = self._speaking.pop()  # the newest: older ones may be cut meanwhile
            if slot in self._places.connections:
                served += 1
                slot.since = time.monotonic()
                task = asyncio.ensure_future(self._connect(connection, slot))
                slot.drop = task.cancel
                self._connecting.add(task)
                task.add_done_callback(self._connecting.discard)
        if self._speaking:
            asyncio.get_running_loop().call_soon(self._serve_some)

    def _pause(self, wait: float) -> None:
        loop = asyncio.get_running_loop()
        loop.remove_reader(self._sock)
        loop.call_later(wait, self._resume)

    def _resume(self) -> None:
        if self._sock.fileno() >= 0:
            asyncio.get_running_loop().add_reader(self._sock, self._accept)

    async def _connect(self, connection: socket.socket, slot: PortConnection) -> None:
        """Make the TLS handshake, if any, and hand the connection to the protocol."""
        within = {} if self._context is None else _TLS
        protocol = self._make(slot)
        try:
            await asyncio.get_running_loop().connect_accepted_socket(
                lambda: protocol, connection, ssl=self._context, **within
            )
        except (OSError, asyncio.CancelledError):
            slot.leave()
            if protocol.is_made:
                protocol.cut()  # its transport closes the socket; the file number may be reused
            else:
                connection.close()


_TLS: Final = {"ssl_handshake_timeout": SILENT, "ssl_shutdown_timeout": SHUTDOWN}
