"""The models that a scenario can be played in, side by side behind one interface.

`full`: bodies, cameras, persons with phones and every byte on the network. `timed`: travel and
service times only, a thousand times faster; the DVA's core is the same in both. `task`: one
person at a task of the literature, with the operators and hands of the full model. `transports`:
a session of teleoperation beside TCP flows on one congested link, and a drive over it.
`middleware`: commands over real middleware and an emulated link, in real time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Final, Generic, TypeVar

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.measure import Columns, names_of
from dva_sim.kernel.retired import use_now
from dva_sim.kernel.suggestions import unknown
from dva_sim.kernel.yaml_files import Document
from dva_sim.simulation import full, middleware, task, timed, transports
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.measures import episodes as of_full
from dva_sim.simulation.measures import middleware as of_middleware
from dva_sim.simulation.measures import sessions as of_transports
from dva_sim.simulation.measures import shifts as of_timed
from dva_sim.simulation.measures import trials as of_task
from dva_sim.simulation.measures import workload
from dva_sim.simulation.measures.commands import Row
from dva_sim.simulation.measures.drives import COMMAND_COLUMNS, DRIVE_COLUMNS
from dva_sim.simulation.measures.reported import REPORTED_COLUMNS
from dva_sim.simulation.middleware import MiddlewareScenario
from dva_sim.simulation.run_measures import RunMeasure, values_of
from dva_sim.simulation.scenario import Scenario, contradictions
from dva_sim.simulation.task import TaskScenario
from dva_sim.simulation.timed import TimedScenario
from dva_sim.simulation.transports import TransportScenario

Tables = dict[str, list[dict[str, Any]]]


AnyScenario = Scenario | TimedScenario | TaskScenario | TransportScenario | MiddlewareScenario


S = TypeVar("S", bound=AnyScenario)
Operated = TypeVar("Operated", Scenario, TaskScenario, TransportScenario)


class Model(Generic[S]):
    """Base class of models: what a study does with a scenario.

    Attributes:
        scenario: Class of its scenarios.
        columns: Every column of its tables. `runs` has one row for each run.
        is_recorded: True if its runs can be recorded, filmed and run side by side.
        is_real_time: True if runs take real time: then nothing else may run beside them, and their
            order is random.
    """

    scenario: type[S]
    columns: ClassVar[Columns]
    is_recorded = False
    is_real_time = False

    def simulate(self, scenario: S, seed: int) -> Any:
        """Run a scenario; what is left of the run, to be measured."""
        raise NotImplementedError

    def rows(self, recording: Any, with_tracks: bool = False) -> Tables:
        """Return what is measured of a run, by table."""
        raise NotImplementedError

    def build(self, source: Document | Mapping[str, Any], changes: Mapping[str, Any]) -> S:
        """Return the scenario of a file, with some keys changed.

        Raises:
            ConfigError: it is not valid.
        """
        raise NotImplementedError

    def measures(self, scenario: S | None = None) -> tuple[str, ...]:
        """Columns of the runs that a study may ask for: of some scenario, or of a certain one."""
        return names_of(self.columns["runs"])

    def tables(
        self,
        scenario: S,
        seed: int,
        with_tracks: bool,
        measures: Sequence[RunMeasure] = (),
    ) -> Tables:
        """Simulate; rows by table, that of the run with the user's own measures.

        Raises:
            ConfigError: a measure of the user's gives no answer that is one.
        """
        recording = self.simulate(scenario, seed)
        tables = self.rows(recording, with_tracks)
        values = values_of(measures, recording, scenario.model)
        if twins := tables["runs"][0].keys() & values.keys():
            raise ConfigError(f"the model {scenario.model!r} has a column {min(twins)!r} itself")
        tables["runs"][0] |= values
        return tables

    def rehearse(self, scenario: S, seed: int) -> None:
        """Find what cannot work before anything runs.

        Raises:
            ConfigError: what cannot be read or placed.
        """

    def lacks(self, scenario: S) -> str:
        """Return, in one line, what this machine lacks for a run; empty if nothing."""
        return ""

    def contradictions(self, scenario: S) -> list[str]:
        """List contradictory settings of a scenario, one sentence each."""
        return []

    # Persons of a population: names for independent runs where a model has none.
    def set_by_study(self, seed: int) -> dict[str, Any]:
        """Return keys that the study itself sets."""
        return {}

    def team(self, scenario: S) -> int:
        """Return how many persons of the population a run needs."""
        return 1

    def played_by(self, scenario: S, person: int) -> S:
        """Return the scenario with a certain person, by index in the population."""
        return scenario


class _Operated(Model[Operated]):
    """Persons are drawn from a population that the study's seed decides."""

    def set_by_study(self, seed: int) -> dict[str, Any]:
        return {"operator.population_seed": seed}

    def played_by(self, scenario: Operated, person: int) -> Operated:
        operator = scenario.operator.model_copy(update={"person": person})
        return scenario.model_copy(update={"operator": operator})


