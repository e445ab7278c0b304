"""Number of persons a study needs, estimated from a pilot or an earlier study.

Every number follows one law: the interval or band that the report shows, narrowed as persons are
added.

A claim is shown by an interval that excludes zero (or a margin). An interval of `n`
persons reaches `stretch * t(n - 1) * spread / sqrt(n)` from its mean, where `t` is Student's
quantile at the interval's level. How persons spread and how much farther than Student's their
interval reaches, because they are skewed or because a band covers several levels at once, are
taken from the study at hand: with as many persons as it has, the law gives the very interval that
its report shows.

References:
    Cohen, Statistical Power Analysis for the Behavioral Sciences (1988), chapter 2 (noncentral t).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from dva_sim.experiments.analysis.hypothesis_tests import (
    PairedRuns,
    claims_of,
    contrasts_of,
    pairs_of,
    places_of,
)
from dva_sim.experiments.analysis.run_grid import Floats, Setting, Table
from dva_sim.experiments.analysis.study_view import StudyView, view_of
from dva_sim.experiments.study.parts import ANSWER, Contrast, Hypothesis
from dva_sim.kernel.units import unit_of
from dva_sim.kernel.wording import quantity
from dva_sim.simulation.labels import level_name, measure_of, setting
from dva_sim.statistics import LEVEL, Band, Interval, band, mean_interval, person_means, students_t

POWERS = (0.8, 0.9)
_ALPHA = 1 - LEVEL
MAX_PERSONS = 10_000


@dataclass(frozen=True)
class IntervalLaw:
    """Half-width of an interval as a function of the number of persons.

    Attributes:
        spread: Standard deviation of persons' means.
        persons: From how many it is known.
        level: Two-sided confidence level whose quantile of Student's shrinks with more persons.
        stretch: Half-width of the interval relative to Student's.
    """

    spread: float
    persons: int
    level: float = LEVEL
    stretch: float = 1.0

    def reach(self, persons: int) -> float:
        """Return the distance from the mean to the end of the interval."""
        return self._critical(persons) * self.spread / math.sqrt(persons)

    def power(self, effect: float, persons: int) -> float:
        """Return the chance that an interval over `persons` lies beyond zero at a mean of `effect`.

        Beyond zero means on the side of the effect; the other side does not count.

        Raises:
            ValueError: fewer than two persons.
        """
        if persons < 2:
            raise ValueError(f"a study needs at least 2 persons, not {persons}")
        shift = abs(effect) / self.spread * math.sqrt(persons)
        critical = self._critical(persons)
        below = float(special.nctdtr(persons - 1, shift, critical))
        # Far from all doubt the series does not converge; so many persons are as good as normal.
        return float(special.ndtr(shift - critical)) if math.isnan(below) else 1 - below

    def _critical(self, persons: int) -> float:
        return self.stretch * students_t(self.level, persons)


def law_of(
    values: ArrayLike, person: ArrayLike, reach: float | None = None, level: float = LEVEL
) -> IntervalLaw | None:
    """Return the law that a study's own interval follows; None where its persons are all alike.

    Args:
        values: One value per run `(n,)`, nan where missing: of a comparison, the difference of
            the pair of runs.
        person: Person of each run `(n,)`.
        reach: Half-width of the study's interval or band, towards the side that counts; Student's
            by default.
        level: Level of that interval; for a band, the level of each of its intervals alone
            (Bonferroni).
    """
    means = person_means(values, person)[1]
    if len(means) < 2 or not np.ptp(means) > 0:
        return None
    plain = IntervalLaw(float(means.std(ddof=1)), len(means), level)
    return plain if reach is None else replace(plain, stretch=reach / plain.reach(len(means)))


class Count(NamedTuple):
    """Number of persons needed, with its 95 % interval given the uncertain spread.

    Infinite beyond `MAX_PERSONS`.
    """

    persons: float
    low: float
    high: float


@dataclass(frozen=True)
class SizePlan:
    """Study size needed to show one thing.

    Attributes:
        name: Name of the hypothesis or comparison.
        what: The claim in words.
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
    """A claim as it would be tested: on two sides if it is that an effect is small."""

    name: str
    what: str
    assumed: str
    law: IntervalLaw
    distance: float  # of the true difference from the nearest bound that is tested
    other: float = math.inf  # its distance from the bound on the other side, if there is one
    least: int = 2  # persons without whom the test cannot come out


