"""Everything one run needs but its seed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from dva_sim import config, resources
from dva_sim.config import Config, Document, load_yaml
from dva_sim.network.link import LinkConfig
from dva_sim.scenario.names import check_names, locate_policy
from dva_sim.scenario.parts import (
    CameraConfig,
    CommandConfig,
    EventConfig,
    GuardConfig,
    OperatorConfig,
    RobotConfig,
    SiteConfig,
)
from dva_sim.scenario.rules import AccessConfig, DispatchConfig

FOLDER = "experiments/scenarios"


class Scenario(Config):
    """Everything one run needs but its seed.

    Attributes:
        model: Tells this kind of scenario from the timed ones.
    """

    model: Literal["full"] = "full"
    description: str = ""
    site: SiteConfig = SiteConfig()
    robot: RobotConfig = RobotConfig()
    guard: GuardConfig = GuardConfig()
    operator: OperatorConfig = OperatorConfig()
    pattern: Literal["req-rep", "pipelined", "pub-sub", "latest-wins"] = "latest-wins"
    profile: str = "default"
    command: CommandConfig = CommandConfig()
    link: LinkConfig = LinkConfig()
    camera: CameraConfig = CameraConfig()
    events: Annotated[tuple[EventConfig, ...], Field(min_length=1)] = (EventConfig(kind="fire"),)
    dispatch: DispatchConfig = DispatchConfig()
    access: tuple[AccessConfig, ...] = ()
    horizon_s: Annotated[float, Field(gt=0, le=86_400)] = 300.0

    @property
    def window(self) -> int | None:
        """How many commands may be unanswered at once; None if nobody answers them."""
        return {"req-rep": 1, "pipelined": self.command.window}.get(self.pattern)

    @model_validator(mode="after")
    def _somebody_can_act(self) -> Scenario:
        if self.robot.count and not self.operator.count:
            raise ValueError("robots need an operator: operator.count is 0")
        if not self.robot.count and not self.guard.count:
            raise ValueError("nobody can respond: robot.count and guard.count are 0")
        return self

    @model_validator(mode="after")
    def _timeout_admits_the_delay(self) -> Scenario:
        """Below four round trips a retry never gets through: the socket opens anew each time."""
        longest = self.link.delay_s + self.link.jitter_s
        needed = 8 * longest + self.robot.processing_s
        if self.robot.count and self.command.timeout_s <= needed:
            raise ValueError(
                f"command.timeout_s {self.command.timeout_s:g} s should be above four round "
                f"trips and the processing time ({needed:g} s), or link.delay_s be shorter"
            )
        return self


def load(name: str, base: Path | None = None) -> Document:
    """Read a scenario by name or path; the data is checked by `build`.

    Raises:
        ConfigError: not found or not YAML.
    """
    return load_yaml(resources.find(name, FOLDER, base=base))


def build(
    source: Document | Mapping[str, Any], changes: Mapping[str, Any] | None = None
) -> Scenario:
    """A scenario from a file or plain data, with some keys changed.

    Args:
        source: A document (mistakes are told with their place) or plain data.
        changes: New values by dotted key, for example `{"link.delay_s": 0.25}`.

    Raises:
        ConfigError: an unknown key, a wrong type, a value out of range, a missing profile.
    """
    return config.build(Scenario, source, changes or {}, check_names, locate_policy)
