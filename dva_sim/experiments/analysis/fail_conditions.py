"""Conditions that a comparison fails by: `p95(response_s) > 1.05x`, and the verdicts on them.

    CONDITION = STATISTIC ( MEASURE ) [per FACTOR] SIGN BOUND
    STATISTIC = mean | median | min | max | p1 ... p99 | share | missing
    MEASURE   = a column, or TABLE.COLUMN; for a share also with a test: share(response_s > 60 s)
                or share(outcome == 'escalated')
    FACTOR    = a factor that both folders vary, or cell for every cell by itself
    SIGN      = > | >= | < | <=
    BOUND     = 1.05x: so many times what the first folder has; +0.5 s or -0.5 s: so much more or
                less than it; 3 s: that much, whatever the first folder has

The unit may be left out; another of the same quantity (ms for s) is converted. A condition holds
if it does so in any part, and with `per` in any group. Values that are missing are left out;
`missing(MEASURE)` is the share of rows without one.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from decimal import Decimal
from typing import Any, NamedTuple

import numpy as np

from dva_sim.experiments.analysis.matched_results import (
    GateGroup,
    Levels,
    MatchedResults,
    Rows,
    as_numbers,
)
from dva_sim.experiments.results.results import Array
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import unknown
from dva_sim.kernel.units import unit_of

Compare = Callable[[Any, Any], Any]

SIGNS: dict[str, Compare] = {
    ">": operator.gt,
    ">=": operator.ge,
    "<": operator.lt,
    "<=": operator.le,
}
TESTS = SIGNS | {"==": operator.eq, "!=": operator.ne}
_SCALES = {
    "s": {"ms": "0.001", "min": "60", "h": "3600"},
    "m": {"mm": "0.001", "cm": "0.01", "km": "1000"},
    "bit/s": {"kbit/s": "1e3", "Mbit/s": "1e6"},
    "": {"%": "0.01"},
}
_WORD = re.compile(
    r"\s*(?:(?P<number>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)|(?P<text>'[^']*'|\"[^\"]*\")"
    r"|(?P<name>[A-Za-z_%][\w./%]*)|(?P<sign>[<>=!]=|[<>()]))"
)
_SHARES = ("share", "missing")
_STATISTICS = ("mean", "median", "min", "max", *_SHARES)


class Test(NamedTuple):
    """Condition on a value that a share counts, such as `> 3` or `== 'timeout'`."""

    sign: str
    than: float | str


@dataclass(frozen=True)
class Bound:
    """Limit that a statistic is compared with.

    Attributes:
        value: A factor, a difference or a value, in the measure's unit.
        kind: `times` what the first folder has, `more` than it, or `absolute`.
    """

    value: float
    kind: str

    def for_(self, first: float) -> float:
        """Return the bound of the second folder's statistic, given the first one's."""
        return {"times": self.value * first, "more": self.value + first}.get(self.kind, self.value)


@dataclass(frozen=True)
class Gate:
    """A condition as written, read."""

    text: str
    statistic: str
    measure: str
    test: Test | None
    per: str | None
    sign: str
    bound: Bound


class _Reader:
    """The words of a condition, one after the other."""

    def __init__(self, text: str) -> None:
        self.text = text
        self._at = 0
        self.kind = ""
        self.word = ""
        self._begin = 0
        self.next()

    def next(self) -> str:
        """Go on; the word left behind."""
        left = self.word
        rest = self.text[self._at :]
        self._begin = self._at + len(rest) - len(rest.lstrip())
        match = _WORD.match(rest)
        if match is None and rest.strip():
            raise self.error(f"{rest.strip()[0]!r} has no meaning here")
        self.kind = str(match.lastgroup) if match else "end"
        self.word = match[self.kind] if match else ""
        self._at += match.end() if match else 0
        return left

    def take(self, kind: str, among: tuple[str, ...] = (), called: str = "") -> str:
        """Return the next word, which must be of a kind.

        Raises:
            ConfigError: it is not.
        """
        if self.kind != kind or (among and self.word not in among):
            next_word = f"not {self.word!r}" if self.word else "and then it ends"
            raise self.error(f"expected {called or ' or '.join(map(repr, among))}, {next_word}")
        return self.next()

    def error(self, problem: str) -> ConfigError:
        """Return a mistake in the condition, at the word it has come to."""
        return ConfigError(
            f"--fail-if {self.text!r}, column {self._begin + 1}: {problem}; "
            "conditions look like p95(response_s) > 1.05x, "
            "mean(drive_time_s) per cell > +0.5 s, or share(confirmed) < 95 %"
        )


def parse(text: str) -> Gate:
    """Read a condition.

    Raises:
        ConfigError: it is none, told with what was expected.
    """
    words = _Reader(text)
    name = words.word
    if words.kind == "name" and name not in _STATISTICS and percent_of(name) is None:
        raise words.error(unknown("statistic", name, [*_STATISTICS, "p1 to p99"]))
    statistic = words.take("name", called="a statistic")
    words.take("sign", ("(",))
    measure = words.take("name", called="a measure")
    test = _test(words, measure) if statistic == "share" and words.kind == "sign" else None
    words.take("sign", (")",))
    per = None
    if words.word == "per":
        words.next()
        per = words.take("name", called="a factor or cell")
    sign = words.take("sign", tuple(SIGNS))
    unit = "" if statistic in _SHARES else unit_of(measure)
    bound = _bound(words, unit)
    if words.kind != "end":
        raise words.error(f"{words.word!r} is too much")
    return Gate(
        text=text, statistic=statistic, measure=measure, test=test, per=per, sign=sign, bound=bound
    )


def percent_of(statistic: str) -> float | None:
    """Parse a percentile's name: 95 for `p95`; None for other statistics."""
    match = re.fullmatch(r"p(\d\d?(?:\.\d+)?)", statistic)
    return float(match[1]) if match and float(match[1]) else None