def plans(
    study: Mapping[str, Any], runs: Table, decided: Collection[str] | None = None
) -> list[SizePlan]:
    """Plan sizes for each hypothesis and other comparison, and for an open answer.

    Args:
        study: Study as the manifest has it.
        runs: The table of runs.
        decided: Names of hypotheses and comparisons that are left out because they need no more.
            None for a pilot, where nothing is left out; without any claim not even an answer
            that is not open.
    """
    claims = claims_of(study)
    named = contrasts_of(study)
    claimed = {claim.comparison for claim in claims.values()}
    unclaimed = {k: c for k, c in named.items() if k not in claimed and k != ANSWER}
    family = _families(study, claims, named)
    in_any_case = decided is None and not claims and not unclaimed
    tests = [
        *_of_answer(view_of(study, runs), in_any_case),
        *_of_claims(study, runs, claims, named, family),
        *_of_comparisons(study, runs, unclaimed, family),
    ]
    return [_plan(test) for test in tests if test.name not in (decided or ())]


def _families(
    study: Mapping[str, Any], claims: Mapping[str, Hypothesis], named: Mapping[str, Contrast]
) -> Counter[str]:
    """Count the tests that share a 5 % error rate: hypotheses and comparisons by family."""
    tests = Counter(named[claim.comparison].family for claim in claims.values())
    for name, contrast in named.items():
        if name != ANSWER:
            tests[contrast.family] += len(places_of(study, contrast))
    return tests


def _of_answer(view: StudyView | None, in_any_case: bool) -> Iterator[_Test]:
    """Yield what settles an answer: the largest difference found, and the smallest that matters.

    The smallest is asked where most persons are needed among the stops that are open.
    """
    if view is None or view.contrast is None or view.series_factor is None:
        return
    differences = view.difference(view.panels[0], *view.contrast)
    bands = band(differences, view.level)
    smallest = view.smallest_effect
    is_judged = np.isfinite(bands.critical)
    if not is_judged.any():
        return
    holds_zero = (bands.low <= 0) & (bands.high >= 0)
    bounds = np.maximum(-bands.low, bands.high)
    is_open = is_judged & holds_zero & (bounds > (smallest or 0.0))
    largest = int(np.where(is_judged, abs(bands.mean), -1.0).argmax())
    effect = abs(float(bands.mean[largest]))
    if (is_open[largest] or in_any_case) and effect > (smallest or 0.0):
        yield _to_settle(view, bands, differences, (largest, effect, "the largest found"))
    if smallest is not None and (is_open.any() or in_any_case):
        stops = np.flatnonzero(is_open) if is_open.any() else [largest]
        aims = [(int(stop), smallest, "the smallest that matters") for stop in stops]
        tests = [_to_settle(view, bands, differences, each) for each in aims]
        yield max(tests, key=lambda test: _plan(test).counts[0].persons)


def _to_settle(
    view: StudyView, bands: Band, differences: Floats, aim: tuple[int, float, str]
) -> _Test:
    """Return the test that shows a difference at a stop not to be zero.

    Args:
        view: View of the study.
        bands: Its differences at all stops, with their band.
        differences: Differences of persons `(persons, stops)`.
        aim: The stop, the true difference that is assumed, and what that is in words.
    """
    stop, effect, why = aim
    mean = float(bands.mean[stop])
    reach = float(bands.high[stop]) - mean if mean < 0 else mean - float(bands.low[stop])
    each = 1 - (1 - view.level) / int(np.isfinite(bands.critical).sum())
    law = law_of(differences[:, stop], np.arange(len(differences)), reach, each)
    assert law is not None  # there is a band
    assumed = f"{quantity(effect, unit_of(view.measure))}, {why}"
    return _Test(ANSWER, f"{_sides_of(view, stop)}: not zero", assumed, law, effect)


def _assumed(largest: float, smallest: float | None) -> Iterator[tuple[float, str]]:
    """Yield true differences that one may count on: that found, if it matters, and the smallest."""
    if largest > (smallest or 0.0):
        yield largest, "the largest found"
    if smallest is not None:
        yield smallest, "the smallest that matters"


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
        level = 1 - 2 * _ALPHA / family[contrast.family]  # one-sided
        if (pairs := pairs_of(study, runs, contrast, at)) is None:
            continue
        interval = _interval(pairs, level)
        unit = unit_of(contrast.measure)
        mean = interval.mean
        is_same = claim.direction == "same"
        side = -1 if claim.direction == "below" else 1
        ends = {-1: interval.high - mean, 1: mean - interval.low}
        law = _law(pairs, max(ends.values()) if is_same else ends[side], level)
        distance = claim.margin - abs(mean) if is_same else side * mean - claim.margin
        what = f"{_sides(contrast, at)}: {_CLAIMS[claim.direction]}{quantity(claim.margin, unit)}"
        assumed = f"{quantity(mean, unit)}, as found"
        if law is not None:
            distance_to_opposite = claim.margin + abs(mean) if is_same else math.inf
            yield _Test(name, what, assumed, law, distance, distance_to_opposite)


