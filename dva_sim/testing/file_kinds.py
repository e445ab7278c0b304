"""Kinds of YAML files: recognise, check with the code that runs them, locate mistakes.

It stands above all rooms whose files it knows: the table of all kinds stands at the end.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, Final

from PIL import Image

from dva_sim.agents.operator.published import SplitFile, load_split
from dva_sim.agents.robot.profile import RobotProfile, read_robot
from dva_sim.agents.tilt import PhoneProfile, try_phone
from dva_sim.experiments.execution.dry_run import contradictions_in
from dva_sim.experiments.study import cell_grid
from dva_sim.experiments.study.answerable import coverage_remarks, why_unanswered
from dva_sim.experiments.study.file_kinds import EVIDENCE, FileKind
from dva_sim.experiments.study.file_kinds import KINDS as KINDS_OF_RUNS
from dva_sim.experiments.study.loading import load_study
from dva_sim.experiments.study.mistake_places import blamed_in
from dva_sim.experiments.study.registration import Preregistration, departures, load_registration
from dva_sim.experiments.study.study import Study
from dva_sim.kernel.config import Config, validate
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.yaml_files import Document, read_text
from dva_sim.protocol.mistakes import Problem
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.middleware import MiddlewareScenario
from dva_sim.simulation.models import model_of
from dva_sim.simulation.scenario import Scenario
from dva_sim.simulation.task import TaskScenario
from dva_sim.simulation.timed.scenario import TimedScenario
from dva_sim.simulation.transports import TransportScenario
from dva_sim.validation.dispatch.cases import CaseFile, load_cases
from dva_sim.validation.network.reference import PlanConfig, load_plan
from dva_sim.worlds.drawn_plan import make_plan
from dva_sim.worlds.geo import GeoFrame
from dva_sim.worlds.geojson import read_features, storeys
from dva_sim.worlds.maps import RosMap, doubts_of_map
from dva_sim.worlds.site import DEFAULT_FRAME, SiteFile, doubts_of_site, load_site, map_site

PROBE: Final = "drive-to-event"  # scenario with which a map is tried
PROBES: Final = 6  # number of its runs
_SCENARIOS: Final = (
    Scenario,
    TimedScenario,
    TaskScenario,
    TransportScenario,
    MiddlewareScenario,
)


# What readers may raise on files that nobody would write, besides what they say in words.
_HOSTILE: Final = (ValueError, OverflowError, Image.DecompressionBombError)


def check_config(kind: FileKind, document: Document) -> list[Problem]:
    """List the mistakes in a configuration, as found by the code that runs it."""
    return _collect(
        document.file, partial(_mistakes, kind.model, document), partial(blamed_in, document)
    )


def _mistakes(model: type[Config], document: Document) -> Iterator[ConfigError]:
    """Yield mistakes of files that may have several; a file's only mistake is raised."""
    if model in _CHECKS:
        yield from _CHECKS[model](document)
    elif model in _LOADERS:
        _LOADERS[model](document)
    else:
        validate(model, document.data, document.error)


def doubts(kind: FileKind, document: Document) -> list[str]:
    """List contradictory settings in a valid study or scenario, and why a study answers nothing."""
    if kind.model is Study:
        study = load_study(document.file)
        return [*why_unanswered(study), *contradictions_in(cell_grid.cells(study))]
    if kind.model is RosMap:
        return [*doubts_of_map(document.file), *_without_a_place(document)]
    if kind.model is SiteFile:
        return doubts_of_site(document)
    if kind.model not in _SCENARIOS:
        return []
    model = model_of(document)
    return model.contradictions(model.build(document, {}))


def notes(kind: FileKind, document: Document) -> str:
    """Describe a valid file in a line: its contents, or limits of the answer that it promises."""
    if kind.model is Study:
        return "; ".join(coverage_remarks(load_study(document.file)))
    if kind.model in (Scenario, TimedScenario):
        return str(model_of(document).build(document, {}).events_summary)
    return ""


def _without_a_place(document: Document) -> Iterator[str]:
    """Say of a map in how many runs no event finds a place."""
    scenario = scenarios.load(PROBE)
    model = model_of(scenario)
    problems = list[str]()
    for seed in range(1, PROBES + 1):
        try:
            model.rehearse(model.build(scenario, {"site.map": str(document.file.resolve())}), seed)
        except ConfigError as error:
            problems.append(error.problem)
    if problems:
        yield (
            f"{len(problems)} of {PROBES} runs that were tried cannot begin: {problems[0]}; "
            "it needs more open floor"
        )


