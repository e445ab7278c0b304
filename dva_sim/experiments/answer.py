"""The answer to a study's question, in sentences that claim no more than the runs support."""

from __future__ import annotations

from dataclasses import dataclass, field
from textwrap import wrap

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.answer_places import at, condition, is_ordered, places
from dva_sim.experiments.labels import (
    Level,
    factor_name,
    level_name,
    listing,
    measure_name,
    number,
    percent,
    quantity,
    unit_of,
)

Floats = NDArray[np.float64]

_LEAST = 0.01  # that is not printed as zero


@dataclass(frozen=True)
class Missed:
    """Runs without confirmation under one level, at the hardest condition."""

    line: Level
    missed: int
    runs: int

    @property
    def share(self) -> float:
        """Missed runs as a share of all runs."""
        return self.missed / self.runs if self.runs else float("nan")


@dataclass(frozen=True)
class Finding:
    """A declared contrast as measured: all that the sentences are made from.

    Attributes:
        measure: Column compared; in excess of the reference if `in_excess`.
        factor: Factor whose levels `first` and `second` are compared.
        over: Factor along which the difference is followed, with its `levels` `(k,)`.
        within: Levels of the other factors.
        mean: First minus second, at each level `(k,)`; nan where there is no pair.
        low: Lower edge of the simultaneous 95 % band `(k,)`; nan if none can be given.
        high: Its upper edge `(k,)`.
        persons: How many persons (clusters) the band rests on.
        smallest_effect: Smallest difference declared to matter, in the measure's unit.
        missed: Runs without confirmation at the last level, per level of `factor`.
        horizon: What such a run counts with [s], if all count with the same.
        cluster: What the band rests on: persons, or shifts.
        widest: The greatest difference that is possible; a band of that size says nothing.
        all_confirmed: Whether no run of any cell was missed.
        everywhere: Where a contrast holds that runs over nothing.
        failed: Runs that are missing because they failed.
    """

    measure: str
    in_excess: bool
    factor: str
    first: Level
    second: Level
    over: str
    levels: tuple[Level, ...]
    within: dict[str, Level]
    mean: Floats
    low: Floats
    high: Floats
    persons: int
    smallest_effect: float | None = None
    missed: tuple[Missed, ...] = ()
    horizon: float | None = None
    cluster: str = "person"
    widest: float = np.inf
    all_confirmed: bool = False
    everywhere: str = "throughout"
    failed: int = 0

    @property
    def unit(self) -> str:
        """Unit of the measure."""
        return unit_of(self.measure)


@dataclass(frozen=True)
class Answer:
    """What a reader should take home.

    Attributes:
        lead: The answer in one to three sentences.
        notes: What must be known to read it fairly.
    """

    lead: str
    notes: list[str] = field(default_factory=list)

    def __repr__(self) -> str:
        """To be read: the answer in lines, and how much more there is to know."""
        lines = wrap(self.lead, 100)
        more = f"notes: {len(self.notes)}" if self.notes else ""
        return "\n".join([*lines, more] if more else lines)


def answer(finding: Finding) -> Answer:
    """Say where the difference can be told from zero, how large it is, and what is ruled out."""
    if not np.isfinite(finding.low).any():
        return Answer(_without_band(finding), [*_misses(finding), _what_is_measured(finding)])
    sentences = [*_tellable(finding), *_ruled_out(finding), *_unpaired(finding)]
    notes = [*_misses(finding), f"{_what_is_measured(finding)} {_what_the_band_is(finding)}"]
    return Answer(" ".join(sentences), notes)


def _tellable(f: Finding) -> list[str]:
    """Size and reach of the effect, for each direction in which a level differs from zero."""
    sentences: list[str] = []
    for chosen in (f.low > 0, f.high < 0):
        where = np.flatnonzero(chosen)
        if len(where):
            head = "Elsewhere it turns round: " if sentences else condition(f)
            sentences.append(_capital(f"{head}{_effect(f, where)}"))
    return sentences


def _effect(f: Finding, where: NDArray[np.intp]) -> str:
    """`A takes 4.5 s longer than B at ... (band). The difference can be told from zero ...`."""
    stop = _telling_level(f, where)
    band = f"{number(f.low[stop])} to {quantity(f.high[stop], f.unit)}"
    reach = "only there" if len(where) == 1 < len(f.levels) else places(f, where)
    return (
        f"{_comparison(f, f.mean[stop])} {at(f, [stop])} (95 % Monte Carlo band, given the model: "
        f"{band}). The difference can be told from zero {reach}{_remark_on_size(f, where)}."
    )


def _remark_on_size(f: Finding, where: NDArray[np.intp]) -> str:
    """Real is not yet relevant: say so where the whole band is below what matters."""
    bound = float(np.maximum(abs(f.low[where]), abs(f.high[where])).max())
    if f.smallest_effect is None or bound >= f.smallest_effect:
        return ""
    return f", but stays below the {_declared(f)} declared to matter"


def _ruled_out(f: Finding) -> list[str]:
    """What the runs say where the band holds zero: the same, settled, or still open."""
    bounds = np.maximum(-f.low, f.high)
    holds_zero = (f.low <= 0) & (f.high >= 0)
    limit = np.inf if f.smallest_effect is None else f.smallest_effect
    nowhere = bool((holds_zero == np.isfinite(f.low)).all())
    sentences = [_no_difference(f)] if nowhere else []
    if len(same := np.flatnonzero(holds_zero & (bounds == 0))):
        sentences.append(f"No {f.cluster} fares differently {places(f, same)}.")
    if len(settled := np.flatnonzero(holds_zero & (bounds > 0) & (bounds <= limit))):
        sentences.append(_settled(f, settled, float(bounds[settled].max()), nowhere))
    if len(undecided := np.flatnonzero(holds_zero & (bounds > limit))):
        sentences.append(_undecided(f, undecided, float(bounds[undecided].max())))
    return sentences


