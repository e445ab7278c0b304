"""What a YAML file is, by its keys and its folder, and where in it a mistake was made.

It stands above all rooms whose files it knows. What is opened here tells of a file of another kind
what it is, and which command takes it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, NamedTuple

from dva_sim.agents.operator.published import SplitFile, TargetFile
from dva_sim.agents.people.profiles import BystanderProfile, GuardProfile
from dva_sim.agents.population import Population
from dva_sim.agents.robot.profile import RobotProfile
from dva_sim.agents.tilt import AccelerometerPart, PhoneProfile
from dva_sim.experiments.study.factor_levels import Bands
from dva_sim.experiments.study.registration import Preregistration
from dva_sim.experiments.study.study import FOLDER, Study, Version
from dva_sim.experiments.study.study_file import load_study
from dva_sim.experiments.study.tuning import TunedValues
from dva_sim.kernel import resources
from dva_sim.kernel.config import Config, Document, KeyPath, load_yaml
from dva_sim.kernel.config_overrides import blame, parse_changes, set_by
from dva_sim.kernel.errors import ConfigError
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.models import MODELS, PLUGINS, OwnScenario, model_of
from dva_sim.simulation.scenario import Scenario
from dva_sim.simulation.shift.scenario import TimedScenario
from dva_sim.simulation.task import TaskScenario
from dva_sim.simulation.transport import TransportScenario
from dva_sim.validation.dispatch.cases import CaseFile
from dva_sim.validation.network.reference import PlanConfig
from dva_sim.worlds.maps import RosMap
from dva_sim.worlds.site import SiteFile

_COUNTS: Final = {
    "robot base": ("robot", "count"),
    "guard post": ("guard", "count"),
    "operator desk": ("operator", "count"),
}


class FileKind(NamedTuple):
    """One kind of YAML file.

    Attributes:
        name: As it is called in messages.
        model: Its keys.
        folder: Where files of this kind lie.
        command: What does something with it, if a command does.
    """

    name: str
    model: type[Config]
    folder: str
    command: str = ""


_RUN, _PLAY, _DRAW = "dva-sim run", "dva-sim episode", "dva-sim site show"
KINDS: Final = (
    FileKind("study", Study, "experiments", _RUN),
    FileKind("scenario", Scenario, "experiments/scenarios", _PLAY),
    FileKind("timed scenario", TimedScenario, "experiments/scenarios", _PLAY),
    FileKind("task", TaskScenario, "experiments/scenarios/tasks", _PLAY),
    FileKind("transports", TransportScenario, "experiments/scenarios", _PLAY),
    FileKind("own scenario", OwnScenario, "experiments/scenarios", _PLAY),
    FileKind("validation cases", CaseFile, "experiments/validation"),
    FileKind("targets", TargetFile, "experiments/validation"),
    FileKind("measurements", PlanConfig, "experiments/validation"),
    FileKind("split", SplitFile, "experiments/validation"),
    FileKind("site", SiteFile, "worlds", _DRAW),
    FileKind("ROS map", RosMap, "worlds", _DRAW),
    FileKind("robot", RobotProfile, "agents/robots"),
    FileKind("phone", PhoneProfile, "agents/phones"),
    FileKind("accelerometer", AccelerometerPart, "agents/accelerometers"),
    FileKind("guard", GuardProfile, "agents/people"),
    FileKind("bystanders", BystanderProfile, "agents/people"),
    FileKind("operators", Population, "agents/people"),
    FileKind("bands of operators", Bands, "agents/people"),
    FileKind("registration", Preregistration, "experiments"),
    FileKind("tuned values", TunedValues, "experiments/tuned"),
)


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
        document = _yaml(name)
        if document is None or error.file != str(document.file):
            raise
        raise of_other_kind(document, "dva-sim run", "study") or error from None


def _yaml(name: str | Path) -> Document | None:
    try:
        return load_yaml(resources.find(str(name), FOLDER, is_asked=True))
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


@contextmanager
def mistakes_of(name: str, pairs: Sequence[str], seed: int) -> Iterator[None]:
    """Tell a mistake in a scenario at its key or at the `--set` that makes it.

    Args:
        name: The scenario, by name or path.
        pairs: `key=value` for each key that is changed.
        seed: Of the run.

    Raises:
        ConfigError: what was raised inside, with its place.
    """
    try:
        yield
    except ConfigError as error:
        if error.file is not None and not error.keys:
            raise _of_other_kind(error, name) or error from None
        raise _placed(error, name, pairs, seed) from None


def _of_other_kind(error: ConfigError, name: str) -> ConfigError | None:
    document = _document(name)
    if document is None or error.file != str(document.file):
        return None
    return of_other_kind(document, "dva-sim episode", "scenario")


def _document(name: str) -> Document | None:
    try:
        return scenarios.load(name)
    except ConfigError:
        return None


def _placed(error: ConfigError, name: str, pairs: Sequence[str], seed: int) -> ConfigError:
    """A mistake that has no place yet, if it is one of the scenario."""
    document = _document(name)
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
