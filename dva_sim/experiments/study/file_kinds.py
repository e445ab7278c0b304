"""Kinds of YAML files, told by their keys and folders; studies opened by name.

The error for a file of the wrong kind says what it is, and which command takes
it. Files of evidence are known above (`testing/file_kinds.py`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Final, NamedTuple

from dva_sim.agents.operator.published import SplitFile, TargetFile
from dva_sim.agents.people.profiles import BystanderProfile, GuardProfile
from dva_sim.agents.population import Population
from dva_sim.agents.robot.profile import RobotProfile
from dva_sim.agents.tilt import AccelerometerPart, PhoneProfile
from dva_sim.experiments.study.factor_levels import Bands
from dva_sim.experiments.study.loading import load_study
from dva_sim.experiments.study.registration import Preregistration
from dva_sim.experiments.study.study import FOLDER, Study, Version
from dva_sim.experiments.study.tuning import TunedValues
from dva_sim.kernel import resources
from dva_sim.kernel.config import Config
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.yaml_files import Document, load_yaml
from dva_sim.ros.profile import RosProfile
from dva_sim.simulation.middleware import MiddlewareScenario
from dva_sim.simulation.models import MODELS
from dva_sim.simulation.scenario import Scenario
from dva_sim.simulation.task import TaskScenario
from dva_sim.simulation.timed.scenario import TimedScenario
from dva_sim.simulation.transports import TransportScenario
from dva_sim.worlds.maps import RosMap
from dva_sim.worlds.site import SiteFile


class FileKind(NamedTuple):
    """One kind of YAML file.

    Attributes:
        name: Name as used in messages.
        model: Its keys.
        folder: Folder of such files.
        command: Command that takes such files, if any.
        borrowed: Keys that are those of another kind, so that they alone tell nothing.
    """

    name: str
    model: type[Config]
    folder: str
    command: str = ""
    borrowed: frozenset[str] = frozenset()


_RUN = "dva-sim run"
_PLAY = "dva-sim episode"
_DRAW = "dva-sim site show"
_SCENARIOS = "experiments/scenarios"
EVIDENCE = "experiments/validation"
KINDS: Final = (
    FileKind("study", Study, "experiments", _RUN),
    FileKind("scenario", Scenario, _SCENARIOS, _PLAY),
    FileKind("timed scenario", TimedScenario, _SCENARIOS, _PLAY),
    FileKind("task", TaskScenario, "experiments/scenarios/tasks", _PLAY),
    FileKind("transports", TransportScenario, _SCENARIOS, _PLAY),
    FileKind("middleware", MiddlewareScenario, _SCENARIOS, _PLAY),
    FileKind("targets", TargetFile, EVIDENCE),
    FileKind("split", SplitFile, EVIDENCE),
    FileKind("site", SiteFile, "worlds", _DRAW),
    FileKind("ROS map", RosMap, "worlds", _DRAW),
    FileKind("robot", RobotProfile, "agents/robots"),
    FileKind("robot of ROS", RosProfile, "agents/ros", borrowed=frozenset({"site"})),
    FileKind("phone", PhoneProfile, "agents/phones"),
    FileKind("accelerometer", AccelerometerPart, "agents/accelerometers"),
    FileKind("guard", GuardProfile, "agents/people"),
    FileKind("bystanders", BystanderProfile, "agents/people"),
    FileKind("operators", Population, "agents/people"),
    FileKind("bands of operators", Bands, "agents/people"),
    FileKind("registration", Preregistration, "experiments"),
    FileKind("tuned values", TunedValues, "experiments/tuned"),
)


def recognise(document: Document, kinds: Sequence[FileKind] = KINDS) -> FileKind | None:
    """Return the kind that knows most of the keys.

    Among equals, the one whose folder it lies in.
    """
    keys = document.data.keys() - {"description"}
    model = document.data.get("model")
    named = {each.scenario: name for name, each in MODELS.items() if name != "full"}
    fit = [kind for kind in kinds if named.get(kind.model, model) == model]
    shared = {
        kind.name: len(keys & (kind.model.model_fields.keys() - kind.borrowed)) for kind in fit
    }
    likely = [kind for kind in fit if shared[kind.name] == max(shared.values())]
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
    """Return a study; for a file of another kind, report its kind.

    Raises:
        ConfigError: not found, not a study, not valid, or changes that make no sense.
    """
    try:
        return load_study(name, settings, version=version, pilot=pilot)
    except ConfigError as error:
        document = opened(lambda: load_yaml(resources.find(str(name), FOLDER, is_asked=True)))
        if document is None or error.file != str(document.file):
            raise
        raise of_other_kind(document, "dva-sim run", "study") or error from None


def opened(load: Callable[[], Document]) -> Document | None:
    """Return a document; None if it cannot be read."""
    try:
        return load()
    except ConfigError:
        return None


def of_other_kind(document: Document, command: str, expected: str) -> ConfigError | None:
    """Return the error for a file of another kind than a command takes.

    None if it fits or is unknown.

    Args:
        document: The file.
        command: Command that takes files of the right kind.
        expected: Name of the right kind.
    """
    folder = document.file.resolve().parent
    if folder.as_posix().endswith(EVIDENCE):
        validate = f"dva-sim validate {document.file.stem.partition('-')[0]}"
        return ConfigError(f"is evidence, not a {expected}; try: {validate}", document.file)
    kind = recognise(document)
    if kind is None or kind.command == command:
        return None
    suggestion = f"; try: {kind.command} {document.file}" if kind.command else ""
    article = "an" if kind.name[0] in "aeiou" else "a"
    return ConfigError(f"is {article} {kind.name}, not a {expected}{suggestion}", document.file)
