"""MQTT by paho-mqtt and a mosquitto broker at either end."""

from __future__ import annotations

import os
import shutil
import socket
import threading
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

from typing_extensions import override

from dva_sim.kernel.errors import ConfigError
from dva_sim.network.emulator.linux_calls import die_with_parent
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
from dva_sim.serving.processes import Child, end_all

if TYPE_CHECKING:
    from paho.mqtt.client import Client

_SYSTEM: Final = os.pathsep.join(
    (os.environ.get("PATH", os.defpath), "/usr/local/sbin", "/usr/sbin")
)
# Where Debian puts it is not on the path of everybody.
PROGRAM: Final = shutil.which("mosquitto", path=_SYSTEM) or "mosquitto"
COMMANDS = "command"
PICTURES = "picture"
ROBOT_TOPIC: Final = (
    "robot"  # where the robot's end says that it hears commands; the broker keeps it
)
_AGAIN: Final = 0.1  # interval between two attempts to connect [s]


class MqttTransport(CommandTransport):
    """MQTT 5 over TCP.

    Args:
        qos: 0: sent once. 1: sent until acknowledged. 2: exactly once.
        nodelay: True if broker and clients send small messages at once (TCP_NODELAY).
        expiry_s: The broker drops what has waited longer [s], whole seconds; None: never.
        broker: The end at which the broker is.
    """

    title = "MQTT"
    library = "paho"
    extra = "mqtt"
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
        self.qos = qos
        self.nodelay = nodelay
        self.expiry_s = expiry_s
        self.broker = broker

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
        self._options = options
        self._receive = receive
        self._hears, self._tells = (PICTURES, COMMANDS)[:: 1 if side == "near" else -1]
        self._broker = None
        if side == options.broker:
            self._broker = _Broker(place.address(side), place.port, options.nodelay)
        self._is_near = side == "near"
        self._is_ready = threading.Event()
        self._client = self._made()

    def _made(self) -> Client:
        from paho.mqtt.client import Client, MQTTv5  # late: an extra
        from paho.mqtt.enums import CallbackAPIVersion

        client = Client(CallbackAPIVersion.VERSION2, protocol=MQTTv5)
        if self._options.nodelay:
            client.on_socket_open = lambda _, __, opened: opened.setsockopt(
                socket.IPPROTO_TCP, socket.TCP_NODELAY, 1
            )
        client.reconnect_delay_set(1, 1)
        client.on_connect = self._on_connect
        client.on_subscribe = self._on_subscribe
        client.on_message = self._on_message
        return client

    def _on_connect(self, client: Client, *_: Any) -> None:
        """Subscribe, also after a connection that was lost."""
        topics = [(self._hears, self._options.qos)]
        client.subscribe([*topics, (ROBOT_TOPIC, 1)] if self._is_near else topics)

    def _on_message(self, _: Client, __: Any, message: Any) -> None:
        if message.topic == ROBOT_TOPIC:
            self._is_ready.set()
        else:
            self._receive(message.payload)

    def _on_subscribe(self, client: Client, *_: Any) -> None:
        if not self._is_near:
            client.publish(ROBOT_TOPIC, b"here", 1, retain=True)
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


class _Broker:
    """A mosquitto that listens at one address alone, and ends with this process.

    Its files have no names: nothing is left behind, whatever ends it. It stays root, which inside a
    user namespace is nobody else's: there it could not become another user.

    Args:
        address: IPv4 address of this machine.
        port: Port.
        nodelay: True to send small messages at once (TCP_NODELAY).

    Raises:
        TransportError: it cannot be started.
    """

    def __init__(self, address: str, port: int, nodelay: bool) -> None:
        self._place = address, port
        self._refuse_taken_port()
        configuration = os.memfd_create("configuration")
        os.fchmod(configuration, 0o600)
        os.write(
            configuration,
            f"listener {port} {address}\nallow_anonymous true\nuser root\nlog_dest stderr\n"
            f"log_type error\nset_tcp_nodelay {str(nodelay).lower()}\n".encode(),
        )
        me = os.getpid()
        try:
            self._process = Child(
                "the MQTT broker",
                [PROGRAM, "-c", f"/proc/self/fd/{configuration}"],
                pass_fds=(configuration,),
                preexec_fn=lambda: die_with_parent(me),
            )
        except OSError as error:
            raise TransportError(f"{PROGRAM} cannot be started: {error.strerror}") from None
        finally:
            os.close(configuration)

    def _refuse_taken_port(self) -> None:
        """Say so now: who waits for the broker would take another program for it."""
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind(self._place)
            except OSError as error:
                at = ":".join(map(str, self._place))
                problem = f"{PROGRAM} cannot listen at {at}: {error.strerror}"
                raise TransportError(problem) from None

    def close(self) -> None:
        """End it."""
        end_all([self._process], 0.0)
