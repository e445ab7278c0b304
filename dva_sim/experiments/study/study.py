"""The versions of a study beside the one its file describes, and what `run` is asked for.

A study: one question, the factors it varies, and the contrast that answers it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, PrivateAttr, field_validator

from dva_sim.experiments.study import validation
from dva_sim.experiments.study.designs import ROWS, Design, Row, all_factors, read_table
from dva_sim.experiments.study.overrides import Changed, change
from dva_sim.experiments.study.schema import (
    ANSWER,
    REPEATS,
    Changes,
    Contrast,
    Count,
    Hypothesis,
    Levels,
    Part,
    Prediction,
    Robustness,
    Seed,
    Stop,
    Tuning,
    refuse_keys_of_the_design,
)
from dva_sim.experiments.study.status import Status
from dva_sim.kernel import resources
from dva_sim.kernel.config import AlsoCalled, Config, Document, KeyPath, load_yaml, validate
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.key_changes import blame, parse_changes, set_by
from dva_sim.kernel.streams import derive_seed
from dva_sim.simulation.models import SCENARIOS
from dva_sim.simulation.scenario import load as load_scenario

Version = Literal["quick", "full"]
VERSIONS: tuple[Version, ...] = ("quick", "full")
SIZES: dict[Version, str] = {"quick": "small", "full": "larger"}


@dataclass(frozen=True)
class Variant:
    """Which variant of a study is meant.

    Attributes:
        version: The small or the larger version; None for the study as its file says.
        pilot: Only so many persons.
    """

    version: Version | None = None
    pilot: int | None = None

    @classmethod
    def of(cls, *, quick: bool, full: bool, pilot: int | None) -> Variant:
        """The variant that the options `--quick`, `--full` and `--pilot` ask for.

        Raises:
            ConfigError: both versions are asked for.
        """
        if quick and full:
            raise ConfigError("--quick and --full are two versions of a study; give one of them")
        return cls("quick" if quick else "full" if full else None, pilot)

    def folder(self, name: str) -> Path:
        """Where results go if nobody says: each variant has its own folder."""
        marks = [self.version or "", "pilot" if self.pilot is not None else ""]
        return Path("results") / "-".join([Path(name).stem, *filter(None, marks)])


FOLDER = "experiments"


class Study(Config):
    """What is asked, and all that is run to answer it.

    Attributes:
        question: In words.
        predictions: What was expected before anything was run.
        seed: Of the whole study; the population of persons is drawn from it too.
        persons: Simulated persons: the blocks of the design and clusters of the statistics.
        replications: Paired trials per person.
        factors: Levels of each scenario key that is varied; the cells are their full grid.
        design: Which levels are run together, if not every one with every other.
        treatments: Factors whose levels are names of several changes at once.
        parts: Scenarios by name, each run in every cell.
        answer: The declared contrast.
        comparisons: Further contrasts by name.
        hypotheses: Claims about contrasts, by name; `dva-sim register` fixes them.
        tuning: How the level `tuned` of the factor `tuning` comes by its value.
        robustness: The answer again under other models of the persons.
        stop: When enough persons were simulated.
        budget_s: Time by the clock [s] after which no further persons are begun.
        record: Which episodes are kept as recordings.
        quick: Keys that are otherwise in the small version, which `--quick` runs.
        full: Keys that are otherwise in the larger version, which `--full` runs.
    """

    question: str
    predictions: tuple[Prediction, ...] = ()
    seed: Annotated[Seed, AlsoCalled("random_seed")] = 1
    persons: Annotated[Count, AlsoCalled("participants", "subjects", "n_persons")] = 24
    replications: Annotated[Count, AlsoCalled("trials", "repetitions", "repeats", "runs")] = 5
    factors: dict[str, Levels] = Field(default_factory=dict)
    design: Design | None = None
    treatments: dict[str, dict[str, Changes]] = Field(default_factory=dict)
    parts: Annotated[dict[str, Part], Field(min_length=1)]
    answer: Contrast | None = None
    comparisons: dict[str, Contrast] = Field(default_factory=dict)
    hypotheses: dict[str, Hypothesis] = Field(default_factory=dict)
    tuning: Tuning | None = None
    robustness: Robustness | None = None
    stop: Stop | None = None
    budget_s: Annotated[float, Field(gt=0)] | None = None
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

    @field_validator("comparisons")
    @classmethod
    def _leaves_room_for_the_answer(cls, value: dict[str, Contrast]) -> dict[str, Contrast]:
        if ANSWER in value:
            raise ValueError(f"a comparison cannot be called {ANSWER!r}: the declared contrast is")
        return value

    @property
    def contrasts(self) -> dict[str, Contrast]:
        """All that is compared by name, the answer first."""
        return {**({ANSWER: self.answer} if self.answer else {}), **self.comparisons}

    @property
    def most_persons(self) -> int:
        """How many persons are simulated at most."""
        return self.persons if self.stop is None else max(self.persons, self.stop.most_persons)

    @property
    def listed_rows(self) -> list[Row]:
        """Levels that are run together, as listed in the study or in its CSV file."""
        if self._table is not None:
            return list(self._table.data[ROWS])
        return list(self.design.rows or ()) if self.design is not None else []

    def asked(self) -> dict[str, Any]:
        """All keys that say what is run and how it is read, as JSON would hold them."""
        return self.model_dump(mode="json", exclude={"record", *VERSIONS})

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
        """Scenario keys changed in every part, by `--set` or by `full`."""
        return self._changes

    @property
    def settings(self) -> tuple[str, ...]:
        """The `key=value` pairs of `--set`; any makes the study exploratory."""
        return self._settings

    @property
    def pilot(self) -> int | None:
        """How many persons a pilot of it has; None where it is none."""
        return self._pilot

    @property
    def version(self) -> Version | None:
        """Which of its versions it is; None where it is as its file says."""
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
        """What its results may be called."""
        return self._status

    def error(self, problem: str, path: KeyPath) -> ConfigError:
        """A mistake at what `--set` gives, at a key of the study's file, or in that of its rows."""
        if pair := self.setting_of(path):
            return ConfigError(f"--set {pair}: {problem}")
        if self._table is not None and path[:2] == ("design", ROWS):
            return self._table.error(problem, path[1:])
        return (
            self._document.error(problem, path) if self._document.places else ConfigError(problem)
        )

    def setting_of(self, path: KeyPath) -> str | None:
        """The last pair of `--set` that gives what stands at a key of the study."""
        key = ".".join(map(str, path))
        for pair in reversed(self.settings):
            given = pair.partition("=")[0].strip()
            if f"{key}.".removeprefix("factors.").startswith(f"{given.removeprefix('factors.')}."):
                return pair
        return None

    def is_from_file(self, path: KeyPath) -> bool:
        """Whether the study's file, rather than `--set`, says what stands at `path`."""
        if self._table is not None and path[:2] == ("design", ROWS):
            return path[1:] in self._table.places
        return path in self._document.places


