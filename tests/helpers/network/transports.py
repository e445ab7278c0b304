"""A small world that is equal over every transport, and a meddler with its messages.

What a test says about a `World` it says about virtual time, about sockets, and about sockets
with keys alike. Nothing here waits for a fixed time where it can wait for a condition.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from random import Random
from typing import Any

import zmq
from helpers.processes.patience import PATIENCE_S

from dva_sim.agents.device import AgentDevice
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.recorder import Recorder
from dva_sim.kernel.streams import Streams
from dva_sim.network.connections import Connector
from dva_sim.network.keys import KeyRing
from dva_sim.network.link import ConstantRate, Link, LinkConfig
from dva_sim.network.messaging import (
    OnReply,
    Request,
    Requester,
    Service,
    Subscription,
    Transport,
    Wire,
)
from dva_sim.network.real_network import NetworkError
from dva_sim.network.realtime import LiveClock
from dva_sim.network.sockets import SocketNetwork
from dva_sim.network.virtual_network import VirtualNetwork
from dva_sim.worlds.geo import GeoFrame

DVA, ROBOT, PHONE, TABLET = (f"02:00:00:00:00:0{i}" for i in range(1, 5))
NODES = (DVA, ROBOT, PHONE, TABLET)
GUARD = "02:00:00:00:00:05"  # has a key like them, but is elsewhere
STRANGER = "02:00:00:00:00:99"  # id of a device with an unknown address

BRIEF = 0.15  # a time-out that is meant to run out; an authenticated handshake fits in [s]
PATIENT = PATIENCE_S  # one that is not [s]
STEP = 0.005  # interval of checks of a condition [s]
DELAY = 0.001  # one-way delay in virtual time [s]

VIRTUAL: dict[str, Callable[[], Connector]] = {
    "virtual messages": lambda: Connector(depth="message"),
    "virtual segments": lambda: Connector(depth="segment"),
    "virtual datagrams": lambda: Connector("datagrams"),
}
"""Transports in virtual time."""

LOSSY = "virtual segments with loss"  # what is promised, TCP keeps through losses


class World:
    """Four nodes that can ask and tell each other."""

    network: Transport
    marks = 0  # published so far; see `Listener`

    @property
    def clock(self) -> Clock:
        return self.network.clock

    def run_for(self, seconds: float) -> None:
        self.clock.run(self.clock.now + seconds)

    def run_until(self, condition: Callable[[], object], limit: float = PATIENCE_S) -> None:
        """Let time pass until a condition holds."""
        end = self.clock.now + limit
        while not condition():
            assert self.clock.now < end, f"has not come true within {limit} s"
            self.run_for(STEP)

    def serve(self, node: str, service: Service) -> None:
        self.network.serve(node, service)

    def leave(self, node: str) -> None:
        """A node crashes."""
        raise NotImplementedError

    def come_back(self, node: str) -> None:
        """It is there again, at its old address."""
        raise NotImplementedError

    def close(self) -> None:
        """Close all open sockets."""


class VirtualWorld(World):
    """Virtual time; what carries the messages is chosen, and how many packets the links lose."""

    def __init__(self, connector: Connector | None = None, loss: float = 0.0) -> None:
        self._loss = loss
        self._links: dict[tuple[str, str], Link] = {}
        self.network: VirtualNetwork = VirtualNetwork(
            Clock(), lambda a, b: (self._link(a, b), self._link(b, a)), connector=connector
        )
        self.leave, self.come_back = self.network.leave, self.network.come_back  # type: ignore[method-assign]

    def _link(self, a: str, b: str) -> Link:
        config = LinkConfig(delay_s=DELAY, loss=self._loss)
        link = Link(config, ConstantRate(config.rate_bps), Streams(1), f"{a}>{b}")
        return self._links.setdefault((a, b), link)


class SocketWorld(World):
    """Sockets on this machine, in real time; with keys if there is a ring."""

    def __init__(self, ring: KeyRing | None = None) -> None:
        self.ring, self.reports = ring, list[str]()
        self.network: SocketNetwork = SocketNetwork(LiveClock(), ring, self.reports.append)
        self._ports = {n: int(self.network.join(n).partition(":")[2]) for n in NODES}
        self._elsewhere: list[SocketNetwork] = []
        self._outside: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self._programs: list[zmq.Socket[bytes]] = []

    def leave(self, node: str) -> None:
        self.network.leave(node)

    def come_back(self, node: str) -> None:
        self.run_until(lambda: self._joined(node))

    def come_back_soon(self, node: str) -> None:
        """Rejoin once the port is free, while the nodes keep working."""
        if not self._joined(node):
            self.clock.call_after(STEP, self.come_back_soon, node)

    def _joined(self, node: str) -> bool:
        try:
            self.network.join(node, port=self._ports[node])
        except NetworkError:
            return False  # sockets are closed in the background: the port is not free yet
        return True

    def port(self, node: str, published: bool = False) -> int:
        return self._ports[node] + published

    def elsewhere(self) -> SocketNetwork:
        """The network as another process sees it: it knows nobody."""
        network = SocketNetwork(self.network.clock, self.ring, self.reports.append)
        self._elsewhere.append(network)
        return network

    def _program(self, kind: int) -> zmq.Socket[bytes]:
        self._programs.append(self._outside.socket(kind))
        return self._programs[-1]

    def program(self, kind: int, peer: str, published: bool = False) -> zmq.Socket[bytes]:
        """A socket of another program, connected to a node, with the keys of the tablet."""
        socket = self._program(kind)
        if self.ring is not None:
            public, secret = self.ring.pair(TABLET)
            socket.setsockopt(zmq.CURVE_SERVERKEY, self.ring.public(peer))
            socket.setsockopt(zmq.CURVE_PUBLICKEY, public)
            socket.setsockopt(zmq.CURVE_SECRETKEY, secret)
        socket.connect(f"tcp://127.0.0.1:{self.port(peer, published)}")
        return socket

    def replace(self, node: str, kind: int, published: bool = False) -> zmq.Socket[bytes]:
        """Put a socket of another program in the place of a node."""
        socket = self._program(kind)
        if self.ring is not None:
            public, secret = self.ring.pair(node)
            socket.setsockopt(zmq.CURVE_SERVER, 1)
            socket.setsockopt(zmq.CURVE_PUBLICKEY, public)
            socket.setsockopt(zmq.CURVE_SECRETKEY, secret)
        port = socket.bind_to_random_port("tcp://127.0.0.1")
        self.network.introduce(node, f"127.0.0.1:{port - published}")
        return socket

    def receive(self, socket: zmq.Socket[bytes]) -> list[bytes]:
        """Receive as another program, while the nodes keep working."""
        self.run_until(lambda: socket.poll(0))
        return socket.recv_multipart()

    def close(self) -> None:
        self._outside.destroy(linger=0)
        for network in [self.network, *self._elsewhere]:
            network.close()


@dataclass(frozen=True)
class Plan:
    """Chances of loss and duplication, and maximum hold time of a message [s]."""

    lose: float = 0.0
    double: float = 0.0
    hold: float = 0.0


class Meddler:
    """Disturbs messages between a transport and their receivers, by a seeded generator.

    Messages that are held back are overtaken by others, copies too.
    """

    def __init__(self, clock: Clock, seed: int, plan: Plan) -> None:
        self._clock, self._rng, self.plan = clock, Random(seed), plan
        self.done: Counter[str] = Counter()

    def service(self, service: Service) -> Service:
        """Wrap a service so that its requests and replies are disturbed."""

        def troubled(request: Request) -> None:
            def answer(reply: bytes) -> None:
                self.pass_on(request.answer, reply)

            self.pass_on(service, request._replace(answer=answer))

        return troubled

    def handler(self, handler: Callable[[Any], object]) -> Callable[[Any], None]:
        """Wrap a handler of publications so that they are disturbed."""
        return lambda payload: self.pass_on(handler, payload)

    def pass_on(self, take: Callable[[Any], object], what: object) -> None:
        rng, plan = self._rng, self.plan
        if rng.random() < plan.lose:
            self.done["lost"] += 1
            return
        if rng.random() < plan.double:
            self.done["doubled"] += 1
            self._later(take, what)
        self._later(take, what)

    def _later(self, take: Callable[[Any], object], what: object) -> None:
        """Half of them are held back, so that those behind them overtake."""
        hold = self._rng.choice((0.0, self._rng.uniform(0.0, self.plan.hold)))
        if hold:
            self.done["held back"] += 1
        self._clock.call_after(hold, take, what)


class Meddled:
    """A transport whose requests, replies and publications a meddler is allowed to touch."""

    def __init__(self, transport: Transport, meddler: Meddler) -> None:
        self._transport, self._meddler = transport, meddler

    def __getattr__(self, name: str) -> Any:
        return getattr(self._transport, name)

    def serve(self, node: str, service: Service) -> None:
        self._transport.serve(node, self._meddler.service(service))

    def subscribe(
        self, node: str, publisher: str, topic: str, handler: Callable[[Any], object]
    ) -> Subscription:
        handler = self._meddler.handler(handler)
        return self._transport.subscribe(node, publisher, topic, handler)


class Asker:
    """Asks a peer, and keeps how each request has ended: in replies, or in None for failure."""

    def __init__(
        self,
        transport: Transport,
        timeout: float = PATIENT,
        window: int = 1,
        attempts: int = 3,
        node: str = PHONE,
        peer: str = ROBOT,
    ) -> None:
        self.requester = Requester(transport, node, peer, timeout, attempts, window)
        self.ends: dict[bytes, list[bytes | None]] = {}

    def ask(self, *questions: bytes) -> None:
        for question in questions:
            ends = self.ends.setdefault(question, [])
            self.requester.request(question, ends.append, lambda ends=ends: ends.append(None))

    def all_over(self) -> bool:
        return all(self.ends.values())

    def replies(self) -> list[bytes | None]:
        """Replies to all requests; fails unless each has ended exactly once."""
        assert [len(ends) for ends in self.ends.values()] == [1] * len(self.ends)
        return [ends[0] for ends in self.ends.values()]


class Tap:
    """A transport that notes what its wires send, and how many of them there were."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport
        self.sent: list[bytes] = []
        self.wires = 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._transport, name)

    def connect(self, node: str, peer: str, on_reply: OnReply, pipelined: bool) -> Wire:
        self.wires += 1
        return _TappedWire(self._transport.connect(node, peer, on_reply, pipelined), self.sent)