class _Full(_Operated[Scenario]):
    scenario = Scenario
    columns: ClassVar[Columns] = {
        "runs": of_full.RUN_COLUMNS,
        "events": of_full.EVENT_COLUMNS,
        "people": of_full.PEOPLE_COLUMNS,
        "operators": workload.OPERATOR_COLUMNS,
        "tracks": of_full.TRACK_COLUMNS,
        "drives": DRIVE_COLUMNS,
        "commands": COMMAND_COLUMNS,
        "reported": REPORTED_COLUMNS,
    }
    is_recorded = True
    build = staticmethod(scenarios.build)
    contradictions = staticmethod(contradictions)
    rehearse = staticmethod(full.rehearse)
    simulate = staticmethod(full.simulate)

    def measures(self, scenario: Scenario | None = None) -> tuple[str, ...]:
        return super().measures() if scenario is None else of_full.measures_of(scenario)

    def team(self, scenario: Scenario) -> int:
        return scenario.operator.count

    def rows(self, recording: full.Recording, with_tracks: bool = False) -> Tables:
        tracks = {"tracks": of_full.track_rows(recording)} if with_tracks else {}
        return of_full.tables_of(recording) | tracks


class _Timed(Model[TimedScenario]):
    scenario = TimedScenario
    columns: ClassVar[Columns] = {
        "runs": of_timed.RUN_COLUMNS,
        "events": of_timed.EVENT_COLUMNS,
        "responders": of_timed.RESPONDER_COLUMNS,
    }
    build = staticmethod(timed.build)

    def contradictions(self, scenario: TimedScenario) -> list[str]:
        return [f"events: {doubt}" for doubt in scenario.events_doubts]

    rehearse = staticmethod(timed.rehearse_timed)
    simulate = staticmethod(timed.simulate_timed)

    def measures(self, scenario: TimedScenario | None = None) -> tuple[str, ...]:
        return super().measures() if scenario is None else of_timed.measures_of(scenario)

    def rows(self, recording: timed.TimedRecording, with_tracks: bool = False) -> Tables:
        return of_timed.tables(recording)


class _Task(_Operated[TaskScenario]):
    scenario = TaskScenario
    columns: ClassVar[Columns] = {"runs": of_task.RUN_COLUMNS, "trials": of_task.TRIAL_COLUMNS}
    build = staticmethod(task.build)
    simulate = staticmethod(task.play)

    def measures(self, scenario: TaskScenario | None = None) -> tuple[str, ...]:
        return super().measures() if scenario is None else of_task.measures_of(scenario)

    def rehearse(self, scenario: TaskScenario, seed: int) -> None:
        task.rehearse(scenario)

    def rows(self, recording: list[Row], with_tracks: bool = False) -> Tables:
        return {"runs": [of_task.run_row(recording)], "trials": recording}


class _Transports(_Operated[TransportScenario]):
    scenario = TransportScenario
    columns: ClassVar[Columns] = {
        "runs": of_transports.RUN_COLUMNS,
        "flows": of_transports.FLOW_COLUMNS,
    }
    build = staticmethod(transports.build)
    simulate = staticmethod(transports.simulate_session)

    def rehearse(self, scenario: TransportScenario, seed: int) -> None:
        transports.rehearse(scenario)

    def rows(self, recording: transports.SessionRecording, with_tracks: bool = False) -> Tables:
        return of_transports.tables(recording)


class _Middleware(Model[MiddlewareScenario]):
    scenario = MiddlewareScenario
    columns: ClassVar[Columns] = {
        "runs": of_middleware.RUN_COLUMNS,
        "commands": of_middleware.COMMAND_COLUMNS,
        "pictures": of_middleware.PICTURE_COLUMNS,
    }
    is_real_time = True
    build = staticmethod(middleware.build)
    simulate = staticmethod(middleware.measure)

    def lacks(self, scenario: MiddlewareScenario) -> str:
        return middleware.lacks(scenario)

    def rows(self, recording: middleware.MiddlewareRun, with_tracks: bool = False) -> Tables:
        return of_middleware.tables(recording)


MODELS: Final[dict[str, Model[Any]]] = {
    "full": _Full(),
    "timed": _Timed(),
    "task": _Task(),
    "transports": _Transports(),
    "middleware": _Middleware(),
}
"""By name, as a scenario, a results folder or a recording names them."""


def model_of(document: Document) -> Model[Any]:
    """Return the model that a scenario file asks for.

    Raises:
        ConfigError: there is no such model.
    """
    name = document.data.get("model", "full")
    if isinstance(name, str) and name in MODELS:
        return MODELS[name]
    advice = use_now("model", "FILE:CLASS") if ".py:" in str(name) else ""
    raise document.error(advice or unknown("model", name, MODELS), ("model",))


def model_for(scenario: AnyScenario) -> Model[Any]:
    """Return the model of a scenario that has been read."""
    return MODELS[scenario.model]


def measured_names() -> set[str]:
    """Return every column of every table of our models."""
    return {column.name for model in MODELS.values() for columns in model.columns.values()
            for column in columns}  # fmt: skip
