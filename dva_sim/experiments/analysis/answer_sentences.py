"""The answer to a study's question, in sentences that claim no more than the runs support."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.analysis.answer import Answer, Finding, too_few
from dva_sim.experiments.analysis.level_phrases import at, condition, is_ordered, places
from dva_sim.kernel.wording import capital, listing, number, percent, quantity
from dva_sim.simulation.labels import factor_name, level_name, measure_called, measure_name

_LEAST = 0.01  # that is not printed as zero


def answer(finding: Finding) -> Answer:
    """Say how large the difference is, where it differs from zero, and what is ruled out."""
    measured = {"Measured": " ".join([_what_is_measured(finding), *_misses(finding)])}
    if not np.isfinite(finding.low).any():
        return Answer(_without_band(finding), measured)
    return Answer(f"{_effect(finding)} {_reach(finding)}".strip(), measured)


def _effect(f: Finding) -> str:
    """`A takes 4.5 s longer than B at 1 s (95 % band 3.0 to 6.0 s).`, or that there is none."""
    where = np.flatnonzero(f.low > 0) if (f.low > 0).any() else np.flatnonzero(f.high < 0)
    if len(where):
        return capital(f"{condition(f)}{_size(f, _telling_level(f, where))}.")
    first, second = level_name(f.factor, f.first), level_name(f.factor, f.second)
    if f.has_too_few:
        place = f", {condition(f, inside=True)}".removesuffix(", ")
        few = f"{too_few(f.persons, f.cluster)} whether {first} and {second} differ"
        return capital(f"{few}{place} (95 % {_interval_name(f)}).")
    anywhere = f" at any {factor_name(f.over)} tried" if f.over else ""
    return capital(
        f"{condition(f)}no difference between {first} and {second} was found{anywhere} "
        f"(95 % {_interval_name(f)})."
    )


def _size(f: Finding, stop: int) -> str:
    """`A takes 4.5 s longer than B at a one-way delay of 1 s (95 % band 3.0 to 6.0 s)`.

    The band of `4.5 s less` is given as `3.0 to 6.0 s`.
    """
    side = -1 if f.mean[stop] < 0 else 1
    low, high = sorted((side * float(f.low[stop]), side * float(f.high[stop])))
    ends = f"{number(low)} to {quantity(high, f.unit)}"
    comparison = f"{_comparison(f, f.mean[stop])}{_after(at(f, [stop]))}"
    return f"{comparison} (95 % {_interval_name(f)} {ends})"


def _interval_name(f: Finding) -> str:
    """A band covers several levels at once."""
    return "band" if len(f.levels) > 1 else "interval"


def _reach(f: Finding) -> str:
    """One sentence: where it differs from zero, and what holds elsewhere."""
    clauses = [*_differs(f), *_elsewhere(f)]
    return capital("; ".join(clauses)) + "." if clauses else ""


def _differs(f: Finding) -> list[str]:
    """Say at which stops the contrast differs from zero, main direction first."""
    found = [np.flatnonzero(chosen) for chosen in (f.low > 0, f.high < 0) if chosen.any()]
    if not found:
        return []
    where = found[0]
    there = "only there" if len(where) == 1 < len(f.levels) else places(f, where)
    clauses = [f"it differs from zero{_after(there)}{_remark_on_size(f, where)}"]
    if len(found) > 1:
        stop = _telling_level(f, found[1])
        clauses.append(f"it is the other way round {places(f, found[1])}: {_size(f, stop)}")
    return clauses


def _remark_on_size(f: Finding, where: NDArray[np.intp]) -> str:
    """Real is not yet relevant: say so where the whole band is below what matters."""
    bound = float(np.maximum(abs(f.low[where]), abs(f.high[where])).max())
    if f.smallest_effect is None or bound >= f.smallest_effect:
        return ""
    return f", but stays below the {_declared(f)} declared to matter"


def _elsewhere(f: Finding) -> Iterator[str]:
    """Describe the stops where the band includes zero: equal, effect ruled out, or open."""
    is_equal = f.holds_zero & (f.bounds == 0)
    is_settled = f.holds_zero & ~is_equal & ~f.is_open
    kinds: list[tuple[NDArray[np.bool_], Callable[[float], str]]] = [
        (is_equal, lambda _: "both are equal"),
        (is_settled, partial(_ruled_out, f)),
        (f.is_open, partial(_left_open, f)),
        (~np.isfinite(f.low), lambda _: "runs are missing"),
    ]
    for chosen, clause in kinds:
        where = np.flatnonzero(chosen)
        if len(where):
            yield f"{places(f, where)} {clause(float(f.bounds[where].max()))}".lstrip()


def _ruled_out(f: Finding, bound: float) -> str:
    matters = f", less than the {_declared(f)} declared to matter" if f.smallest_effect else ""
    return f"any effect is below {quantity(max(bound, _LEAST), f.unit)}{matters}"


def _left_open(f: Finding, bound: float) -> str:
    """Say how large an effect could still be, or that the data rule out nothing."""
    if bound >= f.widest:
        why = f"{f.persons} {f.cluster}s rule out nothing at all, more are needed"
    else:
        why = f"up to {quantity(bound, f.unit)} is not ruled out, so more {f.cluster}s are needed"
    return f"the question stays open: {why}"


def _declared(f: Finding) -> str:
    return level_name(f.measure, f.smallest_effect)


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
    place = _after(at(f, [stop]))
    seen = f"{condition(f, inside=True)}{_comparison(f, f.mean[stop])}{place}"
    return f"{why} In the runs that were made, {seen}."


def _misses(f: Finding) -> list[str]:
    """Misses are a result of their own: the mean alone would hide them behind the horizon."""
    if not f.missed:
        return []
    part = f"in part {f.part} " if f.part else ""
    every = capital(f"{part}the first event of every run{' that did not fail' if f.failed else ''}")
    where = _after(at(f, [len(f.levels) - 1]))
    if f.all_confirmed:
        return [f"{every} was confirmed."]
    if not any(m.missed for m in f.missed):
        return [f"{every} was confirmed{where}, under each {factor_name(f.factor)}."]
    shares = [
        f"{level_name(f.factor, m.line)} {percent(m.share)} ({m.missed} of {m.runs})"
        for m in f.missed
    ]
    unseen = capital(f"{part}not confirmed{where}: {listing(shares)}.")
    return [unseen, _what_misses_count(f)]


def _after(where: str) -> str:
    """A place behind other words; nothing where there is none."""
    return f" {where}" if where else ""


def _what_misses_count(f: Finding) -> str:
    if measure_called(f.measure).awaits != "confirmation":
        return "Such a run counts with what was measured until it ended."
    horizon = f" ({quantity(f.horizon, 's')})" if f.horizon is not None else ""
    return f"Such a run counts with all the time it was given{horizon}."


def _what_is_measured(f: Finding) -> str:
    part = f"in part {f.part}, " if f.part else ""
    excess = f", beyond that of the {f.cluster}'s own reference run" if f.in_excess else ""
    return capital(f"{part}the {measure_name(f.measure)}{excess}.")


def _comparison(f: Finding, difference: float) -> str:
    first, second = level_name(f.factor, f.first), level_name(f.factor, f.second)
    if difference == 0:
        return f"{first} equals {second}"
    size = quantity(abs(difference), f.unit)
    if measure_called(f.measure).awaits:
        return f"{first} takes {size} {'longer' if difference > 0 else 'less'} than {second}"
    side = "above" if difference > 0 else "below"
    return f"{first} lies {size} {side} {second}"


def _telling_level(f: Finding, where: NDArray[np.intp]) -> int:
    """The last level of a quantity, for that is the question; else the largest difference."""
    return int(where[-1] if is_ordered(f) else where[np.argmax(abs(f.mean[where]))])


def telling_stop(finding: Finding) -> int | None:
    """Return the stop the answer leads with, else the last one that has a band."""
    for chosen in (finding.low > 0, finding.high < 0):
        if len(where := np.flatnonzero(chosen)):
            return _telling_level(finding, where)
    there = np.flatnonzero(np.isfinite(finding.low))
    return int(there[-1]) if len(there) else None
