"""Asking and telling over MQTT 5, in real time: every node is a client of one broker.

A node's client id is its device id. The broker lets a client write only what is from itself, and
read only what is for it (`RULES`), so a topic names the true client; nobody proves to be the device
that its client id names. Topics are listed in `protocol/README.md`.
"""

from __future__ import annotations

import secrets
import socket
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import quote, unquote

from typing_extensions import override

from dva_sim.network.messaging import OnReply
from dva_sim.network.mqtt_broker import Broker, BrokerError, new_client
from dva_sim.network.real_network import (
    DRAIN,
    LARGEST,
    LARGEST_PICTURE,
    NetworkError,
    RealNetwork,
)
from dva_sim.network.realtime import LiveClock

if TYPE_CHECKING:
    from paho.mqtt.client import Client, MQTTMessageInfo

RULES: Final = """\
topic read news/+/+
topic read gone/+
pattern write request/+/%c
pattern read request/%c/+
pattern write reply/+/%c
pattern read reply/%c/+
pattern write news/%c/+
pattern write wants/+/%c
pattern read wants/%c/+
pattern write gone/%c
"""
MOST_WAITING: Final = 1000  # messages that a client has not sent, or a subscription holds
MOST_TAKEN: Final = 10_000  # messages of a process that have arrived and wait for their turn
MOST_WANTED: Final = 1_000_000  # characters of all topics that subscribers want of a node
LONGEST_TAG: Final = 64  # of the correlation data of a request [B]
KEEP_ALIVE: Final = 10  # without a word either end takes the connection for lost after it [s]
BEGIN: Final = 2.0  # for the first connection of a node, before anything else [s]
GRACE: Final = 0.3  # from one lost connection to a look at the others [s]
LINGER: Final = 0.2  # for last words [s]
_WITH_WILL: Final = 4  # a reason to disconnect by which the broker publishes the last will
_SEPARATOR: Final = "\n"  # between topics that somebody wants

Ways = Callable[[str], Path | None]


def open_broker(host: str, port: int, also: Path | None = None) -> Broker:
    """Start a broker for the nodes of a run.

    Args:
        host: Address of this machine.
        port: Port.
        also: A socket of the file system at which it listens, too.

    Raises:
        NetworkError: it cannot listen there, or is not installed.
    """
    largest = LARGEST_PICTURE + 1000
    try:
        broker = Broker(
            *(host, port),
            nodelay=True,
            settings=f"max_packet_size {largest}\nmax_queued_messages {MOST_WAITING}\n"
            "allow_duplicate_messages false\n" + (f"listener 0 {also}\n" if also else ""),
            rules=RULES,
        )
        broker.wait()
    except BrokerError as error:
        raise NetworkError(str(error)) from None
    return broker


