"""Requests and publications over ZeroMQ sockets, in real time.

Each node has two sockets: a ROUTER for the requests to it, on the port that it registers with, and
an XPUB for what it publishes, on the next one; peers use REQ, DEALER, SUB (`protocol/README.md`).
"""

from __future__ import annotations

import ctypes
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from typing import Any, Final, Protocol

import zmq
from typing_extensions import override

from dva_sim.kernel.errors import DvaSimError
from dva_sim.network.connections import ZeromqConfig
from dva_sim.network.keys import KeyRing
from dva_sim.network.messaging import OnReply
from dva_sim.network.real_network import (
    DRAIN,
    LARGEST,
    MAX_PICTURE,
    NetworkError,
    RealNetwork,
)
from dva_sim.network.realtime import LiveClock, Poller
from dva_sim.network.security import Refusal, Security, Socket
from dva_sim.network.socket_io import (
    MORE,
    NOBLOCK,
    PublisherSocket,
    cut,
    drop_rest,
    read_next,
    receive,
    receive_parts,
    recv,
    send,
)


def options_of(zeromq: ZeromqConfig) -> dict[int, int]:
    """Return the socket options by number, without those that the kernel chooses."""
    options = {
        zmq.SNDHWM: zeromq.high_water_mark,
        zmq.RCVHWM: zeromq.high_water_mark,
        zmq.SNDBUF: zeromq.send_buffer_bytes,
        zmq.RCVBUF: zeromq.receive_buffer_bytes,
    }
    return {int(option): value for option, value in options.items() if value is not None}


class SocketWire:
    """Connection to the service of a peer: what REQ and DEALER have in common."""

    kind: int

    def __init__(self, network: SocketNetwork, node: str, peer: str, on_reply: OnReply) -> None:
        self._network = network
        self._node = node
        self._peer = peer
        self._on_reply = on_reply
        self._socket = network.client(self.kind, node, peer)
        self._configure()
        network.clock.watch(self._socket, self._replies)

    def _configure(self) -> None:
        """Set the options of this kind of socket."""

    def send(self, tag: int, data: bytes) -> None:
        """Implement `Wire`."""
        raise NotImplementedError

    def close(self) -> None:
        """Implement `Wire`."""
        self._network.close_client(self._socket, self._peer)

    def _replies(self) -> None:
        for _ in range(DRAIN):
            frames = read_next(self._socket)
            if frames is None:
                return
            self._reply(frames)

    def _reply(self, frames: list[bytes]) -> None:
        raise NotImplementedError


class ReqWire(SocketWire):
    """A REQ socket: libzmq itself keeps requests and replies in step."""

    kind = zmq.REQ

    def _configure(self) -> None:
        # A doubled reply must not be taken for the answer to the next request.
        self._socket.setsockopt(zmq.REQ_CORRELATE, 1)
        self._tag = 0

    @override
    def send(self, tag: int, data: bytes) -> None:
        # A REQ socket: the previous request must have been answered.
        self._tag = tag
        self._network.note(self._node, data)
        # Sending discards unread replies, so the socket need not be looked at: its file signals.
        self._network.send(self._socket, [data], look=False)

    def _replies(self) -> None:
        """Read the one reply that there can be: looking for more would delay every command."""
        frames = receive(self._socket)
        self._network.clock.read_out(self._socket)
        if frames is not None:
            self._reply(frames)

    def _reply(self, frames: list[bytes]) -> None:
        if len(frames) == 1:
            self._network.note(self._node, frames[0], sent=False)
            self._on_reply(self._tag, frames[0])


class DealerWire(SocketWire):
    """A DEALER socket: the tag travels in front of the request, and comes back."""

    kind = zmq.DEALER

    @override
    def send(self, tag: int, data: bytes) -> None:
        self._network.note(self._node, data)
        self._network.send(self._socket, [tag.to_bytes(8, "big"), b"", data])

    def _reply(self, frames: list[bytes]) -> None:
        if len(frames) == 3 and len(frames[0]) == 8 and not frames[1]:
            self._network.note(self._node, frames[2], sent=False)
            self._on_reply(int.from_bytes(frames[0], "big"), frames[2])


