"""The patterns over ZeroMQ sockets, in real time.

Each node of this process has two sockets of its own: a ROUTER for the requests to it, on the
port it registers with, and an XPUB for what it publishes, on the next port. Peers connect to
them with REQ or DEALER, and with SUB. `protocol/README.md` says the same for other programs.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Final

import zmq

from dva_sim.errors import DvaSimError
from dva_sim.network.patterns import OnReply, Request, Service
from dva_sim.network.realtime import LiveClock

DEFAULT_PORT: Final = 5600  # of requests; what is published is on the next one
LARGEST: Final = 65_536  # ZeroMQ drops who sends longer messages [B]
LARGEST_PICTURE: Final = 2_000_000  # the same of a publisher [B]
DRAIN: Final = 64  # messages read from one socket before others have their turn
LINGER: Final = 200  # for last words when a node leaves [ms]
FIRST_TRY, LAST_TRY = 100, 2_000  # between attempts to connect [ms]
PORT_TRIES: Final = 50


class NetworkError(DvaSimError):
    """A port that cannot be opened."""


def split_address(address: str) -> tuple[str, int]:
    """Host and port of an address by the schema, such as `192.168.1.48:5600`, or without port."""
    host, _, port = address.partition(":")
    return host, int(port) if port else DEFAULT_PORT


class Security:
    """No keys: everybody may connect. What binds keys to sockets has the same methods."""

    def secure_server(self, socket: zmq.Socket[bytes], node: str) -> None:
        """Before a socket of `node` is bound."""

    def secure_client(self, socket: zmq.Socket[bytes], node: str, peer: str) -> None:
        """Before a socket of `node` is connected to `peer`."""

    def release(self, socket: zmq.Socket[bytes]) -> None:
        """Before a socket is closed."""

    def sender(self, frame: zmq.Frame) -> str | None:
        """Id of the device whose key opened the connection that a frame came by."""
        return None


class SocketNetwork:
    """The nodes of this process on the network; see `Transport`.

    Args:
        clock: Waits for the sockets.
        security: Gives sockets their keys.

    Attributes:
        counters: What was refused or could not be sent, by reason.
    """

    def __init__(self, clock: LiveClock, security: Security | None = None) -> None:
        self.clock = clock
        self.context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self.security = security or Security()
        self.counters: Counter[str] = Counter()
        self._addresses: dict[str, str] = {}
        self._services: dict[str, Service] = {}
        self._routers: dict[str, zmq.Socket[bytes]] = {}
        self._publishers: dict[str, _Publisher] = {}
        self._clients: set[zmq.Socket[bytes]] = set()

    # --- who is where ------------------------------------------------------------------

    def introduce(self, node: str, address: str) -> None:
        """See `Transport`; who connects from now on goes to the new address."""
        self._addresses[node] = address

    def endpoint(self, node: str, published: bool) -> str | None:
        """Where a node takes requests, or publishes; None if it was never introduced."""
        address = self._addresses.get(node)
        if address is None:
            return None
        host, port = split_address(address)
        return f"tcp://{host}:{port + published}"

    def join(self, node: str, host: str = "127.0.0.1", port: int = 0) -> str:
        """Open the two sockets of a node.

        Args:
            node: The node.
            host: Address of this machine to listen on.
            port: Of requests; 0 for any two free ports in a row.

        Returns:
            Its address, as for a registration.

        Raises:
            NetworkError: the ports are taken, or the host is not this machine.
        """
        router, publisher = self._listener(zmq.ROUTER, node), self._listener(zmq.XPUB, node)
        for _ in range(PORT_TRIES):
            try:
                chosen = _bind(router, host, port)
                publisher.bind(f"tcp://{host}:{chosen + 1}")
            except zmq.ZMQError as error:
                with suppress(zmq.ZMQError):
                    router.unbind(_text(router.last_endpoint))
                if port:
                    self._discard(router, publisher)
                    raise NetworkError(
                        f"cannot listen on {host}, ports {port} and {port + 1}: {error}"
                    ) from None
            else:
                break
        else:
            self._discard(router, publisher)
            raise NetworkError(f"found no two free ports in a row on {host}")
        self._routers[node] = router
        self._publishers[node] = _Publisher(publisher)
        self.clock.watch(router, lambda: self._requests(node, router))
        self.clock.watch(publisher, self._publishers[node].hear)
        self.introduce(node, f"{host}:{chosen}")
        return self._addresses[node]

    def leave(self, node: str) -> None:
        """Close the sockets of a node; a request that is still answered goes nowhere."""
        self._discard(self._routers.pop(node), self._publishers.pop(node).socket)

    def close(self) -> None:
        """Close everything; what was sent last has a moment to leave."""
        for node in list(self._routers):
            self.leave(node)
        for socket in list(self._clients):
            self.close_client(socket, linger=LINGER)
        self.context.term()

    # --- requests ----------------------------------------------------------------------

    def serve(self, node: str, service: Service) -> None:
        """See `Transport`; the node must have joined."""
        self._services[node] = service

    def connect(self, node: str, peer: str, on_reply: OnReply, pipelined: bool) -> _Wire:
        """See `Transport`: by a REQ socket, or by a DEALER."""
        return (_DealerWire if pipelined else _ReqWire)(self, node, peer, on_reply)

    def _requests(self, node: str, router: zmq.Socket[bytes]) -> None:
        """Hand the requests that have arrived to the service of a node."""
        for _ in range(DRAIN):
            try:
                frames = router.recv_multipart(zmq.NOBLOCK, copy=False)
            except zmq.Again:
                return
            self._request(node, router, frames)

    def _request(self, node: str, router: zmq.Socket[bytes], frames: list[zmq.Frame]) -> None:
        """One request: its route back, an empty frame, and one frame with the message."""
        empty = next((i for i, frame in enumerate(frames) if i and not len(frame)), None)
        service = self._services.get(node)
        if empty is None or service is None:
            self.counters["requests of another form"] += 1
            return
        route = [frame.bytes for frame in frames[: empty + 1]]
        body = frames[empty + 1 :]
        # Anything but one frame is no message; its empty text is refused as such, and answered.
        data = body[0].bytes if len(body) == 1 else b""

        def answer(reply: bytes) -> None:
            self._send(router, [*route, reply])

        service(Request(data, answer, self.security.sender(frames[-1])))

    def _send(self, socket: zmq.Socket[bytes], frames: list[bytes]) -> None:
        """Send without waiting; what does not fit is dropped and counted."""
        try:
            socket.send_multipart(frames, zmq.NOBLOCK)
        except zmq.ZMQError:
            # The queue is full, the peer is gone, or the node has left since.
            self.counters["not sent"] += 1

    # --- publications ------------------------------------------------------------------

    def publish(self, node: str, topic: str, payload: Any, size: int) -> None:
        """See `Transport`; what is not bytes packs itself into bytes."""
        publisher = self._publishers.get(node)
        if publisher is not None:
            data = payload if isinstance(payload, bytes) else payload.pack(size)
            self._send(publisher.socket, [topic.encode(), data])

    def ready(self, node: str, topic: str, size: int) -> bool:
        """See `Transport`: what waits in the kernel cannot be seen from here."""
        publisher = self._publishers.get(node)
        return publisher is not None and publisher.wanted(topic)

    def subscribe(
        self, node: str, publisher: str, topic: str, handler: Callable[[Any], object]
    ) -> _Subscription:
        """See `Transport`."""
        return _Subscription(self, node, publisher, topic, handler)

    # --- sockets -----------------------------------------------------------------------

    def _listener(self, kind: int, node: str) -> zmq.Socket[bytes]:
        socket = self.context.socket(kind)
        socket.linger = LINGER
        socket.setsockopt(zmq.MAXMSGSIZE, LARGEST)
        self.security.secure_server(socket, node)
        return socket

    def client(self, kind: int, node: str, peer: str) -> zmq.Socket[bytes]:
        """A socket of `node` for a connection to `peer`, not yet connected."""
        socket = self.context.socket(kind)
        socket.linger = 0
        socket.setsockopt(zmq.MAXMSGSIZE, LARGEST_PICTURE if kind == zmq.SUB else LARGEST)
        socket.setsockopt(zmq.RECONNECT_IVL, FIRST_TRY)
        socket.setsockopt(zmq.RECONNECT_IVL_MAX, LAST_TRY)
        self.security.secure_client(socket, node, peer)
        self._clients.add(socket)
        return socket

    def close_client(self, socket: zmq.Socket[bytes], linger: int = 0) -> None:
        """Close a socket made by `client`."""
        if socket in self._clients:
            self._clients.remove(socket)
            self.clock.unwatch(socket)
            self.security.release(socket)
            socket.close(linger)

    def _discard(self, *sockets: zmq.Socket[bytes]) -> None:
        for socket in sockets:
            self.clock.unwatch(socket)
            self.security.release(socket)
            socket.close()


def _text(option: object) -> str:
    """The text of a socket option, which pyzmq gives as bytes."""
    return option.decode() if isinstance(option, bytes) else str(option)


def _bind(router: zmq.Socket[bytes], host: str, port: int) -> int:
    if port:
        router.bind(f"tcp://{host}:{port}")
        return port
    return router.bind_to_random_port(f"tcp://{host}", 20_000, 60_000)


class _Publisher:
    """An XPUB socket, and what its subscribers want."""

    def __init__(self, socket: zmq.Socket[bytes]) -> None:
        self.socket = socket
        self._topics: set[str] = set()

    def wanted(self, topic: str) -> bool:
        """Whether anybody has subscribed to a topic."""
        return any(topic.startswith(known) for known in self._topics)

    def hear(self) -> None:
        """A subscriber came or went: XPUB tells of the first and of the last for a topic."""
        with suppress(zmq.Again):
            while True:
                said = self.socket.recv(zmq.NOBLOCK)
                topic = said[1:].decode(errors="replace")
                if said[:1] == b"\x01" and len(self._topics) < 10_000:
                    self._topics.add(topic)
                elif said[:1] == b"\x00":
                    self._topics.discard(topic)


class _Wire:
    """One connection to the service of a peer, as far as REQ and DEALER agree."""

    kind: int

    def __init__(self, network: SocketNetwork, node: str, peer: str, on_reply: OnReply) -> None:
        self._network, self._on_reply = network, on_reply
        self._socket = network.client(self.kind, node, peer)
        self._configure()
        endpoint = network.endpoint(peer, published=False)
        if endpoint is not None:
            self._socket.connect(endpoint)
        network.clock.watch(self._socket, self._replies)

    def _configure(self) -> None:
        """Set the options of this kind of socket."""

    def send(self, tag: int, data: bytes) -> None:
        """See `Wire`."""
        raise NotImplementedError

    def close(self) -> None:
        """See `Wire`."""
        self._network.close_client(self._socket)

    def _replies(self) -> None:
        for _ in range(DRAIN):
            if self._socket.closed:
                return  # by what the last reply brought about
            try:
                frames = self._socket.recv_multipart(zmq.NOBLOCK)
            except zmq.Again:
                return
            self._reply(frames)

    def _reply(self, frames: list[bytes]) -> None:
        raise NotImplementedError


class _ReqWire(_Wire):
    """A REQ socket: libzmq itself keeps requests and replies in step."""

    kind = zmq.REQ

    def _configure(self) -> None:
        # A doubled reply must not be taken for the answer to the next request.
        self._socket.setsockopt(zmq.REQ_CORRELATE, 1)
        self._tag = 0

    def send(self, tag: int, data: bytes) -> None:
        """See `Wire`; the last one sent must have been answered."""
        self._tag = tag
        try:
            self._socket.send(data, zmq.NOBLOCK)
        except zmq.ZMQError:
            # Nobody to connect to: the time-out will tell.
            self._network.counters["not sent"] += 1

    def _reply(self, frames: list[bytes]) -> None:
        if len(frames) == 1:
            self._on_reply(self._tag, frames[0])


class _DealerWire(_Wire):
    """A DEALER socket: the tag travels in front of the request, and comes back."""

    kind = zmq.DEALER

    def send(self, tag: int, data: bytes) -> None:
        """See `Wire`."""
        try:
            self._socket.send_multipart([tag.to_bytes(8, "big"), b"", data], zmq.NOBLOCK)
        except zmq.ZMQError:
            self._network.counters["not sent"] += 1

    def _reply(self, frames: list[bytes]) -> None:
        if len(frames) == 3 and len(frames[0]) == 8 and not frames[1]:
            self._on_reply(int.from_bytes(frames[0], "big"), frames[2])


class _Subscription:
    """A SUB socket; see `Subscription`."""

    def __init__(
        self,
        network: SocketNetwork,
        node: str,
        publisher: str,
        topic: str,
        handler: Callable[[Any], object],
    ) -> None:
        self._network, self._handler = network, handler
        self._socket = network.client(zmq.SUB, node, publisher)
        self._socket.subscribe(topic)
        endpoint = network.endpoint(publisher, published=True)
        if endpoint is not None:
            self._socket.connect(endpoint)
        network.clock.watch(self._socket, self._hear)

    def close(self) -> None:
        """See `Subscription`."""
        self._network.close_client(self._socket)

    def _hear(self) -> None:
        for _ in range(DRAIN):
            if self._socket.closed:
                return  # by what was heard last
            try:
                frames = self._socket.recv_multipart(zmq.NOBLOCK)
            except zmq.Again:
                return
            if len(frames) == 2:
                self._handler(frames[1])
            else:
                self._network.counters["publications of another form"] += 1
