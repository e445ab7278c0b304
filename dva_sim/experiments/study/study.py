"""A study: one question, the factors it varies, and the contrast that answers it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, PrivateAttr, ValidationInfo, field_validator

from dva_sim.experiments.study.designs import ROWS, Design, Row
from dva_sim.experiments.study.parts import (
    ANSWER,
    REPEATS,
    SPARES_THE_DESIGN,
    Changes,
    Contrast,
    Count,
    Hypothesis,
    Levels,
    MapRule,
    Prediction,
    RobustnessRule,
    ScenarioChanges,
    ScreeningRule,
    Seed,
    StopRule,
    StudyPart,
    Tuning,
)
from dva_sim.kernel.config import AlsoCalled, Config
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.yaml_files import Document, KeyPath

Version = Literal["quick", "full"]
VERSIONS: tuple[Version, ...] = ("quick", "full")
SIZES: dict[Version, str] = {"quick": "small", "full": "larger"}
FOLDER = "experiments"


class Status(Config):
    """Status of a result and its reasons; kept in the manifest and shown in the report.

    Attributes:
        kind: `declared`: run as its file says, nothing registered. `exploratory`: something was
            changed, tried or left open. `confirmatory`: run as registered, on seeds that nobody
            could know before.
        why: Reasons and remarks, each a sentence without its full stop.
        reproducible: True if the same command gives the same bytes on any machine.
        registration: The registration, even if this result departs from it; None if there is none.
    """

    kind: Literal["declared", "exploratory", "confirmatory"] = "declared"
    why: tuple[str, ...] = ()
    reproducible: bool = True
    registration: dict[str, Any] | None = Field(default=None)


class Study(Config):
    """Study: a question, and everything that is run to answer it.

    Attributes:
        question: Description in words.
        predictions: Predictions written down before anything was run.
        seed: Random seed of the whole study; the population of persons is drawn from it too.
        persons: Simulated persons: the blocks of the design and clusters of the statistics.
        replications: Paired trials per person.
        factors: Levels of each scenario key that is varied; the cells are their full grid.
        design: Combination of levels, if not every one with every other.
        treatments: Factors whose levels are names of several changes at once.
        parts: Scenarios by name, each run in every cell.
        answer: The declared contrast.
        comparisons: Further contrasts by name.
        hypotheses: Claims about contrasts, by name; `dva-sim register` fixes them.
        tuning: Rule that chooses the value for level `tuned` of the factor `tuning`.
        robustness: The answer again under other models of the persons.
        map: Map: the best level of the answer's factor at each level that it runs over.
        screening: Assumed numbers that `dva-sim screen` varies; the study's own runs do not.
        stop: Rule that ends the study early.
        budget_s: Time by the clock [s] after which no further persons are begun.
        measures: Further columns of the runs: covariates of ours, such as `way_off_m`, and
            measures of the user's own, `mine.py:Mine`.
        covariates: Columns of the runs, or products of some, that no treatment changes and whose
            mean over all persons and trials is zero: the answer is adjusted for what they happen
            to be.
        record: Episodes to keep as recordings.
        quick: Keys that are otherwise in the small version, which `--quick` runs.
        full: Keys that are otherwise in the larger version, which `--full` runs.
    """

    question: str
    predictions: tuple[Prediction, ...] = ()
    seed: Annotated[Seed, AlsoCalled("random_seed")] = 1
    persons: Annotated[Count, AlsoCalled("participants", "subjects", "n_persons")] = 24
    replications: Annotated[Count, AlsoCalled("trials", "repetitions", "repeats", "runs")] = 5
    factors: Annotated[dict[str, Levels], SPARES_THE_DESIGN] = Field(default_factory=dict)
    design: Design | None = None
    treatments: dict[str, dict[str, ScenarioChanges]] = Field(default_factory=dict)
    parts: Annotated[dict[str, StudyPart], Field(min_length=1)]
    answer: Contrast | None = None
    comparisons: dict[str, Contrast] = Field(default_factory=dict)
    hypotheses: dict[str, Hypothesis] = Field(default_factory=dict)
    tuning: Tuning | None = None
    robustness: RobustnessRule | None = None
    map: MapRule | None = None
    screening: ScreeningRule | None = None
    stop: StopRule | None = None
    budget_s: Annotated[float, Field(gt=0)] | None = None
    measures: tuple[str, ...] = ()
    covariates: tuple[str, ...] = ()
    record: Literal["all", "worst", "sample"] | None = None
    quick: Changes = Field(default_factory=dict)
    full: Changes = Field(default_factory=dict)

    _document: Document = PrivateAttr(default_factory=lambda: Document({}, Path()))
    _table: Document | None = PrivateAttr(default=None)
    _changes: Changes = PrivateAttr(default_factory=dict)
    _settings: tuple[str, ...] = PrivateAttr(default=())
    _pilot: int | None = PrivateAttr(default=None)
    _version: Version | None = PrivateAttr(default=None)
    _status: Status = PrivateAttr(default_factory=Status)
    _usual: dict[str, Any] = PrivateAttr(default_factory=dict)
    _lost: tuple[str, ...] = PrivateAttr(default=())

    @field_validator("parts", "comparisons")
    @classmethod
    def _leaves_room(cls, value: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
        """Return it with names free for repeats, called as a part, and the answer."""
        of_parts = ("a part", REPEATS, "the repeats are")
        of_comparisons = ("a comparison", ANSWER, "the declared contrast is")
        what, taken, by = of_parts if info.field_name == "parts" else of_comparisons
        if taken in value:
            raise ValueError(f"{what} cannot be called {taken!r}: {by}")
        return value

    @property
    def contrasts(self) -> dict[str, Contrast]:
        """All that is compared by name, the answer first."""
        return {**({ANSWER: self.answer} if self.answer else {}), **self.comparisons}

    @property
    def most_persons(self) -> int:
        """Maximum number of persons."""
        return self.persons if self.stop is None else max(self.persons, self.stop.most_persons)

    @property
    def listed_rows(self) -> list[Row]:
        """Levels that are run together, as listed in the study or in its CSV file."""
        if self._table is not None:
            return list(self._table.data[ROWS])
        return list(self.design.rows or ()) if self.design is not None else []

    def asked(self) -> dict[str, Any]:
        """Return all keys that determine the runs and their analysis, as JSON data."""
        unasked = [key for key in ("measures", "covariates", "map") if not getattr(self, key)]
        apart = {"record", "screening", *VERSIONS, *unasked}
        return self.model_dump(mode="json", exclude=apart)

    @property
    def file(self) -> Path:
        """The study's file."""
        return self._document.file

    @property
    def folder(self) -> Path:
        """Folder of the study's file."""
        return self.file.parent

    @property
    def changes(self) -> Mapping[str, Any]:
        """Scenario keys changed in every part, by `--set` or by `full`."""
        return self._changes

    @property
    def settings(self) -> tuple[str, ...]:
        """The `key=value` pairs of `--set`; any makes the study exploratory."""
        return self._settings

    @property
    def lost(self) -> tuple[str, ...]:
        """Declared claims that the settings have made impossible, one sentence each."""
        return self._lost

    @property
    def pilot(self) -> int | None:
        """Number of persons in a pilot; None if it is not a pilot."""
        return self._pilot

    @property
    def version(self) -> Version | None:
        """Version of the study; None if unchanged from its file."""
        return self._version

    @property
    def versions(self) -> list[Version]:
        """The versions that its file has beside the one that it describes."""
        return [version for version in VERSIONS if getattr(self, version)]

    @property
    def usual(self) -> dict[str, Any]:
        """Its name and the size that its file gives it, whichever version of it this is."""
        return self._usual

    @property
    def status(self) -> Status:
        """Status of its results."""
        return self._status

    def error(self, problem: str, path: KeyPath) -> ConfigError:
        """Return a mistake at what `--set` gives, at a key of the file, or in that of its rows."""
        if pair := self.setting_of(path):
            return ConfigError(f"--set {pair}: {problem}")
        if self._table is not None and path[:2] == ("design", ROWS):
            return self._table.error(problem, path[1:])
        return (
            self._document.error(problem, path) if self._document.places else ConfigError(problem)
        )

    def setting_of(self, path: KeyPath) -> str | None:
        """Return the last `--set` pair that gives the value at a key of the study."""
        key = ".".join(map(str, path))
        for pair in reversed(self.settings):
            name = pair.partition("=")[0].strip()
            if f"{key}.".removeprefix("factors.").startswith(f"{name.removeprefix('factors.')}."):
                return pair
        return None

    def is_from_file(self, path: KeyPath) -> bool:
        """Return True if the value at `path` is of the study's file rather than of `--set`."""
        if self._table is not None and path[:2] == ("design", ROWS):
            return path[1:] in self._table.places
        return path in self._document.places