def load_study(
    name: str | Path,
    settings: Iterable[str] = (),
    *,
    version: Version | None = None,
    pilot: int | None = None,
) -> Study:
    """Read a study by name or path.

    Args:
        name: The study.
        settings: `key=value` pairs. A key of the study (`seed=2`, `factors.pattern=[req-rep]`)
            changes the study. Any other key is one of the scenario and holds in every part; if
            it is a factor, its value or list of values takes the place of the factor's levels.
        version: The small or the larger version, by the study's key `quick` or `full`.
        pilot: Only so many persons, with random seeds that the study itself never uses.

    Raises:
        ConfigError: not found, not valid, or changes that make no sense.
    """
    from dva_sim.experiments.study.registration import settled  # it knows cells, which studies make

    document = load_yaml(resources.find(str(name), FOLDER, is_asked=True))
    try:
        study, data = _in_version(document, version)
    except ConfigError as error:
        from dva_sim.experiments.study.documents import of_other_kind  # it knows studies, too

        raise of_other_kind(document, "dva-sim run", "study") or error from None
    usual = study.usual
    if settings := tuple(settings):
        study = _with_settings(data, document, settings)
    study._version, study._usual = version, usual
    if pilot is not None:
        study = _piloted(study, pilot)
    return settled(study)


def _in_version(document: Document, version: Version | None) -> tuple[Study, Changed]:
    """The study as its file says, or one of its versions; all of them are judged."""
    written = Changed(document.data, {}, ())
    study = _built(written, document)
    study._usual = _size_of(study)
    made = {name: _version_of(study, written, document, name) for name in study.versions}
    if version is None:
        return study, written
    if version not in made:
        raise document.error(f"has no {SIZES[version]} version: no key {version!r}")
    return made[version]