def _test(words: _Reader, measure: str) -> Test | None:
    if words.word == ")":
        return None
    sign = words.take("sign", tuple(TESTS))
    if words.kind in ("text", "name"):
        return Test(sign, words.next().strip("'\""))
    text = words.take("number", called="a number or a word")
    return Test(sign, _scaled(text, words, unit_of(measure)))


def _bound(words: _Reader, unit: str) -> Bound:
    text = words.take("number", called="a number")
    if words.word == "x" and text[0] not in "+-":
        words.next()
        return Bound(float(text), "times")
    kind = "more" if text[0] in "+-" else "absolute"
    return Bound(_scaled(text, words, unit), kind)


def _scaled(text: str, words: _Reader, unit: str) -> float:
    """Return a number in the measure's unit, given the unit that stands after it, if any does."""
    if words.kind != "name":
        return float(text)
    scales = {unit: "1"} | _SCALES.get(unit, {})
    if words.word not in scales:
        units = ", ".join(name for name in scales if name) or "none"
        raise words.error(f"unit {words.word!r} does not fit; units: {units}")
    return float(Decimal(text) * Decimal(scales[words.next()]))  # 95 % is 0.95 to the last bit


@dataclass(frozen=True)
class GateVerdict:
    """A gate in one group of cells.

    Attributes:
        gate: The condition.
        part: Name of the part.
        levels: Levels that the cells have in common.
        first: The statistic in the first folder.
        second: The statistic in the second folder.
        bound: Limit for the second folder's statistic.
        missing: Share of the rows without a value, in both.
    """

    gate: Gate
    part: str
    levels: Levels
    first: float
    second: float
    bound: float
    missing: tuple[float, float]

    def __repr__(self) -> str:
        word = "failed" if self.holds else "passed"
        where = ", ".join([self.part, *(f"{name} {level}" for name, level in self.levels)])
        numbers = f"A {self.first:.5g}, B {self.second:.5g}, bound {self.bound:.5g}"
        return f"Verdict({word}: {self.gate.text}; {where}: {numbers})"

    @property
    def holds(self) -> bool:
        """True if the condition holds, so that the comparison fails."""
        return bool(SIGNS[self.gate.sign](self.second, self.bound))


