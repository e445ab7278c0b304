"""A study: one question, the factors it varies, and the contrast that answers it."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, PrivateAttr, field_validator

from dva_sim import resources
from dva_sim.config import Config, Document, Path_, load_yaml, parse_changes, validate
from dva_sim.errors import ConfigError
from dva_sim.experiments import faults
from dva_sim.experiments.asking import (
    REPEATS,
    Answer,
    Changes,
    Count,
    Levels,
    Part,
    Prediction,
    Robustness,
    Seed,
    Tuning,
    refuse_keys_of_the_design,
)

FOLDER = "experiments"


class Study(Config):
    """What is asked, and all that is run to answer it.

    Attributes:
        question: In words.
        predictions: What was expected before anything was run.
        seed: Of the whole study; the population of persons is drawn from it too.
        persons: Simulated persons, the clusters.
        replications: Paired trials per person.
        factors: Levels of each scenario key that is varied; the cells are their full grid.
        treatments: Factors whose levels are names of several changes at once.
        parts: Scenarios by name, each run in every cell.
        answer: The declared contrast.
        tuning: How the level `tuned` of the factor `tuning` comes by its value.
        robustness: The answer again under other models of the persons.
    """

    question: str
    predictions: tuple[Prediction, ...] = ()
    seed: Seed = 1
    persons: Count = 24
    replications: Count = 5
    factors: dict[str, Levels] = Field(default_factory=dict)
    treatments: dict[str, dict[str, Changes]] = Field(default_factory=dict)
    parts: Annotated[dict[str, Part], Field(min_length=1)]
    answer: Answer | None = None
    tuning: Tuning | None = None
    robustness: Robustness | None = None

    _document: Document = PrivateAttr(default_factory=lambda: Document({}, Path()))
    _changes: Changes = PrivateAttr(default_factory=dict)
    _settings: tuple[str, ...] = PrivateAttr(default=())

    @field_validator("factors")
    @classmethod
    def _varies_the_scenario(cls, value: dict[str, Levels]) -> dict[str, Levels]:
        refuse_keys_of_the_design(value)
        return value

    @field_validator("treatments")
    @classmethod
    def _changes_the_scenario(
        cls, value: dict[str, dict[str, Changes]]
    ) -> dict[str, dict[str, Changes]]:
        for levels in value.values():
            for changes in levels.values():
                refuse_keys_of_the_design(changes)
        return value

    @field_validator("parts")
    @classmethod
    def _leaves_room_for_repeats(cls, value: dict[str, Part]) -> dict[str, Part]:
        if REPEATS in value:
            raise ValueError(f"a part cannot be called {REPEATS!r}: the repeats are")
        return value

    @property
    def file(self) -> Path:
        """The study's file."""
        return self._document.file

    @property
    def folder(self) -> Path:
        """Where the study's file lies."""
        return self.file.parent

    @property
    def changes(self) -> Mapping[str, Any]:
        """Scenario keys changed in every part by `--set`."""
        return self._changes

    @property
    def settings(self) -> tuple[str, ...]:
        """The `key=value` pairs of `--set`; any makes the study exploratory."""
        return self._settings

    def error(self, problem: str, path: Path_) -> ConfigError:
        """A mistake at a key of the study's file."""
        return (
            self._document.error(problem, path) if self._document.places else ConfigError(problem)
        )

    def is_from_file(self, path: Path_) -> bool:
        """Whether the study's file, rather than `--set`, says what stands at `path`."""
        return path in self._document.places


def load_study(name: str | Path, settings: Iterable[str] = ()) -> Study:
    """Read a study by name or path, and change it by `key=value` pairs.

    A key of the study (`seed=2`, `replications=1`, `factors.pattern=[req-rep]`) changes the
    study. Any other key is one of the scenario and holds in every part; if it is a factor,
    its value or list of values takes the place of the factor's levels.

    Raises:
        ConfigError: not found, not valid, or a pair that makes no sense.
    """
    document = load_yaml(resources.find(str(name), FOLDER))
    study = validate(Study, document.data, document.error)
    for problem in (*faults.of_factors(study), *faults.of_claims(study)):
        raise document.error(*problem)
    study._document = document
    return _with_settings(study, document, tuple(settings))


def _with_settings(study: Study, document: Document, settings: Sequence[str]) -> Study:
    if not settings:
        return study
    data, changes, touched = copy.deepcopy(document.data), {}, []
    data.setdefault("factors", {})
    for key, value in parse_changes(settings).items():
        path = _study_path(key, data["factors"])
        if path is None:
            changes[key] = value
        else:
            _put(data, path, [value] if _is_level(path, value) else value)
            touched.append(path)
    _refuse_design(changes)
    changed = validate(Study, data, lambda problem, _: ConfigError(f"--set: {problem}"))
    for problem, _ in faults.of_factors(changed):
        raise ConfigError(f"--set: {problem}")
    if any(faults.of_answer(changed)):  # levels are gone: no mistake, but no contrast
        changed = changed.model_copy(update={"answer": None, "robustness": None})
    elif any(faults.of_robustness(changed)):
        changed = changed.model_copy(update={"robustness": None})
    kept = {
        p: at for p, at in document.places.items() if not any(p[: len(t)] == t for t in touched)
    }
    changed._document = dataclasses.replace(document, places=kept)
    changed._changes, changed._settings = changes, tuple(settings)
    return changed


def _study_path(key: str, factors: Mapping[str, Any]) -> tuple[str, ...] | None:
    """Where a key stands in the study; None for a key of the scenario."""
    head, _, rest = key.partition(".")
    if key in factors:
        return "factors", key
    if head == "factors" and rest:
        return "factors", rest
    return tuple(key.split(".")) if head in Study.model_fields else None


def _is_level(path: tuple[str, ...], value: Any) -> bool:
    return path[0] == "factors" and len(path) == 2 and not isinstance(value, list)


def _put(data: dict[str, Any], path: tuple[str, ...], value: Any) -> None:
    for step in path[:-1]:
        inner = data.get(step)
        if not isinstance(inner, dict):
            known = ", ".join(data)
            raise ConfigError(f"--set: no {step!r} in the study to change; there: {known}")
        data = inner
    data[path[-1]] = value


def _refuse_design(changes: Iterable[str]) -> None:
    try:
        refuse_keys_of_the_design(changes)
    except ValueError as error:
        raise ConfigError(f"--set: {error}") from None