def _undecided(f: Finding, where: NDArray[np.intp], bound: float) -> str:
    """Nothing is ruled out: say how large an effect may be, unless as large as it ever can."""
    still = f"The question stays open {places(f, where)}: "
    if bound >= f.widest:
        return f"{still}{f.persons} {f.cluster}s rule out nothing at all; more are needed."
    return (
        f"{still}an effect as large as {quantity(bound, f.unit)} is not ruled out, so more "
        f"{f.cluster}s are needed."
    )


def _settled(f: Finding, where: NDArray[np.intp], bound: float, nowhere: bool) -> str:
    bound = max(bound, _LEAST)
    verdict = f"effect above {quantity(bound, f.unit)} either way is ruled out"
    matters = f", and with it the {_declared(f)} declared to matter" if f.smallest_effect else ""
    if nowhere:
        return f"An {verdict} {places(f, where)}{matters}."
    return f"It cannot be told from zero {places(f, where)}, where an {verdict}{matters}."


def _no_difference(f: Finding) -> str:
    first, second = level_name(f.factor, f.first), level_name(f.factor, f.second)
    anywhere = f" at any {factor_name(f.over)} tried" if f.over else ""
    return _capital(
        f"{condition(f)}no difference between {first} and {second} can be told from zero"
        f"{anywhere} (95 % Monte Carlo band, given the model)."
    )


def _declared(f: Finding) -> str:
    return level_name(f.measure, f.smallest_effect)


def _unpaired(f: Finding) -> list[str]:
    missing = [int(i) for i in np.flatnonzero(~np.isfinite(f.low))]
    return [f"Nothing can be said {at(f, missing)}: runs are missing."] if missing else []


def _without_band(f: Finding) -> str:
    """Without a band: the plain mean of these runs, and no claim beyond them."""
    there = np.flatnonzero(np.isfinite(f.mean))
    if not len(there):
        return "No pair of runs is complete, so the question stays open."
    stop = int(there[-1])
    if f.persons < 2:
        why = f"Too few {f.cluster}s to answer: an interval needs at least two, here is one."
    else:
        why = f"The difference is the same for every {f.cluster}, so that no interval can be given."
    seen = f"{condition(f, inside=True)}{_comparison(f, f.mean[stop])} {at(f, [stop])}"
    return f"{why} In the runs that were made, {seen}."


def _capital(sentence: str) -> str:
    return sentence[:1].upper() + sentence[1:]


def _misses(f: Finding) -> list[str]:
    """Misses are a result of their own: the mean alone would hide them behind the horizon."""
    if not f.missed:
        return []
    every = f"Every event{' of the runs that did not fail' if f.failed else ''} was confirmed"
    if f.all_confirmed:
        return [f"{every}, in every cell."]
    where = at(f, [len(f.levels) - 1])
    if not any(m.missed for m in f.missed):
        return [f"{every} {where}, under each {factor_name(f.factor)}."]
    shares = [
        f"{level_name(f.factor, m.line)} {percent(m.share)} ({m.missed} of {m.runs})"
        for m in f.missed
    ]
    return [f"Not confirmed {where}: {listing(shares)}. {_what_misses_count(f)}"]


def _what_misses_count(f: Finding) -> str:
    if f.measure not in ("drive_time_s", "confirmation_mean_s"):
        return "Such a run counts with what was measured until it ended."
    horizon = f" ({quantity(f.horizon, 's')})" if f.horizon is not None else ""
    return (
        f"Such a run counts with all the time it was given{horizon}, which says less than that "
        "the event was missed."
    )


def _what_is_measured(f: Finding) -> str:
    same = f"the same {f.cluster} and trial"
    excess = f", in excess of the reference run of {same}" if f.in_excess else ""
    return f"Compared is the {measure_name(f.measure)}{excess}, over {_persons(f)}."


def _what_the_band_is(f: Finding) -> str:
    if not f.over:
        return "More runs narrow the band, but do not make the model truer."
    return (
        f"The band covers every {factor_name(f.over)} at once; more runs narrow it, but do not "
        "make the model truer."
    )


def _persons(f: Finding) -> str:
    return f"one simulated {f.cluster}" if f.persons == 1 else f"{f.persons} simulated {f.cluster}s"


def _comparison(f: Finding, difference: float) -> str:
    first, second = level_name(f.factor, f.first), level_name(f.factor, f.second)
    if difference == 0:
        return f"{first} equals {second}"
    size = quantity(abs(difference), f.unit)
    if f.unit == "s" and f.measure == "drive_time_s":
        return f"{first} takes {size} {'longer' if difference > 0 else 'less'} than {second}"
    side = "above" if difference > 0 else "below"
    return f"{first} lies {size} {side} {second}"


def _telling_level(f: Finding, where: NDArray[np.intp]) -> int:
    """The last level of a quantity, for that is the question; else the largest difference."""
    return int(where[-1] if is_ordered(f) else where[np.argmax(abs(f.mean[where]))])


def telling_stop(finding: Finding) -> int | None:
    """The stop of which the answer speaks first; the last with a band where nothing is told."""
    for chosen in (finding.low > 0, finding.high < 0):
        if len(where := np.flatnonzero(chosen)):
            return _telling_level(finding, where)
    there = np.flatnonzero(np.isfinite(finding.low))
    return int(there[-1]) if len(there) else None
