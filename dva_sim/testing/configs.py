"""Configurations: read and rehearsed by the same code that runs them."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, Final

from PIL import Image

from dva_sim.agents.operator.published import TargetFile, load_split
from dva_sim.agents.people.profiles import BystanderProfile, GuardProfile
from dva_sim.agents.population import Population
from dva_sim.agents.robot.profile import read_robot
from dva_sim.agents.tilt import AccelerometerPart, PhoneProfile, try_phone
from dva_sim.experiments.execution.dry_run import contradictions_in
from dva_sim.experiments.study import cell_grid
from dva_sim.experiments.study.factor_levels import Bands
from dva_sim.experiments.study.registration import departures, load_registration
from dva_sim.experiments.study.study import Study
from dva_sim.experiments.study.study_file import load_study
from dva_sim.experiments.study.tuning import TunedValues
from dva_sim.kernel.config import Config, Document, validate
from dva_sim.kernel.errors import ConfigError
from dva_sim.simulation.models import model_of
from dva_sim.testing.file_kinds import FileKind, blamed_in
from dva_sim.testing.promises import Problem
from dva_sim.validation.dispatch.cases import load_cases
from dva_sim.validation.network.reference import load_plan
from dva_sim.worlds.geo import GeoFrame
from dva_sim.worlds.geojson import read_plan
from dva_sim.worlds.maps import RosMap
from dva_sim.worlds.site import DEFAULT_FRAME, load_site, map_site

# What readers may raise on files that nobody would write, besides what they say in words.
_HOSTILE: Final = (ValueError, OverflowError, Image.DecompressionBombError)

Check = Callable[[Document], Iterator[ConfigError]]


def check_config(kind: FileKind, document: Document) -> list[Problem]:
    """What is wrong with a configuration, by the code that runs it."""
    return _collect(
        document.file, partial(CHECKS[kind.name], document), partial(blamed_in, document)
    )


def doubts(kind: FileKind, document: Document) -> list[str]:
    """What does not go together in a valid study or scenario."""
    if kind.model is Study:
        return contradictions_in(cell_grid.cells(load_study(document.file)))
    if CHECKS[kind.name] is not _check_scenario:
        return []
    model = model_of(document)
    return model.contradictions(model.build(document, {}))


def check_plan(path: Path) -> list[Problem]:
    """What is wrong with a drawn plan; whether its bases are free is for its site to say."""

    def read() -> Iterator[ConfigError]:
        read_plan(path, _frame_of(path))
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


CHECKS: Final[dict[str, Check]] = {
    "study": _check_study,
    "scenario": _check_scenario,
    "timed scenario": _check_scenario,
    "task": _check_scenario,
    "transports": _check_scenario,
    "own scenario": _check_scenario,
    "validation cases": _check_cases,
    "targets": _check_model(TargetFile),
    "measurements": _check_plan,
    "split": _check_split,
    "site": _check_site,
    "ROS map": _check_map,
    "robot": _check_robot,
    "phone": _check_phone,
    "accelerometer": _check_model(AccelerometerPart),
    "guard": _check_model(GuardProfile),
    "bystanders": _check_model(BystanderProfile),
    "operators": _check_model(Population),
    "bands of operators": _check_model(Bands),
    "registration": _check_registration,
    "tuned values": _check_model(TunedValues),
}
"""How files of each kind are checked, by the names of `experiments.documents`."""
