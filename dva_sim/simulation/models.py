"""The models that a scenario can be played in, as a study sees them.

`full`: bodies, cameras, persons with phones and every byte on the network. `timed`: travel and
service times only, a thousand times faster; the DVA's core is the same in both. `task`: one
person at a task of the literature, with the operators and hands of the full model. `transports`:
a session of teleoperation beside TCP flows on one congested link, and a drive over it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Protocol

from dva_sim.kernel.config import Document
from dva_sim.kernel.suggestions import unknown
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.scenario import Scenario
from dva_sim.simulation.shift import scenario as timed
from dva_sim.simulation.shift.scenario import TimedScenario
from dva_sim.simulation.task import scenario as tasks
from dva_sim.simulation.task.scenario import TaskScenario
from dva_sim.simulation.transport import scenario as transports
from dva_sim.simulation.transport.scenario import TransportScenario

if TYPE_CHECKING:
    from dva_sim.simulation.full import Recording


AnyScenario = Scenario | TimedScenario | TaskScenario | TransportScenario
SCENARIOS: dict[str, type[AnyScenario]] = {
    "full": Scenario,
    "timed": TimedScenario,
    "task": TaskScenario,
    "transports": TransportScenario,
}
Tables = dict[str, list[dict[str, Any]]]


class Model(Protocol):
    """What a study does with a scenario."""

    def measures(self, scenario: AnyScenario | None = None) -> tuple[str, ...]:
        """Columns of the runs that a study may ask for: of some scenario, or of a certain one."""

    def build(self, source: Document, changes: Mapping[str, Any]) -> AnyScenario:
        """The scenario of a file, with some keys changed.

        Raises:
            ConfigError: it is not valid.
        """

    def set_by_study(self, seed: int) -> dict[str, Any]:
        """Keys that the study itself sets."""

    def team(self, scenario: AnyScenario) -> int:
        """How many persons of the population a run takes."""

    def played_by(self, scenario: AnyScenario, person: int) -> AnyScenario:
        """The scenario with a certain person, by index in the population."""

    def rehearse(self, scenario: AnyScenario, seed: int) -> None:
        """Find what cannot work before anything runs.

        Raises:
            ConfigError: what cannot be read or placed.
        """

    def tables(self, scenario: AnyScenario, seed: int, with_tracks: bool) -> Tables:
        """Simulate; rows by table."""


def model_of(document: Document) -> Model:
    """The model that a scenario file asks for.

    Raises:
        ConfigError: there is no such model.
    """
    name = document.data.get("model", "full")
    if not isinstance(name, str) or name not in MODELS:
        raise document.error(unknown("model", name, MODELS), ("model",))
    return MODELS[name]


def model_for(scenario: AnyScenario) -> Model:
    """The model of a scenario that has been read."""
    return MODELS[scenario.model]


def tables_of(recording: Recording) -> Tables:
    """What is measured of a run of the full model, but for its tracks."""
    from dva_sim.simulation.full import measures, workload

    return {
        "runs": [measures.run_row(recording)],
        "events": measures.event_rows(recording),
        "people": measures.people_rows(recording),
        "operators": workload.operator_rows(recording),
    }


class _Full:
    def measures(self, scenario: AnyScenario | None = None) -> tuple[str, ...]:
        from dva_sim.simulation.full import measures

        return (
            measures.measures_of(scenario) if isinstance(scenario, Scenario) else measures.MEASURES
        )

    def build(self, source: Document, changes: Mapping[str, Any]) -> Scenario:
        return scenarios.build(source, changes)

    def set_by_study(self, seed: int) -> dict[str, Any]:
        return {"operator.population_seed": seed}

    def team(self, scenario: AnyScenario) -> int:
        assert isinstance(scenario, Scenario)
        return scenario.operator.count

    def played_by(self, scenario: AnyScenario, person: int) -> Scenario:
        assert isinstance(scenario, Scenario)
        operator = scenario.operator.model_copy(update={"person": person})
        return scenario.model_copy(update={"operator": operator})

    def rehearse(self, scenario: AnyScenario, seed: int) -> None:
        from dva_sim.simulation.full import rehearse

        assert isinstance(scenario, Scenario)
        rehearse(scenario, seed)

    def tables(self, scenario: AnyScenario, seed: int, with_tracks: bool) -> Tables:
        from dva_sim.simulation.full import measures, simulate

        assert isinstance(scenario, Scenario)
        recording = simulate(scenario, seed)
        tracks = {"tracks": measures.track_rows(recording)} if with_tracks else {}
        return tables_of(recording) | tracks


class _Timed:
    """Its persons are but names for independent runs."""

    def measures(self, scenario: AnyScenario | None = None) -> tuple[str, ...]:
        from dva_sim.simulation.shift.measures import MEASURES, measures_of

        return measures_of(scenario) if isinstance(scenario, TimedScenario) else MEASURES

    def build(self, source: Document, changes: Mapping[str, Any]) -> TimedScenario:
        return timed.build(source, changes)

    def set_by_study(self, seed: int) -> dict[str, Any]:
        return {}

    def team(self, scenario: AnyScenario) -> int:
        return 1

    def played_by(self, scenario: AnyScenario, person: int) -> AnyScenario:
        return scenario

    def rehearse(self, scenario: AnyScenario, seed: int) -> None:
        from dva_sim.simulation.shift import rehearse_timed

        assert isinstance(scenario, TimedScenario)
        rehearse_timed(scenario, seed)

    def tables(self, scenario: AnyScenario, seed: int, with_tracks: bool) -> Tables:
        from dva_sim.simulation.shift import simulate_timed
        from dva_sim.simulation.shift.measures import tables

        assert isinstance(scenario, TimedScenario)
        return tables(simulate_timed(scenario, seed))


class _Task:
    """A run is a block of trials of one person; `trials` has a row for each."""

    def measures(self, scenario: AnyScenario | None = None) -> tuple[str, ...]:
        from dva_sim.simulation.task.measures import MEASURES, measures_of

        return measures_of(scenario) if isinstance(scenario, TaskScenario) else MEASURES

    def build(self, source: Document, changes: Mapping[str, Any]) -> TaskScenario:
        return tasks.build(source, changes)

    def set_by_study(self, seed: int) -> dict[str, Any]:
        return {"operator.population_seed": seed}

    def team(self, scenario: AnyScenario) -> int:
        return 1

    def played_by(self, scenario: AnyScenario, person: int) -> TaskScenario:
        assert isinstance(scenario, TaskScenario)
        operator = scenario.operator.model_copy(update={"person": person})
        return scenario.model_copy(update={"operator": operator})

    def rehearse(self, scenario: AnyScenario, seed: int) -> None:
        from dva_sim.simulation.task import rehearse

        assert isinstance(scenario, TaskScenario)
        rehearse(scenario)

    def tables(self, scenario: AnyScenario, seed: int, with_tracks: bool) -> Tables:
        from dva_sim.simulation.task import play
        from dva_sim.simulation.task.measures import run_row

        assert isinstance(scenario, TaskScenario)
        trials = play(scenario, seed)
        return {"runs": [run_row(trials)], "trials": trials}


class _Transports:
    """A run is the network first, and then one drive of one person over it."""

    def measures(self, scenario: AnyScenario | None = None) -> tuple[str, ...]:
        from dva_sim.simulation.transport.measures import MEASURES

        return MEASURES

    def build(self, source: Document, changes: Mapping[str, Any]) -> TransportScenario:
        return transports.build(source, changes)

    def set_by_study(self, seed: int) -> dict[str, Any]:
        return {"operator.population_seed": seed}

    def team(self, scenario: AnyScenario) -> int:
        return 1

    def played_by(self, scenario: AnyScenario, person: int) -> TransportScenario:
        assert isinstance(scenario, TransportScenario)
        operator = scenario.operator.model_copy(update={"person": person})
        return scenario.model_copy(update={"operator": operator})

    def rehearse(self, scenario: AnyScenario, seed: int) -> None:
        from dva_sim.simulation.transport import rehearse

        assert isinstance(scenario, TransportScenario)
        rehearse(scenario)

    def tables(self, scenario: AnyScenario, seed: int, with_tracks: bool) -> Tables:
        from dva_sim.simulation.transport import simulate_transports

        assert isinstance(scenario, TransportScenario)
        return simulate_transports(scenario, seed)


MODELS: dict[str, Model] = {
    "full": _Full(),
    "timed": _Timed(),
    "task": _Task(),
    "transports": _Transports(),
}
