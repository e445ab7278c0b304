"""The answer to a study's question, in at most two sentences that claim no more than was shown."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.analysis.answer import Answer, Finding, OtherRuns
from dva_sim.experiments.analysis.level_phrases import at, condition, is_ordered, places
from dva_sim.kernel.wording import capital, listing, number, percent, quantity, signed
from dva_sim.simulation.labels import factor_name, level_name, measure_called, measure_name, named

_LEAST = 0.01  # that is not printed as zero
EXTRAPOLATED = "extrapolated"


def answer(finding: Finding) -> Answer:
    """Say which side is ahead and by how much, then where it holds and what it depends on."""
    measured = {"Measured": " ".join([_what_is_measured(finding), *_misses(finding)])}
    if not np.isfinite(finding.low).any():
        return Answer(_without_band(finding), measured)
    first, rest = _effect(finding)
    clauses = [*rest, *dependence(finding, is_led=bool(finding.differs.any()))]
    second = f" {capital('; '.join(clauses))}." if clauses else ""
    return Answer(f"{capital(first)}.{second}", measured)


def dependence(f: Finding, is_led: bool = True) -> Iterator[str]:
    """Yield what else the difference depends on: other settings, and models of the persons.

    Args:
        f: The finding.
        is_led: True if the first sentence is about a difference, and so says one of them.
    """
    by_setting = is_led and f.elsewhere is not None and f.elsewhere.turns
    if f.elsewhere is not None and not by_setting:
        count = f.elsewhere.count
        others = "the other setting" if count == 1 else f"the {count} other settings"
        yield f"in {others} tried it is {_reaches(f, f.elsewhere)}"
    if f.models is not None and (by_setting or not is_led):
        over = f"over {f.models.count} other models of the persons"
        yield f"{over} it is {_reaches(f, f.models)}"
    if f.only_model:
        yield f"only one model of the persons was tried ({f.only_model})"


def _effect(f: Finding) -> tuple[str, list[str]]:
    """The first sentence, and the clauses of the second that go with it."""
    if f.differs.any():
        return _difference(f, _telling_level(f, np.flatnonzero(f.differs)))
    if f.has_too_few:
        return _too_small(f), list(_elsewhere(f, but=f.is_open))
    anywhere = f" at any {factor_name(f.over)} tried" if f.over else _after(f.everywhere)
    none = f"no difference between {_first(f)} and {_second(f)} was found{anywhere}"
    is_settled = f.holds_zero & (f.bounds > 0)
    if not is_settled.any():
        return f"{none}{_settings(f)}: both are equal", list(_elsewhere(f, but=f.holds_zero))
    bound = max(float(f.bounds[is_settled].max(initial=0.0)), _LEAST)
    excluded = f"differences above {quantity(bound, f.unit)} are excluded{_less_than_matters(f)}"
    sure = _sure(f, f.holds_zero)
    return f"{none}{_settings(f)}: {excluded} ({sure})", list(_elsewhere(f, but=is_settled))


def _difference(f: Finding, stop: int) -> tuple[str, list[str]]:
    """`A is slower than B: +4.5 s at a delay of 1 s (95 % band 3.0 to 6.0 s)`, and where."""
    where = np.flatnonzero(f.low > 0 if f.mean[stop] > 0 else f.high < 0)
    compared, there = _compared(f, f.mean[stop]), at(f, [stop])
    beyond = f", {EXTRAPOLATED}" if stop in f.outside else ""
    reach = [*_differs(f, where), *_elsewhere(f)]
    if f.elsewhere is not None and f.elsewhere.turns:
        over = f"{_reaches(f, f.elsewhere, own=f.mean[stop])}{_after(there)}"
        first = f"{_depends(f)} on the setting: {over}, over {f.elsewhere.count + 1} settings"
        return f"{first}{beyond}", [f"{condition(f)} it is {_size(f, stop)}", *reach]
    if f.models is not None:
        over = f"{_reaches(f, f.models, own=f.mean[stop])}{_after(there)}{_settings(f)}"
        who = f"{_depends(f)} on the persons" if f.models.turns else compared
        if not f.models.turns and not f.models.low * f.models.high > 0:
            who = f"{who} for the study's own persons, though not for all"
        first = f"{who}: {over}, over {f.models.count + 1} models of the persons{beyond}"
        own = f"with the study's own persons it is {_size(f, stop)}{_remark_on_size(f, where)}"
        return first, [own, *reach]
    size = _size(f, stop, there=f"{_after(there)}{_settings(f)}", beyond=beyond)
    return f"{compared}{_remark_on_size(f, where)}: {size}", reach


def _depends(f: Finding) -> str:
    return f"whether {_sides(f)} depends"


def _sides(f: Finding) -> str:
    """`A or B is faster`, or `the path length is lower with A or with B`."""
    if _is_of_sides(f):
        return f"{_first(f)} or {_second(f)} is {_better(f)}"
    return f"the {measure_name(f.measure)} is {_better(f)} with {_first(f)} or with {_second(f)}"


def _too_small(f: Finding) -> str:
    """`the study is too small to tell whether A or B is faster: ...`."""
    bound = float(f.bounds[f.is_open].max())
    if bound >= f.widest:
        left = f"{f.persons} {f.cluster}s exclude nothing"
    else:
        most = quantity(bound, f.unit)
        left = f"with {f.persons} {f.cluster}s, differences up to {most} are not excluded"
    there = _after(places(f, np.flatnonzero(f.is_open)))
    return (
        f"the study is too small to tell whether {_sides(f)}: {left}{there}{_settings(f)} "
        f"({_sure(f, f.is_open)})"
    )


def _compared(f: Finding, difference: float) -> str:
    """`A is slower than B`, or `with A the path length is higher than with B`."""
    word = _word(f, difference)
    if _is_of_sides(f):
        return f"{_first(f)} is {word} than {_second(f)}"
    return f"with {_first(f)} the {measure_name(f.measure)} is {word} than with {_second(f)}"


def _word(f: Finding, difference: float) -> str:
    """`slower` or `faster`, `longer` or `shorter`, `higher` or `lower`."""
    if _is_of_sides(f):
        return "slower" if difference > 0 else "faster"
    if f.unit == "s":
        return "longer" if difference > 0 else "shorter"
    return "higher" if difference > 0 else "lower"


def _is_of_sides(f: Finding) -> bool:
    """True if the sides can be called faster: their names are words, and a time is awaited."""
    return bool(measure_called(f.measure).awaits) and isinstance(f.first, str)


def _better(f: Finding) -> str:
    return _word(f, -1.0)


def _first(f: Finding) -> str:
    return _side(f, f.first)


def _second(f: Finding) -> str:
    return _side(f, f.second)


def _side(f: Finding, level: str | float | bool | None) -> str:
    """The name of a level; with its factor's where it is no word of its own."""
    return level_name(f.factor, level) if isinstance(level, str) else named(f.factor, level)


