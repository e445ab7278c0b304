"""One client of a rosbridge server: its subscriptions, rights and rate limits."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final, Protocol

from dva_sim.ros.gateway import RosDriver
from dva_sim.ros.rosbridge import (
    BadOperation,
    decode,
    encode,
    is_finite,
    name_in,
    number_in,
    plain_type,
)
from dva_sim.ros.websocket import TOO_SLOW, WebSocketConnection

Json = dict[str, Any]

PER_SECOND: Final = 200.0  # design: sustained rate of operations; a joystick makes 50 [1/s]
BURST: Final = 400.0  # design: maximum operations at once
MAX_DROPPED: Final = 20_000  # design: dropped operations after which a flooding peer is cut off
MAX_TOPICS: Final = 256
MAX_BEHIND: Final = 200_000  # design: backlog above which a peer gets no more readings [B]
SAY_AGAIN: Final = 5.0  # design: shortest interval between two equal refusals [s]
EMERGENCY: Final = b"/emergency_stop"
ALIASES: Final = frozenset({"geometry_msgs/Twist", "geometry_msgs/TwistStamped"})


class PeerHost(Protocol):
    """Services that a client's state needs from the server."""

    def now(self) -> float:
        """Return the time [s]."""

    def type_of(self, topic: str) -> str | None:
        """Return the type of a topic; None if it is not served."""

    def subscribed(self, peer: RosPeer, topic: str) -> None:
        """Handle a new subscription of a client."""

    def changed(self) -> None:
        """Handle the end of a client's subscriptions."""

    def command(self, peer: RosPeer, topic: str, speed: float, turn_rate: float) -> str:
        """Execute a command; return the reason of a refusal, or ""."""

    def call(self, peer: RosPeer, service: str, args: Any, answer: Callable[..., object]) -> None:
        """Call a service; `answer(ok, values)` takes the result."""

    def tell(self, what: str) -> None:
        """Add a line to the story."""


class PeerTopic:
    """One subscription: minimum interval of messages [s], and time of the last one sent [s]."""

    def __init__(self, period: float) -> None:
        self.period = period
        self.sent_at = -math.inf


