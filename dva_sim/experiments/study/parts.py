"""Keys of a study's file below its top level: answer, hypotheses, tuning and repeats."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from typing import Annotated, Any, Literal, TypeVar

from pydantic import AfterValidator, ConfigDict, Field, model_validator

from dva_sim.kernel.config import Config, Scalar
from dva_sim.statistics import LEVEL

SET_BY_DESIGN = {"operator.person": "persons", "operator.population_seed": "seed"}

TUNING = "tuning"  # name of the factor whose levels are these:
UNTUNED = "untuned"
TUNED = "tuned"
REPEATS = "robustness"  # name of the table of repeats, so of no part
STRATEGY = "operator.strategy"
ANSWER = "answer"  # the declared contrast, where a comparison is named
POINT = "point"  # name of the factor that numbers the points of a design without levels

Keys = TypeVar("Keys", bound=Iterable[str])
Level = Scalar
Direction = Literal["above", "below", "same"]


def _distinct(levels: tuple[Level, ...]) -> tuple[Level, ...]:
    for level in (level for at, level in enumerate(levels) if level in levels[:at]):
        raise ValueError(f"level {level!r} appears twice")
    return levels


def _ascending(range_: tuple[float, float]) -> tuple[float, float]:
    if range_[0] > range_[1]:
        raise ValueError(f"range should ascend, not go from {range_[0]:g} to {range_[1]:g}")
    return range_


Levels = Annotated[
    tuple[Level, ...],
    Field(min_length=1, json_schema_extra={"uniqueItems": True}),
    AfterValidator(_distinct),
]
Count = Annotated[int, Field(ge=1)]
Seed = Annotated[int, Field(ge=0, lt=2**63)]
Range = Annotated[tuple[float, float], AfterValidator(_ascending)]
Changes = dict[str, Any]


def says(*keys: str, not_: str = "") -> dict[str, Any]:
    """Return the JSON Schema of a mapping with values under these keys and no others."""
    rules: dict[str, Any] = {key: {"not": {"type": "null"}} for key in keys}
    return {
        "required": list(keys),
        "properties": rules | ({not_: {"maxProperties": 0}} if not_ else {}),
    }


def multiplied(covariate: str) -> list[str]:
    """Return the columns whose product a covariate is: `caution_off * way_off_m`, or one alone."""
    return [name.strip() for name in covariate.split("*")]


def refuse_keys_of_the_design(keys: Keys) -> Keys:
    """Return the persons, which are the study's own to choose.

    Raises:
        ValueError: a key that the study sets itself.
    """
    for key in keys:
        if key in SET_BY_DESIGN:
            raise ValueError(f"{key!r} is set by the study; change {SET_BY_DESIGN[key]!r} instead")
    return keys


SPARES_THE_DESIGN = AfterValidator(refuse_keys_of_the_design)  # no key that the study sets itself
ScenarioChanges = Annotated[Changes, SPARES_THE_DESIGN]


class StudyPart(Config):
    """One scenario that is run in every cell.

    Attributes:
        scenario: Name or path, also relative to the study's file.
        changes: Changes to the scenario, in every cell of the part.
        reference: Changes that make the reference run, one for each person and trial.
        replications: Trials per person, if not those of the study.
    """

    scenario: str
    changes: ScenarioChanges = Field(default_factory=dict)
    reference: ScenarioChanges | None = None
    replications: Count | None = None


class Contrast(Config):
    """Two levels of one factor, compared in one measure.

    Attributes:
        part: Part it is measured in.
        measure: Column of the table `runs`; in excess of the reference run where there is one.
        factor: Factor whose two levels are compared.
        contrast: The two levels: the first minus the second.
        over: Factor along which the difference is followed; without it, one difference.
        within: Levels of the other factors.
        family: Tests of one family share their chance of a false alarm.
        smallest_effect: Smallest difference that matters, in the measure's own unit.
        smallest_effect_s: The smallest effect for a measure in seconds [s].
    """

    part: str
    measure: str
    factor: str
    contrast: tuple[Level, Level]
    over: str | None = None
    within: dict[str, Level] = Field(default_factory=dict)
    family: Annotated[str, Field(min_length=1)] = "main"
    smallest_effect: Annotated[float, Field(gt=0)] | None = None
    smallest_effect_s: Annotated[float, Field(gt=0)] | None = None

    @property
    def smallest(self) -> float | None:
        """Smallest difference that matters, in the measure's unit."""
        if self.measure.endswith("_s") and self.smallest_effect_s is not None:
            return self.smallest_effect_s
        return self.smallest_effect


