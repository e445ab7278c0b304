"""The answer to a study's question, in whole sentences that claim no more than was shown."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.analysis.answer import Answer, Finding, OtherRuns
from dva_sim.experiments.report.prose import sentence
from dva_sim.kernel.units import unit_of
from dva_sim.kernel.wording import listing, number, quantity, signed
from dva_sim.simulation.labels import (
    factor_name,
    level_name,
    measure_called,
    measure_name,
    named,
    setting,
)

_SMALLEST_PRINTED = 0.01  # that is not printed as zero


def answer(finding: Finding) -> Answer:
    """Return the leading side and its lead, then where that holds and what it depends on."""
    f = finding
    measured = sentence(
        "measured",
        f=f,
        measure=measure_name(f.measure),
        factor=factor_name(f.factor),
        place=place(f, [len(f.levels) - 1]),
        sides=[(level_name(f.factor, m.level), m) for m in f.missed],
        waits=measure_called(f.measure).awaits == "confirmation",
    )
    stop = telling_stop(f)
    if stop is None:
        lead = _without_band(f)
    else:
        sentences = _difference(f, stop) if f.differs.any() else _no_difference(f)
        lead = " ".join(filter(None, sentences))
    return Answer(lead, {"Measured": measured})


def _difference(f: Finding, stop: int) -> Iterator[str]:
    """Yield the difference with its widest range, where it holds, and what it depends on."""
    where = np.flatnonzero(f.low > 0 if f.mean[stop] > 0 else f.high < 0)
    others = f.elsewhere if f.elsewhere is not None and f.elsewhere.turns else f.models
    bound = float(np.maximum(abs(f.low[where]), abs(f.high[where])).max())
    yield sentence(
        "difference",
        **_facts(f, stop),
        others=others,
        is_of_settings=others is f.elsewhere,
        limits="" if others is None else _limits(f, others, stop),
        levels=_levels_of(f),
        factors=listing([factor_name(name) for name in f.within]),
        beyond=stop in f.outside,
        is_small=f.smallest_effect is not None and bound < f.smallest_effect,
    )
    yield _useful(f)
    if len(f.levels) > 1:
        word = _word(f, f.mean[stop])
        yield sentence("where", word=word, place=place(f, where), is_there=len(where) == 1)
    opposite = np.setdiff1d(np.flatnonzero(f.differs), where)
    if len(opposite):
        turned = _telling_level(f, opposite)
        yield sentence(
            "opposite",
            word=_word(f, f.mean[turned]),
            place=place(f, opposite),
            size=_size(f, turned),
            peak=level_name(f.over, f.levels[turned]) if len(opposite) > 1 else "",
        )
    yield from _elsewhere(f, but=f.differs)
    yield _dependence(f, is_led=True)


def _no_difference(f: Finding) -> Iterator[str]:
    """Yield what is excluded or left open at the leading level, then at the others."""
    is_settled = f.holds_zero & (f.bounds > 0)
    chosen = f.is_open if f.has_too_few else is_settled if is_settled.any() else f.holds_zero
    unsure = f.is_open if f.has_too_few else f.holds_zero
    yield sentence(
        "no_difference",
        **_facts(f, 0),
        bound=float(f.bounds[chosen].max()),
        least=_SMALLEST_PRINTED,
        place=place(f, np.flatnonzero(f.is_open)) if f.has_too_few else f.everywhere,
        over=factor_name(f.over),
        beyond=bool(set(f.outside) & set(np.flatnonzero(unsure).tolist())),
    )
    yield _useful(f)
    yield from _elsewhere(f, but=chosen)
    yield _dependence(f, is_led=False)


def _useful(f: Finding) -> str:
    """Say up to which count more are shown to help, on both sides; empty without counts."""
    sides = [
        f"{'not beyond' if n == f.levels[0] else 'up to'} {level_name(f.over, n)} "
        f"with {_side(f, side)}"
        for side, n in f.useful
    ]
    return sentence("useful", factor=factor_name(f.over), sides=sides) if sides else ""


def _elsewhere(f: Finding, but: NDArray[np.bool_]) -> Iterator[str]:
    """Describe the other stops where the band includes zero: equal, excluded, or undecided."""
    is_equal = f.holds_zero & (f.bounds == 0)
    kinds = {
        "equal": is_equal,
        "excluded": f.holds_zero & ~is_equal & ~f.is_open,
        "open": f.is_open,
        "missing": ~np.isfinite(f.low),
    }
    for kind, chosen in kinds.items():
        where = np.flatnonzero(chosen & ~but)
        if len(where):
            bound = max(float(f.bounds[where].max()), _SMALLEST_PRINTED)
            yield sentence("elsewhere", f=f, kind=kind, place=place(f, where), bound=bound)


def _dependence(f: Finding, is_led: bool) -> str:
    """Say what else the difference depends on: other settings, and models of the persons.

    Args:
        f: The finding.
        is_led: True if the first sentence is about a difference, and so says one of them.
    """
    by_setting = is_led and f.elsewhere is not None and f.elsewhere.turns
    elsewhere = None if by_setting else f.elsewhere
    models = f.models if by_setting or not is_led else None
    return sentence(
        "dependence",
        f=f,
        elsewhere="" if elsewhere is None else _limits(f, elsewhere),
        levels="" if elsewhere is None else other_levels(f, elsewhere.count),
        models="" if models is None else _limits(f, models),
    )


def _without_band(f: Finding) -> str:
    """Return the plain mean of these runs, without a band and without a claim beyond them."""
    stops = np.flatnonzero(np.isfinite(f.mean))
    if not len(stops):
        return sentence("no_pair")
    stop = int(stops[-1])
    return sentence("without_band", **_facts(f, stop), mean=float(f.mean[stop]))


def _facts(f: Finding, stop: int) -> dict[str, object]:
    """Return names of measure, sides and levels, and the difference at a stop."""
    return {
        "f": f,
        "measure": measure_name(f.measure),
        "word": _word(f, f.mean[stop]),
        "better": _word(f, -1.0),
        "first": _side(f, f.first),
        "second": _side(f, f.second),
        "there": place(f, [stop]),
        "settings": setting(f.within),
        "size": _size(f, stop),
        "band": _interval(f),
        "matters": level_name(f.measure, f.smallest_effect),
    }


def _word(f: Finding, difference: float) -> str:
    longer, shorter = ("longer", "shorter") if f.unit == "s" else ("higher", "lower")
    return longer if difference > 0 else shorter


def _side(f: Finding, level: str | float | bool | None) -> str:
    """Return the name of a level; with its factor's where it would be ambiguous."""
    return level_name(f.factor, level) if isinstance(level, str) else named(f.factor, level)


