"""What a YAML file is, by its keys and its folder, and where in it a mistake was made.

It stands above all rooms whose files it knows. What is opened here tells of a file of another kind
what it is, and which command takes it; what is checked is read and rehearsed by the same code that
runs it. The table of all kinds stands at the end.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final, NamedTuple

from PIL import Image

from dva_sim.agents.operator.published import SplitFile, TargetFile, load_split
from dva_sim.agents.people.profiles import BystanderProfile, GuardProfile
from dva_sim.agents.population import Population
from dva_sim.agents.robot.profile import RobotProfile, read_robot
from dva_sim.agents.tilt import AccelerometerPart, PhoneProfile, try_phone
from dva_sim.experiments.execution.dry_run import contradictions_in
from dva_sim.experiments.study import cell_grid
from dva_sim.experiments.study.factor_levels import Bands
from dva_sim.experiments.study.loading import load_study
from dva_sim.experiments.study.registration import Preregistration, departures, load_registration
from dva_sim.experiments.study.study import FOLDER, Study, Version
from dva_sim.experiments.study.tuning import TunedValues
from dva_sim.kernel import resources
from dva_sim.kernel.config import Config, validate
from dva_sim.kernel.config_overrides import blame, parse_changes, set_by
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.yaml_files import Document, KeyPath, load_yaml, read_text
from dva_sim.protocol.mistakes import Problem
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.models import MODELS, PLUGINS, OwnScenario, model_of
from dva_sim.simulation.scenario import Scenario
from dva_sim.simulation.shift.scenario import TimedScenario
from dva_sim.simulation.task import TaskScenario
from dva_sim.simulation.transport import TransportScenario
from dva_sim.validation.dispatch.cases import CaseFile, load_cases
from dva_sim.validation.network.reference import PlanConfig, load_plan
from dva_sim.worlds.drawn_plan import make_plan
from dva_sim.worlds.geo import GeoFrame
from dva_sim.worlds.geojson import read_features
from dva_sim.worlds.maps import RosMap, doubts_of_map
from dva_sim.worlds.site import DEFAULT_FRAME, SiteFile, load_site, map_site

PROBE: Final = "drive-to-event"  # the scenario that a map is tried with
PROBES: Final = 6  # its runs
_COUNTS: Final = {
    "robots of the scenario": ("robot", "count"),
    "guards of the scenario": ("guard", "count"),
    "another bystander": ("bystander", "count"),
    "without robot.way_m": ("robot", "way_m"),
    "without guard.way_m": ("guard", "way_m"),
}


class FileKind(NamedTuple):
    """One kind of YAML file.

    Attributes:
        name: As it is called in messages.
        model: Its keys.
        folder: Where files of this kind lie.
        command: What does something with it, if a command does.
        load: Reads it as the program does, where that is more than its keys.
        check: Gives every mistake, where there may be several.
    """

    name: str
    model: type[Config]
    folder: str
    command: str = ""
    load: Callable[[Document], object] | None = None
    check: Callable[[Document], Iterator[ConfigError]] | None = None

    def mistakes(self, document: Document) -> Iterator[ConfigError]:
        """What is wrong, by the code that runs it.

        Raises:
            ConfigError: the first mistake, where there is but one to be told.
        """
        if self.check is not None:
            yield from self.check(document)
        elif self.load is not None:
            self.load(document)
        else:
            validate(self.model, document.data, document.error)


def recognise(document: Document) -> FileKind | None:
    """The kind that knows most of the keys; among equals, the one whose folder it lies in."""
    keys = document.data.keys() - {"description"}
    model = document.data.get("model")
    if (
        isinstance(model, str)
        and model not in MODELS
        and (".py:" in model or model in PLUGINS.known())
    ):
        return next(kind for kind in KINDS if kind.model is OwnScenario)
    named = {each.scenario: name for name, each in MODELS.items() if name != "full"}
    named[OwnScenario] = "of a user's model"
    kinds = [kind for kind in KINDS if named.get(kind.model, model) == model]
    shared = {kind.name: len(keys & kind.model.model_fields.keys()) for kind in kinds}
    likely = [kind for kind in kinds if shared[kind.name] == max(shared.values())]
    if len(likely) == 1:
        return likely[0]
    folder = document.file.resolve().parent.as_posix()
    here = [kind for kind in likely if folder.endswith(f"/{kind.folder}")]
    return here[0] if len(here) == 1 else None


def open_study(
    name: str | Path,
    settings: Iterable[str] = (),
    *,
    version: Version | None = None,
    pilot: int | None = None,
) -> Study:
    """`load_study`, which tells of a file of another kind what it is.

    Raises:
        ConfigError: not found, not a study, not valid, or changes that make no sense.
    """
    try:
        return load_study(name, settings, version=version, pilot=pilot)
    except ConfigError as error:
        document = _opened(lambda: load_yaml(resources.find(str(name), FOLDER, is_asked=True)))
        if document is None or error.file != str(document.file):
            raise
        raise of_other_kind(document, "dva-sim run", "study") or error from None


def _opened(load: Callable[[], Document]) -> Document | None:
    try:
        return load()
    except ConfigError:
        return None


def of_other_kind(document: Document, command: str, wanted: str) -> ConfigError | None:
    """That a file is of another kind than a command takes; None if it is not, or cannot be told.

    Args:
        document: The file.
        command: Which files of the right kind have.
        wanted: What these are called.
    """
    kind = recognise(document)
    if kind is None or kind.command == command:
        return None
    given = f"; try: {kind.command} {document.file}" if kind.command else ""
    article = "an" if kind.name[0] in "aeiou" else "a"
    return ConfigError(f"is {article} {kind.name}, not a {wanted}{given}", document.file)


def blamed_in(document: Document, error: ConfigError) -> ConfigError:
    """The same mistake at the key that it is about, unless another file holds it."""
    problem = error.problem
    if error.file is not None:
        if Path(error.file).exists():
            return error
        problem = f"{error.file!r}: {problem}"
    counts: list[KeyPath] = [path for phrase, path in _COUNTS.items() if phrase in problem]
    return document.error(problem, counts[0] if counts else _quoted(document, problem))


def _quoted(document: Document, problem: str) -> KeyPath:
    """The deepest key whose value the problem quotes."""
    for path in sorted(document.places, key=len, reverse=True):
        value: Any = document.data
        for step in path:
            value = value[step]
        if isinstance(value, str) and repr(value) in problem:
            return path
    return ()


def placed_mistake(error: ConfigError, name: str, pairs: Sequence[str], seed: int) -> ConfigError:
    """A mistake in a scenario with its place: see `scenario_mistakes.mistakes_of`."""
    if error.file is not None and not error.keys:
        return _of_other_kind(error, name) or error
    return _placed(error, name, pairs, seed)


def _of_other_kind(error: ConfigError, name: str) -> ConfigError | None:
    document = _opened(lambda: scenarios.load(name))
    if document is None or error.file != str(document.file):
        return None
    return of_other_kind(document, "dva-sim episode", "scenario")


def _placed(error: ConfigError, name: str, pairs: Sequence[str], seed: int) -> ConfigError:
    """A mistake that has no place yet, if it is one of the scenario."""
    document = _opened(lambda: scenarios.load(name))
    if document is None:
        return error
    changes = parse_changes(pairs)

    def make(some: Mapping[str, Any]) -> None:
        model = model_of(document)
        model.rehearse(model.build(document, some), seed)

    try:
        make(changes)
    except ConfigError:
        found = error if error.keys else blame(error, changes, make, document)
        return set_by(pairs, found) if found.keys else blamed_in(document, found)
    return error  # it can be run: the mistake is in what else was asked for


# What readers may raise on files that nobody would write, besides what they say in words.
_HOSTILE: Final = (ValueError, OverflowError, Image.DecompressionBombError)


def check_config(kind: FileKind, document: Document) -> list[Problem]:
    """What is wrong with a configuration, by the code that runs it."""
    return _collect(document.file, partial(kind.mistakes, document), partial(blamed_in, document))


def doubts(kind: FileKind, document: Document) -> list[str]:
    """What does not go together in a valid study or scenario."""
    if kind.model is Study:
        return contradictions_in(cell_grid.cells(load_study(document.file)))
    if kind.model is RosMap:
        return [*doubts_of_map(document.file), *_without_a_place(document)]
    if kind.load is not _rehearse:
        return []
    model = model_of(document)
    return model.contradictions(model.build(document, {}))


def _without_a_place(document: Document) -> Iterator[str]:
    """Say of a map in how many runs no event finds a place."""
    scenario = scenarios.load(PROBE)
    model, problems = model_of(scenario), list[str]()
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
    """What is wrong with a drawn plan; whether its bases are free is for its site to say."""

    def read() -> Iterator[ConfigError]:
        make_plan(read_features(path, _frame_of(path)))
        return iter(())

    return _collect(path, read, lambda error: error)


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


# --- kinds -----------------------------------------------------------------------------
def _check_study(document: Document) -> Iterator[ConfigError]:
    """The study, its scenarios in every cell, and one run of each built as by the runner."""
    study = load_study(document.file)
    versions = [study, *(load_study(document.file, version=name) for name in study.versions)]
    cells = [cell_grid.to_rehearse(version, cell_grid.cells(version)) for version in versions]
    for cell in {cell.config: cell for some in cells for cell in some}.values():
        try:
            cell_grid.rehearse(study, cell)
        except ConfigError as error:
            place = ("parts", cell.part, "scenario")
            yield error if error.file is not None else document.error(error.problem, place)


def _check_registration(document: Document) -> Iterator[ConfigError]:
    """The registration, and whether the study beside it is still what was registered."""
    found = load_registration(document)
    file = document.file.parent / f"{found.study}.yaml"
    if not file.is_file():
        yield document.error(f"{file.name}, the study it is of, is not beside it", ("study",))
        return
    for problem in departures(found, load_study(file, version="full" if found.full else None)):
        yield document.error(problem, ("plan",))


def _rehearse(document: Document) -> None:
    model = model_of(document)
    model.rehearse(model.build(document, {}), seed=1)


def _load_map(document: Document) -> None:
    validate(RosMap, document.data, document.error)
    map_site(document.file.resolve(), seed=1, robots=1, guards=1)


def _load_robot(document: Document) -> None:
    """The profile, and its motors made once."""
    spec = read_robot(document).drive_spec()
    spec.drive(spec)


def _load_phone(document: Document) -> None:
    """The profile, and all that it names made once."""
    try_phone(validate(PhoneProfile, document.data, document.error))


def _frame_of(path: Path) -> GeoFrame:
    """A plane where the plan is, so that it can be judged without its site."""
    try:
        features = json.loads(read_text(path))["features"]
        position: Any = next(f["geometry"]["coordinates"] for f in features if f.get("geometry"))
        while isinstance(position[0], list):
            position = position[0]
        longitude, latitude = float(position[0]), float(position[1])
    except (LookupError, TypeError, ValueError, AttributeError, StopIteration):
        return DEFAULT_FRAME  # what is wrong with it, its reader says with the place
    return GeoFrame(latitude, longitude) if abs(latitude) < 89 else DEFAULT_FRAME


_RUN, _PLAY, _DRAW = "dva-sim run", "dva-sim episode", "dva-sim site show"
_SCENARIOS, _EVIDENCE = "experiments/scenarios", "experiments/validation"
KINDS: Final = (
    FileKind("study", Study, "experiments", _RUN, check=_check_study),
    FileKind("scenario", Scenario, _SCENARIOS, _PLAY, _rehearse),
    FileKind("timed scenario", TimedScenario, _SCENARIOS, _PLAY, _rehearse),
    FileKind("task", TaskScenario, "experiments/scenarios/tasks", _PLAY, _rehearse),
    FileKind("transports", TransportScenario, _SCENARIOS, _PLAY, _rehearse),
    FileKind("own scenario", OwnScenario, _SCENARIOS, _PLAY, _rehearse),
    FileKind("validation cases", CaseFile, _EVIDENCE, load=lambda d: load_cases(d.file)),
    FileKind("targets", TargetFile, _EVIDENCE),
    FileKind("measurements", PlanConfig, _EVIDENCE, load=lambda d: load_plan(str(d.file))),
    FileKind("split", SplitFile, _EVIDENCE, load=lambda d: load_split(str(d.file))),
    FileKind("site", SiteFile, "worlds", _DRAW, lambda d: load_site(d.file)),
    FileKind("ROS map", RosMap, "worlds", _DRAW, _load_map),
    FileKind("robot", RobotProfile, "agents/robots", load=_load_robot),
    FileKind("phone", PhoneProfile, "agents/phones", load=_load_phone),
    FileKind("accelerometer", AccelerometerPart, "agents/accelerometers"),
    FileKind("guard", GuardProfile, "agents/people"),
    FileKind("bystanders", BystanderProfile, "agents/people"),
    FileKind("operators", Population, "agents/people"),
    FileKind("bands of operators", Bands, "agents/people"),
    FileKind("registration", Preregistration, "experiments", check=_check_registration),
    FileKind("tuned values", TunedValues, "experiments/tuned"),
)