_CLAIMS = {"above": "above ", "below": "below \N{MINUS SIGN}", "same": "the same within "}


def _of_comparisons(
    study: Mapping[str, Any], runs: Table, named: Mapping[str, Contrast], family: Counter[str]
) -> Iterator[_Test]:
    for name, contrast in named.items():
        alpha = _ALPHA / family[contrast.family]
        places = [(at, pairs_of(study, runs, contrast, at)) for at in places_of(study, contrast)]
        differences = [
            (_interval(pairs, 1 - alpha), pairs, at) for at, pairs in places if pairs is not None
        ]
        finite = [each for each in differences if math.isfinite(each[0].mean)]
        if not finite:
            continue
        interval, pairs, at = max(finite, key=lambda each: abs(each[0].mean))
        unit = unit_of(contrast.measure)
        reach = interval.mean - interval.low if interval.mean > 0 else interval.high - interval.mean
        if (law := _law(pairs, reach, 1 - alpha)) is None:
            continue
        what = f"{_sides(contrast, at)}: not zero"
        least = math.ceil(math.log2(2 / alpha))  # 2 in 2 ** n ways to swap labels are as far off
        for effect, why in _assumed(abs(interval.mean), contrast.smallest):
            assumed = f"{quantity(effect, unit)}, {why}"
            yield _Test(name, what, assumed, law, effect, least=least)


def _interval(pairs: PairedRuns, level: float) -> Interval:
    """Return the interval of the mean difference at a given level."""
    return mean_interval(pairs.first - pairs.second, pairs.person, level)


def _law(pairs: PairedRuns, reach: float, level: float) -> IntervalLaw | None:
    return law_of(pairs.first - pairs.second, pairs.person, reach, level)


def _plan(test: _Test) -> SizePlan:
    law = test.law

    def chance(persons: int) -> float:
        missed = [1 - law.power(d, persons) for d in (test.distance, test.other) if d < math.inf]
        return 1 - sum(missed)

    powers = POWERS if test.distance > 0 else ()
    counts = tuple(_count(chance, share, law.persons, test.least) for share in powers)
    return SizePlan(test.name, test.what, test.assumed, law.persons, counts)


def _count(chance: Callable[[int], float], power: float, persons_so_far: int, least: int) -> Count:
    """Return the fewest persons with such a chance, and how far a few leave it open."""
    persons = _fewest(chance, power)
    freedom = persons_so_far - 1
    # The sum of squares over the true variance is chi-squared; persons go with the variance.
    low, high = (freedom / special.chdtri(freedom, tail) for tail in (0.025, 0.975))
    counts = (max(count, least) for count in (persons, persons * low, persons * high))
    return Count(*(math.inf if count > MAX_PERSONS else math.ceil(count) for count in counts))


def _fewest(chance: Callable[[int], float], power: float) -> float:
    """Return the fewest, by doubling, then by halves; infinite beyond `MAX_PERSONS`."""
    low = 1
    high = 2
    while chance(high) < power:
        if high > MAX_PERSONS:
            return math.inf
        low = high
        high = 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if chance(middle) >= power else (middle, high)
    return high


def _sides(contrast: Contrast, at: Setting) -> str:
    measure = measure_of(contrast.measure, contrast.part)
    return _difference_text(contrast.factor, contrast.contrast, measure, at)


def _sides_of(view: StudyView, stop: int) -> str:
    assert view.series_factor is not None
    assert view.contrast is not None
    at = dict(view.panels[0]) | view.at_stop(stop)
    measure = measure_of(view.measure, view.part.name)
    return _difference_text(view.series_factor.name, view.contrast, measure, at)


def _difference_text(factor: str, levels: tuple[Any, Any], measure: str, at: Setting) -> str:
    """Return `A minus B in driving time, at delay 1 s`."""
    first, second = (level_name(factor, level) for level in levels)
    where = f", {setting(at)}" if at else ""
    return f"{first} minus {second} in {measure}{where}"