class Hypothesis(Config):
    """A claim about one contrast at one place, to be tested; registered, it is confirmatory.

    Attributes:
        text: Text in words.
        comparison: Contrast to test: `answer`, or the name of a comparison.
        direction: Sign of the first level minus the second: `above` zero, `below` it, or the
            `same`.
        margin: Margin in the measure's unit: least difference of `above` and `below`, largest
            difference of `same`.
        at: Levels of other factors than the contrast's. By default those that the contrast is
            `within`, and the last level of the factor it runs `over`.
    """

    model_config = ConfigDict(
        json_schema_extra={
            "anyOf": [
                {"properties": {"direction": {"enum": ["above", "below"]}}},
                {"required": ["margin"], "properties": {"margin": {"exclusiveMinimum": 0}}},
            ]
        }
    )

    text: str = ""
    comparison: str = ANSWER
    direction: Direction
    margin: Annotated[float, Field(ge=0)] = 0.0
    at: dict[str, Level] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _same_within_something(self) -> Hypothesis:
        if self.direction == "same" and self.margin == 0:
            raise ValueError("'same' needs a margin: nothing is the same to the last digit")
        return self


class StopRule(Config):
    """Stopping rule: after each batch of persons, in seed order, decide if there are enough.

    The study's `persons` are the first batch. After each, every half-width of the 95 % interval
    is looked at: of the mean of a measure in each cell of a part, or of a contrast at each level
    of the factor it runs over, for all of them at once.

    Attributes:
        half_width: Largest half-width that is good enough, in the measure's unit.
        measure: Column of the table `runs`, in excess of the reference run where there is one.
        part: Part it is measured in.
        comparison: Comparison in place of a measure: `answer`, or the name of a comparison.
        batch_persons: Number of persons in each further batch. `double`, for `answer` only: each
            batch doubles the persons so far, and the looks share the 5 % by which intervals may
            err. Otherwise an interval that ends a study by its width covers less than 95 %.
        most_persons: After so many it ends in any case.

    References:
        Chow & Robbins, Annals of Mathematical Statistics 36 (1965), 457-462: why a fixed width
        can be waited for, and that the interval holds in the limit only. Jennison & Turnbull,
        Group Sequential Methods (2000), chapter 9 (repeated confidence intervals).
    """

    model_config = ConfigDict(
        json_schema_extra={
            "oneOf": [says("comparison"), says("measure", "part")],
            "if": {"properties": {"batch_persons": {"const": "double"}}},
            "then": {"properties": {"comparison": {"const": ANSWER}}},
        }
    )

    half_width: Annotated[float, Field(gt=0)]
    measure: str | None = None
    part: str | None = None
    comparison: str | None = None
    batch_persons: Count | Literal["double"]
    most_persons: Count

    @model_validator(mode="after")
    def _looks_at_one_thing(self) -> StopRule:
        is_measured = (self.measure is not None, self.part is not None)
        if is_measured != (self.comparison is None,) * 2:
            raise ValueError("should name a comparison, or a measure and its part")
        if self.is_scheduled and self.comparison != ANSWER:
            raise ValueError("batch_persons: double is for the comparison 'answer'")
        return self

    @property
    def is_scheduled(self) -> bool:
        """True if the looks are few and share the chance to err."""
        return self.batch_persons == "double"

    def looks(self, persons: int) -> list[int]:
        """Return numbers of persons after which the intervals are looked at, ascending.

        Args:
            persons: The first batch.
        """
        most = max(persons, self.most_persons)
        if isinstance(self.batch_persons, int):
            return [*range(persons, most, self.batch_persons), most]
        doubled = (persons * 2**n for n in range(most.bit_length()))
        return [*itertools.takewhile(lambda count: count < most, doubled), most]

    def level(self, persons: int) -> float:
        """Return the confidence level of the interval of one look; see `looks`."""
        shared_by = len(self.looks(persons)) if self.is_scheduled else 1
        return 1 - (1 - LEVEL) / shared_by


