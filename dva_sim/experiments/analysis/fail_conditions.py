"""Conditions that a comparison fails by: `p95(response_s) > 1.05x`, read word by word.

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

import operator
import re
from collections.abc import Callable
from dataclasses import dataclass
from decimal import Decimal
from typing import Any, NamedTuple

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
        """The bound of the second folder's statistic, given the first one's."""
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
        found = _WORD.match(rest)
        if found is None and rest.strip():
            raise self.error(f"{rest.strip()[0]!r} has no meaning here")
        self.kind = str(found.lastgroup) if found else "end"
        self.word = found[self.kind] if found else ""
        self._at += found.end() if found else 0
        return left

    def take(self, kind: str, among: tuple[str, ...] = (), called: str = "") -> str:
        """The next word, which must be of a kind.

        Raises:
            ConfigError: it is not.
        """
        if self.kind != kind or (among and self.word not in among):
            found = f"not {self.word!r}" if self.word else "and then it ends"
            raise self.error(f"expected {called or ' or '.join(map(repr, among))}, {found}")
        return self.next()

    def error(self, problem: str) -> ConfigError:
        """A mistake in the condition, at the word it has come to."""
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
    statistic = _statistic(words)
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
    found = re.fullmatch(r"p(\d\d?(?:\.\d+)?)", statistic)
    return float(found[1]) if found and float(found[1]) else None


def _statistic(words: _Reader) -> str:
    name = words.word
    if words.kind == "name" and name not in _STATISTICS and percent_of(name) is None:
        raise words.error(unknown("statistic", name, [*_STATISTICS, "p1 to p99"]))
    return words.take("name", called="a statistic")


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
    """A number in the measure's unit, given the unit that stands after it, if any does."""
    if words.kind != "name":
        return float(text)
    scales = {unit: "1"} | _SCALES.get(unit, {})
    if words.word not in scales:
        known = ", ".join(name for name in scales if name) or "none"
        raise words.error(f"unit {words.word!r} does not fit; units: {known}")
    return float(Decimal(text) * Decimal(scales[words.next()]))  # 95 % is 0.95 to the last bit
