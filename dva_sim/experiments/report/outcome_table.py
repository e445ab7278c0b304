"""Outcomes of events in a report: the answer's contrast in words, a table, and all in a line."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.analysis.answer import Finding
from dva_sim.experiments.analysis.competing_risks import CLEARED, CONFIRMED, NOTHING, Ended, Endings
from dva_sim.experiments.analysis.run_grid import Setting
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.answer_sentences import place
from dva_sim.experiments.report.cell_table import CellTable
from dva_sim.experiments.report.prose import note, sentence
from dva_sim.experiments.study.parts import Level
from dva_sim.kernel.wording import listing, number, percent, quantity
from dva_sim.simulation.labels import factor_name, level_name, setting
from dva_sim.statistics import Interval


def sentences(endings: Endings, view: StudyView, finding: Finding | None) -> list[str]:
    """Return the contrast at the last stop at which not all went right; nothing without one."""
    if finding is None:
        return []
    sides = (finding.first, finding.second)
    stops = [stop for stop in view.stops if not _all_right(endings, sides, stop)]
    if not stops:
        return [sentence("endings_right", part=finding.part)]
    stop = stops[-1]
    within = f"with {setting(finding.within)}" if finding.within else ""
    levels = [level_name(finding.factor, side) for side in sides]
    difference = endings.difference(*sides, stop)
    sign = 1 if difference.mean > 0 else -1
    low, high = sorted(sign * max(-1.0, min(end, 1.0)) for end in (difference.low, difference.high))
    is_known = bool(np.isfinite(difference.low) and difference.mean != 0)
    return [
        sentence(
            "endings",
            part=finding.part,
            place=", ".join(filter(None, (within, place(finding, [view.stops.index(stop)])))),
            horizon=quantity(endings.horizon, "s"),
            sides=[_side(view, endings.at(level, stop)) for level in sides],
            first=levels[0],
            second=levels[1],
            direction="above" if sign > 0 else "below",
            points=number(100 * abs(difference.mean)) if is_known else "",
            ends=f"{number(100 * low)} to {number(100 * high)}" if low < high else "",
        )
    ]


def in_a_line(endings: Endings, part: str, failed: int = 0) -> str:
    """Say that everything went right in a part, failed runs excepted."""
    return sentence("all_right", part=part, failed=failed, cleared=CLEARED in endings.ways)


def table(endings: Endings, view: StudyView, cluster: str) -> CellTable:
    """Return the share of each way, line by line at each stop at which not all went right.

    If there is no such stop where the answer looks, elsewhere.
    """
    panels = view.panels[:1]
    if not (places := _places(endings, view, panels)):
        panels = view.panels[1:]
        places = _places(endings, view, panels)
    rows = [
        [*map(_level, setting), str(ended.events), *map(_share, ended.shares.values())]
        for panel, stop in places[:_MAX_PLACES]
        for setting, ended in _rows(endings, view, panel, stop)
        if ended.events
    ]
    names = [f.name for f in (view.over, view.series_factor) if f is not None]
    if panels != view.panels[:1]:
        names = [*view.panels[0], *names]
    factors = [factor_name(name) for name in names]
    last = f"nothing by {quantity(endings.horizon, 's')}"
    heads = [*factors, "events", *(last if w == NOTHING else w for w in endings.ways)]
    where = setting(view.panels[0]) if panels == view.panels[:1] else ""
    facts = {"where": where, "has_drives": view.part.has("confirmed")}
    text = note("endings", cluster=cluster, **facts, shown=_MAX_PLACES, places=len(places))
    return CellTable(view.part.name, heads, len(factors), rows, note=text)


_MAX_PLACES = 12


def _places(
    endings: Endings, view: StudyView, panels: Sequence[Setting]
) -> list[tuple[Setting, Level]]:
    """Return panels and stops where not everything went right."""
    return [
        (panel, stop)
        for panel in panels
        for stop in view.stops
        if not _all_right(endings, view.series, stop, panel)
    ]


def _rows(
    endings: Endings, view: StudyView, panel: Setting, stop: Level
) -> Iterator[tuple[list[tuple[str, Level]], Ended]]:
    """Yield each line there, with the levels that name it."""
    named = list(panel.items()) if panel != view.panels[0] else []
    named += [(view.over.name, stop)] if view.over else []
    for level_of_series in view.series:
        level = [(view.series_factor.name, level_of_series)] if view.series_factor else []
        yield [*named, *level], endings.at(level_of_series, stop, panel)


def _level(named: tuple[str, Level]) -> str:
    return level_name(*named)


def _all_right(
    endings: Endings, levels: Sequence[Level], stop: Level, panel: Setting | None = None
) -> bool:
    return all(bool(endings.is_right[endings.under(level, stop, panel)].all()) for level in levels)


def _side(view: StudyView, ended: Ended) -> str:
    """Return `REQ/REP confirmed 83 % (60 to 94 %), link lost 17 % (6 to 40 %)`."""
    name = level_name(view.series_factor.name, ended.level) if view.series_factor else "all"
    clauses = [
        f"{ending} {_share(share)}"
        for ending, share in ended.shares.items()
        if share.mean > 0 or ending == CONFIRMED
    ]
    return f"{name}: {listing(clauses)}"


def _share(interval: Interval) -> str:
    """Return a share with its interval, where there are enough persons for one."""
    if not np.isfinite(interval.low):
        return percent(interval.mean)
    low = percent(interval.low).removesuffix("\N{NO-BREAK SPACE}%")
    return f"{percent(interval.mean)} ({low} to {percent(interval.high)})"


_SEEN = "confirmed", "contained"
_LEFT = {
    "escalated": "escalated",
    "expired": "expired",
    "open": "still open at the end",
    "undetected": "never reported",
}


class EventOutcomes(NamedTuple):
    """Counts of events by outcome.

    Attributes:
        real: Events that were no false alarms.
        confirmed: Real ones that were confirmed.
        missed: Real ones that were refuted, by kind and by who looked.
        left: Other real ones, by what became of them.
        false_alarms: Number of false alarms.
        believed: False alarms that were confirmed.
    """

    real: int
    confirmed: int
    missed: Counter[tuple[str, str]]
    left: Counter[str]
    false_alarms: int
    believed: int

    @property
    def warns(self) -> bool:
        """Return True if an event was missed or a false alarm was taken for real."""
        return bool(self.missed or self.believed)

    def __str__(self) -> str:
        """Return `Events: 288, of which 263 were confirmed, 23 missed (real but refuted: ...)`."""
        return sentence(
            "events",
            e=self,
            missed=[_looked(*key, n) for key, n in self.missed.most_common()],
            left=[(_LEFT.get(outcome, outcome), n) for outcome, n in self.left.most_common()],
        )


def _looked(kind: str, responder: str, number: int) -> str:
    if number == 1:
        return f"1 {kind.replace('_', ' ')} inspected by a {responder}"
    return f"{number} {kind.replace('_', ' ')}s inspected by {responder}s"


def outcomes_of(events: Mapping[str, NDArray[Any]]) -> EventOutcomes | None:
    """Count the events of a table by outcome; None if it has no events or no outcomes."""
    if "outcome" not in events or "is_true" not in events or not len(events["outcome"]):
        return None
    real = np.asarray(events["is_true"]) == True  # noqa: E712  (True, False or missing)
    outcome = np.asarray(events["outcome"])
    confirmed = np.isin(outcome, _SEEN)
    missed = real & (outcome == "refuted")
    kinds = np.asarray(events["kind"])
    whose = np.asarray(events["responder_kind"])
    return EventOutcomes(
        real=int(real.sum()),
        confirmed=int((real & confirmed).sum()),
        missed=Counter(zip(map(str, kinds[missed]), map(str, whose[missed]), strict=True)),
        left=Counter(map(str, outcome[real & ~confirmed & ~missed])),
        false_alarms=int((~real).sum()),
        believed=int((~real & confirmed).sum()),
    )
