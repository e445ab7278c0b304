"""The transports that a scenario can name: those that are shipped, and users' own."""

from __future__ import annotations

from typing import Final

from dva_sim.kernel.plugins import Plugins
from dva_sim.network.middleware.dds import DdsTransport
from dva_sim.network.middleware.ends import CommandTransport
from dva_sim.network.middleware.mqtt import MqttTransport
from dva_sim.network.middleware.udp import UdpTransport
from dva_sim.network.middleware.webrtc import WebRtcTransport
from dva_sim.network.middleware.websocket import WebSocketTransport
from dva_sim.network.middleware.zenoh import ZenohTransport
from dva_sim.network.middleware.zeromq import ZeroMqTransport

SHIPPED: Final[dict[str, type[CommandTransport]]] = {
    "zeromq": ZeroMqTransport,
    "mqtt": MqttTransport,
    "udp": UdpTransport,
    "websocket": WebSocketTransport,
    "zenoh": ZenohTransport,
    "webrtc": WebRtcTransport,
    "dds": DdsTransport,
}

PLUGINS: Final = Plugins[CommandTransport](
    kind="transport",
    base=CommandTransport,  # type: ignore[type-abstract]
    shipped=SHIPPED,
    folder="protocol/transports",
    group="dva_sim.transports",
    key="transport.name",
    needs="near(place, receive)",
    public="dva_sim.network.middleware.CommandTransport",
)

known_transports = PLUGINS.known
load_transport = PLUGINS.load
