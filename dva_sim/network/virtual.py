"""The virtual network: the patterns in virtual time, over links with delay, loss and rate.

Both patterns run on reliable streams, as ZeroMQ's run on TCP.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from typing import Any

from dva_sim.clock import Clock
from dva_sim.network.link import Link
from dva_sim.network.patterns import OnReply, Request, Service
from dva_sim.network.stream import Connection

FRAMING = 9  # ZMTP header of a frame above 255 bytes [B]

Links = Callable[[str, str], tuple[Link, Link]]
Traffic = Callable[[float, str, str, int], None]


class VirtualNetwork:
    """Who is reachable, over which links; see `Transport`.

    Args:
        clock: The run's clock.
        links: Gives the link from one node to another, and the one back.
        traffic: Told of each message sent: time [s], from, to, size [B].
    """

    def __init__(self, clock: Clock, links: Links, traffic: Traffic | None = None) -> None:
        self.clock = clock
        self.links = links
        self.traffic = traffic or (lambda *_: None)
        self._services: dict[str, Service] = {}
        self._gone: set[str] = set()
        self._subscriptions: dict[str, list[VirtualSubscription]] = defaultdict(list)
        self._wanted: dict[tuple[str, str], list[VirtualSubscription]] = {}

    def introduce(self, node: str, address: str) -> None:
        """See `Transport`: here everybody is found by name."""

    def serve(self, node: str, service: Service) -> None:
        """See `Transport`."""
        self._services[node] = service

    def service(self, node: str) -> Service | None:
        """What takes the requests to a node, if it is there."""
        return None if node in self._gone else self._services.get(node)

    def connect(self, node: str, peer: str, on_reply: OnReply, pipelined: bool) -> VirtualWire:
        """See `Transport`: a connection is the same, pipelined or not."""
        return VirtualWire(self, node, peer, on_reply)

    def publish(self, node: str, topic: str, payload: Any, size: int) -> None:
        """See `Transport`."""
        total = size + FRAMING + len(topic) + 2
        for subscription in self._subscribers(node, topic):
            if subscription.joined:
                self.traffic(self.clock.now, node, subscription.node, total)
                subscription.connection.to_opener.send(payload, total)

    def ready(self, node: str, topic: str, size: int) -> bool:
        """See `Transport`: the link's queue shows what still waits."""
        for subscription in self._subscribers(node, topic):
            if subscription.joined:
                return subscription.downlink.backlog_bytes(self.clock.now) < size
        return False

    def subscribe(
        self, node: str, publisher: str, topic: str, handler: Callable[[Any], object]
    ) -> VirtualSubscription:
        """See `Transport`."""
        subscription = VirtualSubscription(self, node, publisher, topic, handler)
        self._subscriptions[publisher].append(subscription)
        self._wanted.clear()
        if publisher not in self._gone:
            subscription.open()
        return subscription

    def leave(self, node: str) -> None:
        """A node crashes: it takes no requests, and its connections are gone."""
        self._gone.add(node)
        for subscription in self._subscriptions[node]:
            subscription.drop()

    def come_back(self, node: str) -> None:
        """The node is there again; those who had subscribed to it connect anew."""
        if node not in self._gone:
            return  # a second connection would be opened over the first
        self._gone.discard(node)
        for subscription in self._subscriptions[node]:
            subscription.open()

    def forget(self, subscription: VirtualSubscription) -> None:
        """A subscription is closed."""
        known = self._subscriptions[subscription.publisher]
        if subscription in known:
            known.remove(subscription)
            self._wanted.clear()

    def _subscribers(self, node: str, topic: str) -> list[VirtualSubscription]:
        """Who wants a topic, joined or not: found out anew when somebody has come or gone."""
        known = self._wanted.get((node, topic))
        if known is None:
            known = [s for s in self._subscriptions[node] if topic.startswith(s.topic)]
            self._wanted[node, topic] = known
        return known


class VirtualWire:
    """One connection to a service; requests wait until it is open."""

    def __init__(self, network: VirtualNetwork, node: str, peer: str, on_reply: OnReply) -> None:
        self._network, self._node, self._peer = network, node, peer
        out, back = network.links(node, peer)
        self._connection = Connection(
            network.clock, out, back, self._at_peer, lambda payload: on_reply(*payload)
        )
        self._waiting: list[tuple[int, bytes]] | None = []
        self._connection.open(self._opened)

    def send(self, tag: int, data: bytes) -> None:
        """See `Wire`."""
        if self._waiting is None:
            self._transmit(tag, data)
        else:
            self._waiting.append((tag, data))

    def close(self) -> None:
        """See `Wire`: a request that has arrived is executed, its reply is dropped."""
        self._connection.close()

    def _opened(self) -> None:
        waiting, self._waiting = self._waiting or [], None
        for tag, data in waiting:
            self._transmit(tag, data)

    def _transmit(self, tag: int, data: bytes) -> None:
        size = len(data) + FRAMING
        self._network.traffic(self._network.clock.now, self._node, self._peer, size)
        self._connection.to_peer.send((tag, data), size)

    def _at_peer(self, payload: tuple[int, bytes]) -> None:
        """A request has reached the peer: hand it to the service there."""
        tag, data = payload
        service = self._network.service(self._peer)
        if service is not None:
            service(Request(data, lambda reply: self._answer(tag, reply)))

    def _answer(self, tag: int, reply: bytes) -> None:
        if self._connection.to_opener.closed:
            return
        size = len(reply) + FRAMING
        self._network.traffic(self._network.clock.now, self._peer, self._node, size)
        self._connection.to_opener.send((tag, reply), size)


class VirtualSubscription:
    """A SUB socket: opens a connection to the publisher and says what it wants.

    Attributes:
        joined: Whether the publisher knows of it by now.
        downlink: Carries what is published to it.
    """

    def __init__(
        self,
        network: VirtualNetwork,
        node: str,
        publisher: str,
        topic: str,
        handler: Callable[[Any], object],
    ) -> None:
        self._network, self._handler = network, handler
        self.node, self.publisher, self.topic = node, publisher, topic
        self.connection = self._new_connection()
        self.joined = False

    def open(self) -> None:
        """Shake hands, then subscribe."""
        self.connection = self._new_connection()
        self.connection.open(self._subscribe)

    def drop(self) -> None:
        """The connection breaks; what was under way is lost."""
        self.connection.close()
        self.joined = False

    def close(self) -> None:
        """See `Subscription`."""
        self.drop()
        self._network.forget(self)

    def _new_connection(self) -> Connection:
        out, self.downlink = self._network.links(self.node, self.publisher)
        return Connection(self._network.clock, out, self.downlink, self._joined, self._handler)

    def _subscribe(self) -> None:
        self.connection.to_peer.send(self.topic, len(self.topic) + 1)

    def _joined(self, _: object) -> None:
        self.joined = True
