"""A study: one question, the factors it varies, and the contrast that answers it."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, Field, PrivateAttr, field_validator

from dva_sim import resources
from dva_sim.config import Config, Document, Path_, load_yaml, parse_changes, validate
from dva_sim.errors import ConfigError

FOLDER = "experiments"
SET_BY_DESIGN = {"operator.person": "persons", "operator.population_seed": "seed"}

Level = bool | int | float | str | None


def _distinct(levels: tuple[Level, ...]) -> tuple[Level, ...]:
    for index, level in enumerate(levels):
        if level in levels[:index]:
            raise ValueError(f"level {level!r} stands twice")
    return levels


Levels = Annotated[tuple[Level, ...], Field(min_length=1), AfterValidator(_distinct)]
Count = Annotated[int, Field(ge=1)]


class Part(Config):
    """One scenario that is run in every cell.

    Attributes:
        scenario: By name or path, also relative to the study's file.
        reference: Changes that make the reference run, one for each person and trial.
        replications: Trials per person, if not those of the study.
    """

    scenario: str
    reference: dict[str, Any] | None = None
    replications: Count | None = None

    @field_validator("reference")
    @classmethod
    def _person_is_the_designs(cls, value: dict[str, Any] | None) -> dict[str, Any] | None:
        _refuse_keys_of_the_design(value or {})
        return value


class Answer(Config):
    """The contrast declared to answer the question, before anything is run.

    Attributes:
        part: Part it is measured in.
        measure: Column of the table `runs`; in excess of the reference run where there is one.
        factor: Factor whose two levels are compared.
        contrast: The two levels: the first minus the second.
        over: Factor along which the difference is followed.
        within: Levels of the other factors.
        smallest_effect: Smallest difference that matters, in the measure's own unit.
        smallest_effect_s: The same for a measure in seconds [s].
    """

    part: str
    measure: str
    factor: str
    contrast: tuple[Level, Level]
    over: str
    within: dict[str, Level] = Field(default_factory=dict)
    smallest_effect: Annotated[float, Field(gt=0)] | None = None
    smallest_effect_s: Annotated[float, Field(gt=0)] | None = None


class Study(Config):
    """What is asked, and all that is run to answer it.

    Attributes:
        question: In words.
        seed: Of the whole study; the population of persons is drawn from it too.
        persons: Simulated persons, the clusters.
        replications: Paired trials per person.
        factors: Levels of each scenario key that is varied; the cells are their full grid.
        parts: Scenarios by name, each run in every cell.
        answer: The declared contrast.
    """

    question: str
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1
    persons: Count = 24
    replications: Count = 5
    factors: dict[str, Levels] = Field(default_factory=dict)
    parts: Annotated[dict[str, Part], Field(min_length=1)]
    answer: Answer | None = None

    _document: Document = PrivateAttr(default_factory=lambda: Document({}, Path()))
    _changes: dict[str, Any] = PrivateAttr(default_factory=dict)
    _settings: tuple[str, ...] = PrivateAttr(default=())

    @field_validator("factors")
    @classmethod
    def _varies_the_scenario(cls, value: dict[str, Levels]) -> dict[str, Levels]:
        _refuse_keys_of_the_design(value)
        return value

    @property
    def folder(self) -> Path:
        """Where the study's file lies."""
        return self._document.file.parent

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
    problem = _unanswerable(study)
    if problem:
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
    if _unanswerable(changed):  # its levels are gone, which is no mistake but leaves no contrast
        changed = changed.model_copy(update={"answer": None})
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


def _refuse_keys_of_the_design(keys: Iterable[str]) -> None:
    for key in keys:
        if key in SET_BY_DESIGN:
            raise ValueError(f"{key!r} is set by the study; change {SET_BY_DESIGN[key]!r} instead")


def _refuse_design(changes: Iterable[str]) -> None:
    try:
        _refuse_keys_of_the_design(changes)
    except ValueError as error:
        raise ConfigError(f"--set: {error}") from None


def _unanswerable(study: Study) -> tuple[str, Path_] | None:
    """Why the declared contrast cannot be computed, and where that is said."""
    answer = study.answer
    if answer is None:
        return None
    if answer.part not in study.parts:
        known = ", ".join(study.parts)
        return f"answer.part {answer.part!r} is not a part; parts: {known}", ("answer", "part")
    wanted: list[tuple[Path_, str, tuple[Level, ...]]] = [
        (("answer", "factor"), answer.factor, answer.contrast),
        (("answer", "over"), answer.over, ()),
        *((("answer", "within", key), key, (level,)) for key, level in answer.within.items()),
    ]
    for path, factor, levels in wanted:
        if factor not in study.factors:
            known = ", ".join(study.factors)
            return f"{factor!r} is not a factor; factors: {known}", path
        for level in levels:
            if level not in study.factors[factor]:
                known = ", ".join(map(str, study.factors[factor]))
                return f"{level!r} is not a level of {factor!r}; levels: {known}", path
    if answer.contrast[0] == answer.contrast[1]:
        return "contrast compares a level with itself", ("answer", "contrast")
    return None