def check_plan(path: Path) -> list[Problem]:
    """List the mistakes in a drawn plan; its site decides if the bases are free."""

    def read() -> Iterator[ConfigError]:
        levels: list[str | None] = [*storeys(path)]
        for level in levels or [None]:
            make_plan(read_features(path, _frame_of(path), level))
        return iter(())

    return _collect(path, read, lambda error: error)


def _collect(
    path: Path,
    check: Callable[[], Iterator[ConfigError]],
    blame: Callable[[ConfigError], ConfigError],
) -> list[Problem]:
    problems = []
    try:
        for error in check():
            problems.append(_problem(path, blame(error)))
    except ConfigError as error:
        problems.append(_problem(path, blame(error)))
    except RecursionError:
        problems.append(Problem(1, 1, "is nested too deeply"))
    except _HOSTILE as error:
        problems.append(Problem(1, 1, f"cannot be read: {error}"))
    return list(dict.fromkeys(problems))


def _problem(path: Path, error: ConfigError) -> Problem:
    same = error.file is None or Path(error.file).resolve() == path.resolve()
    return Problem(
        error.line or 1, error.column or 1, error.problem, None if same else str(error.file)
    )


# --- kinds -----------------------------------------------------------------------------
def _check_study(document: Document) -> Iterator[ConfigError]:
    """Yield the study, its scenarios in every cell, and one run of each built as by the runner."""
    study = load_study(document.file)
    versions = [study, *(load_study(document.file, version=name) for name in study.versions)]
    cells = [cell_grid.to_rehearse(version, cell_grid.cells(version)) for version in versions]
    for cell in {cell.config: cell for some in cells for cell in some}.values():
        try:
            cell_grid.rehearse(study, cell)
        except ConfigError as error:
            path = ("parts", cell.part, "scenario")
            yield error if error.file is not None else document.error(error.problem, path)


def _check_registration(document: Document) -> Iterator[ConfigError]:
    """Yield the departures of the study beside a registration from the registered plan."""
    registered = load_registration(document)
    file = document.file.parent / f"{registered.study}.yaml"
    if not file.is_file():
        yield document.error(f"{file.name}, the study it is of, is not beside it", ("study",))
        return
    for problem in departures(
        registered, load_study(file, version="full" if registered.full else None)
    ):
        yield document.error(problem, ("plan",))


def _rehearse(document: Document) -> None:
    model = model_of(document)
    model.rehearse(model.build(document, {}), seed=1)


def _load_map(document: Document) -> None:
    validate(RosMap, document.data, document.error)
    map_site(document.file.resolve(), seed=1, robots=1, guards=1)


def _load_robot(document: Document) -> None:
    """Load the profile, and make its motors once."""
    spec = read_robot(document).drive_spec()
    spec.drive(spec)


def _load_phone(document: Document) -> None:
    """Load the profile, and make all that it names once."""
    try_phone(validate(PhoneProfile, document.data, document.error))


def _frame_of(path: Path) -> GeoFrame:
    """Return a plane where the plan is, so that it can be judged without its site."""
    try:
        features = json.loads(read_text(path))["features"]
        position: Any = next(f["geometry"]["coordinates"] for f in features if f.get("geometry"))
        while isinstance(position[0], list):
            position = position[0]
        longitude = float(position[0])
        latitude = float(position[1])
    except (LookupError, TypeError, ValueError, AttributeError, StopIteration):
        return DEFAULT_FRAME  # what is wrong with it, its reader says with the place
    return GeoFrame(latitude, longitude) if abs(latitude) < 89 else DEFAULT_FRAME


KINDS: Final = (
    *KINDS_OF_RUNS,
    FileKind("validation cases", CaseFile, EVIDENCE),
    FileKind("measurements", PlanConfig, EVIDENCE),
)
"""All kinds; those of evidence are of no use to a run."""

_LOADERS: Final[dict[type[Config], Callable[[Document], object]]] = {
    **dict.fromkeys(_SCENARIOS, _rehearse),
    CaseFile: lambda d: load_cases(d.file),
    PlanConfig: lambda d: load_plan(str(d.file)),
    PhoneProfile: _load_phone,
    RobotProfile: _load_robot,
    RosMap: _load_map,
    SiteFile: lambda d: load_site(d.file),
    SplitFile: lambda d: load_split(str(d.file)),
}
"""Reader of each kind of file whose validation goes beyond its keys."""

_CHECKS: Final[dict[type[Config], Callable[[Document], Iterator[ConfigError]]]] = {
    Preregistration: _check_registration,
    Study: _check_study,
}
"""Kinds of files in which several mistakes can be reported."""