class RosPeer:
    """A client.

    Args:
        name: Name for people.
        connection: Connection to the client.
        host: Server of the client.

    Attributes:
        wants: Subscriptions of the client.
        driver: Device of the client; None until it first takes control.
        only_stops: True if the client may only stop robots.
    """

    def __init__(self, name: str, connection: WebSocketConnection, host: PeerHost) -> None:
        self.name = name
        self._connection = connection
        self._host = host
        self.wants: dict[str, PeerTopic] = {}
        self.driver: RosDriver | None = None
        self.only_stops = False
        self._room = BURST
        self._filled_at = host.now()
        self._dropped = 0
        self._reported_at: dict[str, float] = {}

    def take(self, data: bytes) -> None:
        """Handle a message, or drop it above the rate limit; emergencies are always handled."""
        if not self._has_room() and EMERGENCY not in data:
            self._drop()
            return
        try:
            operation = decode(data)
            self._do(operation)
        except BadOperation as error:
            self.say(str(error))

    def _has_room(self) -> bool:
        now = self._host.now()
        self._room = min(BURST, self._room + PER_SECOND * (now - self._filled_at))
        self._filled_at = now
        if self._room < 1.0:
            return False
        self._room -= 1.0
        return True

    def _drop(self) -> None:
        self._dropped += 1
        if self._dropped == 1:
            self.say(f"more than {PER_SECOND:g} messages a second: the rest is dropped")
            self._host.tell(f"{self.name} floods: more than {PER_SECOND:g} messages a second")
        elif self._dropped == MAX_DROPPED:
            self._connection.close(TOO_SLOW, "a flood of messages")

    def _do(self, operation: Json) -> None:
        if self.only_stops and operation["op"] != "call_service":
            raise BadOperation("too many clients are connected: only emergency_stop is served")
        match operation["op"]:
            case "subscribe":
                self._subscribe(operation)
            case "unsubscribe":
                self.wants.pop(name_in(operation, "topic"), None)
                self._host.changed()
            case "advertise":
                self._advertise(operation)
            case "publish":
                self._publish(operation)
            case "call_service":
                self._call(operation)
            case "unadvertise" | "status" | "set_level" | "auth":
                pass
            case unknown:
                raise BadOperation(f"op {unknown[:40]!r} is not supported")

    def _subscribe(self, operation: Json) -> None:
        topic = name_in(operation, "topic")
        type_name = self._host.type_of(topic)
        if type_name is None:
            raise BadOperation(f"topic {topic!r} is not served; see /rosapi/topics")
        kind = operation.get("type")
        if kind is not None and plain_type(name_in(operation, "type")) != type_name:
            raise BadOperation(f"topic {topic!r} is of type {type_name}, not {kind}")
        if operation.get("compression", "none") not in ("none", None):
            self.say("compression is not supported: messages come as JSON")
        number_in(operation, "queue_length", 1e9)
        period = number_in(operation, "throttle_rate", 3_600_000) / 1000
        if len(self.wants) >= MAX_TOPICS:
            raise BadOperation(f"a client may subscribe to at most {MAX_TOPICS} topics")
        self.wants[topic] = PeerTopic(period)
        self._host.subscribed(self, topic)

    def _advertise(self, operation: Json) -> None:
        topic = name_in(operation, "topic")
        if not topic.endswith("/cmd_vel"):
            raise BadOperation(f"topic {topic!r} is not read; cmd_vel of a robot is")
        if plain_type(name_in(operation, "type")) not in ALIASES:
            raise BadOperation(f"topic {topic!r} takes geometry_msgs/Twist or TwistStamped")

    def _publish(self, operation: Json) -> None:
        topic = name_in(operation, "topic")
        message = operation.get("msg")
        twist: Any = message.get("twist", message) if isinstance(message, dict) else None
        try:
            speed = twist["linear"]["x"]
            turn_rate = twist["angular"]["z"]
        except (TypeError, KeyError):
            raise BadOperation(f"{topic!r}: no Twist with linear.x and angular.z") from None
        for what, value in (("linear.x", speed), ("angular.z", turn_rate)):
            if not is_finite(value):
                raise BadOperation(f"{topic!r}: {what} is {str(value)[:40]}, not a finite number")
        if why := self._host.command(self, topic, float(speed), float(turn_rate)):
            raise BadOperation(f"{topic!r}: {why}")

    def _call(self, operation: Json) -> None:
        service = name_in(operation, "service")
        call_id = operation.get("id")
        if call_id is not None and not is_finite(call_id):
            name_in(operation, "id")

        def answer(ok: bool, values: Any) -> None:
            reply = {"op": "service_response", "service": service, "values": values, "result": ok}
            self._send(reply | ({} if call_id is None else {"id": call_id}))

        self._host.call(self, service, operation.get("args"), answer)

    # --- messages to the client ----------------------------------------------------------

    def offer(self, topic: str, data: bytes) -> None:
        """Send a reading, unless it is too soon after the last one or the client lags behind."""
        subscription = self.wants.get(topic)
        now = self._host.now()
        # The tolerance covers the rounding of times that are multiples of the period.
        if subscription is None or now < subscription.sent_at + subscription.period - 1e-6:
            return
        if self._connection.waiting <= MAX_BEHIND:
            subscription.sent_at = now
            self._connection.send(data)

    def say(self, what: str) -> None:
        """Report a refusal to the client; repeat the same one only after `SAY_AGAIN`."""
        now = self._host.now()
        if now - self._reported_at.get(what, -math.inf) >= SAY_AGAIN:
            if len(self._reported_at) > MAX_TOPICS:
                self._reported_at.clear()
            self._reported_at[what] = now
            self._send({"op": "status", "level": "error", "msg": what})

    def _send(self, operation: Json) -> None:
        if self._connection.waiting <= MAX_BEHIND:
            self._connection.send(encode(operation))

    def close(self) -> None:
        """End the connection."""
        self._connection.close(reason="the run is over")
