"""Commands over real middleware and an emulated link: what is sent over what, as configured."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field

from dva_sim.kernel import config_overrides
from dva_sim.kernel.config import Config, Fail, Key
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.yaml_files import Document
from dva_sim.network.link import LinkConfig
from dva_sim.network.middleware import PLUGINS


class TransportChoice(Config):
    """Transport of the commands.

    Attributes:
        name: A shipped transport, an installed one, or a file and its class.
        options: Its own options.
    """

    name: Annotated[str, Key("transport")]
    options: Annotated[dict[str, Any], Key("options of the transport")] = Field(
        default_factory=dict
    )


class StreamConfig(Config):
    """A stream of messages of one size.

    Attributes:
        rate_hz: Messages per second.
        bytes: Size of a message.
    """

    rate_hz: Annotated[float, Field(gt=0, le=200)]
    bytes: Annotated[int, Field(ge=8, le=60_000)]


class ObedienceConfig(Config):
    """Rules that a robot obeys, as in a full scenario.

    Attributes:
        watchdog_s: Time without a newer command after which it stops.
        max_age_s: A command that is older is not obeyed.
    """

    watchdog_s: Annotated[float, Field(gt=0, le=60), Key("watchdog of the robot")] = 1.0
    max_age_s: Annotated[float, Field(gt=0, le=120), Key("age limit of a command")] = 1.0


class MiddlewareScenario(Config):
    """An operator that sends commands to a robot over real middleware, in real time.

    Attributes:
        model: Name of this kind of scenario.
        transport: Transport of the commands.
        link: Link between the two, as in a full scenario; its time begins with the run.
        command_rate_hz: Commands per second, each as the phone's app sends it.
        pictures: Pictures that the robot sends over the same transport; by default none.
        robot: Robot's rules for accepting commands.
        set_up_s: Start of the measurement; a transport that is not connected by then has failed.
        measure_s: Length of the measurement.
        attempts: Number of attempts when the machine disturbs a run; the last counts.
    """

    model: Literal["middleware"]
    description: str = ""
    transport: TransportChoice = TransportChoice(name="zeromq")
    link: LinkConfig = LinkConfig()
    command_rate_hz: Annotated[float, Field(gt=0, le=200), Key("command rate")] = 20.0
    pictures: StreamConfig | None = None
    robot: ObedienceConfig = ObedienceConfig()
    set_up_s: Annotated[float, Field(gt=0, le=60)] = 3.0
    measure_s: Annotated[float, Field(gt=0, le=600)] = 8.0
    attempts: Annotated[int, Field(ge=1, le=10)] = 3


def build(
    source: Document | Mapping[str, Any], changes: Mapping[str, Any] | None = None
) -> MiddlewareScenario:
    """Return a scenario from a file or plain data, with some keys changed.

    Args:
        source: Document, whose mistakes are reported with their place, or plain data.
        changes: New values by dotted key, such as `{"transport.name": "mqtt"}`.

    Raises:
        ConfigError: an unknown key or name, a wrong type, a value out of range.
    """
    return config_overrides.build(MiddlewareScenario, source, changes, _complete)


def _complete(scenario: MiddlewareScenario, error: Fail) -> MiddlewareScenario:
    """Refuse a transport that does not exist, or options that it does not take."""
    try:
        transport = PLUGINS.load(scenario.transport.name, scenario.transport.options)()
    except ConfigError as problem:
        raise error(problem.problem, ("transport",)) from None
    if scenario.pictures is not None and not transport.carries_pictures:
        raise error(f"{scenario.transport.name} carries no pictures", ("pictures",))
    return scenario