def _version_of(
    study: Study, written: Changed, document: Document, version: Version
) -> tuple[Study, Changed]:
    """A version, and its keys; claims about what the small version leaves out are left out."""
    try:
        data = change(written, getattr(study, version), Study, _scenarios_of(written, document))
        made = _built(data, document, may_lose=version == "quick")
        if made.answer is None and study.answer is not None:
            _built(data, document)  # which tells why it cannot be answered
        made._usual = study.usual
        return made, data
    except ConfigError as error:
        raise _told_in(study, version, error) from None


def _size_of(study: Study) -> dict[str, Any]:
    """What a report needs to tell one version of a study from another."""
    factors = {name: list(levels) for name, levels in study.factors.items()}
    size = {"persons": study.persons, "replications": study.replications, "factors": factors}
    return {"name": study.file.stem} | size


def _told_in(study: Study, version: Version, error: ConfigError) -> ConfigError:
    """A mistake of a version, at the key that it names."""
    named = [
        key
        for key in getattr(study, version)
        if key.rpartition(".")[2] in error.problem
        or any(repr(step) in error.problem for step in key.split("."))
    ]
    problem = f"in the {SIZES[version]} version: {error.problem}"
    return study.error(problem, (version, *named[:1]))


def _with_settings(data: Changed, document: Document, settings: tuple[str, ...]) -> Study:
    """The study changed by `--set`; claims about levels that are gone are gone, too."""
    changes, scenarios = parse_changes(settings), _scenarios_of(data, document)

    def make(some: Mapping[str, Any]) -> Study:
        return _built(change(data, some, Study, scenarios), document, may_lose=True)

    try:
        study = make(changes)
    except ConfigError as error:
        raise set_by(settings, blame(error, changes, make, document)) from None
    study._settings = settings
    return study


def _scenarios_of(data: Changed, document: Document) -> list[type[Config]]:
    """The kinds of scenarios that the parts have; all kinds where one cannot be read."""
    try:
        named = [part["scenario"] for part in data.data["parts"].values()]
        files = [load_scenario(name, base=document.file.parent) for name in named]
        return list({SCENARIOS[str(file.data.get("model", "full"))]: None for file in files})
    except (ConfigError, LookupError, TypeError, AttributeError):
        return list(SCENARIOS.values())


def _piloted(study: Study, persons: int) -> Study:
    """Some persons with luck of their own, so that nothing of the study itself is seen."""
    if persons < 1:
        raise ConfigError(f"a pilot should have at least 1 person, not {persons}")
    seed = derive_seed(study.seed, "pilot")
    pilot = study.model_copy(update={"persons": persons, "seed": seed, "stop": None})
    pilot._pilot = persons
    for problem, _ in validation.of_size(pilot):
        raise ConfigError(f"a pilot of {persons} persons: {problem}")
    return pilot


def _built(data: Changed, document: Document, may_lose: bool = False) -> Study:
    """The study, if it makes sense.

    Args:
        data: Its keys.
        document: Its file.
        may_lose: Whether claims about what is not there are lost, instead of being mistakes.
    """
    study = validate(Study, data.data, document.error)
    study._document = dataclasses.replace(
        document, places={p: at for p, at in document.places.items() if data.holds(p)}
    )
    study._changes = data.changes
    study._table = _table_of(study)
    _tell_first(study, validation.of_design(study))
    factors = all_factors(study.design, study.factors, study.listed_rows)
    study = study.model_copy(update={"factors": factors})
    _tell_first(study, validation.of_factors(study))
    if may_lose:
        # A claim that is made in the same breath is a mistake and no loss.
        _tell_first(study, (f for f in validation.of_claims(study) if not data.holds(f[1])))
        study = validation.kept_claims(study)
    else:
        _tell_first(study, validation.of_claims(study))
    _tell_first(study, validation.of_stop(study))
    return study


def _table_of(study: Study) -> Document | None:
    """The rows of the file that the design names; None if it names none."""
    if study.design is None or study.design.csv is None:
        return None
    try:
        path = resources.find(study.design.csv, FOLDER, suffix=".csv", base=study.folder)
    except ConfigError as error:
        problem = error.problem.replace("study ", "file of rows ", 1)
        raise study.error(problem, ("design", "csv")) from None
    return read_table(path)


def _tell_first(study: Study, found: Iterable[validation.Fault]) -> None:
    for problem, path in found:
        raise study.error(problem, path)