class SocketSubscription:
    """A SUB socket; see `Subscription`."""

    def __init__(
        self,
        network: SocketNetwork,
        node: str,
        publisher: str,
        topic: str,
        handler: Callable[[Any], object],
    ) -> None:
        self._network = network
        self._node = node
        self._peer = publisher
        self._handler = handler
        self._socket = network.client(zmq.SUB, node, publisher)
        self._socket.subscribe(topic)
        self._paused = self._over = False
        network.clock.watch(self._socket, self._hear)

    def close(self) -> None:
        """Implement `Subscription`."""
        self._paused = self._over = True
        self._network.close_client(self._socket, self._peer, soon=True)

    def pause(self) -> None:
        """See `Subscription`: what is not read waits in the socket."""
        self._paused = True
        self._network.clock.unwatch(self._socket)

    def resume(self) -> None:
        """Implement `Subscription`."""
        if self._paused and not self._over:
            self._paused = False
            self._network.clock.watch(self._socket, self._hear)

    def _hear(self) -> None:
        for _ in range(DRAIN):
            frames = None if self._paused else read_next(self._socket)
            if frames is None:
                return
            if len(frames) == 2:
                self._network.hand_over(self._node, self._peer, frames[1], self._handler)
            else:
                self._network.counters["publications of another form"] += 1


DEFAULT_PORT: Final = 5600  # port of requests; publications use the next one
MAX_TOPIC: Final = 512  # longest message of a subscriber: ZeroMQ drops one that sends more [B]
LINGER: Final = 200  # time for pending messages when a node leaves [ms]
LOOK_ASIDE: Final = 0.05  # interval of looks at handshakes [s]
CLOSED_AT_ONCE: Final = 10  # maximum sockets that are closed at each such look
GIVE_BACK: Final = 10.0  # interval of checks whether to give memory back, which takes 5 ms [s]
WORTH_IT: Final = 50  # closed sockets that make giving memory back worthwhile
READ_KEYS: Final = 1.0  # interval of looks for new and removed keys [s]
BIND_AGAIN: Final = 0.05  # interval of attempts while a port is still in use [s]
RETRY: Final = 5.0  # delay of a new attempt after ZeroMQ gave up connecting [s]
PORT_TRIES: Final = 50  # attempts to find two free ports in a row
SOCKET_LIMIT: Final = 60_000  # maximum sockets of the context
# A peer that loses its power disappears without closing its connections. Without these options a
# subscriber would wait for ever and a request for its time-out, and a listener would keep dead
# connections.
CLIENT: Final[Mapping[int, int]] = {
    zmq.TCP_KEEPALIVE: 1,
    zmq.TCP_KEEPALIVE_IDLE: 2,  # silence before the kernel probes the peer [s]
    zmq.TCP_KEEPALIVE_INTVL: 2,  # between probes [s]
    zmq.TCP_KEEPALIVE_CNT: 15,  # unanswered probes that end a connection
    zmq.TCP_MAXRT: 30_000,  # maximum time for which sent bytes stay unacknowledged [ms]
    zmq.CONNECT_TIMEOUT: 10_000,  # until a new attempt, since the kernel's own pauses double [ms]
}
# More patient: a phone that sleeps and only listens would never reconnect.
LISTENER: Final[Mapping[int, int]] = {
    zmq.TCP_KEEPALIVE: 1,
    zmq.TCP_KEEPALIVE_IDLE: 30,
    zmq.TCP_KEEPALIVE_INTVL: 30,
    zmq.TCP_KEEPALIVE_CNT: 20,
}


def give_back_memory() -> None:
    """Return memory that closed sockets have freed to the system, where the C library can.

    A connection takes 110 kB in pieces, with memory of others in between: by itself the library
    keeps almost all of it, and with each wave of devices it touches more pages.
    """
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).malloc_trim(0)


def split_address(address: str) -> tuple[str, int]:
    """Return host and port of an address such as `192.168.1.48:5600`; the port is optional."""
    host, _, port = address.partition(":")
    return host, int(port) if port else DEFAULT_PORT


class NodeCrossing(Protocol):
    """Route of connections between nodes across a link."""

    def place(self, port: int) -> str:
        """Return a further endpoint of a node that listens at a port."""

    def way(self, node: str, peer: str, endpoint: str) -> str | None:
        """Return the endpoint that leads a node to its peer; None: that of the peer itself."""


