"""From a study to its runs: the full grid of cells, with luck shared between them."""

from __future__ import annotations

import hashlib
import itertools
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dva_sim import scenario as scenarios
from dva_sim.config import Document
from dva_sim.errors import ConfigError
from dva_sim.experiments.models import AnyScenario, model_for, model_of
from dva_sim.experiments.study import Level, Part, Study
from dva_sim.streams import derive_seed

REFERENCE = -1

Key = tuple[str, int]


@dataclass(frozen=True, slots=True)
class Cell:
    """One configuration of one part.

    Attributes:
        part: Name of the part.
        index: Position in the grid of factors, or `REFERENCE`.
        levels: Level of each factor; none for the reference.
        scenario: As it will be run, but for the person.
        config: Hash of that scenario.
    """

    part: str
    index: int
    levels: tuple[tuple[str, Level], ...]
    scenario: AnyScenario
    config: str


@dataclass(frozen=True, slots=True)
class Job:
    """One run.

    Attributes:
        part: Name of the part.
        cell: Level of each factor; empty for a reference run.
        index: Position of the cell in the grid, or `REFERENCE`.
        person: Index of the simulated person, from 0.
        trial: Index of the trial, from 0.
        seed: The run's luck: the same for this person and trial in every cell.
        scenario: All that the run needs but its seed.
        config: Hash of the scenario but for the person.
    """

    part: str
    cell: tuple[tuple[str, Level], ...]
    index: int
    person: int
    trial: int
    seed: int
    scenario: AnyScenario
    config: str

    @property
    def is_reference(self) -> bool:
        """Whether this is the run that others are compared with."""
        return self.index == REFERENCE

    @property
    def key(self) -> Key:
        """What tells this run from all others; equal keys are the same run."""
        return self.config, self.seed


def cells(study: Study) -> list[Cell]:
    """All configurations, by part, the reference first, then the grid with the last factor fastest.

    Raises:
        ConfigError: a scenario that cannot be read, or is not valid with some change.
    """
    return [cell for name in study.parts for cell in _cells_of(study, name)]


def base_scenario(study: Study, part: str) -> AnyScenario:
    """A part's scenario before any factor has changed it."""
    return _build(study, part, _source(study, study.parts[part]), {})


def jobs(study: Study, grid: Sequence[Cell] | None = None) -> list[Job]:
    """All runs in a fixed order: part, cell, person, trial.

    Args:
        study: What is asked.
        grid: Its cells, if they have been made already.

    Raises:
        ConfigError: a scenario that cannot be read, or is not valid with some change.
    """
    every = cells(study) if grid is None else grid
    parts = [(name, [cell for cell in every if cell.part == name]) for name in study.parts]
    return [job for name, part_cells in parts for job in _jobs_of(study, name, part_cells)]


def stable_hash(data: Any) -> str:
    """64 bits that depend on the data alone, not on the machine or the order of keys."""
    text = json.dumps(data, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def inputs(cells: Iterable[Cell]) -> dict[str, str]:
    """Files that scenarios name by path (maps, traces), with the hash of their contents."""
    dumps = (cell.scenario.model_dump(mode="json") for cell in cells)
    names = sorted({text for dump in dumps for text in _texts(dump) if "." in text})
    short = [name for name in names if "\n" not in name and len(name) < 1000]
    paths = [(name, Path(_file_of(name))) for name in short]
    return {
        name: hashlib.sha256(path.read_bytes()).hexdigest()[:16]
        for name, path in paths
        if path.is_file()
    }


def _file_of(name: str) -> str:
    """The file of a policy that is named as `file.py:Class`; other names are files as they are."""
    return name.rpartition(":")[0] if ".py:" in name else name


def _texts(data: Any) -> Iterator[str]:
    if isinstance(data, str):
        yield data
    elif isinstance(data, Mapping | list):
        for value in data.values() if isinstance(data, Mapping) else data:
            yield from _texts(value)


def _cells_of(study: Study, name: str) -> Iterator[Cell]:
    part = study.parts[name]
    source = _source(study, part)
    if part.reference is not None:
        yield _cell(name, REFERENCE, (), _build(study, name, source, part.reference))
    for index, levels in enumerate(itertools.product(*study.factors.values())):
        changes = dict(zip(study.factors, levels, strict=True))
        scenario = _build(study, name, source, changes)
        yield _cell(name, index, tuple(changes.items()), scenario)


def _cell(
    part: str, index: int, levels: tuple[tuple[str, Level], ...], scenario: AnyScenario
) -> Cell:
    return Cell(part, index, levels, scenario, stable_hash(scenario.model_dump(mode="json")))


def _source(study: Study, part: Part) -> Document:
    return scenarios.load(part.scenario, base=study.folder)


def _build(study: Study, part: str, source: Document, changes: Mapping[str, Any]) -> AnyScenario:
    """The part's scenario; a mistake in a change is told where the study makes it."""
    model = model_of(source)
    fixed = {**study.changes, **model.set_by_study(study.seed)}
    try:
        return model.build(source, _located({**fixed, **changes}, study.folder))
    except ConfigError as error:
        blamed = _blamed(study, part, error, changes) if error.file is None else None
        raise (blamed or error) from None


def _located(changes: dict[str, Any], folder: Path) -> dict[str, Any]:
    """A policy in a file beside the study is found from anywhere."""
    key = "dispatch.policy"
    named: dict[str, Any] = {"dispatch": {"policy": changes.get(key)}}
    scenarios.locate_policy(named, [folder])
    return {**changes, key: named["dispatch"]["policy"]} if key in changes else changes


def _blamed(
    study: Study, part: str, error: ConfigError, changes: Mapping[str, Any]
) -> ConfigError | None:
    for key in changes:
        for path in (("factors", key), ("parts", part, "reference", key)):
            if key in error.problem and study.is_from_file(path):
                return study.error(error.problem, path)
    return None


def _jobs_of(study: Study, name: str, part_cells: Sequence[Cell]) -> Iterator[Job]:
    # Persons of one cluster follow each other, so that no two clusters share an operator.
    team = max(1, *(model_for(cell.scenario).team(cell.scenario) for cell in part_cells))
    trials = study.parts[name].replications or study.replications
    for cell in part_cells:
        for person in range(study.persons):
            scenario = model_for(cell.scenario).played_by(cell.scenario, person * team)
            for trial in range(trials):
                seed = derive_seed(study.seed, name, person, trial)
                yield Job(name, cell.levels, cell.index, person, trial, seed, scenario, cell.config)
