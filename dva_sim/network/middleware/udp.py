"""Datagrams: a command each, nothing is sent again, nothing waits."""

from __future__ import annotations

import select
import socket
import time
from contextlib import suppress
from typing import Final

from typing_extensions import override

from dva_sim.network.middleware.ends import (
    CommandTransport,
    Receive,
    Rendezvous,
    TransportEnd,
    TransportError,
    connected,
)

LARGEST: Final = 65_000  # maximum payload of a datagram, which IP sends in fragments [B]
_GREETING: Final = b"hello"
_AGAIN: Final = 0.2  # interval between two greetings [s]


class UdpTransport(CommandTransport):
    """Plain UDP."""

    title = "UDP"

    @override
    def near(self, place: Rendezvous, receive: Receive) -> TransportEnd:
        end = _Datagrams(place.near, 0, receive)
        return connected(end, lambda: end.find((place.far, place.port), place.ready_by))

    @override
    def far(self, place: Rendezvous, receive: Receive) -> TransportEnd:
        return _Datagrams(place.far, place.port, receive)


class _Datagrams(TransportEnd):
    """A socket; the robot's learns from a greeting where its pictures go."""

    def __init__(self, address: str, port: int, receive: Receive) -> None:
        self._receive = receive
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind((address, port))
        except OSError:
            self._socket.close()
            raise
        self._socket.setblocking(False)
        self._peer: tuple[str, int] | None = None
        self._is_near = False

    def find(self, peer: tuple[str, int], ready_by: float) -> None:
        """Greet the robot until it greets back."""
        self._peer = peer
        self._is_near = True
        while time.monotonic() < ready_by:
            self.send(_GREETING)
            if select.select([self._socket], [], [], _AGAIN)[0]:
                return
        raise TransportError("the robot does not answer")

    @override
    def send(self, data: bytes) -> bool:
        if self._peer is None or len(data) > LARGEST:
            return False
        with suppress(BlockingIOError, ConnectionRefusedError):
            return self._socket.sendto(data, self._peer) > 0
        return False

    @override
    def serve(self, until: float) -> None:
        while (left := until - time.monotonic()) > 0:
            if select.select([self._socket], [], [], left)[0]:
                with suppress(ConnectionRefusedError):
                    self._hear(*self._socket.recvfrom(65_536))

    def _hear(self, data: bytes, sender: tuple[str, int]) -> None:
        if data != _GREETING:
            self._receive(data)
        elif not self._is_near:
            self._peer = sender
            self.send(_GREETING)

    @override
    def close(self) -> None:
        self._socket.close()