class MqttNetwork(RealNetwork):
    """The nodes of this process, each a client of the same broker.

    Threads of the library move bytes; everything else is done in the thread of the clock.

    Args:
        clock: Waits for what arrives.
        broker: Its address, `HOST:PORT`, which is that of every node.
        tell: Callback for one line when the broker is lost, or found again.
        qos: 0: messages are sent once. 1: until the broker has acknowledged them.
        tells_loss: True to report a lost broker; otherwise another process of the run does.
        ways: Function that returns the socket of the file system that leads a node to the broker
            across a link; None: the node connects to its address.
    """

    def __init__(
        self,
        clock: LiveClock,
        broker: str,
        tell: Callable[[str], object] = lambda _: None,
        qos: int = 0,
        tells_loss: bool = True,
        ways: Ways | None = None,
    ) -> None:
        super().__init__(clock, tell)
        self.way: Ways = ways or (lambda _: None)
        self.broker, self.qos, self._tells_loss = broker, qos, tells_loss
        self._nodes: dict[str, _Node] = {}
        self._joined: set[str] = set()
        self._is_lost = False
        self._without: set[str] = set()  # nodes that have lost their connection
        self._taken: deque[Callable[[], object]] = deque()
        self._bell, self._ring = socket.socketpair()
        for end in (self._bell, self._ring):
            end.setblocking(False)
        clock.watch(self._bell.fileno(), self._take)

    # --- what arrives ------------------------------------------------------------------

    def later(self, action: Callable[[], object], is_message: bool = False) -> None:
        """Let the clock's thread do something; may be called in any thread."""
        if is_message and len(self._taken) >= MOST_TAKEN:
            self.counters["not taken: too many messages wait"] += 1
            return
        self._taken.append(action)
        with suppress(OSError):  # it rings already, or all is closed
            self._ring.send(b"!")

    def _take(self) -> None:
        with suppress(BlockingIOError):
            self._bell.recv(4096)
        for _ in range(min(DRAIN, len(self._taken))):
            self._taken.popleft()()
        if self._taken:
            with suppress(OSError):
                self._ring.send(b"!")

    def connected(self, node: str) -> None:
        """Tell that the broker is there again, once for all nodes, or that it was there all along.

        mosquitto closes a connection without a reason when another client takes its client id.
        """
        if self._is_lost:
            self._is_lost = False
            self._without.clear()
            self._tell(f"the MQTT broker at {self.broker} is reached again")
        elif node in self._without:
            self._without.remove(node)
            self._tell_once(
                f"{node} was disconnected from the MQTT broker for a moment: another program may "
                "have connected under its id"
            )

    def refused(self, node: str, why: str) -> None:
        """Tell once that the broker does not take a node."""
        self._tell_once(f"the MQTT broker at {self.broker} refuses {node}: {why}")

    def disconnected(self, node: str) -> None:
        """Note that a node has lost its connection, and see in a moment whether all have."""
        self._without.add(node)
        self.clock.call_after(GRACE, self._look_for_broker)

    def _look_for_broker(self) -> None:
        is_there = any(node.client.is_connected() for node in self._nodes.values())
        if self._tells_loss and not self._is_lost and not is_there:
            self._is_lost = True
            self._tell(
                f"the MQTT broker at {self.broker} is lost: nothing is sent or heard until it is "
                "back"
            )

    # --- who is where ------------------------------------------------------------------

    def node(self, node: str) -> _Node:
        """Return the client of a node, made when it is first needed."""
        if node not in self._nodes:
            self._nodes[node] = _Node(self, node)
        return self._nodes[node]

    @override
    def is_here(self, node: str) -> bool:
        return node in self._joined

    @override
    def join(self, node: str, host: str = "127.0.0.1", port: int = 0) -> str:
        if port and port != int(self.broker.rpartition(":")[2]):
            raise NetworkError(
                f"over MQTT every device is found at the broker, {self.broker}, not at port {port}"
            )
        is_new = node not in self._nodes
        self._joined.add(node)
        self.node(node).hears(f"request/{node}/+", f"wants/{node}/+", "gone/+")
        # Later on nothing waits: robots may drive. Across a link one does not know for how long.
        if is_new and self.way(node) is None:
            self.node(node).wait_until_it_hears()
        self.introduce(node, self.broker)
        return self.broker

    @override
    def leave(self, node: str) -> None:
        self._joined.remove(node)
        self.node(node).hears_no_more(f"request/{node}/+", f"wants/{node}/+", "gone/+")

    @override
    def close(self) -> None:
        clients = [node.leaves() for node in self._nodes.values()]
        until = time.monotonic() + LINGER
        while time.monotonic() < until and any(client.is_connected() for client in clients):
            time.sleep(0.005)
        self.clock.unwatch(self._bell.fileno())
        self._bell.close()
        self._ring.close()

    # --- requests ----------------------------------------------------------------------

    @override
    def connect(self, node: str, peer: str, on_reply: OnReply, pipelined: bool) -> _Wire:
        return _Wire(self, node, peer, on_reply)

    def request(self, node: str, sender: str, data: bytes, reply_to: str, tag: bytes) -> None:
        """Hand a request to the service of a node; its reply can go to nobody but the sender."""
        topic = f"reply/{sender}/{node}"
        is_fit = reply_to == topic and len(tag) <= LONGEST_TAG
        if node not in self._services or node not in self._joined or not is_fit:
            self.counters["requests of another form"] += 1
            return

        def send(reply: bytes) -> None:
            if node in self._joined:
                self.node(node).send(topic, reply, tag=tag)

        # Refused below if it is too long, and answered: an empty text is no message.
        read = data if len(data) <= LARGEST else b""
        self._serve_request(node, read, send, sender=sender, peer=sender, origin=sender)

    # --- publications ------------------------------------------------------------------

    @override
    def publish(self, node: str, topic: str, payload: Any, size: int) -> None:
        if node in self._joined:
            self.note(node, payload)
            if self.node(node).is_wanted(topic):
                data = payload if isinstance(payload, bytes) else payload.pack(size)
                self.node(node).send(f"news/{node}/{_level(topic)}", data)

    @override
    def ready(self, node: str, topic: str, size: int) -> bool:
        if node not in self._joined:
            return False
        return self.node(node).is_wanted(topic) and self.node(node).backlog() < size

    @override
    def subscribe(
        self, node: str, publisher: str, topic: str, handler: Callable[[Any], object]
    ) -> _Subscription:
        return _Subscription(self, node, publisher, topic, handler)