class Prediction(Config):
    """Prediction for one contrast, written down before the first run.

    Attributes:
        text: Text in words.
        direction: Sign of the first level minus the second: `above` zero, `below` it, or the `same`
            but for less than the smallest effect that matters. Without it nothing is judged.
        factor: Factor whose levels are compared; by default the answer's.
        contrast: The two levels; by default the answer's.
        at: Levels of other factors. By default those the answer is `within`, the last level of
            the factor it runs `over`, and the second of its contrast.
        expects: Range in which the mean difference is expected, in the measure's unit.
        expects_s: The expected range for a measure in seconds [s].
    """

    text: Annotated[str, Field(min_length=1)]
    direction: Direction | None = None
    factor: str | None = None
    contrast: tuple[Level, Level] | None = None
    at: dict[str, Level] = Field(default_factory=dict)
    expects: Range | None = None
    expects_s: Range | None = None

    @model_validator(mode="after")
    def _can_be_judged(self) -> Prediction:
        judged = self.direction is not None
        if not judged and (self.at or self.factor or self.contrast or self.expected):
            raise ValueError("a prediction with a contrast or a range needs a direction")
        if self.factor is not None and self.contrast is None:
            raise ValueError("a prediction of another factor needs its contrast")
        return self

    @property
    def expected(self) -> Range | None:
        """Range of the mean difference, in the measure's unit."""
        return self.expects if self.expects is not None else self.expects_s


class Tuning(Config):
    """One rule, with one budget for all, by which a key is chosen for each level of some factors.

    The rule: least mean of the measure over persons who take no part in the study; of equal ones
    the nearest to 1.

    Attributes:
        key: Key to tune.
        levels: Its values tried, the same for all.
        by: Factors for each of whose levels it is tuned on its own.
        at: Levels of the other factors while it is tuned.
        part: Part it is tuned in.
        measure: Column of the table `runs` that should be small.
        persons: Simulated persons, others than the study's.
        replications: Trials of each.
        seed: Random seed of the tuning; independent of the study's.
    """

    key: str
    levels: Annotated[
        tuple[Annotated[float, Field(gt=0)], ...], Field(min_length=2), AfterValidator(_distinct)
    ]
    by: Annotated[tuple[str, ...], Field(min_length=1)]
    at: dict[str, Level] = Field(default_factory=dict)
    part: str
    measure: str
    persons: Count = 8
    replications: Count = 2
    seed: Seed


class RobustnessRule(Config):
    """The answer's contrast again, under other models of the persons.

    Every strategy is tried with the persons' usual parameters and with each of `sets` others,
    which fill the bands of calibration evenly (Latin hypercube, on a logarithmic scale).

    Attributes:
        strategies: Strategies of the operators; by default only the scenario's.
        sets: Number of other parameter sets.
        bands: File of the bands, in `agents/people` or by path: `[low, high]` for each trait.
        at: Levels of the factor that the answer runs `over`; by default its last.
        persons: Simulated persons in each repeat: the first of the study's.
        replications: Trials of each.
    """

    strategies: Annotated[tuple[str, ...], AfterValidator(_distinct)] = ()
    sets: Annotated[int, Field(ge=0, le=1000)] = 8
    bands: str = "operators-bands"
    at: Levels | None = None
    persons: Annotated[int, Field(ge=2)] = 6
    replications: Count = 2


class MapRule(Config):
    """Map of costs: each level of the answer's factor at each level that it runs over.

    Attributes:
        models: Factor whose levels are the models of persons that the data leave open; findings are
            given as a range over them.
        choosing: Level of `models` whose persons choose how they steer: the share of them who
            move and wait is shown beside each pattern.
        notes: Further assumptions, by level of the factor that the answer runs over.
    """

    models: str
    choosing: str | None = None
    notes: dict[str, str] = Field(default_factory=dict)


class ScreeningRule(Config):
    """Screening: assumed numbers varied within their bands, to see which move the answer.

    `dva-sim screen` runs it: each trajectory changes one number after the other, so that with `k`
    numbers there are `trajectories` times `k + 1` points, each with both sides of the contrast.

    Attributes:
        over: Keys of assumed numbers, `*` for any part of them; `dva-sim assumed` lists them.
        at: Level of the factor that the answer runs `over`; by default its last.
        trajectories: Number of trajectories.
        persons: Simulated persons at each point, others than the study's.
        replications: Trials of each.
        seed: Random seed of the screening; independent of the study's.
    """

    over: Annotated[tuple[str, ...], Field(min_length=1), AfterValidator(_distinct)] = (
        "operator.*",
        "phone.*",
    )
    at: Level = None
    trajectories: Annotated[int, Field(ge=2, le=1000)] = 8
    persons: Count = 4
    replications: Count = 1
    seed: Seed


DESIGN: dict[str, str] = {
    "part": "part of the study",
    "cell": "position of the configuration in the design, -1 for a reference run",
    "config": "hash of the scenario as run, but for the person",
    "is_reference": "whether the others are measured against this run",
    "person": "simulated person, or with the timed model independent run; the cluster",
    "trial": "of the person; the same random numbers in every cell",
    "seed": "of the run; the same for this person and trial in every cell",
    "parameters": "set of the persons' parameters in a repeat, 0 for the usual ones",
}
