"""Plan of a storm: a scenario, and the faults that strike it, each with its time.

A plan is data. It can be written to a file, cut down to fewer faults, and run again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from io import StringIO
from pathlib import Path
from typing import Any, Final

from ruamel.yaml import YAML

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.scenario import Scenario
from dva_sim.storms.releaser import LABEL as RELEASER
from dva_sim.storms.releaser import ROLE as RELEASER_ROLE

RECOVERS_WITHIN: Final = 120.0
"""Time from the end of the last fault to the probes that must succeed (S8) [s].

A request fails after three attempts of 9 s. A device that cannot register retries every 2 s, and
one that can renews every 10 s; after 10 s of silence the DVA ends a device's permissions. Four of
these chains follow each other if a robot has just been restarted under its driver.
"""
PROBES_LAST: Final = 120.0
"""Longest time of a probe, from the first request to its end [s]."""


@dataclass(frozen=True)
class Fault:
    """A fault that a storm causes, at a time or at a message.

    Attributes:
        kind: Its name, as in `dva_sim.storms.faults.FAULTS`.
        at_s: Earliest start [s].
        for_s: Duration [s]; 0: a single act.
        target: Label of the device that it strikes, such as `robot-1`; empty: any; `robot-*`: the
            robot that receives the awaited message.
        source: Label of the sender, for faults of messages; empty: any.
        on: Kind of message to the target that it waits for, such as `StartTeleOp`; empty: it
            begins at `at_s`.
        value: Its strength, whose meaning depends on the kind.
    """

    kind: str
    at_s: float
    for_s: float = 0.0
    target: str = ""
    source: str = ""
    on: str = ""
    value: float = 0.0

    def as_plain(self) -> dict[str, Any]:
        """Return it for a file, without default values."""
        usual = {field.name: field.default for field in fields(self)}
        return {key: value for key, value in asdict(self).items() if value != usual[key]}


@dataclass(frozen=True)
class StormPlan:
    """Storm: a scenario and its faults.

    Attributes:
        seed: Random seed.
        scenario: Keys of a scenario, as in its file.
        faults: Faults in order of time.
        calm_s: End of the last fault [s]; from then on everything has to recover.
        drivers: Number of drivers who are never idle, besides the operators of the scenario.
    """

    seed: int
    scenario: Mapping[str, Any]
    faults: tuple[Fault, ...]
    calm_s: float
    drivers: int = 0

    @property
    def horizon_s(self) -> float:
        """End of the storm, after recovery and probes [s]; late probes prolong it."""
        return self.calm_s + RECOVERS_WITHIN + PROBES_LAST

    def built(self) -> Scenario:
        """Return the scenario.

        Raises:
            ConfigError: it makes no sense.
        """
        rooms = {**self.scenario.get("dva", {}).get("control_rooms", {}), RELEASER: RELEASER_ROLE}
        changes = {
            "horizon_s": self.horizon_s,
            "emergency.release": "person",
            "dva.control_rooms": rooms,
        }
        scenario = scenarios.build(dict(self.scenario), changes)
        assert isinstance(scenario, Scenario)
        return scenario

    def with_faults(self, faults: tuple[Fault, ...]) -> StormPlan:
        """Return the same storm with other faults."""
        return replace(self, faults=faults)

    def as_plain(self) -> dict[str, Any]:
        """Return it for a file."""
        return {
            "seed": self.seed,
            "calm_s": self.calm_s,
            "drivers": self.drivers,
            "scenario": dict(self.scenario),
            "faults": [fault.as_plain() for fault in self.faults],
        }

    def text(self) -> str:
        """Return its file."""
        text = StringIO()
        YAML().dump(self.as_plain(), text)
        return text.getvalue()


def load_plan(path: Path) -> StormPlan:
    """Read a plan from its file.

    Raises:
        ConfigError: it cannot be read, or is not a plan.
    """
    data = load_yaml(path).data
    try:
        faults = tuple(Fault(**fault) for fault in data["faults"])
        calm = float(data["calm_s"])
        drivers = int(data.get("drivers", 0))
        plan = StormPlan(int(data["seed"]), data["scenario"], faults, calm, drivers)
    except (KeyError, TypeError, ValueError) as error:
        raise ConfigError(f"is not the plan of a storm: {error}", path) from None
    plan.built()
    return plan