def _size(f: Finding, stop: int, *, there: str = "", beyond: str = "") -> str:
    """`+4.5 s at a delay of 1 s (95 % band 3.0 to 6.0 s)`."""
    band = f"{number(float(f.low[stop]))} to {quantity(float(f.high[stop]), f.unit)}"
    return f"{signed(float(f.mean[stop]), f.unit)}{there} (95 % {_interval(f)} {band}{beyond})"


def _sure(f: Finding, chosen: NDArray[np.bool_]) -> str:
    """`95 % band, extrapolated`, of the chosen stops."""
    is_beyond = set(f.outside) & set(np.flatnonzero(chosen).tolist())
    return f"95 % {_interval(f)}{f', {EXTRAPOLATED}' if is_beyond else ''}"


def _interval(f: Finding) -> str:
    """A band covers several levels at once."""
    return "band" if len(f.levels) > 1 else "interval"


def _reaches(f: Finding, others: OtherRuns, own: float | None = None) -> str:
    """`+41.1 to +115 s`: the range over other runs, and the study's own mean."""
    means = [others.low, others.high, *([] if own is None else [float(own)])]
    if others.count == 1 and own is None:
        return signed(others.low, f.unit)
    return f"{signed(min(means), '')} to {signed(max(means), f.unit)}"


def _differs(f: Finding, where: NDArray[np.intp]) -> Iterator[str]:
    """Say at which stops the contrast differs from zero, main direction first."""
    if len(f.levels) == 1:
        return
    word, there = _word(f, f.mean[where[0]]), places(f, where)
    yield f"it is {word} {'only there' if len(where) == 1 else there}"
    other = np.setdiff1d(np.flatnonzero(f.differs), where)
    if len(other):
        stop = _telling_level(f, other)
        peak = f" at {level_name(f.over, f.levels[stop])}" if len(other) > 1 else ""
        yield f"it is {_word(f, f.mean[stop])} {places(f, other)}: {_size(f, stop)}{peak}"


