"""Messaging patterns as ZeroMQ offers them, on the virtual network.

Request/reply is lock-step with a time-out and a number of attempts; publish/subscribe
sends and forgets. Both run on reliable streams, as ZeroMQ's run on TCP.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from dva_sim.clock import Clock
from dva_sim.network.link import Link
from dva_sim.network.stream import Connection

FRAMING = 9  # ZMTP header of a frame above 255 bytes [B]
QUEUE_LIMIT = 1000  # requests waiting at one requester

Answer = Callable[[bytes], None]
Service = Callable[[bytes, Answer], None]
Links = Callable[[str, str], tuple[Link, Link]]
Traffic = Callable[[float, str, str, int], None]


class Network:
    """Who is reachable, over which links.

    Args:
        clock: The run's clock.
        links: Gives the link from one node to another, and the one back.
        traffic: Told of each message sent: time [s], from, to, size [B].
    """

    def __init__(self, clock: Clock, links: Links, traffic: Traffic | None = None) -> None:
        self.clock = clock
        self.links = links
        self.traffic = traffic or (lambda *_: None)
        self._services: dict[tuple[str, str], Service] = {}
        self._publishers: dict[tuple[str, str], Publisher] = {}

    def serve(self, node: str, service: str, handler: Service) -> None:
        """Let `handler(data, answer)` take the requests to a service of `node`."""
        self._services[node, service] = handler

    def service(self, node: str, service: str) -> Service | None:
        """The handler of a service, if anybody offers it."""
        return self._services.get((node, service))

    def publisher(self, node: str, service: str) -> Publisher:
        """The publishing socket of `node`, made when first asked for."""
        key = node, service
        if key not in self._publishers:
            self._publishers[key] = Publisher(self, node)
        return self._publishers[key]


@dataclass
class _Request:
    """A request that waits or is under way."""

    data: bytes
    on_reply: Callable[[bytes], object]
    on_failure: Callable[[], object]
    attempts_left: int = 0
    generation: int = 0
    sent_at: float = 0.0


class Requester:
    """A REQ socket: one request at a time, each answered before the next is sent.

    After a time-out the socket is closed and opened anew (a reply still under way is lost,
    a request already received is executed), and the same bytes are sent again.

    Args:
        network: Where it lives.
        node: Who asks.
        peer: Who answers.
        service: Name of the service there.
        timeout: How long to wait for a reply [s].
        attempts: How often a request is sent before it has failed.
    """

    def __init__(
        self,
        network: Network,
        node: str,
        peer: str,
        service: str,
        timeout: float,
        attempts: int = 3,
    ) -> None:
        self._network, self._clock = network, network.clock
        self.node, self.peer, self._service = node, peer, service
        self._timeout, self._attempts = timeout, attempts
        self._queue: deque[_Request] = deque()
        self._current: _Request | None = None
        self._connection: Connection | None = None
        self._is_open = False
        self._generation = 0
        self.timeouts = self.failures = self.overflows = 0
        self.round_trips: list[float] = []

    @property
    def busy(self) -> bool:
        """Whether a request is under way."""
        return self._current is not None

    def request(
        self,
        data: bytes,
        on_reply: Callable[[bytes], object],
        on_failure: Callable[[], object] = lambda: None,
    ) -> None:
        """Send `data` as soon as all earlier requests are done."""
        if len(self._queue) >= QUEUE_LIMIT:
            self.overflows += 1
            on_failure()
            return
        self._queue.append(_Request(data, on_reply, on_failure, self._attempts))
        if self._current is None:
            self._next()

    def close(self) -> None:
        """Forget everything, without a word to those who wait."""
        self._queue.clear()
        self._current = None
        self._disconnect()

    def _next(self) -> None:
        if not self._queue:
            return
        self._current = self._queue.popleft()
        self._current.sent_at = self._clock.now
        self._attempt()

    def _attempt(self) -> None:
        """Send the current request, over a new connection if there is none."""
        request = self._current
        assert request is not None
        request.attempts_left -= 1
        self._generation += 1
        request.generation = self._generation
        self._clock.call_after(self._timeout, self._expire, self._generation)
        if self._is_open:
            self._send()
        else:
            self._connect()

    def _connect(self) -> None:
        out, back = self._network.links(self.node, self.peer)
        connection = Connection(self._clock, out, back, self._at_peer, self._on_reply)
        self._connection = connection

        def opened() -> None:
            self._is_open = True
            self._send()

        connection.open(opened)

    def _disconnect(self) -> None:
        if self._connection is not None:
            self._connection.close()
        self._connection, self._is_open = None, False

    def _send(self) -> None:
        request, connection = self._current, self._connection
        if request is None or connection is None:
            return
        size = len(request.data) + FRAMING
        self._network.traffic(self._clock.now, self.node, self.peer, size)
        connection.to_peer.send((request.data, request.generation), size)

    def _at_peer(self, payload: tuple[bytes, int]) -> None:
        """The request has reached the peer: hand it to the service there."""
        data, generation = payload
        handler = self._network.service(self.peer, self._service)
        if handler is None:
            return
        connection = self._connection

        def answer(reply: bytes) -> None:
            if connection is None or connection.to_opener.closed:
                return
            size = len(reply) + FRAMING
            self._network.traffic(self._clock.now, self.peer, self.node, size)
            connection.to_opener.send((reply, generation), size)

        handler(data, answer)

    def _on_reply(self, payload: tuple[bytes, int]) -> None:
        reply, generation = payload
        request = self._current
        if request is None or generation != request.generation:
            return  # an answer to an attempt that was given up
        self.round_trips.append(self._clock.now - request.sent_at)
        self._current = None
        request.on_reply(reply)
        if self._current is None:
            self._next()

    def _expire(self, generation: int) -> None:
        request = self._current
        if request is None or request.generation != generation:
            return
        self.timeouts += 1
        self._disconnect()
        if request.attempts_left > 0:
            self._attempt()
            return
        self.failures += 1
        self._current = None
        request.on_failure()
        if self._current is None:
            self._next()


@dataclass
class Publisher:
    """A PUB socket: what is published goes to everybody who has subscribed by then."""

    network: Network
    node: str
    subscribers: list[Subscription] = field(default_factory=list)
    refused: int = 0

    def publish(self, topic: str, payload: Any, size: int) -> None:
        """Send `payload`, counted as `size` bytes [B], to the subscribers of `topic`."""
        for subscription in self.subscribers:
            if topic.startswith(subscription.topic):
                total = size + FRAMING + len(topic) + 2
                self.network.traffic(self.network.clock.now, self.node, subscription.node, total)
                if not subscription.connection.to_opener.send(payload, total):
                    self.refused += 1


class Subscription:
    """A SUB socket: opens a connection to the publisher and says what it wants.

    Args:
        network: Where it lives.
        node: Who subscribes.
        publisher: To whom.
        topic: Prefix of the topics wanted; ends with `|` so that none matches by accident.
        handler: Takes each payload.
    """

    def __init__(
        self,
        network: Network,
        node: str,
        publisher: Publisher,
        topic: str,
        handler: Callable[[Any], object],
    ) -> None:
        self.node, self.topic, self._publisher = node, topic, publisher
        out, back = network.links(node, publisher.node)
        self.connection = Connection(network.clock, out, back, self._joined, handler)
        self.connection.open(self._subscribe)

    def close(self) -> None:
        """Leave; nothing more is delivered."""
        self.connection.close()
        if self in self._publisher.subscribers:
            self._publisher.subscribers.remove(self)

    def _subscribe(self) -> None:
        self.connection.to_peer.send(self.topic, len(self.topic) + 1)

    def _joined(self, _: object) -> None:
        self._publisher.subscribers.append(self)
