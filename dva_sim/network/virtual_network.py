"""The virtual network: the patterns in virtual time, over links with delay, loss and rate."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Callable
from functools import partial
from typing import Any

from typing_extensions import override

from dva_sim.kernel.clock import Clock
from dva_sim.network.connections import AnyConnection, Connector
from dva_sim.network.link import Link
from dva_sim.network.messaging import OnReply, Request, RequestTap, Service
from dva_sim.network.zmtp import ZmtpConnection

FRAMING = 9  # ZMTP header of a frame above 255 bytes, counted for shorter ones too [B]
RECONNECT = 0.1  # delay of a reconnection; ZeroMQ's default [s]
SUBSCRIBE_AGAIN = 1.0  # interval of subscriptions where one may get lost; assumed [s]

Links = Callable[[str, str], tuple[Link, Link]]
Traffic = Callable[[float, str, str, int, Any], None]
Delivered = Callable[[float, str, str, Any], None]
Take = Callable[[Any], None]
Interference = Callable[[str, str, Any, Take], None]
"""Callback for a payload that reaches a node: sender, receiver, payload, and its consumer."""


class VirtualNetwork:
    """Network in virtual time: reachable nodes and their links; see `Transport`.

    Args:
        clock: The run's clock.
        links: Function that returns the link from one node to another, and the one back.
        traffic: Callback for each message sent: time [s], sender, receiver, size [B], content.
        connector: Function that makes the connections.
        delivered: Callback for each message that arrives: time [s], sender, receiver, content.

    Attributes:
        dropped: Publications that found the pipe of a subscriber full.
        taps: See `Transport`.
        interference: Filter that may drop, delay or replace each payload; None: no interference.
        on_open: Callback for each connection that is open now: its node, and the peer.
    """

    def __init__(
        self,
        clock: Clock,
        links: Links,
        traffic: Traffic | None = None,
        connector: Connector | None = None,
        delivered: Delivered | None = None,
    ) -> None:
        self.clock = clock
        self.links = links
        self.traffic = traffic or (lambda *_: None)
        self.delivered = delivered or (lambda *_: None)
        self.connector = connector or Connector()
        self.dropped = 0
        self.taps: dict[str, RequestTap] = {}
        self.interference: Interference | None = None
        self.on_open: Callable[[str, str], object] = lambda node, peer: None
        self._services: dict[str, Service] = {}
        self._gone: set[str] = set()
        self._clients: dict[str, dict[VirtualClient, None]] = defaultdict(dict)
        self._wanted: dict[tuple[str, str], list[VirtualSubscription]] = {}

    def introduce(self, node: str, address: str) -> None:
        """Do nothing: nodes are found here by their ids; see `Transport`."""

    def forget(self, node: str) -> None:
        """Forget a node."""

    def serve(self, node: str, service: Service) -> None:
        """Implement `Transport`."""
        self._services[node] = service

    def service(self, node: str) -> Service | None:
        """Return the service of a node, if the node is present."""
        return None if node in self._gone else self._services.get(node)

    def connect(self, node: str, peer: str, on_reply: OnReply, pipelined: bool) -> VirtualWire:
        """See `Transport`: a connection is the same, pipelined or not."""
        return VirtualWire(self, node, peer, on_reply)

    def publish(self, node: str, topic: str, payload: Any, size: int) -> None:
        """Implement `Transport`."""
        total = size + FRAMING + len(topic) + 2
        for subscription in self._subscribers(node, topic):
            send = subscription.send
            if send is not None:
                if send(payload, total):
                    self.traffic(self.clock.now, node, subscription.node, total, payload)
                else:
                    self.dropped += 1

    def ready(self, node: str, topic: str, size: int) -> bool:
        """See `Transport`: nothing else waits in the connection or before the link."""
        for subscription in self._subscribers(node, topic):
            if subscription.send is not None:
                return subscription.connection.peer.backlog_bytes(self.clock.now) < size
        return False

    def subscribe(
        self, node: str, publisher: str, topic: str, handler: Callable[[Any], object]
    ) -> VirtualSubscription:
        """Implement `Transport`."""
        return VirtualSubscription(self, node, publisher, topic, handler)

    def leave(self, node: str) -> None:
        """Let a node crash: it takes no requests, and the connections to it are gone."""
        self._gone.add(node)
        for client in self._clients[node]:
            client.drop()

    def come_back(self, node: str) -> None:
        """Bring a node back; its clients reconnect a little later."""
        if node in self._gone:
            self._gone.discard(node)
            for client in self._clients[node]:
                self.clock.call_after(RECONNECT, client.reopen)

    def remember(self, client: VirtualClient) -> None:
        """Register a client of a node."""
        self._clients[client.peer][client] = None
        self._wanted.clear()

    def release(self, client: VirtualClient) -> None:
        """Unregister a client of a node."""
        self._clients[client.peer].pop(client, None)
        self._wanted.clear()

    def is_wanted(self, client: VirtualClient) -> bool:
        """Return True if the peer is present and the client still registered."""
        return client.peer not in self._gone and client in self._clients[client.peer]

    def _subscribers(self, node: str, topic: str) -> list[VirtualSubscription]:
        """Return the subscribers of a topic, connected or not; cached until one comes or goes."""
        subscribers = self._wanted.get((node, topic))
        if subscribers is None:
            subscribers = [
                client
                for client in self._clients[node]
                if isinstance(client, VirtualSubscription) and topic.startswith(client.topic)
            ]
            self._wanted[node, topic] = subscribers
        return subscribers


class VirtualClient:
    """Client that connects to a peer, and reconnects when the connection broke.

    Attributes:
        connection: The present one.
    """

    def __init__(self, network: VirtualNetwork, node: str, peer: str) -> None:
        self._network = network
        self.node = node
        self.peer = peer
        self.connection = self._new_connection()
        self._is_up = False
        network.remember(self)
        self._open()

    def drop(self) -> None:
        """Break the connection; what was under way is lost."""
        self.connection.drop()
        self._is_up = False

    def reopen(self) -> None:
        """Reconnect, unless that has been done or the client is closed."""
        if not self._is_up:
            self.connection = self._new_connection()
            self._open()

    def close(self) -> None:
        """See `Wire` and `Subscription`."""
        self.connection.close()
        self._network.release(self)

    def _while_connected(self, take: Take) -> Take:
        """Return a consumer that ignores payloads once the connection they came by is gone."""
        connection = self.connection

        def taken(payload: Any) -> None:
            if self.connection is connection and self._network.is_wanted(self):
                take(payload)

        return taken

    def _open(self) -> None:
        if self._network.is_wanted(self):
            self._is_up = True
            self.connection.open(self._opened)

    def _opened(self) -> None:
        raise NotImplementedError

    def _new_connection(self) -> AnyConnection:
        raise NotImplementedError


class VirtualWire(VirtualClient):
    """One connection to a service; requests wait until it is open and has room."""

    def __init__(self, network: VirtualNetwork, node: str, peer: str, on_reply: OnReply) -> None:
        self._waiting: deque[tuple[int, bytes]] = deque()
        self._on_reply = on_reply
        self._is_open = False
        super().__init__(network, node, peer)

    def send(self, tag: int, data: bytes) -> None:
        """Implement `Wire`."""
        self._waiting.append((tag, data))
        self._go_on()

    @override
    def drop(self) -> None:
        # Messages still in the pipe go over the next connection.
        super().drop()
        self._is_open = False
        if isinstance(self.connection, ZmtpConnection):
            payloads = [payload for payload, _ in self.connection.opener.pipe]
            self._waiting.extendleft(reversed(payloads))

    def _opened(self) -> None:
        self._is_open = True
        if isinstance(self.connection, ZmtpConnection):
            self.connection.opener.pipe.on_room = self._go_on
        self._network.on_open(self.node, self.peer)
        self._go_on()

    def _go_on(self) -> None:
        """Send waiting requests, as far as there is room."""
        while self._is_open and self._waiting:
            tag, data = self._waiting[0]
            size = len(data) + FRAMING
            if not self.connection.opener.send((tag, data), size):
                return
            self._waiting.popleft()
            self._network.traffic(self._network.clock.now, self.node, self.peer, size, data)

    def _new_connection(self) -> AnyConnection:
        """Return a connection; replies go back over the one that their request came by."""
        network = self._network

        def at_peer(payload: tuple[int, bytes]) -> None:
            tag, data = payload
            if network.interference is None:
                self._serve(made, tag, data)
            else:
                network.interference(self.node, self.peer, data, partial(self._serve, made, tag))

        made = network.connector.connect(
            network.clock,
            network.links(self.node, self.peer),
            at_peer,
            self._replied,
        )
        return made

    def _serve(self, connection: AnyConnection, tag: int, data: bytes) -> None:
        network = self._network
        service = network.service(self.peer)
        if service is None:
            return
        network.delivered(network.clock.now, self.node, self.peer, data)
        request = Request(data, partial(self._answer, connection, tag), peer=self.node)
        tap = network.taps.get(self.peer)
        if tap is None:
            service(request)
        else:
            tap.serve(service, request)

    def _replied(self, payload: tuple[int, bytes]) -> None:
        tag, data = payload
        if self._network.interference is None:
            self._take_reply(tag, data)
        else:
            take = self._while_connected(partial(self._take_reply, tag))
            self._network.interference(self.peer, self.node, data, take)

    def _take_reply(self, tag: int, data: bytes) -> None:
        network = self._network
        network.delivered(network.clock.now, self.peer, self.node, data)
        self._on_reply(tag, data)

    def _answer(self, connection: AnyConnection, tag: int, reply: bytes) -> None:
        size = len(reply) + FRAMING
        if connection.peer.send((tag, reply), size):
            self._network.traffic(self._network.clock.now, self.peer, self.node, size, reply)


class VirtualSubscription(VirtualClient):
    """SUB socket: opens a connection to the publisher and sends its topic.

    Attributes:
        send: Function that sends it a publication of a size [B]; None until the publisher knows
            of the subscription.
    """

    def __init__(
        self,
        network: VirtualNetwork,
        node: str,
        publisher: str,
        topic: str,
        handler: Callable[[Any], object],
    ) -> None:
        self.topic = topic
        self._handler = handler
        self._newest: Any = None  # latest payload of a batch, if only that is kept
        self._hand_on = self._keep if network.connector.conflates_receiver else handler
        self.send: Callable[[Any, int], bool] | None = None
        super().__init__(network, node, publisher)

    def pause(self) -> None:
        """Implement `Subscription`."""
        self.connection.opener.pause()

    def resume(self) -> None:
        """Implement `Subscription`."""
        self.connection.opener.resume()

    @override
    def drop(self) -> None:
        super().drop()
        self.send = None

    def _opened(self) -> None:
        """Subscribe; repeat that at intervals where it may get lost."""
        self._network.on_open(self.node, self.peer)
        connection = self.connection
        if connection.opener.send(self.topic, len(self.topic) + 1) and not connection.keeps:
            self._network.clock.call_after(SUBSCRIBE_AGAIN, self._opened)

    def _joined(self, _: object) -> None:
        self.send = self.connection.peer.send

    def _new_connection(self) -> AnyConnection:
        network = self._network

        return network.connector.connect(
            network.clock,
            network.links(self.node, self.peer),
            self._joined,
            self._heard,
            publishes=True,
        )

    def _heard(self, payload: Any) -> None:
        if self._network.interference is None:
            self._take(payload)
        else:
            take = self._while_connected(self._take)
            self._network.interference(self.peer, self.node, payload, take)

    def _take(self, payload: Any) -> None:
        network = self._network
        network.delivered(network.clock.now, self.peer, self.node, payload)
        if (tap := network.taps.get(self.node)) is not None:
            tap.heard(self.peer, payload)
        self._hand_on(payload)

    def _keep(self, payload: Any) -> None:
        """Keep the newest of a batch: ZeroMQ decodes all of it before a program wakes up."""
        if self._newest is None:
            self._network.clock.call_after(0.0, self._hand_over)
        self._newest = payload

    def _hand_over(self) -> None:
        newest = self._newest
        self._newest = None
        if self._network.is_wanted(self):
            self._handler(newest)