class _Node:
    """A client of the broker, with what it waits for and what others want of it.

    Attributes:
        client: Its connection.
        wires: Open connections to services, by what is unique to each.
        listening: Its subscriptions, by publisher.
    """

    def __init__(self, network: MqttNetwork, name: str) -> None:
        self._network, self.name = network, name
        self.wires: dict[bytes, _Wire] = {}
        self.listening: dict[str, list[_Subscription]] = {}
        self._last: int | None = None  # number of the newest subscription
        self._confirmed: set[int] = set()  # numbers of those that the broker has
        self._filters: dict[str, int] = {}  # what it hears: how often that was asked for
        self._wanted: dict[str, tuple[str, ...]] = {}  # topics, by subscriber
        self._waiting: deque[tuple[MQTTMessageInfo, int]] = deque()  # not sent yet, with its size
        self._backlog = 0  # [B]
        self.client = self._new_client()
        self.hears(f"reply/{name}/+")
        self.client.loop_start()  # at last: from here on its thread calls us

    def _new_client(self) -> Client:
        way, later = self._network.way(self.name), self._network.later
        client = new_client(self.name, nodelay=True, kind="unix" if way else "tcp")
        client.on_connect = self._on_connect
        client.on_subscribe = lambda _, __, number, *___: self._confirmed.add(number)
        client.on_disconnect = lambda *_: later(self._disconnected)
        client.on_message = self._arrived
        client.max_queued_messages_set(MOST_WAITING)
        client.will_set(f"gone/{self.name}", b"", qos=1)
        host, _, port = self._network.broker.rpartition(":")
        client.connect_async(str(way or host), int(port), KEEP_ALIVE)
        return client

    # --- the connection ----------------------------------------------------------------

    def _on_connect(self, _: Client, __: Any, ___: Any, code: Any, ____: Any) -> None:
        """Subscribe, also after a connection that was lost; in the library's thread."""
        if code.is_failure:
            self._network.later(lambda: self._network.refused(self.name, str(code)))
        else:
            self._network.later(self._connected)
            self._subscribe(*list(self._filters))

    def _subscribe(self, *filters: str) -> None:
        _, number = self.client.subscribe([(each, self._network.qos) for each in filters])
        self._last = self._last if number is None else number

    def _connected(self) -> None:
        for publisher in self.listening:
            self.say_wants(publisher)
        self._network.connected(self.name)

    def _disconnected(self) -> None:
        self._wanted.clear()  # the broker has kept what is wanted, and says it once more
        self._network.disconnected(self.name)

    def leaves(self) -> Client:
        """Disconnect once all is sent, in such a way that the broker says that it is gone."""
        from paho.mqtt.packettypes import PacketTypes  # late: an extra
        from paho.mqtt.reasoncodes import ReasonCode  # late: an extra

        self.client.disconnect(ReasonCode(PacketTypes.DISCONNECT, identifier=_WITH_WILL))
        return self.client

    def hears(self, *filters: str) -> None:
        """Let the broker pass on what matches some filters."""
        for each in filters:
            self._filters[each] = self._filters.get(each, 0) + 1
            if self._filters[each] == 1:
                self._subscribe(each)

    def wait_until_it_hears(self) -> None:
        """Wait until the broker has confirmed all that was asked for, or for a moment."""
        until = time.monotonic() + BEGIN
        while self._last not in self._confirmed and time.monotonic() < until:
            time.sleep(0.001)

    def hears_no_more(self, *filters: str) -> None:
        """Take back what was asked for by `hears`."""
        for each in filters:
            self._filters[each] -= 1
            if not self._filters[each]:
                del self._filters[each]
                self.client.unsubscribe(each)

    # --- what is sent ------------------------------------------------------------------

    def send(
        self, topic: str, data: bytes, *, tag: bytes = b"", reply_to: str = "", keep: bool = False
    ) -> None:
        """Send without waiting, or drop and count it."""
        from paho.mqtt.packettypes import PacketTypes  # late: an extra
        from paho.mqtt.properties import Properties  # late: an extra

        self.backlog()
        if len(self._waiting) >= MOST_WAITING:
            self._network.counters["not sent"] += 1
            return
        properties = Properties(PacketTypes.PUBLISH)
        if tag:
            properties.CorrelationData = tag
        if reply_to:
            properties.ResponseTopic = reply_to
        info = self.client.publish(topic, data, self._network.qos, keep, properties)
        if info.rc:
            self._network.counters["not sent"] += 1
        else:
            self._waiting.append((info, len(data)))
            self._backlog += len(data)

    def backlog(self) -> int:
        """Return how much waits to be sent [B]."""
        while self._waiting and _is_over(self._waiting[0][0]):
            self._backlog -= self._waiting.popleft()[1]
        return self._backlog

    def is_wanted(self, topic: str) -> bool:
        """Return whether somebody wants a topic of this node."""
        return any(topic.startswith(each) for wants in self._wanted.values() for each in wants)

    def say_wants(self, publisher: str) -> None:
        """Let the broker keep, for a publisher, which of its topics this node wants."""
        topics = [quote(each.topic) for each in self.listening.get(publisher, ())]
        text = _SEPARATOR.join(dict.fromkeys(topics)) + _SEPARATOR if topics else ""
        self.send(f"wants/{publisher}/{self.name}", text.encode(), keep=True)

    # --- what arrives ------------------------------------------------------------------

    def _arrived(self, _: Client, __: Any, message: Any) -> None:
        self._network.later(lambda: self._take(message), is_message=True)

    def _take(self, message: Any) -> None:
        kind, *names = message.topic.split("/")
        data, properties = message.payload, message.properties
        tag = getattr(properties, "CorrelationData", b"")
        if kind == "wants":
            self._take_wants(names[1], data)
        elif message.retain:  # what somebody has left at the broker is old
            self._network.counters["kept messages, which are old"] += 1
        elif kind == "request":
            self._network.request(
                *(self.name, names[1], data, getattr(properties, "ResponseTopic", ""), tag)
            )
        elif kind == "reply" and (wire := self.wires.get(tag[8:])) is not None:
            wire.reply(names[1], int.from_bytes(tag[:8], "big"), data)
        elif kind == "gone":
            self._wanted.pop(names[0], None)
        elif kind == "news":
            topic = unquote(names[1])
            for each in [s for s in self.listening.get(names[0], ()) if topic.startswith(s.topic)]:
                each.hear(data)

    def _take_wants(self, subscriber: str, data: bytes) -> None:
        self._wanted.pop(subscriber, None)
        topics = data.decode(errors="replace").split(_SEPARATOR)[:-1]
        known = sum(len(topic) for wants in self._wanted.values() for topic in wants)
        if topics and known + len(data) <= MOST_WANTED:
            self._wanted[subscriber] = tuple(map(unquote, topics))


