"""Configurations: read and rehearsed by the same code that runs them."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

from PIL import Image

from dva_sim.agents.operator.person import Population
from dva_sim.agents.people import BystanderProfile, GuardProfile
from dva_sim.agents.profile import RobotProfile, read_robot
from dva_sim.agents.tilt import AccelerometerPart, PhoneProfile, try_phone
from dva_sim.checking.problem import Problem
from dva_sim.config import Config, Document, Path_, validate
from dva_sim.errors import ConfigError
from dva_sim.experiments import design
from dva_sim.experiments.design import Cell
from dva_sim.experiments.episode import contradictions_in
from dva_sim.experiments.models import model_for, model_of
from dva_sim.experiments.registration import Registration, departures, load_registration
from dva_sim.experiments.repeats import Bands
from dva_sim.experiments.study import Study, load_study
from dva_sim.experiments.transports import TransportScenario
from dva_sim.experiments.tuned import Tuned
from dva_sim.experiments.validation.dispatch.cases import CaseFile, load_cases
from dva_sim.experiments.validation.network.plan import PlanConfig, load_plan
from dva_sim.experiments.validation.operators.targets import SplitFile, TargetFile, load_split
from dva_sim.scenario import Scenario, build, contradictions
from dva_sim.tasks import TaskScenario
from dva_sim.timed.scenario import TimedScenario
from dva_sim.worlds.geo import GeoFrame
from dva_sim.worlds.maps import RosMap
from dva_sim.worlds.plan import read_plan
from dva_sim.worlds.site import DEFAULT_FRAME, SiteFile, load_site, map_site

# What readers may raise on files that nobody would write, besides what they say in words.
_HOSTILE: Final = (ValueError, OverflowError, Image.DecompressionBombError)

_COUNTS: Final = {
    "robot base": ("robot", "count"),
    "guard post": ("guard", "count"),
    "operator desk": ("operator", "count"),
}

Check = Callable[[Document], Iterator[ConfigError]]


@dataclass(frozen=True)
class Kind:
    """One kind of YAML file.

    Attributes:
        name: As it is called in the output.
        model: Its keys.
        folder: Where files of this kind lie.
        check: Yields what is wrong, or raises it.
    """

    name: str
    model: type[Config]
    folder: str
    check: Check


def check_config(kind: Kind, document: Document) -> list[Problem]:
    """What is wrong with a configuration, by the code that runs it."""
    return _collect(document.file, partial(kind.check, document), partial(_blamed, document))


def doubts(kind: Kind, document: Document) -> list[str]:
    """What does not go together in a valid study or scenario."""
    if kind.model is Study:
        return contradictions_in(load_study(document.file))
    return contradictions(build(document)) if kind.model is Scenario else []


def check_plan(path: Path) -> list[Problem]:
    """What is wrong with a drawn plan; whether its bases are free is for its site to say."""

    def read() -> Iterator[ConfigError]:
        read_plan(path, _frame_of(path))
        return iter(())

    return _collect(path, read, lambda error: error)


def recognise(document: Document) -> Kind | None:
    """The kind that knows most of the keys; among equals, the one whose folder it lies in."""
    keys = document.data.keys() - {"description"}
    model = document.data.get("model")
    others = {TimedScenario: "timed", TaskScenario: "task", TransportScenario: "transports"}
    kinds = [kind for kind in KINDS if others.get(kind.model, model) == model]
    shared = {kind.name: len(keys & kind.model.model_fields.keys()) for kind in kinds}
    likely = [kind for kind in kinds if shared[kind.name] == max(shared.values())]
    if len(likely) == 1:
        return likely[0]
    folder = document.file.resolve().parent.as_posix()
    here = [kind for kind in likely if folder.endswith(f"/{kind.folder}")]
    return here[0] if len(here) == 1 else None


def _collect(
    path: Path,
    check: Callable[[], Iterator[ConfigError]],
    blame: Callable[[ConfigError], ConfigError],
) -> list[Problem]:
    found = []
    try:
        for error in check():
            found.append(_told(path, blame(error)))
    except ConfigError as error:
        found.append(_told(path, blame(error)))
    except RecursionError:
        found.append(Problem(1, 1, "is nested too deeply"))
    except _HOSTILE as error:
        found.append(Problem(1, 1, f"cannot be read: {error}"))
    return list(dict.fromkeys(found))


def _told(path: Path, error: ConfigError) -> Problem:
    same = error.file is None or Path(error.file).resolve() == path.resolve()
    return Problem(
        error.line or 1, error.column or 1, error.problem, None if same else str(error.file)
    )


def _blamed(document: Document, error: ConfigError) -> ConfigError:
    """The same mistake at the key that it is about, unless another file holds it."""
    problem = error.problem
    if error.file is not None:
        if Path(error.file).exists():
            return error
        problem = f"{error.file!r}: {problem}"
    counts: list[Path_] = [path for phrase, path in _COUNTS.items() if phrase in problem]
    return document.error(problem, counts[0] if counts else _quoted(document, problem))


def _quoted(document: Document, problem: str) -> Path_:
    """The deepest key whose value the problem quotes."""
    for path in sorted(document.places, key=len, reverse=True):
        value: Any = document.data
        for step in path:
            value = value[step]
        if isinstance(value, str) and repr(value) in problem:
            return path
    return ()


# --- kinds -----------------------------------------------------------------------------


def _check_study(document: Document) -> Iterator[ConfigError]:
    """The study, its scenarios in every cell, and one run of each built as by the runner."""
    study = load_study(document.file)
    versions = [study, *(load_study(document.file, version=name) for name in study.versions)]
    cells = [design.to_rehearse(version, design.cells(version)) for version in versions]
    for cell in {cell.config: cell for some in cells for cell in some}.values():
        try:
            model_for(cell.scenario).rehearse(cell.scenario, study.seed)
        except ConfigError as error:
            yield _blamed_in_cell(document, cell, error)


def _check_registration(document: Document) -> Iterator[ConfigError]:
    """The registration, and whether the study beside it is still what was registered."""
    found = load_registration(document)
    file = document.file.parent / f"{found.study}.yaml"
    if not file.is_file():
        yield document.error(f"{file.name}, the study it is of, is not beside it", ("study",))
        return
    for problem in departures(found, load_study(file, version="full" if found.full else None)):
        yield document.error(problem, ("plan",))


def _blamed_in_cell(document: Document, cell: Cell, error: ConfigError) -> ConfigError:
    """A mistake at the factor that makes it, or else at the scenario of the part."""
    blamed = _blamed(document, error)
    if blamed.file != str(document.file) or blamed.line != 1:
        return blamed
    keys = [".".join(path) for phrase, path in _COUNTS.items() if phrase in error.problem]
    factors = [("factors", key) for key in keys if key in dict(cell.levels)]
    return document.error(blamed.problem, (*factors, ("parts", cell.part, "scenario"))[0])


def _check_scenario(document: Document) -> Iterator[ConfigError]:
    model = model_of(document)
    model.rehearse(model.build(document, {}), seed=1)
    return iter(())


def _check_cases(document: Document) -> Iterator[ConfigError]:
    load_cases(document.file)
    return iter(())


def _check_plan(document: Document) -> Iterator[ConfigError]:
    load_plan(str(document.file))
    return iter(())


def _check_split(document: Document) -> Iterator[ConfigError]:
    load_split(str(document.file))
    return iter(())


def _check_site(document: Document) -> Iterator[ConfigError]:
    load_site(document.file)
    return iter(())


def _check_map(document: Document) -> Iterator[ConfigError]:
    validate(RosMap, document.data, document.error)
    map_site(document.file.resolve(), seed=1, robots=1, guards=1)
    return iter(())


def _check_robot(document: Document) -> Iterator[ConfigError]:
    """The profile, and its motors made once."""
    spec = read_robot(document).drive_spec()
    spec.drive(spec)
    return iter(())


def _check_phone(document: Document) -> Iterator[ConfigError]:
    """The profile, and all that it names made once."""
    try_phone(validate(PhoneProfile, document.data, document.error))
    return iter(())


def _check_model(model: type[Config]) -> Check:
    def check(document: Document) -> Iterator[ConfigError]:
        validate(model, document.data, document.error)
        return iter(())

    return check


def _frame_of(path: Path) -> GeoFrame:
    """A plane where the plan is, so that it can be judged without its site."""
    try:
        position: Any = json.loads(path.read_text(encoding="utf-8"))
        position = position["features"][0]["geometry"]["coordinates"]
        while isinstance(position[0], list):
            position = position[0]
        longitude, latitude = float(position[0]), float(position[1])
    except (LookupError, TypeError, ValueError):
        return DEFAULT_FRAME  # what is wrong with it, its reader says with the place
    return GeoFrame(latitude, longitude) if abs(latitude) < 89 else DEFAULT_FRAME


KINDS: Final = (
    Kind("study", Study, "experiments", _check_study),
    Kind("scenario", Scenario, "experiments/scenarios", _check_scenario),
    Kind("timed scenario", TimedScenario, "experiments/scenarios", _check_scenario),
    Kind("task", TaskScenario, "experiments/scenarios/tasks", _check_scenario),
    Kind("transports", TransportScenario, "experiments/scenarios", _check_scenario),
    Kind("validation cases", CaseFile, "experiments/validation", _check_cases),
    Kind("targets", TargetFile, "experiments/validation", _check_model(TargetFile)),
    Kind("measurements", PlanConfig, "experiments/validation", _check_plan),
    Kind("split", SplitFile, "experiments/validation", _check_split),
    Kind("site", SiteFile, "worlds", _check_site),
    Kind("ROS map", RosMap, "worlds", _check_map),
    Kind("robot", RobotProfile, "agents/robots", _check_robot),
    Kind("phone", PhoneProfile, "agents/phones", _check_phone),
    Kind(
        "accelerometer", AccelerometerPart, "agents/accelerometers", _check_model(AccelerometerPart)
    ),
    Kind("guard", GuardProfile, "agents/people", _check_model(GuardProfile)),
    Kind("bystanders", BystanderProfile, "agents/people", _check_model(BystanderProfile)),
    Kind("operators", Population, "agents/people", _check_model(Population)),
    Kind("bands of operators", Bands, "agents/people", _check_model(Bands)),
    Kind("registration", Registration, "experiments", _check_registration),
    Kind("tuned values", Tuned, "experiments/tuned", _check_model(Tuned)),
)
