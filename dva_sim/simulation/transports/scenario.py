"""A comparison of transports: who sends what beside whom, what is driven, and one such run.

The traffic does not depend on the drive, so the fates of commands and pictures are the same
as if both were simulated together. A drive begins at some moment of the time that is measured, and
goes on from its beginning when it outlasts it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field

from dva_sim.kernel import config_overrides
from dva_sim.kernel.config import Config, Fail, Key
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.yaml_files import Document
from dva_sim.network.transports import Contest, ContestConfig, Fates, play
from dva_sim.simulation import task
from dva_sim.simulation.scenario.parts import OperatorConfig
from dva_sim.simulation.task import TaskScenario
from dva_sim.simulation.task.recorded_delays import FrameStream, RecordedDelays
from dva_sim.simulation.task.scenario import PlantConfig
from dva_sim.simulation.task.tasks import Corner, Course, Slalom


class DriveConfig(Config):
    """Vehicle that is driven over the link.

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
        model: Name of this kind of scenario.
        operator: Person who drives, as in a full scenario.
        drive: Vehicle and course.
    """

    model: Literal["transports"]
    description: str = ""
    operator: OperatorConfig = OperatorConfig()
    drive: DriveConfig

    def task(self) -> TaskScenario:
        """Return the drive as a task, whose link is to be the recorded one.

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
    """Return a comparison from a file or plain data, with some keys changed.

    Args:
        source: Document, whose mistakes are reported with their place, or plain data.
        changes: New values by dotted key, such as `{"bulk.down": 2}`.

    Raises:
        ConfigError: an unknown key or name, a wrong type, a value out of range.
    """
    return config_overrides.build(TransportScenario, source, changes, _complete)


def _complete(scenario: TransportScenario, error: Fail) -> TransportScenario:
    """Refuse a drive that is none."""
    try:
        scenario.task()
    except ConfigError as problem:
        raise error(problem.problem, ("drive",)) from None
    return scenario


class SessionRecording(NamedTuple):
    """Results of a run.

    Attributes:
        contest: Fates of everything sent.
        trial: Measures of the drive.
    """

    scenario: TransportScenario
    contest: Contest
    trial: dict[str, Any]


def simulate_session(scenario: TransportScenario, seed: int) -> SessionRecording:
    """Return the network first, and then one drive over what it delivers."""
    contest = play(scenario, seed)
    trials = task.play(scenario.task(), seed, make_recorded_delays(scenario, contest))
    failures = sum(trial["plugin_failures"] for trial in trials)  # while practising, too
    return SessionRecording(scenario, contest, trials[-1] | {"plugin_failures": failures})


def rehearse(scenario: TransportScenario) -> None:
    """Make what drives, and let no time pass.

    Raises:
        ConfigError: who drives cannot be made.
    """
    task.rehearse(scenario.task())


def make_recorded_delays(scenario: TransportScenario, contest: Contest) -> RecordedDelays:
    """Return the delays of commands and pictures while the session was measured."""
    return RecordedDelays(
        _stream(contest, contest.commands, scenario.commands.rate_hz),
        _stream(contest, contest.pictures, scenario.pictures.rate_hz),
    )


def _stream(contest: Contest, fates: Fates, rate: float) -> FrameStream:
    made = np.array(fates.made)
    arrived = np.array(fates.arrived)
    counts = (made >= contest.since) & (made < contest.until)
    return FrameStream(1.0 / rate, (arrived - made)[counts])
