"""How many persons a study needs to show what it claims, counted from a pilot or an earlier one."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from dva_sim.experiments.asking import ANSWER, Contrast, Hypothesis
from dva_sim.experiments.contrasts import Pairs, claims_of, contrasts_of, pairs_of, places_of
from dva_sim.experiments.effects import Setting, Table
from dva_sim.experiments.labels import level_name, measure_name, quantity, setting, unit_of
from dva_sim.experiments.statistics import LEVEL, person_means, power

POWERS = (0.8, 0.9)
MOST_PERSONS = 10_000
_ALPHA = 1 - LEVEL


class Count(NamedTuple):
    """How many persons are needed, and what else would fit the spread as known: its 95 % interval.

    Infinite beyond `MOST_PERSONS`.
    """

    persons: float
    low: float
    high: float


@dataclass(frozen=True)
class Plan:
    """What a study would need to show one thing.

    Attributes:
        name: Of the hypothesis or comparison.
        what: Which claim, in words.
        assumed: The true difference that is counted on, in words.
        known_from: Persons from whom the spread is known.
        counts: For each of `POWERS`; none where the claim is not true under what is assumed.
    """

    name: str
    what: str
    assumed: str
    known_from: int
    counts: tuple[Count, ...]


class _Test(NamedTuple):
    """A claim as it would be tested: twice one-sided if it is one of sameness."""

    name: str
    what: str
    assumed: str
    pairs: Pairs
    distance: float  # of the true difference from the bound that is tested
    level: float  # of a two-sided interval that would test it
    is_same: bool = False
    least: int = 2  # persons without whom the test cannot come out


def plans(study: Mapping[str, Any], runs: Table) -> list[Plan]:
    """What each hypothesis and each other comparison would need; the answer if there is none."""
    claims, named = claims_of(study), contrasts_of(study)
    claimed = {claim.comparison for claim in claims.values()}
    others = {k: c for k, c in named.items() if k not in claimed and k != ANSWER}
    if not claims and not others:
        others = {k: c for k, c in named.items() if k == ANSWER}
    family = _families(study, claims, named)
    tests = [
        *_of_claims(study, runs, claims, named, family),
        *_of_comparisons(study, runs, others, family),
    ]
    return [_plan(test) for test in tests]


def _families(
    study: Mapping[str, Any], claims: Mapping[str, Hypothesis], named: Mapping[str, Contrast]
) -> Counter[str]:
    """How many tests share a chance of 5 %; the answer is one of them where it is all there is."""
    tests = Counter(named[claim.comparison].family for claim in claims.values())
    for name, contrast in named.items():
        if name != ANSWER:
            tests[contrast.family] += len(places_of(study, contrast))
    return tests or Counter(contrast.family for contrast in named.values())


def _of_claims(
    study: Mapping[str, Any],
    runs: Table,
    claims: Mapping[str, Hypothesis],
    named: Mapping[str, Contrast],
    family: Counter[str],
) -> Iterator[_Test]:
    for name, claim in claims.items():
        contrast = named[claim.comparison]
        at = places_of(study, contrast)[-1] | claim.at
        if (pairs := _pairs(study, runs, contrast, at)) is None:
            continue
        mean, unit = _mean(pairs), unit_of(contrast.measure)
        side = -1 if claim.direction == "below" else 1
        is_same = claim.direction == "same"
        distance = claim.margin if is_same else side * mean - claim.margin
        what = f"{_sides(contrast, at)}: {_CLAIMS[claim.direction]}{quantity(claim.margin, unit)}"
        assumed = "none at all" if is_same else f"{quantity(mean, unit)}, as found"
        level = 1 - 2 * _ALPHA / family[contrast.family]  # one-sided
        yield _Test(name, what, assumed, pairs, distance, level, is_same)


_CLAIMS = {"above": "above ", "below": "below \N{MINUS SIGN}", "same": "the same within "}


def _of_comparisons(
    study: Mapping[str, Any],
    runs: Table,
    named: Mapping[str, Contrast],
    family: Counter[str],
) -> Iterator[_Test]:
    for name, contrast in named.items():
        at = places_of(study, contrast)[-1]
        if (pairs := _pairs(study, runs, contrast, at)) is None:
            continue
        smallest, unit = contrast.smallest, unit_of(contrast.measure)
        effect = abs(_mean(pairs)) if smallest is None else smallest
        why = "as found" if smallest is None else "the smallest that matters"
        what, assumed = f"{_sides(contrast, at)}: not zero", f"{quantity(effect, unit)}, {why}"
        alpha = _ALPHA / family[contrast.family]
        least = math.ceil(math.log2(2 / alpha))  # 2 in 2 ** n ways to swap labels are as far off
        yield _Test(name, what, assumed, pairs, effect, 1 - alpha, least=least)


def _plan(test: _Test) -> Plan:
    values = test.pairs.first - test.pairs.second
    known = len(person_means(values, test.pairs.person)[0])

    def chance(persons: int) -> float:
        found = power(values, test.pairs.person, test.distance, persons, level=test.level)
        return 2 * found - 1 if test.is_same else found

    wanted = POWERS if test.distance > 0 else ()
    counts = tuple(_count(chance, share, known, test.least) for share in wanted)
    return Plan(test.name, test.what, test.assumed, known, counts)


def _count(chance: Callable[[int], float], wanted: float, known: int, least: int) -> Count:
    """The fewest persons with such a chance, and how far the spread of a few leaves it open."""
    from scipy import special

    persons = _fewest(chance, wanted)
    freedom = known - 1
    # The sum of squares over the true variance is chi-squared; persons go with the variance.
    low, high = (freedom / special.chdtri(freedom, tail) for tail in (0.025, 0.975))
    counts = (persons, persons * low, persons * high)
    return Count(*(_capped(max(count, least)) for count in counts))


def _fewest(chance: Callable[[int], float], wanted: float) -> float:
    """By doubling, then by halves; infinite beyond `MOST_PERSONS`."""
    low, high = 1, 2
    while chance(high) < wanted:
        if high > MOST_PERSONS:
            return math.inf
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if chance(middle) >= wanted else (middle, high)
    return high


def _capped(persons: float) -> float:
    return math.inf if persons > MOST_PERSONS else math.ceil(persons)


def _pairs(study: Mapping[str, Any], runs: Table, contrast: Contrast, at: Setting) -> Pairs | None:
    """Both sides, if at least two persons have a difference and they are not all alike."""
    pairs = pairs_of(study, runs, contrast, at)
    if pairs is None:
        return None
    means = person_means(pairs.first - pairs.second, pairs.person)[1]
    return pairs if len(means) > 1 and np.ptp(means) > 0 else None


def _mean(pairs: Pairs) -> float:
    return float(person_means(pairs.first - pairs.second, pairs.person)[1].mean())


def _sides(contrast: Contrast, at: Setting) -> str:
    first, second = (level_name(contrast.factor, x) for x in contrast.contrast)
    where = f", {setting(at)}" if at else ""
    return f"{first} minus {second} in {measure_name(contrast.measure)}{where}"