class _Wire:
    """Requests to one peer, matched to replies by a unique tag; see `Wire`."""

    def __init__(self, network: MqttNetwork, node: str, peer: str, on_reply: OnReply) -> None:
        self._network, self._node, self._peer = network, network.node(node), peer
        self._on_reply = on_reply
        self._id = secrets.token_bytes(8)
        self._node.wires[self._id] = self

    def send(self, tag: int, data: bytes) -> None:
        """Send a request; a peer that nobody has introduced cannot be reached."""
        self._network.note(self._node.name, data)
        if self._network.address(self._peer) is None:
            self._network.counters["not sent"] += 1
            return
        self._node.send(
            f"request/{self._peer}/{self._node.name}",
            data,
            tag=tag.to_bytes(8, "big") + self._id,
            reply_to=f"reply/{self._node.name}/{self._peer}",
        )

    def reply(self, peer: str, tag: int, data: bytes) -> None:
        """Take a reply, if it is the peer's."""
        if peer == self._peer and len(data) <= LARGEST:
            self._network.note(self._node.name, data, sent=False)
            self._on_reply(tag, data)
        else:
            self._network.counters["replies of another form"] += 1

    def close(self) -> None:
        """Implement `Wire`."""
        self._node.wires.pop(self._id, None)


class _Subscription:
    """A subscription that queues publications while it is paused."""

    def __init__(
        self,
        network: MqttNetwork,
        node: str,
        publisher: str,
        topic: str,
        handler: Callable[[Any], object],
    ) -> None:
        self._network, self._node, self._publisher = network, network.node(node), publisher
        self.topic, self._handler = topic, handler
        self._held: deque[bytes] = deque()
        self._paused = self._over = False
        # By the bar at their end topics are whole; what has none begins several.
        self._filter = f"news/{publisher}/{_level(topic) if topic.endswith('|') else '+'}"
        self._node.listening.setdefault(publisher, []).append(self)
        self._node.hears(self._filter)
        self._node.say_wants(publisher)

    def hear(self, data: bytes) -> None:
        """Take a publication, or keep it for later."""
        if self._over:
            return
        if not self._paused:
            self._network.hand_over(self._node.name, self._publisher, data, self._handler)
        elif len(self._held) < MOST_WAITING:
            self._held.append(data)
        else:
            self._network.counters["not taken: too many messages wait"] += 1

    def close(self) -> None:
        """Implement `Subscription`."""
        if self._over:
            return
        self._over = True
        others = self._node.listening[self._publisher]
        others.remove(self)
        if not others:
            del self._node.listening[self._publisher]
        self._node.hears_no_more(self._filter)
        self._node.say_wants(self._publisher)

    def pause(self) -> None:
        """Implement `Subscription`."""
        self._paused = True

    def resume(self) -> None:
        """Implement `Subscription`."""
        self._paused = False
        while self._held and not self._paused and not self._over:
            data = self._held.popleft()
            self._network.hand_over(self._node.name, self._publisher, data, self._handler)


def _level(topic: str) -> str:
    """Return a topic of ours as one level of a topic of MQTT."""
    return quote(topic, safe=":|")


def _is_over(info: MQTTMessageInfo) -> bool:
    """Return whether a message was sent, or is lost."""
    try:
        return bool(info.is_published())
    except (RuntimeError, ValueError):
        return True
