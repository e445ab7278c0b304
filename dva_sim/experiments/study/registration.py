"""Registration of a confirmatory run, fixed before any of it is run.

The hash of all that is fixed gives the run its seed. So it uses different persons and random
numbers from any earlier run, and a study that is changed and registered again gets new ones.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from dva_sim import __version__
from dva_sim.experiments.study import cell_grid
from dva_sim.experiments.study.hashing import (
    digest,
    fingerprint,
    fingerprint_of_judges,
    inputs,
    stable_hash,
)
from dva_sim.experiments.study.inputs import StudyInputs
from dva_sim.experiments.study.parts import POINT
from dva_sim.experiments.study.study import Status, Study
from dva_sim.kernel.config import Config, validate
from dva_sim.kernel.errors import ConfigError, DvaSimError
from dva_sim.kernel.resources import REGISTRATION
from dva_sim.kernel.streams import derive_seed
from dva_sim.kernel.yaml_files import Document, load_yaml

_OPEN = {"question", "seed"}  # keys that a registration does not fix
_ANY_SEED = 0  # what is fixed must not depend on the seed that follows from it


class Preregistration(Config):
    """Registered study.

    Attributes:
        study: Name of the study.
        question: Question as worded at registration.
        made_with: Version of the program, and the fingerprint of what simulates.
        judged_with: The fingerprint of what will judge the hypotheses.
        full: True for the larger version.
        earlier: Hashes of the registrations that this one replaces, the oldest first.
        plan: Everything that is fixed: the keys of the study, and hashes of its rows, its resolved
            scenarios, and the files that these name.
        hash: Hash of the plan and the earlier registrations. Names and program versions are left
            out, so that changing one does not give another seed.
    """

    study: str
    question: str = ""
    made_with: str
    judged_with: str = ""
    full: bool = False
    earlier: tuple[str, ...] = ()
    plan: dict[str, Any]
    hash: str = ""

    @property
    def proper_hash(self) -> str:
        """Hash of the fixed keys."""
        return digest(self.model_dump(mode="json", include={"plan", "earlier"}))

    @property
    def seed(self) -> int:
        """Seed of the confirmatory run."""
        return derive_seed("registration", self.hash)


def load_registration(document: Document) -> Preregistration:
    """Return the registration that a file holds.

    Raises:
        ConfigError: it holds none.
    """
    return validate(Preregistration, document.data, document.error)


def registration_of(study: Study) -> Preregistration | None:
    """Return the registration beside a study; None where there is none.

    Raises:
        ConfigError: the file there holds none.
    """
    path = study.folder / f"{study.file.stem}{REGISTRATION}"
    return load_registration(load_yaml(path)) if path.is_file() else None


def register(study: Study, again: bool = False) -> str:
    """Write the registration of a study's confirmatory run, and return its lines.

    Args:
        study: Study as in its file, in one of its versions.
        again: True to replace an earlier registration; the report will always mention it.

    Raises:
        ConfigError: nothing to register, a size left open, or a registration that is there.
    """
    if not study.hypotheses:
        raise study.error("nothing to register: no key 'hypotheses'", ())
    for key, value in (("stop", study.stop), ("budget_s", study.budget_s)):
        if value is not None:
            problem = f"a registered study has a fixed number of persons; leave {key!r} out"
            raise study.error(problem, (key,))
    path = study.folder / f"{study.file.stem}{REGISTRATION}"
    registered = registration_of(study)
    if registered is not None and not again:
        raise ConfigError(f"{path} already exists; --again replaces it, and the report will say so")
    made = Preregistration(
        study=study.file.stem,
        question=study.question,
        made_with=f"{__version__} {fingerprint()}",
        judged_with=fingerprint_of_judges(),
        full=study.version == "full",
        earlier=(*registered.earlier, registered.hash) if registered is not None else (),
        plan=plan_of(study),
    )
    made = made.model_copy(update={"hash": made.proper_hash})
    cell_grid.cells(study.model_copy(update={"seed": made.seed}))  # its points are valid, too
    _write(path, _as_text(made), registered is not None)
    names = ", ".join(study.hypotheses)
    size = f"{study.persons} persons x {study.replications}"
    return f"Registered {names} on {size} trials, in {path}\nRun unchanged, it confirms or refutes"


def _write(path: Path, text: str, replaces: bool) -> None:
    """Write a registration; of two processes at once, only one makes it."""
    part = path.with_name(f".{path.name}.{os.getpid()}") if replaces else path
    try:
        file = part.open("w" if replaces else "x", encoding="utf-8", newline="\n")
    except FileExistsError:
        raise ConfigError(f"{path} was made by another process meanwhile") from None
    except OSError as error:
        raise DvaSimError(f"{path} cannot be written: {error.strerror}") from None
    try:
        with file:
            file.write(text)
        part.replace(path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise DvaSimError(f"{path} cannot be written: {error.strerror}") from None


def plan_of(study: Study) -> dict[str, Any]:
    """Return all that fixes a confirmatory run, but for its seed, as JSON would hold it."""
    nobody = study.model_copy(update={"seed": _ANY_SEED})
    files_read = StudyInputs(nobody)
    cells = cell_grid.cells(nobody, files_read)
    files = {
        name: f"{Path(name).name} {content}"
        for name, content in inputs((cell.scenario for cell in cells), files_read.measures).items()
    }
    description = {key: value for key, value in nobody.asked().items() if key not in _OPEN}
    description["factors"] = {
        f: levels for f, levels in description["factors"].items() if f != POINT
    }
    if study.listed_rows:
        description["design"]["rows"] = stable_hash(study.listed_rows)
    resolved = {
        "scenarios": {
            part: _hash_of(cell_grid.base_scenario(files_read, part), files) for part in study.parts
        },
        "cells": stable_hash([_hash_of(cell.scenario, files) for cell in cells]),
        "inputs": sorted(files.values()),
    }
    plan: dict[str, Any] = json.loads(json.dumps(description | resolved))
    return {key: value for key, value in plan.items() if value not in (None, [], {})}


def settled(study: Study) -> Study:
    """Return the study with its status; run as registered, it has the seed of the registration.

    Raises:
        ConfigError: the registration cannot be read, or the study has a cell that is not valid.
    """
    registered = registration_of(study)
    why = [*_liberties(study), *(departures(registered, study) if registered is not None else ())]
    confirms = registered is not None and not why
    if registered is not None:
        why += _remarks(registered, study)
    copy = study.model_copy(update={"seed": registered.seed} if registered and confirms else {})
    copy._status = Status(
        kind="confirmatory" if confirms else "exploratory" if why else "declared",
        why=tuple(why),
        reproducible=study.budget_s is None,
        registration=registered.model_dump(mode="json") if registered is not None else None,
    )
    return copy


def _liberties(study: Study) -> Iterator[str]:
    """Name the settings that leave the outcome open when the study starts."""
    yield from (f"--set {setting}" for setting in study.settings)
    if study.pilot is not None:
        yield f"a pilot of {study.pilot} persons"
    if study.stop is not None:
        yield "how many persons are simulated depends on the results"
    if study.budget_s is not None:
        yield f"how many persons are simulated depends on the clock, {study.budget_s:g} s"


def departures(registered: Preregistration, study: Study) -> Iterator[str]:
    """Yield the differences between a study and its registration."""
    if registered.hash != registered.proper_hash:
        yield "the registration was edited: its hash is not that of what it fixes"
    now = plan_of(study)
    keys = [key for key in {**registered.plan, **now} if registered.plan.get(key) != now.get(key)]
    for key in (key for key in keys if key in ("persons", "replications")):
        yield f"{registered.plan.get(key)} {key} were registered, not {now[key]}"
    changed = [key for key in keys if key not in ("persons", "replications")]
    if changed:
        yield f"other than registered: {', '.join(changed)}"


def _remarks(registered: Preregistration, study: Study) -> Iterator[str]:
    """Yield remarks for the reader that are not departures."""
    if registered.study != study.file.stem:
        yield f"it was registered as {registered.study!r}"
    if registered.question not in ("", study.question):
        yield f"its question was worded otherwise when it was registered: {registered.question!r}"
    now = f"{__version__} {fingerprint()}"
    if registered.made_with != now:
        made_with = f"({registered.made_with}; now {now})"
        yield f"the program is another than when it was registered {made_with}"
    if registered.earlier:
        times = "once" if len(registered.earlier) == 1 else f"{len(registered.earlier)} times"
        yield f"it had been registered {times} before, otherwise"


def _hash_of(scenario: Config, files: Mapping[str, str]) -> str:
    """Return files count by name and content, wherever they lie."""
    return stable_hash(_portable(scenario.model_dump(mode="json"), files))


def _portable(data: Any, files: Mapping[str, str]) -> Any:
    if isinstance(data, str):
        return files.get(data, data)
    if isinstance(data, Mapping):
        return {key: _portable(value, files) for key, value in data.items()}
    return [_portable(value, files) for value in data] if isinstance(data, list) else data


def _as_text(made: Preregistration) -> str:
    """Return the YAML with a key of the plan on each line, so that a difference is seen as one."""
    data = made.model_dump(mode="json")
    plan = data.pop("plan")
    lines = [
        f"# Written by `dva-sim register {made.study}` before it was run; not to be edited.",
        *(f"{key}: {json.dumps(value, ensure_ascii=False)}" for key, value in data.items()),
        "plan:",
        *(f"  {key}: {json.dumps(value, ensure_ascii=False)}" for key, value in plan.items()),
    ]
    return "\n".join(lines) + "\n"