def judge(gate: Gate, comparison: MatchedResults) -> list[GateVerdict]:
    """Look at a condition wherever both folders have cells in common.

    Raises:
        ConfigError: no such measure or factor, or nothing to decide it by.
    """
    try:
        comparison.refuse_distrusted()
        table, column = comparison.find(gate.measure)
        by = None if gate.per is None else () if gate.per == "cell" else (gate.per,)
        verdicts = list(_verdicts(gate, comparison, table, column, comparison.groups(by)))
        if not verdicts:
            raise ConfigError(f"no run of either has a value of {column}")
    except ConfigError as error:
        raise ConfigError(f"--fail-if {gate.text!r}: {error}") from None
    return verdicts


def _verdicts(
    gate: Gate, comparison: MatchedResults, table: str, column: str, groups: Iterator[GateGroup]
) -> Iterator[GateVerdict]:
    for group in groups:
        crashed = [comparison.failed(n, group) for n in (0, 1)]
        if gate.statistic != "missing" and (only_second := len(crashed[1] - crashed[0])):
            raise ConfigError(  # as their values are unknown
                f"in part {group.part} {only_second} runs of the second folder failed that did not "
                "in the first; a condition on missing(...) counts them"
            )
        sides = [_tested(gate, comparison.rows(n, table, column, group), column) for n in (0, 1)]
        if not any(len(_values(gate, side)) for side in sides):
            continue
        shares = [_missing(side, len(runs)) for side, runs in zip(sides, crashed, strict=True)]
        measured = shares
        if gate.statistic != "missing":
            measured = [_computed(gate, side) for side in _both(gate, *sides)]
        first, second = measured
        _refuse_undecided(gate, group, first, second)
        bound = gate.bound.for_(first)
        yield GateVerdict(
            gate=gate,
            part=group.part,
            levels=group.levels,
            first=first,
            second=second,
            bound=bound,
            missing=(shares[0], shares[1]),
        )


def _missing(rows: Rows, crashed: int) -> float:
    """Return the share of the rows without a value; a run that failed is one of them."""
    every = len(rows.values) + crashed
    return float((np.isnan(rows.values).sum() + crashed) / every) if every else 1.0


def _both(gate: Gate, first: Rows, second: Rows) -> tuple[Rows, Rows]:
    """Keep the pairs with a value on both sides, so that missing ones do not rank as best."""
    alone = gate.statistic == "share" or gate.bound.kind == "absolute"
    if alone or first.runs != second.runs:
        return first, second
    in_both = np.isfinite(first.values) & np.isfinite(second.values)
    if not in_both.any():
        return first, second
    return first.where(in_both), second.where(in_both)


def _tested(gate: Gate, rows: Rows, column: str) -> Rows:
    """Return the rows with numbers for values: of a share, whether they pass its test."""
    if gate.test is None and gate.statistic != "missing":
        return as_numbers(rows, column)
    if gate.test is not None and not isinstance(gate.test.than, str):
        rows = as_numbers(rows, column)
    passed = [_passes(gate.test, value) for value in rows.values.tolist()]
    return replace(rows, values=np.array(passed, dtype=float))


def _passes(test: Test | None, value: Any) -> float:
    """Return 1 or 0, or nan for a value that is missing."""
    if value is None or value != value:
        return math.nan
    if test is None:
        return 1.0
    return float(TESTS[test.sign](str(value) if isinstance(test.than, str) else value, test.than))


def _values(gate: Gate, rows: Rows) -> Array:
    if gate.statistic == "missing":
        return np.isnan(rows.values).astype(float)
    return rows.values[~np.isnan(rows.values)]


def _computed(gate: Gate, rows: Rows) -> float:
    values = _values(gate, rows)
    percent = percent_of(gate.statistic)
    if not len(values):
        return math.nan
    if percent is not None:
        return float(np.percentile(values, percent))
    taken: Any = {"median": np.median, "min": np.min, "max": np.max}.get(gate.statistic, np.mean)
    return float(taken(values))


def _refuse_undecided(gate: Gate, group: GateGroup, first: float, second: float) -> None:
    """Refuse a gate that cannot be decided: it must not pass for one that was."""
    where = f"in part {group.part}"
    needs_first = gate.bound.kind != "absolute"
    for side, value in (("first", first), ("second", second)):
        if math.isnan(value) and (side == "second" or needs_first):
            raise ConfigError(f"{where} no run of the {side} folder has a value")
    if gate.bound.kind == "times" and first < 0:
        raise ConfigError(f"{where} the first folder has {first:g}; below zero, name a difference")
