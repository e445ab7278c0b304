"""Published data for comparison with operators, and the role of each publication.

Which delays these data cover is said here as well: beyond them, what simulated operators do is
an extrapolation.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import date
from functools import cache
from typing import Annotated, Literal

from pydantic import Field, model_validator

from dva_sim.kernel import resources
from dva_sim.kernel.config import Config, validate
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.yaml_files import load_yaml

FOLDER = "experiments/validation"
TARGETS = "operators"
SPLIT = "operators-split"
HISTORY = "operators-history"

LineKind = Literal["exact", "fitted", "not-fitted", "remembered", "beside"]
Share = Annotated[float, Field(ge=0, le=1)]


class LineConfig(Config):
    """One number to compare with.

    Attributes:
        what: Description of the number.
        unit: Empty for a plain number.
        target: Published value, if a single number was.
        low: Lower end of the passing band; by default anything below `high`.
        high: Upper end of the passing band.
        above: The whole Monte Carlo interval has to lie above this, where the sign is what counts.
        below: The whole Monte Carlo interval has to lie below this.
        beside: True for numbers that are shown but not judged, as they have no band.
    """

    what: str
    unit: str = ""
    target: float | None = None
    low: float | None = None
    high: float | None = None
    above: float | None = None
    below: float | None = None
    beside: bool = False

    @model_validator(mode="after")
    def _in_order(self) -> LineConfig:
        limits = (self.low, self.high, self.above, self.below)
        if self.beside:
            if self.target is None or limits.count(None) < len(limits):
                raise ValueError("a line beside the others has a target and no band")
            return self
        if self.low is None and self.high is None:
            raise ValueError("a line needs low or high; otherwise anything would pass")
        if self.low is not None and self.high is not None and self.low > self.high:
            raise ValueError("low should not be above high")
        return self


class CheckConfig(Config):
    """One published result.

    Attributes:
        metric: Quantity that was measured.
        tag: Certainty of its numbers; the file explains the letters.
        source: The publication, or the derivation.
        lines: Numbers of the check, by name; each gets a verdict of its own.
    """

    metric: str
    tag: str
    source: str
    lines: Annotated[dict[str, LineConfig], Field(min_length=1)]


class SupportConfig(Config):
    """Range of delays that published data cover.

    Attributes:
        strategies: Strategies that the data cover.
        steering: Behaviour observed there: `closed`, steering by what was seen; `waiting`, moving
            and waiting.
        low_s: Shortest delay covered.
        high_s: Longest delay covered.
        why: Source of the data.
    """

    strategies: tuple[str, ...]
    steering: Literal["closed", "waiting"]
    low_s: Annotated[float, Field(ge=0)]
    high_s: Annotated[float, Field(gt=0)]
    why: str


class CurveConfig(Config):
    """Points that people gave, drawn beside what is simulated.

    Attributes:
        what: Description of the points.
        source: The publication.
        x: Conditions.
        y: Values.
        low: Lower ends of intervals; left out: none are known.
        high: Upper ends.
    """

    what: str
    source: str
    x: Annotated[tuple[float, ...], Field(min_length=1)]
    y: tuple[float, ...]
    low: tuple[float, ...] = ()
    high: tuple[float, ...] = ()

    @model_validator(mode="after")
    def _as_many(self) -> CurveConfig:
        intervals = len(self.low), len(self.high)
        if len(self.y) != len(self.x) or intervals not in ((0, 0), (len(self.x), len(self.x))):
            raise ValueError("x, y, low and high should be equally many")
        return self


class TargetFile(Config):
    """The file of targets.

    Attributes:
        description: Description of the file.
        tags: Meanings of the letters of a tag.
        checks: Published results by their short name.
        curves: Points of people by the name of the figure.
        support: Delays that published data cover.
    """

    description: str = ""
    tags: dict[str, str]
    checks: Annotated[dict[str, CheckConfig], Field(min_length=1)]
    curves: dict[str, CurveConfig] = Field(default_factory=dict)
    support: dict[str, SupportConfig]

    @model_validator(mode="after")
    def _known_tags(self) -> TargetFile:
        for name, check in self.checks.items():
            for letter in check.tag.split(","):
                if letter not in self.tags:
                    tags = ", ".join(self.tags)
                    raise ValueError(f"tag {letter!r} of {name} is unknown; known: {tags}")
        return self


class RuleConfig(Config):
    """Conditions for passing a validation: shares of the lines that must pass."""

    exact: Share
    not_fitted: Share


class ComparisonConfig(Config):
    """A comparison of the simulated operators of one day with the published lines.

    Attributes:
        day: Day on which it was made.
        seen: Results that were known before it.
        blind: Publications that were unknown before the comparison.
    """

    day: date
    seen: str
    blind: tuple[str, ...] = ()


class SplitFile(Config):
    """Roles of the checks: lists of checks by publication; and what was compared when.

    Attributes:
        description: Description of the file.
        rule: Rule by which the whole passes.
        strategy: Default strategy of the persons in all tasks.
        strategy_why: Reason for that strategy.
        exact: Checks against theory instead of measured persons.
        fit: May influence parameters; shown, never counted.
        not_fitted: May influence nothing; counted.
        memory: Numbers without a seen source; shown, but not judged.
        comparisons: Comparisons by name, in their order; a table beside has their values.
    """

    description: str = ""
    rule: RuleConfig
    strategy: str
    strategy_why: str = ""
    exact: dict[str, tuple[str, ...]]
    fit: dict[str, tuple[str, ...]]
    not_fitted: dict[str, tuple[str, ...]]
    memory: dict[str, tuple[str, ...]]
    comparisons: dict[str, ComparisonConfig] = Field(default_factory=dict)

    def kinds(self) -> dict[str, LineKind]:
        """Return the kind of each check.

        Raises:
            ConfigError: a check that is assigned twice.
        """
        return {check: kind for check, (kind, _) in self.places().items()}

    def places(self) -> dict[str, tuple[LineKind, str]]:
        """Return the kind of each check, and the publication that it belongs to.

        Raises:
            ConfigError: a check that is assigned twice.
        """
        places: dict[str, tuple[LineKind, str]] = {}
        groups: tuple[tuple[LineKind, dict[str, tuple[str, ...]]], ...] = (
            ("exact", self.exact),
            ("fitted", self.fit),
            ("not-fitted", self.not_fitted),
            ("remembered", self.memory),
        )
        for kind, publications in groups:
            for check, name in ((c, name) for name, own in publications.items() for c in own):
                if check in places:
                    raise ConfigError(f"check {check!r} is assigned twice")
                places[check] = kind, name
        return places


@dataclass(frozen=True)
class TargetLine:
    """One line to judge.

    Attributes:
        check: Short name of the published result.
        name: Name of the line within the check.
        metric: Quantity that the publication measured.
        what: Description of the line.
        source: Source of its numbers.
        tag: Certainty of the numbers.
        kind: Kind of line, which decides if it counts.
        publication: Publication, by which the split groups checks.
        unit: Empty for a plain number.
        target: Published value, if a single number was.
        low: Lower end of the passing band; None: anywhere below `high`.
        high: Upper end of the passing band; None: anywhere above `low`.
        above: The whole interval lies above this; None: it need not.
        below: The whole interval lies below this; None: it need not.
    """

    check: str
    name: str
    metric: str
    what: str
    source: str
    tag: str
    kind: LineKind
    publication: str
    unit: str
    target: float | None
    low: float | None
    high: float | None
    above: float | None = None
    below: float | None = None

    @property
    def id(self) -> str:
        """`check/name`."""
        return f"{self.check}/{self.name}"

    @property
    def has_band(self) -> bool:
        """True if there is a band to judge it by."""
        return self.low is not None or self.high is not None

    def holds(self, value: float) -> bool:
        """Return True if a value lies in the band; nan never does."""
        above = self.low is None or value >= self.low
        return self.has_band and above and (self.high is None or value <= self.high)

    def is_sure(self, low: float, high: float) -> bool:
        """Return True if an interval lies on the required side, if one is required."""
        above = self.above is None or low > self.above
        return above and (self.below is None or high < self.below)


def load_targets(name: str = TARGETS) -> TargetFile:
    """Return the targets, by name or path.

    Raises:
        ConfigError: no such file, or a mistake in it, with its place.
    """
    document = load_yaml(resources.find(name, FOLDER))
    return validate(TargetFile, document.data, document.error)


def load_split(name: str = SPLIT) -> SplitFile:
    """Return the split, by name or path.

    Raises:
        ConfigError: no such file, or a mistake in it, with its place.
    """
    document = load_yaml(resources.find(name, FOLDER))
    split = validate(SplitFile, document.data, document.error)
    try:
        check_comparisons(split)
    except ConfigError as error:
        raise document.error(str(error)) from None
    return split


def check_comparisons(split: SplitFile) -> None:
    """Check that each check has one role, and each publication was blind once at most.

    Raises:
        ConfigError: one has two, or was blind twice, or there is no such publication.
    """
    publications = {name for _, name in split.places().values()}
    seen: set[str] = set()
    for name, comparison in split.comparisons.items():
        for publication in comparison.blind:
            if publication not in publications:
                raise ConfigError(f"comparison {name!r}: no publication is called {publication!r}")
            if publication in seen:
                raise ConfigError(f"publication {publication!r} cannot be blind twice")
            seen.add(publication)


def target_lines(targets: TargetFile, split: SplitFile) -> list[TargetLine]:
    """Return all lines with their kind, in the order of the file of targets.

    Raises:
        ConfigError: a check that is not assigned, or is not there; a tag M that would count.
    """
    places = split.places()
    _complete(targets.checks, split.kinds())
    return [
        TargetLine(
            check=check,
            name=name,
            metric=config.metric,
            what=line.what,
            source=" ".join(config.source.split()),
            tag=config.tag,
            kind="beside" if line.beside else places[check][0],
            publication=places[check][1],
            unit=line.unit,
            target=line.target,
            low=line.low,
            high=line.high,
            above=line.above,
            below=line.below,
        )
        for check, config in targets.checks.items()
        for name, line in config.lines.items()
    ]


def load_history(name: str = HISTORY) -> dict[str, dict[str, float]]:
    """Return the value of each line in each comparison, by line and comparison.

    Raises:
        ConfigError: no such file.
    """
    text = resources.find(name, FOLDER, ".csv").read_text(encoding="utf-8")
    rows = csv.DictReader(text.splitlines())
    return {
        row.pop("line"): {name: float(value) for name, value in row.items() if value}
        for row in rows
    }


def blind_lines(
    lines: Iterable[TargetLine], split: SplitFile, history: Mapping[str, Mapping[str, float]]
) -> dict[str, tuple[int, int]]:
    """Return how many lines held that a comparison saw first, and how many those were.

    Later comparisons of the same lines do not count: by then they had been seen.

    Returns:
        Lines that held and all lines, by the comparison, of those with any.
    """
    counts = {}
    for name, comparison in split.comparisons.items():
        verdicts = [
            line.holds(history[line.id][name])
            for line in lines
            if line.publication in comparison.blind
            and line.has_band
            and name in history.get(line.id, ())
        ]
        if verdicts:
            counts[name] = sum(verdicts), len(verdicts)
    return counts


def _complete(checks: Mapping[str, CheckConfig], kinds: Mapping[str, LineKind]) -> None:
    if missing := [name for name in checks if name not in kinds]:
        raise ConfigError(f"the split does not say what {', '.join(missing)} is for")
    if unknown := [name for name in kinds if name not in checks]:
        raise ConfigError(f"the split names {', '.join(unknown)}, which are not checks")
    for name, check in checks.items():
        if "M" in check.tag.split(",") and kinds[name] != "remembered":
            raise ConfigError(f"{name} is known from memory: it cannot be {kinds[name]}")


@cache
def read_supports(strategy: str) -> tuple[SupportConfig, ...]:
    """Return the ranges known for a strategy, from short delays on; empty without data.

    The delay is that of everything but the person: filter, sampling, link, computers, frames.
    Pointing was watched at lags of up to 0.225 s (MacKenzie & Ware 1993), an excavator at 1.5 s;
    nobody was watched in between.
    """
    supports = [s for s in load_targets().support.values() if strategy in s.strategies]
    return tuple(sorted(supports, key=lambda support: support.low_s))


def ranges(strategy: str, steering: str | None = None) -> tuple[tuple[float, float], ...]:
    """Return delays of the loop at which people were watched, each from and to [s].

    Args:
        strategy: Strategy of the operators.
        steering: `closed` or `waiting`: restricts the data to people who steered so.
    """
    supports = read_supports(strategy)
    return tuple((s.low_s, s.high_s) for s in supports if steering in (None, s.steering))
