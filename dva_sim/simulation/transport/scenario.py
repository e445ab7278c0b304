"""What a comparison of transports consists of: who sends what beside whom, and what is driven."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field

from dva_sim.kernel import config_overrides
from dva_sim.kernel.config import Config, Document, Fail, Key
from dva_sim.kernel.errors import ConfigError
from dva_sim.network.transports import ContestConfig
from dva_sim.simulation import task
from dva_sim.simulation.scenario.parts import OperatorConfig
from dva_sim.simulation.task import TaskScenario
from dva_sim.simulation.task.kinds import Corner, Course, Slalom
from dva_sim.simulation.task.scenario import PlantConfig


class DriveConfig(Config):
    """What is driven over the link.

    Attributes:
        task: A way.
        plant: The vehicle.
        practice: Drives before the one that is kept, in which the person learns the delay.
        horizon_s: A drive that is not done by then is given up.
    """

    task: Annotated[
        Corner | Slalom | Course,
        Field(discriminator="kind"),
        Key(inner={"kind": Key("way that is driven")}),
    ]
    plant: PlantConfig = PlantConfig(speed_mps=0.5)
    practice: Annotated[int, Field(ge=0, le=100)] = 1
    horizon_s: Annotated[float, Field(gt=0, le=7200)] = 600.0


class TransportScenario(ContestConfig):
    """A session beside TCP flows, and a drive over the commands and pictures that it delivers.

    Attributes:
        model: Tells this kind of scenario from the others.
        operator: Who drives, as in a full scenario.
        drive: What is driven.
    """

    model: Literal["transports"]
    description: str = ""
    operator: OperatorConfig = OperatorConfig()
    drive: DriveConfig

    def task(self) -> TaskScenario:
        """The drive as a task, whose link is to be the recorded one.

        Raises:
            ConfigError: who drives cannot be, or not with this vehicle.
        """
        return task.build(
            {
                "model": "task",
                "task": self.drive.task.model_dump(),
                "operator": self.operator.model_dump(),
                "device": {"kind": "joystick", "rate_hz": self.commands.rate_hz},
                "frames": {"rate_hz": self.pictures.rate_hz},
                "plant": self.drive.plant.model_dump(),
                "practice": self.drive.practice,
                "horizon_s": self.drive.horizon_s,
            }
        )


def build(
    source: Document | Mapping[str, Any], changes: Mapping[str, Any] | None = None
) -> TransportScenario:
    """A comparison from a file or plain data, with some keys changed.

    Args:
        source: A document (mistakes are told with their place) or plain data.
        changes: New values by dotted key, such as `{"bulk.down": 2}`.

    Raises:
        ConfigError: an unknown key or name, a wrong type, a value out of range.
    """
    return config_overrides.build(
        TransportScenario, source, changes or {}, _complete, lambda data, folders: None
    )


def _complete(scenario: TransportScenario, error: Fail) -> TransportScenario:
    """Refuse a drive that is none."""
    try:
        scenario.task()
    except ConfigError as problem:
        raise error(problem.problem, ("drive",)) from None
    return scenario