def _remark_on_size(f: Finding, where: NDArray[np.intp]) -> str:
    """Real is not yet relevant: say so where the whole band is below what matters."""
    bound = float(np.maximum(abs(f.low[where]), abs(f.high[where])).max())
    if f.smallest_effect is None or bound >= f.smallest_effect:
        return ""
    return f", but by less than the {_declared(f)} that matter"


def _elsewhere(f: Finding, but: NDArray[np.bool_] | None = None) -> Iterator[str]:
    """Describe the stops where the band includes zero: equal, effect excluded, or undecided.

    Args:
        f: The finding.
        but: Stops of which the first sentence speaks.
    """
    is_equal = f.holds_zero & (f.bounds == 0)
    is_settled = f.holds_zero & ~is_equal & ~f.is_open
    kinds: list[tuple[NDArray[np.bool_], Callable[[float], str]]] = [
        (is_equal, lambda _: "both are equal"),
        (is_settled, partial(_ruled_out, f)),
        (f.is_open, partial(_left_open, f)),
        (~np.isfinite(f.low), lambda _: "runs are missing"),
    ]
    for chosen, clause in kinds:
        where = np.flatnonzero(chosen if but is None else chosen & ~but)
        if len(where):
            there = places(f, where)
            yield f"{there}{there and ', '}{clause(float(f.bounds[where].max()))}"


def _ruled_out(f: Finding, bound: float) -> str:
    return f"differences above {quantity(max(bound, _LEAST), f.unit)} are excluded"


def _less_than_matters(f: Finding) -> str:
    """Said of a null result; where a difference that matters is left, the study is too small."""
    return f", less than the {_declared(f)} that matter" if f.smallest_effect else ""


def _left_open(f: Finding, bound: float) -> str:
    """Say how large an effect could still be, or that the data exclude nothing."""
    if bound >= f.widest:
        return f"it is undecided ({f.persons} {f.cluster}s exclude nothing)"
    return f"it is undecided (differences up to {quantity(bound, f.unit)} are not excluded)"


def _declared(f: Finding) -> str:
    return level_name(f.measure, f.smallest_effect)


def _without_band(f: Finding) -> str:
    """Without a band: the plain mean of these runs, and no claim beyond them."""
    there = np.flatnonzero(np.isfinite(f.mean))
    if not len(there):
        return "No pair of runs is complete, so the question stays open."
    stop = int(there[-1])
    if f.persons < 2:
        why = f"The study is too small to tell: an interval needs two {f.cluster}s, here is one."
    else:
        why = f"The difference is the same for every {f.cluster}, so no interval can be given."
    size, place = signed(float(f.mean[stop]), f.unit), f"{_after(at(f, [stop]))}"
    seen = f"{_compared(f, f.mean[stop])}: {size}"
    if f.mean[stop] == 0:
        seen = f"{_first(f)} equals {_second(f)}"
    return f"{why} In these runs {seen}{place}{_settings(f)}."


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


def _settings(f: Finding) -> str:
    """`, with phone default`: levels of the other factors; nothing without any."""
    return f", {condition(f)}" if f.within else ""


def _what_misses_count(f: Finding) -> str:
    if measure_called(f.measure).awaits != "confirmation":
        return "Such a run counts with what was measured until it ended."
    horizon = f" ({quantity(f.horizon, 's')})" if f.horizon is not None else ""
    return f"Such a run counts with all the time it was given{horizon}."


def _what_is_measured(f: Finding) -> str:
    part = f"in part {f.part}, " if f.part else ""
    excess = ", beyond that of an ideal reference run" if f.in_excess else ""
    return capital(f"{part}the {measure_name(f.measure)}{excess}.")


def _telling_level(f: Finding, where: NDArray[np.intp]) -> int:
    """The last level of a quantity, for that is the question; else the largest difference."""
    return int(where[-1] if is_ordered(f) else where[np.argmax(abs(f.mean[where]))])


def telling_stop(finding: Finding) -> int | None:
    """Return the stop the answer leads with, else the last one that has a band."""
    if finding.differs.any():
        return _telling_level(finding, np.flatnonzero(finding.differs))
    there = np.flatnonzero(np.isfinite(finding.low))
    return int(there[-1]) if len(there) else None
