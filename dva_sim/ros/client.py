"""A client of a rosbridge server that reconnects by itself."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple

from dva_sim.network.realtime import LiveClock
from dva_sim.ros.rosbridge import BadOperation, decode, encode
from dva_sim.ros.websocket import WebSocketDialer, WebSocketUrl

FIRST_PAUSE = 0.5  # design: pause before the second attempt to connect [s]
MAX_PAUSE = 2.0  # design: longest pause before another attempt to connect [s]
SILENT_AFTER: Final = 5.0  # design: silence after which a connection is given up [s]
LARGEST: Final = 16_000_000  # design: a larger message ends the connection [B]
MAX_QUEUED: Final = 200_000  # design: backlog behind which commands are not queued [B]


class Subscribed(NamedTuple):
    """A topic to read.

    Attributes:
        type: Type of its messages, in the spelling of this version of ROS.
        take: Callback for each message.
        largest: Maximum size of a message; larger ones are dropped unread [B].
        throttle_ms: Minimum interval between two messages, kept by the server [ms].
    """

    type: str
    take: Callable[[Any], object]
    largest: int
    throttle_ms: int = 0


class RosbridgeClient:
    """Keeps a connection to a rosbridge server, and reports when it is made or lost.

    Args:
        clock: Polls the socket.
        url: Address of the server.
        topics: Topics to read, by name.
        advertised: Types of the topics that are published, by name.
        on_change: Callback when the connection is made, with an empty text, and when it is lost or
            cannot be made, with the reason.
        on_bad: Callback with the reason and the topic of a refused message.

    Attributes:
        is_connected: True if messages can be sent now.
        counters: Number of refused messages, by reason.
    """

    def __init__(
        self,
        clock: LiveClock,
        url: WebSocketUrl,
        topics: Mapping[str, Subscribed],
        advertised: Mapping[str, str],
        *,
        on_change: Callable[[str], object],
        on_bad: Callable[[str, str], object],
    ) -> None:
        self._clock = clock
        self._url = url
        self._topics = topics
        self._advertised = advertised
        self._on_change = on_change
        self._on_bad = on_bad
        self._pause = FIRST_PAUSE
        self._is_over = False
        self._dialer: WebSocketDialer | None = None
        self.is_connected = False
        self.counters: Counter[str] = Counter()
        self._calls: dict[str, Callable[[bool, str], object]] = {}
        clock.every(1.0, self._look)

    def connect(self) -> None:
        """Begin to connect; failed attempts and lost connections are retried automatically."""
        if self._is_over:
            return
        self._dialer = WebSocketDialer(
            self._clock,
            self._url,
            largest=LARGEST,
            on_open=self._opened,
            on_text=self._take,
            on_end=self._lost,
        )

    def publish(self, topic: str, message: Mapping[str, Any]) -> bool:
        """Publish on an advertised topic; return False if the message cannot be sent now."""
        connection = self._dialer.connection if self._dialer is not None else None
        if not self.is_connected or connection is None or connection.waiting > MAX_QUEUED:
            return False
        connection.send(encode({"op": "publish", "topic": topic, "msg": message}))
        return self.is_connected

    def call(self, service: str, answered: Callable[[bool, str], object]) -> None:
        """Call a service without arguments; `answered` takes success and text of the response."""
        self._calls[service] = answered
        self._send({"op": "call_service", "service": service, "id": service, "args": {}})

    def renew(self, why: str) -> None:
        """Drop the connection with all waiting data, and connect again."""
        if self.is_connected and self._dialer is not None:
            assert self._dialer.connection is not None
            self._dialer.connection.end(why)

    def close(self) -> None:
        """Withdraw all subscriptions and advertisements, and end the connection."""
        self._is_over = True
        if self.is_connected:
            for topic in self._topics:
                self._send({"op": "unsubscribe", "topic": topic})
            for topic in self._advertised:
                self._send({"op": "unadvertise", "topic": topic})
        if self._dialer is not None:
            self._dialer.close()

    def _send(self, operation: dict[str, Any]) -> None:
        if self._dialer is not None and self._dialer.connection is not None:
            self._dialer.connection.send(encode(operation))

    def _opened(self) -> None:
        self.is_connected = True
        for topic, kind in self._advertised.items():
            self._send({"op": "advertise", "topic": topic, "type": kind})
        for topic, subscription in self._topics.items():
            self._send(
                {
                    "op": "subscribe",
                    "topic": topic,
                    "type": subscription.type,
                    "throttle_rate": subscription.throttle_ms,
                    "queue_length": 1,  # old readings are useless
                }
            )
        self._on_change("")

    def _lost(self, why: str) -> None:
        was_connected = self.is_connected
        self.is_connected = False
        if self._is_over:
            return
        self._pause = FIRST_PAUSE if was_connected else min(2.0 * self._pause, MAX_PAUSE)
        self._clock.call_after(self._pause, self.connect)
        self._on_change(why)

    def _look(self) -> None:
        """Give up a silent connection: a peer may vanish without closing it."""
        connection = self._dialer.connection if self._dialer is not None else None
        if not self.is_connected or connection is None:
            return
        if self._clock.now - connection.heard_at > SILENT_AFTER:
            self.renew(f"nothing was heard for {SILENT_AFTER:g} s")
        else:
            connection.ping()

    def _take(self, data: bytes) -> None:
        topic = self._topic_of(data)
        subscription = self._topics.get(topic)
        if subscription is not None and len(data) > subscription.largest:
            self._refuse(topic, f"{len(data)} bytes; at most {subscription.largest} are read")
            return
        if subscription is None and len(data) > MAX_QUEUED:
            self._refuse("", f"{len(data)} bytes of a topic that was not asked for")
            return
        try:
            operation = decode(data)
        except BadOperation as error:
            self._refuse(topic, str(error))
            return
        if operation["op"] == "publish":
            subscription = self._topics.get(str(operation.get("topic")))
            if subscription is not None:
                subscription.take(operation.get("msg"))
        elif operation["op"] == "service_response":
            self._answered(operation)
        elif operation["op"] == "status" and operation.get("level") in ("error", "warning"):
            self._refuse("", f"the server says: {str(operation.get('msg'))[:120]}")

    def _answered(self, operation: dict[str, Any]) -> None:
        answered = self._calls.pop(str(operation.get("id")), None)
        values = operation.get("values")
        if answered is not None:
            answer = values if isinstance(values, dict) else {"message": values}
            done = operation.get("result") is not False and answer.get("success") is True
            answered(done, str(answer.get("message", ""))[:120])

    def _topic_of(self, data: bytes) -> str:
        """Return the topic of a message that may be too large to parse."""
        for topic in self._topics:
            name = f'"{topic}"'.encode()
            if name in data[:300] or name in data[-300:]:
                return topic
        return ""

    def _refuse(self, topic: str, why: str) -> None:
        self.counters[f"refused: {topic or 'a message'}"] += 1
        self._on_bad(topic, why)