class _TappedWire:
    def __init__(self, wire: Wire, sent: list[bytes]) -> None:
        self._wire, self._sent = wire, sent
        self.close = wire.close

    def send(self, tag: int, data: bytes) -> None:
        self._sent.append(data)
        self._wire.send(tag, data)


def echo(request: Request) -> None:
    """A service whose reply can be told from that to any other request."""
    request.answer(b"re: " + request.data)


def small_device(
    world: World, id_tag: str, timeout: float = PATIENT, network: Transport | None = None
) -> AgentDevice:
    """A real device, with no more around it than it needs."""
    return AgentDevice(
        id_tag=id_tag,
        label=f"device {id_tag[-2:]}",
        device_type="Device",
        address="127.0.0.1:5600",
        dva=DVA,
        network=network or world.network,
        recorder=Recorder(),
        frame=GeoFrame(38.66, -9.2),
        timeout=timeout,
        attempts=3,
    )


def numbered(count: int, word: str = "question") -> list[bytes]:
    return [f"{word} {number}".encode() for number in range(count)]


class Listener:
    """Hears a topic of a publisher.

    Marks are published until one is heard: then the subscription has reached the publisher.
    A mark published last of all shows that nothing before it is still to come.
    """

    def __init__(
        self,
        world: World,
        topic: str,
        handler: Callable[[bytes], object] | None = None,
        node: str = ROBOT,
        publisher: str = PHONE,
    ) -> None:
        self._world, self._topic, self.publisher = world, topic, publisher
        self.got: list[bytes] = []
        self._marks: list[bytes] = []
        self._handler = handler or self.got.append
        self.subscription = world.network.subscribe(node, publisher, topic, self._hear)

    def _hear(self, payload: bytes) -> None:
        if payload.startswith(b"mark "):
            self._marks.append(payload)
        else:
            self._handler(payload)

    def await_a_mark(self) -> None:
        """Publish marks until one of them is heard."""
        first = self._world.marks
        self._world.run_until(lambda: self._heard_since(first))

    def _heard_since(self, first: int) -> bool:
        if any(int(mark.split()[1]) >= first for mark in self._marks):
            return True
        mark = f"mark {self._world.marks}".encode()
        self._world.marks += 1
        self._world.network.publish(self.publisher, self._topic, mark, len(mark))
        return False
