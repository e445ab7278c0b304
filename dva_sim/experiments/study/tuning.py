"""The table of tuned values: kept in a file beside the study, and looked up for each cell."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from dva_sim.experiments.study import validation
from dva_sim.experiments.study.parts import Level, Levels, ScreeningRule, Tuning
from dva_sim.experiments.study.study import Status, Study
from dva_sim.kernel import resources
from dva_sim.kernel.config import Config, validate
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.yaml_files import load_yaml

FOLDER = "tuned"  # beside the study
# What a study asks for, and the study that tunes its values does not.
LEFT = (
    *("predictions", "design", "answer", "comparisons", "hypotheses"),
    *("tuning", "robustness", "screening", "stop", "budget_s", "record"),
)


class ChosenValue(Config):
    """One value, for one combination of the levels it was tuned by.

    Attributes:
        when: Levels that it was tuned for.
        value: Value of the tuned key.
    """

    when: dict[str, Level]
    value: float


class TriedValue(Config):
    """One value that was tried.

    Attributes:
        when: Levels it was tried under.
        value: Value of the tuned key.
        mean: Mean of the measure over persons.
        low: Lower end of its 95 % interval.
        high: Upper end.
    """

    when: dict[str, Level]
    value: float
    mean: float
    low: float
    high: float


class TuningBasis(Config):
    """Hashes of the user-editable files that tuned values depend on.

    Attributes:
        persons: Hash of the population.
        phones: Hash of all phones.
    """

    persons: str
    phones: str

    @classmethod
    def of(cls, population: str) -> TuningBasis:
        """Read the current files."""
        phones = resources.available("agents/phones")
        return cls(
            persons=_hash_of([resources.find(population, "agents/people")]),
            phones=_hash_of([phones[name] for name in sorted(phones)]),
        )

    def unlike(self, other: TuningBasis) -> list[str]:
        """Return names of the entries that differ."""
        ours = self.model_dump()
        theirs = other.model_dump()
        return [name for name in ours if ours[name] != theirs[name]]


class TunedValues(Config):
    """Tuned values, with all trials of the tuning.

    Attributes:
        study: Name of the study.
        made_with: Version of the program, and the fingerprint of what simulates.
        basis: The persons and phones that it was made with.
        tuning: The rule as it was then.
        chosen: A value for each combination of levels.
        seen: Every value tried.
    """

    study: str
    made_with: str
    basis: TuningBasis
    tuning: Tuning
    chosen: tuple[ChosenValue, ...]
    seen: tuple[TriedValue, ...]

    def remark(self, now: TuningBasis) -> str:
        """Return the remark that persons or phones have changed since the tuning; empty if not."""
        differences = " and ".join(self.basis.unlike(now))
        return (
            f"tuned with other {differences}: run 'dva-sim tune {self.study}' again"
            if differences
            else ""
        )

    def value_for(self, levels: Mapping[str, Level]) -> float:
        """Return the value chosen for the cell with these levels.

        Raises:
            ConfigError: it was not tuned for them.
        """
        when = {name: levels[name] for name in self.tuning.by}
        for choice in self.chosen:
            if choice.when == when:
                return choice.value
        text = ", ".join(f"{name} {level}" for name, level in when.items())
        raise ConfigError(f"nothing was tuned for {text}; {_how_to_make(self.study)}")


def choose(means: Mapping[float, float]) -> float:
    """Return the rule: the value with the least mean; of equal ones the nearest to 1, by ratio."""
    return min(means, key=lambda value: (means[value], abs(math.log(value)), value))


def file_of(study: Study) -> Path:
    """Return the file of a study's tuned values."""
    return study.folder / FOLDER / f"{study.file.stem}.yaml"


def folder_of_tuning(name: str) -> Path:
    """Return the default folder for the trials of a tuning."""
    return Path("results") / f"{Path(name).stem}-tuning"


def load_tuned(study: Study) -> TunedValues:
    """Return the tuned values of a study.

    Raises:
        ConfigError: there are none, or they were made by another rule.
    """
    path = file_of(study)
    if not path.is_file():
        raise ConfigError(f"{path} is not there; {_how_to_make(study.file.stem)}")
    document = load_yaml(path)
    tuned = validate(TunedValues, document.data, document.error)
    if tuned.tuning != study.tuning:
        problem = "was made by another rule than the study's"
        raise document.error(f"{problem}; {_how_to_make(study.file.stem)}", ("tuning",))
    return tuned


def save_tuned(study: Study, tuned: TunedValues) -> Path:
    """Write the tuned values beside the study; the same bytes for the same values."""
    data = tuned.model_dump(mode="json")
    flow = partial(json.dumps, ensure_ascii=False)  # which is YAML, too
    lines = [
        f"# Written by `dva-sim tune {tuned.study}`; what it says is not to be edited.",
        *(f"{key}: {flow(data[key])}" for key in ("study", "made_with", "basis")),
        "tuning:",
        *(f"  {key}: {flow(value)}" for key, value in data["tuning"].items()),
    ]
    for key in ("chosen", "seen"):
        lines += [f"{key}:", *(f"  - {flow(item)}" for item in data[key])]
    path = file_of(study)
    path.parent.mkdir(exist_ok=True)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
    return path


def _hash_of(files: Iterable[Path]) -> str:
    """Return 64 bits over names and values.

    What describes a file, or comments on it, is none of them.
    """
    data = [[path.name, {**load_yaml(path).data, "description": ""}] for path in files]
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()[:16]


def _how_to_make(name: str) -> str:
    return f"'dva-sim tune {name}' makes it"


def tuning_study(study: Study) -> Study:
    """Return the study that tries every value with persons and seeds of its own, on equal budgets.

    Raises:
        ConfigError: the study tunes nothing.
    """
    rule = rule_of(study)
    factors: dict[str, Levels] = {name: (level,) for name, level in rule.at.items()}
    factors |= {name: study.factors[name] for name in rule.by}
    factors[rule.key] = rule.levels
    question = f"Which {rule.key} for each {', '.join(rule.by)}?"
    return trials_of(study, "tuning", rule, rule.part, question=question, factors=factors)


def trials_of(
    study: Study, key: str, rule: Tuning | ScreeningRule, part: str, **changes: Any
) -> Study:
    """Return runs of one part of a study alone, with persons and random numbers of its own.

    Args:
        study: Study to derive from; everything is kept except for the keys in `LEFT`.
        key: Key of `rule` in the study, for errors.
        rule: Its seed and its size.
        part: Part that is run, without reference runs.
        **changes: Further keys of the trials.

    Raises:
        ConfigError: there are more runs than a study may have.
    """
    usual = {left: Study.model_fields[left] for left in LEFT}
    alone = study.parts[part].model_copy(update={"reference": None, "replications": None})
    trials = study.model_copy(
        update={
            **{left: field.get_default(call_default_factory=True) for left, field in usual.items()},
            "seed": rule.seed,
            "persons": rule.persons,
            "replications": rule.replications,
            "parts": {part: alone},
            **changes,
        }
    )
    for problem, _ in validation.of_size(trials):
        raise study.error(f"{key}: {problem}", (key,))
    trials._status = Status()
    trials._table = None
    return trials


def rule_of(study: Study) -> Tuning:
    """Return the rule by which a study tunes.

    Raises:
        ConfigError: it tunes nothing.
    """
    if study.tuning is None:
        raise ConfigError(f"{study.file} tunes nothing: it has no key 'tuning'")
    return study.tuning
