"""MQTT by paho-mqtt and a mosquitto broker at either end."""

from __future__ import annotations

import threading
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

from typing_extensions import override

from dva_sim.kernel.errors import ConfigError
from dva_sim.network.middleware.ends import (
    SIDES,
    CommandTransport,
    Receive,
    Rendezvous,
    Side,
    TransportEnd,
    TransportError,
    connected,
)
from dva_sim.network.mqtt_broker import PROGRAM, Broker, new_client

if TYPE_CHECKING:
    from paho.mqtt.client import Client

COMMANDS, PICTURES = "command", "picture"
HERE: Final = "robot"  # where the robot's end says that it hears commands; the broker keeps it
_AGAIN: Final = 0.1  # between two attempts to connect [s]


class MqttTransport(CommandTransport):
    """MQTT 5 over TCP.

    Args:
        qos: 0: sent once. 1: sent until acknowledged. 2: exactly once.
        nodelay: True if broker and clients send small messages at once (TCP_NODELAY).
        expiry_s: The broker drops what has waited longer [s], whole seconds; None: never.
        broker: The end at which the broker is.
    """

    title, library, extra = "MQTT", "paho", "mqtt"
    program = PROGRAM

    def __init__(
        self,
        qos: int = 0,
        nodelay: bool = False,
        expiry_s: int | None = None,
        broker: Side = "far",
    ) -> None:
        if qos not in (0, 1, 2):
            raise ConfigError(f"qos {qos!r} should be one of 0, 1, 2")
        if broker not in SIDES:
            raise ConfigError(f"broker {broker!r} should be one of {', '.join(SIDES)}")
        self.qos, self.nodelay, self.expiry_s, self.broker = qos, nodelay, expiry_s, broker

    @override
    def near(self, place: Rendezvous, receive: Receive) -> TransportEnd:
        return self._end(place, receive, "near")

    @override
    def far(self, place: Rendezvous, receive: Receive) -> TransportEnd:
        return self._end(place, receive, "far")

    def _end(self, place: Rendezvous, receive: Receive, side: Side) -> TransportEnd:
        end = _MqttEnd(self, place, receive, side)
        return connected(end, lambda: end.connect(place))


class _MqttEnd(TransportEnd):
    """A client, and the broker where this is its end."""

    def __init__(
        self, options: MqttTransport, place: Rendezvous, receive: Receive, side: Side
    ) -> None:
        self._options, self._receive = options, receive
        self._hears, self._tells = (PICTURES, COMMANDS)[:: 1 if side == "near" else -1]
        self._broker = None
        if side == options.broker:
            self._broker = Broker(place.address(side), place.port, nodelay=options.nodelay)
        self._is_near = side == "near"
        self._is_ready = threading.Event()
        self._client = self._made()

    def _made(self) -> Client:
        client = new_client("", self._options.nodelay)
        client.on_connect = self._on_connect
        client.on_subscribe = self._on_subscribe
        client.on_message = self._on_message
        return client

    def _on_connect(self, client: Client, *_: Any) -> None:
        """Subscribe, also after a connection that was lost."""
        topics = [(self._hears, self._options.qos)]
        client.subscribe([*topics, (HERE, 1)] if self._is_near else topics)

    def _on_message(self, _: Client, __: Any, message: Any) -> None:
        if message.topic == HERE:
            self._is_ready.set()
        else:
            self._receive(message.payload)

    def _on_subscribe(self, client: Client, *_: Any) -> None:
        if not self._is_near:
            client.publish(HERE, b"here", 1, retain=True)
            self._is_ready.set()

    def connect(self, place: Rendezvous) -> None:
        """Wait until the broker is there and, at the operator's end, the robot, too."""
        address = place.address(self._options.broker)
        while not self._is_connected(address, place.port):
            if time.monotonic() > place.ready_by:
                raise TransportError("the broker does not answer")
            time.sleep(_AGAIN)
        self._client.loop_start()
        if not self._is_ready.wait(max(0.0, place.ready_by - time.monotonic())):
            raise TransportError("the robot does not answer")

    def _is_connected(self, address: str, port: int) -> bool:
        with suppress(OSError):
            return bool(self._client.connect(address, port) == 0)
        return False

    @override
    def send(self, data: bytes) -> bool:
        from paho.mqtt.packettypes import PacketTypes
        from paho.mqtt.properties import Properties

        properties = Properties(PacketTypes.PUBLISH)
        if self._options.expiry_s is not None:
            properties.MessageExpiryInterval = self._options.expiry_s
        sent = self._client.publish(self._tells, data, self._options.qos, properties=properties)
        return bool(sent.rc == 0)

    @override
    def close(self) -> None:
        self._client.loop_stop()
        self._client.disconnect()
        if self._broker is not None:
            self._broker.close()
