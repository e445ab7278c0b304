"""The choice of what carries a run's messages over real connections: ZeroMQ or MQTT."""

from __future__ import annotations

import socket
import sys
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from typing import Annotated, Final, Literal

from pydantic import Field

from dva_sim.kernel.config import Config
from dva_sim.kernel.config_overrides import build, parse_changes
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import either
from dva_sim.network.connections import ZeromqConfig
from dva_sim.network.keys import KeyRing
from dva_sim.network.middleware.mqtt import MqttTransport
from dva_sim.network.mqtt import MqttNetwork, Ways
from dva_sim.network.real_network import RealNetwork
from dva_sim.network.realtime import LiveClock
from dva_sim.network.sockets import NodeCrossing, SocketNetwork

ZEROMQ, MQTT = "zeromq", "mqtt"
CARRIERS: Final = ZEROMQ, MQTT
OPTION: Final = "--transport"
DEFAULT_PORT: Final = 1883  # of MQTT
LOCALHOST: Final = "127.0.0.1"


class MqttOptions(Config):
    """Options of MQTT.

    Attributes:
        broker: The end of the link at which the broker is: the DVA's, or the robots'.
        qos: 0: messages are sent once. 1: until the broker has acknowledged them.
    """

    broker: Literal["near", "far"] = "near"
    qos: Annotated[int, Field(ge=0, le=1)] = 0


@dataclass(frozen=True)
class RunCarrier:
    """Transport that carries the messages of a run.

    Attributes:
        name: ZeroMQ, or MQTT.
        mqtt: Options of MQTT.
    """

    name: str = ZEROMQ
    mqtt: MqttOptions = field(default_factory=MqttOptions)

    @property
    def is_mqtt(self) -> bool:
        """Return True for MQTT, which needs a broker."""
        return self.name == MQTT

    @property
    def ends(self) -> tuple[str, str]:
        """The part of a live run that starts the broker, and the one at the other end."""
        return ("dva", "world") if self.mqtt.broker == "near" else ("world", "dva")

    def open(
        self,
        clock: LiveClock,
        ring: KeyRing | None,
        tell: Callable[[str], object],
        zeromq: ZeromqConfig,
        broker: str,
        tells_loss: bool = True,
        crossing: NodeCrossing | None = None,
        ways: Ways | None = None,
    ) -> RealNetwork:
        """Open the network of a process.

        Args:
            clock: Waits for what arrives.
            ring: Keys of the devices, for ZeroMQ; None to run without.
            tell: Callback for one line about each connection that could not be made.
            zeromq: Set on ZeroMQ's sockets.
            broker: Address of MQTT's broker, `HOST:PORT`.
            tells_loss: True if this process reports a lost broker.
            crossing: Leads ZeroMQ's connections across a link.
            ways: Lead MQTT's connections across it; see `MqttNetwork`.
        """
        if self.is_mqtt:
            return MqttNetwork(clock, broker, tell, self.mqtt.qos, tells_loss, ways)
        return SocketNetwork(clock, ring, tell, zeromq, crossing)

    def check(self, hosts: Sequence[str], has_keys: bool) -> None:
        """Refuse what the carrier cannot do, or lacks here.

        Args:
            hosts: Addresses at which devices, or the broker, would listen.
            has_keys: True if keys are wanted.

        Raises:
            ConfigError: in one line.
        """
        if not self.is_mqtt:
            return
        if has_keys:
            raise ConfigError(f"--keys works only with ZeroMQ: leave it out with {OPTION} {MQTT}")
        if beyond := [host for host in hosts if not host.startswith("127.")]:
            raise ConfigError(
                f"{OPTION} {MQTT}: the broker, which has no keys, listens on {LOCALHOST} or on an "
                f"emulated link alone, not on {beyond[0]}"
            )
        if sys.platform != "linux":
            raise ConfigError(f"{OPTION} {MQTT} needs Linux; this is {sys.platform}")
        if missing := MqttTransport().lacks():
            raise ConfigError(missing)


def carrier_of(given: Sequence[str]) -> RunCarrier:
    """Read a carrier as it is given on the command line: its name, and `KEY=VALUE` of its own.

    Raises:
        ConfigError: there is none of that name, or it does not take such an option.
    """
    names = [word for word in given if "=" not in word]
    options = [word for word in given if "=" in word]
    if len(names) > 1 or any(name not in CARRIERS for name in names):
        wrong = names[1] if len(names) > 1 else names[0]
        raise ConfigError(f"{OPTION} {wrong!r} should be {either(CARRIERS)}, given once")
    if options and names != [MQTT]:
        raise ConfigError(f"{OPTION} {options[0]} is an option of {MQTT}: give {OPTION} {MQTT}")
    try:
        mqtt = build(MqttOptions, {}, parse_changes(options), lambda built, _: built)
    except ConfigError as error:
        raise ConfigError(f"{OPTION} {error.problem.removeprefix('--set ')}") from None
    return RunCarrier(names[0] if names else ZEROMQ, mqtt)


def free_port(host: str) -> int:
    """Return a port that is free now.

    Raises:
        ConfigError: the host is not this machine.
    """
    with closing(socket.socket()) as one:
        try:
            one.bind((host, 0))
        except OSError as error:
            raise ConfigError(f"cannot listen on {host}: {error.strerror}") from None
        return int(one.getsockname()[1])