def _size(f: Finding, stop: int) -> str:
    """Return `+4.5 s (95 % band 3.0 to 6.0 s, extrapolated)`; without a band the mean alone."""
    mean = signed(float(f.mean[stop]), f.unit)
    if not np.isfinite(f.low[stop]):
        return mean
    band = f"{number(float(f.low[stop]))} to {quantity(float(f.high[stop]), f.unit)}"
    return f"{mean} (95 % {_interval(f)} {band})"


def _interval(f: Finding) -> str:
    """Return a band covers several levels at once."""
    return "band" if len(f.levels) > 1 else "interval"


def _limits(f: Finding, others: OtherRuns, stop: int | None = None) -> str:
    """Return `+3.8 to +14.9 s (95 % limits.

    Means +5.1 to +14.4 s)`: the widest range that is meant.

    Args:
        f: The finding.
        others: The contrast in other runs.
        stop: Stop whose own band and mean count as well; None: those of the others alone.
    """
    stops = slice(0) if stop is None else slice(stop, stop + 1)
    low = min([others.low, *f.low[stops]])
    high = max([others.high, *f.high[stops]])
    means = [*others.means, *f.mean[stops]]
    mean = f"mean{'s' if min(means) < max(means) else ''} {_range(min(means), max(means), f.unit)}"
    return f"{_range(low, high, f.unit)} (95 % limits; {mean})"


def _range(low: float, high: float, unit: str) -> str:
    return signed(high, unit) if low == high else f"{signed(low, '')} to {signed(high, unit)}"


def other_levels(f: Finding, count: int) -> str:
    """Return `3 other levels of phone`: the levels beside the answer's, by their factors' names."""
    return f"{f'{count} ' if count > 1 else ''}other {_levels_of(f, count)}"


def _levels_of(f: Finding, count: int = 2) -> str:
    """Return `levels of phone`, or `combinations of phone and control`."""
    one = "combination" if len(f.within) > 1 else "level"
    return f"{one}{'s' * (count > 1)} of {listing([factor_name(name) for name in f.within])}"


def _telling_level(f: Finding, where: NDArray[np.intp]) -> int:
    """Return the last level of a quantity, for that is the question.

    Else the largest difference.
    """
    return int(where[-1] if _is_ordered(f) else where[np.argmax(abs(f.mean[where]))])


def telling_stop(finding: Finding) -> int | None:
    """Return the stop the answer leads with, else the last one that has a band."""
    if finding.differs.any():
        return _telling_level(finding, np.flatnonzero(finding.differs))
    stops = np.flatnonzero(np.isfinite(finding.low))
    return int(stops[-1]) if len(stops) else None


def place(f: Finding, where: Sequence[int] | NDArray[np.intp]) -> str:
    """Return `at one-way delay 1 s`, `from 250 ms on`, or else; empty without an axis."""
    if not f.over:
        return f.everywhere
    levels = [f.levels[int(stop)] for stop in where]
    names = [level_name(f.over, level) for level in levels]
    if len(levels) == 1:
        return f"{'at' if unit_of(f.over) else 'with'} {named(f.over, levels[0])}"
    if len(levels) == len(f.levels):
        return f"at every level of {factor_name(f.over)} tried"
    if _is_ordered(f) and levels == list(f.levels[-len(levels) :]):
        return f"from {names[0]} on"
    if _is_ordered(f) and levels == list(f.levels[: len(levels)]):
        return f"up to {names[-1]}"
    return f"at {factor_name(f.over)} {listing(names)}"


def _is_ordered(f: Finding) -> bool:
    """Return True if the levels are ascending quantities."""
    values = [v for v in f.levels if isinstance(v, int | float)]
    return len(values) == len(f.levels) and values == sorted(values)
