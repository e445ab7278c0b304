"""Everything one run needs but its seed."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from dva_sim.config import Config
from dva_sim.key_hints import AlsoCalled
from dva_sim.network.connecting import Depth, TransportKind, ZeromqConfig
from dva_sim.network.link import LinkConfig
from dva_sim.scenario.parts import (
    BystanderConfig,
    CameraConfig,
    CommandConfig,
    EventConfig,
    GuardConfig,
    OperatorConfig,
    PhoneConfig,
    RequestConfig,
    RobotConfig,
    SiteConfig,
)
from dva_sim.scenario.rules import AccessConfig, DispatchConfig, PatrolConfig


class Scenario(Config):
    """Everything one run needs but its seed.

    Attributes:
        model: Tells this kind of scenario from the timed ones.
        control: How operators use robots. `direct`: they close the loop over the link.
            `coordinated`: the robot also watches where it drives, and slows by itself.
            `supervisory`: they name the goal and judge the picture, the robot drives alone.
        transport: What carries messages: ZeroMQ over TCP, or datagrams.
        network_depth: How ZeroMQ over TCP is modelled: by whole messages, exact where nothing
            is lost or piles up; by TCP segments; or as each link asks for.
    """

    model: Literal["full"] = "full"
    description: str = ""
    site: SiteConfig = SiteConfig()
    robot: RobotConfig = RobotConfig()
    guard: GuardConfig = GuardConfig()
    bystander: BystanderConfig = BystanderConfig()
    operator: OperatorConfig = OperatorConfig()
    control: Literal["direct", "coordinated", "supervisory"] = "direct"
    pattern: Annotated[
        Literal["req-rep", "pipelined", "pub-sub", "latest-wins"],
        AlsoCalled("messaging", "messaging_pattern", "protocol"),
    ] = "latest-wins"
    phone: PhoneConfig = PhoneConfig()
    command: CommandConfig = CommandConfig()
    request: RequestConfig = RequestConfig()
    transport: TransportKind = "zeromq"
    zeromq: ZeromqConfig = ZeromqConfig()
    network_depth: Depth = "auto"
    link: LinkConfig = LinkConfig()
    camera: CameraConfig = CameraConfig()
    events: Annotated[tuple[EventConfig, ...], Field(min_length=1)] = (EventConfig(kind="fire"),)
    dispatch: DispatchConfig = DispatchConfig()
    access: tuple[AccessConfig, ...] = ()
    patrols: tuple[PatrolConfig, ...] = ()
    horizon_s: Annotated[
        float, Field(ge=0.001, le=86_400), AlsoCalled("duration_s", "time_limit_s", "length_s")
    ] = 300.0

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