class SocketNetwork(RealNetwork):
    """Network of the nodes of this process, each with sockets of its own.

    Args:
        clock: Clock that waits for the sockets.
        ring: Keys of the devices; None to run without.
        tell: Callback for one line about each connection that could not be made.
        zeromq: Options of every socket but `conflate`: messages here have several parts, of
            which ZeroMQ would keep only the last.
        crossing: Route between nodes of this process at different ends of a link; None: all
            connect directly.
    """

    def __init__(
        self,
        clock: LiveClock,
        ring: KeyRing | None = None,
        tell: Callable[[str], object] = lambda _: None,
        zeromq: ZeromqConfig | None = None,
        crossing: NodeCrossing | None = None,
    ) -> None:
        super().__init__(clock, tell)
        self._crossing = crossing
        self._options = options_of(zeromq or ZeromqConfig())
        self._context: zmq.Context[Socket] = zmq.Context()
        # Each connection needs three; the system's own limit of open files comes first.
        self._context.set(zmq.MAX_SOCKETS, SOCKET_LIMIT)
        self._ring = ring
        self._aside = Poller()  # sockets that can wait, polled now and then
        self._security = Security(self._context, self._aside, ring, self._refused)
        clock.every(LOOK_ASIDE, self._look_aside)
        clock.every(GIVE_BACK, self._give_back)
        if ring is not None:
            clock.every(READ_KEYS, partial(self._read_keys, ring))
        self._routers: dict[str, Socket] = {}
        self._unread: set[Socket] = set()  # routers in the middle of a request that is dropped
        self._publishers: dict[str, PublisherSocket] = {}
        self._clients: dict[str, dict[Socket, str]] = {}  # owner of each socket, by peer
        self._leaving: deque[Socket] = deque()
        self._closed = 0

    # --- nodes and their addresses -----------------------------------------------------

    @override
    def introduce(self, node: str, address: str) -> None:
        before = self.endpoint(node, published=False)
        super().introduce(node, address)
        if self.endpoint(node, published=False) != before:
            for socket in self._clients.get(node, ()):
                self._reach(socket, node)

    @override
    def forget(self, node: str) -> None:
        super().forget(node)
        self._security.forget(node)

    @override
    def is_here(self, node: str) -> bool:
        return node in self._routers

    def endpoint(self, node: str, published: bool) -> str | None:
        """Return where a node takes requests, or publishes; None if it was never introduced."""
        address = self._addresses.get(node)
        if address is None:
            return None
        host, port = split_address(address)
        return f"tcp://{host}:{port + published}"

    @override
    def join(self, node: str, host: str = "127.0.0.1", port: int = 0) -> str:
        router = self._listener(zmq.ROUTER, node)
        publisher = self._listener(zmq.XPUB, node)
        for _ in range(PORT_TRIES):
            try:
                chosen = _bind(router, host, port)
                publisher.bind(f"tcp://{host}:{chosen + 1}")
            except zmq.ZMQError as error:
                with suppress(zmq.ZMQError):
                    router.unbind(_text(router.last_endpoint))
                if port or error.errno != zmq.EADDRINUSE:
                    self._discard(router, publisher)
                    ports = f" ports {port} and {port + 1}" if port else ""
                    text = f"cannot listen on {host}{ports}: {zmq.strerror(error.errno or 0)}"
                    if error.errno == zmq.EADDRINUSE:
                        text += "; a device takes two ports: give another, or 0 for any two"
                    raise NetworkError(text) from None
            else:
                break
        else:
            self._discard(router, publisher)
            raise NetworkError(f"found no two free ports in a row on {host}")
        if self._crossing is not None:
            router.bind(self._crossing.place(chosen))
            publisher.bind(self._crossing.place(chosen + 1))
        self._routers[node] = router
        self._publishers[node] = PublisherSocket(publisher)
        self.clock.watch(router, lambda: self._requests(node, router))
        self.introduce(node, f"{host}:{chosen}")
        return self._addresses[node]

    @override
    def leave(self, node: str) -> None:
        router = self._routers.pop(node)
        self._unread.discard(router)
        self._discard(router, self._publishers.pop(node).socket)

    def _look_aside(self) -> bool:
        if self._context.closed:
            return False
        for socket in self._aside.poll(0.0):
            self._security.handle(socket)
        for publisher in self._publishers.values():
            publisher.hear()
        for _ in range(min(CLOSED_AT_ONCE, len(self._leaving))):
            self._close(self._leaving.popleft())
        return True

    def _give_back(self) -> bool:
        if self._closed >= WORTH_IT:
            self._closed = 0
            give_back_memory()
        return not self._context.closed

    @override
    def close(self) -> None:
        for node in list(self._routers):
            self.leave(node)
        for peer, sockets in list(self._clients.items()):
            for socket in list(sockets):
                socket.linger = LINGER
                self.close_client(socket, peer)
        while self._leaving:
            self._close(self._leaving.popleft())
        self._security.close()
        self._aside.close()
        self._context.term()

    # --- requests ----------------------------------------------------------------------

    @override
    def connect(self, node: str, peer: str, on_reply: OnReply, pipelined: bool) -> SocketWire:
        return (DealerWire if pipelined else ReqWire)(self, node, peer, on_reply)

    def _requests(self, node: str, router: Socket) -> None:
        """Hand the requests that have arrived to the service of a node."""
        if router in self._unread and not self._is_dropped(router):
            return
        for _ in range(DRAIN):
            peer = recv(router, NOBLOCK)
            parts, last = receive_parts(router)
            if last.more:
                self.counters["requests of another form"] += 1
                self._unread.add(router)
                return  # others have their turn before its many further parts
            sender = None if self._ring is None else self._security.sender(last)
            if sender is not None or self._ring is None:
                origin = f"{last.get('Peer-Address')} {sender or ''}"
                self._request(node, router, peer, parts, sender, origin)
            else:
                self.counters["refused: of a key that is no longer known"] += 1
            if not self.clock.has_more(router):
                return

    def _is_dropped(self, router: Socket) -> bool:
        """Drop more of a request with too many parts; True if another one can be read now."""
        if not drop_rest(router):
            return False
        self._unread.discard(router)
        return self.clock.has_more(router)

    def _request(
        self,
        node: str,
        router: Socket,
        peer: bytes,
        parts: list[bytes],
        sender: str | None,
        origin: str,
    ) -> None:
        """Read one request: its route back, an empty frame, and one frame with the message."""
        if node not in self._services or b"" not in parts:
            self.counters["requests of another form"] += 1
            return
        start = parts.index(b"") + 1
        route = [peer, *parts[:start]]
        # Anything but one frame is no message; its empty text is refused as such, and answered.
        data = parts[start] if len(parts) == start + 1 else b""
        # The peer is what the socket itself calls the connection: nobody can take another's.
        self._serve_request(
            node,
            data=data,
            send=lambda reply: self.send(router, [*route, reply]),
            sender=sender,
            peer=peer,
            origin=origin,
        )

    def send(self, socket: Socket, frames: list[bytes], look: bool = True) -> None:
        """Send without waiting, or drop and count it; `look` unless the file signals anyway."""
        try:
            for frame in frames[:-1]:
                send(socket, frame, MORE)
            send(socket, frames[-1], NOBLOCK)
        except zmq.ZMQError:
            # The queue is full, or nobody is there: whoever waits for a reply has a time-out.
            self.counters["not sent"] += 1
        if look:
            self.clock.look(socket)

    # --- publications ------------------------------------------------------------------

    @override
    def publish(self, node: str, topic: str, payload: Any, size: int) -> None:
        publisher = self._publishers.get(node)
        if publisher is not None:
            self.note(node, payload)
            data = payload if isinstance(payload, bytes) else payload.pack(size)
            self.send(publisher.socket, [topic.encode(), data])

    @override
    def ready(self, node: str, topic: str, size: int) -> bool:
        publisher = self._publishers.get(node)  # a backlog in the kernel cannot be seen from here
        return publisher is not None and publisher.wanted(topic)

    @override
    def subscribe(
        self, node: str, publisher: str, topic: str, handler: Callable[[Any], object]
    ) -> SocketSubscription:
        return SocketSubscription(self, node, publisher, topic, handler)

    # --- sockets -----------------------------------------------------------------------

    def _socket(self, kind: int, options: Mapping[int, int]) -> Socket:
        """Return a socket with these options and those of all, for later connections."""
        socket = self._context.socket(kind)
        for option, value in {**options, **self._options}.items():
            socket.setsockopt(option, value)
        return socket

    def _listener(self, kind: int, node: str) -> Socket:
        socket = self._socket(kind, LISTENER)
        socket.linger = LINGER
        socket.setsockopt(zmq.MAXMSGSIZE, MAX_TOPIC if kind == zmq.XPUB else LARGEST)
        try:
            self._security.bind_server(socket, node)
        except DvaSimError:
            socket.close()  # the context would wait for it without end
            raise
        return socket

    def client(self, kind: int, node: str, peer: str) -> Socket:
        """Return a socket of `node`, connected to `peer` if there is a way to it."""
        socket = self._socket(kind, CLIENT)
        socket.linger = 0
        socket.setsockopt(zmq.MAXMSGSIZE, MAX_PICTURE if kind == zmq.SUB else LARGEST)
        self._clients.setdefault(peer, {})[socket] = node
        if self._has_key(peer):
            self._security.connect_client(socket, node, peer)
        else:
            # Peers come from messages: an unknown one must not end this program.
            self._tell_once(f"no public key of {peer}: nothing is sent to it")
        self._reach(socket, peer)
        return socket

    def _has_key(self, peer: str) -> bool:
        """Return True if a peer's key is known, or the network runs without keys."""
        return self._ring is None or peer in self._ring.devices

    def _reach(self, socket: Socket, peer: str) -> None:
        """Connect to the present address of a peer, and to no other, if there is one."""
        published = socket.getsockopt(zmq.TYPE) == zmq.SUB
        endpoint = self.endpoint(peer, published)
        if endpoint is None or not self._has_key(peer):
            return
        if self._crossing is not None and self.is_here(peer):
            node = self._clients[peer][socket]
            endpoint = self._crossing.way(node, peer, endpoint) or endpoint
        cut(socket)
        socket.connect(endpoint)
        self.clock.look(socket)

    def _read_keys(self, ring: KeyRing) -> bool:
        """Apply new, changed and removed keys: connections made with former keys end."""
        if self._context.closed:
            return False
        before = set(ring.devices)
        changed = ring.refresh()
        for peer in sorted(changed):
            has_key = self._has_key(peer)
            came = "has changed" if peer in before else "is new"
            self._tell(f"the key of {peer} {came if has_key else 'has gone: it is not heard now'}")
            for socket, node in self._clients.get(peer, {}).items():
                cut(socket)
                if has_key:
                    self._security.aim(socket, node, peer)
                    self._reach(socket, peer)
        for node in self._publishers if changed & before else ():
            self._renew_publisher(node)
        return True

    def _renew_publisher(self, node: str) -> None:
        """Reopen the publishing socket, so that subscribers are admitted by the current keys."""
        old = self._publishers[node].socket
        endpoint = _text(old.last_endpoint).rstrip("\0")
        old.linger = 0
        self._discard(old)
        self._publishers[node] = PublisherSocket(self._listener(zmq.XPUB, node))
        self._bind_again(node, endpoint)

    def _bind_again(self, node: str, endpoint: str) -> None:
        """Listen where the previous socket did, as soon as that port is free."""
        try:
            self._publishers[node].socket.bind(endpoint)
        except zmq.ZMQError:
            if not self._context.closed:
                self.clock.call_after(BIND_AGAIN, self._bind_again, node, endpoint)

    def close_client(self, socket: Socket, peer: str, soon: bool = False) -> None:
        """Close a socket made by `client`.

        Args:
            socket: Socket, from which nothing more is read.
            peer: Peer that it connects to.
            soon: True to close it later, a few at a time: when many devices vanish together,
                others must not wait.
        """
        sockets = self._clients.get(peer, {})
        if sockets.pop(socket, None) is not None:
            if not sockets:
                del self._clients[peer]
            self.clock.unwatch(socket)
            if soon:
                self._leaving.append(socket)
            else:
                self._close(socket)

    def _close(self, socket: Socket) -> None:
        self._security.release(socket)
        socket.close()
        self._closed += 1

    def _discard(self, *sockets: Socket) -> None:
        for socket in sockets:
            self.clock.unwatch(socket)
            self._close(socket)

    def _refused(self, refusal: Refusal) -> None:
        """Report a refused connection, and retry where ZeroMQ does not."""
        self._tell(str(refusal))
        if refusal.gave_up and refusal.peer is not None:
            self.clock.call_after(RETRY, self._retry, refusal.device, refusal.peer)

    def _retry(self, node: str, peer: str) -> None:
        if self._security.trouble(node, peer) is None:
            return
        for socket in [s for s, owner in self._clients.get(peer, {}).items() if owner == node]:
            socket.connect(cut(socket))
            self.clock.look(socket)
        self.clock.call_after(RETRY, self._retry, node, peer)


def _text(option: object) -> str:
    """Return the text of a socket option, which pyzmq gives as bytes."""
    return option.decode() if isinstance(option, bytes) else str(option)


def _bind(router: Socket, host: str, port: int) -> int:
    if port:
        router.bind(f"tcp://{host}:{port}")
        return port
    return router.bind_to_random_port(f"tcp://{host}", 20_000, 60_000)
