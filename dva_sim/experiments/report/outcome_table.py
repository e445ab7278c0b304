"""Outcomes of events in a report: the answer's contrast in words, and a table."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from dva_sim.experiments.analysis.answer import Finding
from dva_sim.experiments.analysis.competing_risks import CLEARED, CONFIRMED, NOTHING, Ended, Endings
from dva_sim.experiments.analysis.level_phrases import place_of
from dva_sim.experiments.analysis.run_grid import Setting
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.cell_table import CellTable
from dva_sim.experiments.report.prose import note
from dva_sim.experiments.study.parts import Level
from dva_sim.kernel.wording import capital, listing, number, percent, quantity
from dva_sim.simulation.labels import factor_name, level_name, setting
from dva_sim.statistics import Interval


def sentences(endings: Endings, view: StudyView, finding: Finding | None) -> list[str]:
    """The contrast at the last stop at which not all went right; nothing without one."""
    if finding is None:
        return []
    sides = (finding.first, finding.second)
    stops = [stop for stop in view.stops if not _all_right(endings, sides, stop)]
    if not stops:
        return [
            f"In part {finding.part} the first event of every run was confirmed at the levels "
            "that the answer compares; at the others not all were."
        ]
    stop = stops[-1]
    text = "; ".join(_side(view, endings.at(level, stop)) for level in sides)
    where = place_of(finding, view.stops.index(stop))
    when = f"by {quantity(endings.horizon, 's')} after the report"
    there = ", ".join(filter(None, (f"in part {finding.part}", where, when)))
    return [f"{capital(there)}: {text}.{_apart(endings, finding, stop)}"]


def in_a_line(endings: Endings, part: str, failed: int = 0) -> str:
    """Say that everything went right in a part, failed runs excepted."""
    every = f"every event{' whose run did not fail' if failed else ''} was confirmed"
    cleared = ", and every false alarm cleared" if CLEARED in endings.ways else ""
    return f"In part {part} {every}{cleared}."


def table(endings: Endings, view: StudyView, cluster: str) -> CellTable:
    """Share of each way, line by line at each stop at which not all went right.

    If there is no such stop where the answer looks, elsewhere.
    """
    panels = view.panels[:1]
    if not (places := _places(endings, view, panels)):
        panels = view.panels[1:]
        places = _places(endings, view, panels)
    rows = [
        [*map(_level, setting), str(ended.events), *map(_share, ended.shares.values())]
        for panel, stop in places[:_MOST_PLACES]
        for setting, ended in _rows(endings, view, panel, stop)
        if ended.events
    ]
    names = [f.name for f in (view.over, view.line) if f is not None]
    if panels != view.panels[:1]:
        names = [*view.panels[0], *names]
    factors = [factor_name(name) for name in names]
    last = f"nothing by {quantity(endings.horizon, 's')}"
    heads = [*factors, "events", *(last if w == NOTHING else w for w in endings.ways)]
    where = setting(view.panels[0]) if panels == view.panels[:1] else ""
    facts = {"where": where, "has_drives": view.part.has("confirmed")}
    text = note("endings", cluster=cluster, **facts, shown=_MOST_PLACES, places=len(places))
    return CellTable(view.part.name, heads, len(factors), rows, note=text)


_MOST_PLACES = 12


def _places(
    endings: Endings, view: StudyView, panels: Sequence[Setting]
) -> list[tuple[Setting, Level]]:
    """Panels and stops where not everything went right."""
    return [
        (panel, stop)
        for panel in panels
        for stop in view.stops
        if not _all_right(endings, view.lines, stop, panel)
    ]


def _rows(
    endings: Endings, view: StudyView, panel: Setting, stop: Level
) -> Iterator[tuple[list[tuple[str, Level]], Ended]]:
    """Each line there, with the levels that name it."""
    named = list(panel.items()) if panel != view.panels[0] else []
    named += [(view.over.name, stop)] if view.over else []
    for line in view.lines:
        own = [(view.line.name, line)] if view.line else []
        yield [*named, *own], endings.at(line, stop, panel)


def _level(named: tuple[str, Level]) -> str:
    return level_name(*named)


def _all_right(
    endings: Endings, lines: Sequence[Level], stop: Level, panel: Setting | None = None
) -> bool:
    return all(bool(endings.is_right[endings.under(line, stop, panel)].all()) for line in lines)


def _side(view: StudyView, ended: Ended) -> str:
    """`REQ/REP confirmed 83 % (60 to 94 %), link lost 17 % (6 to 40 %)`."""
    name = level_name(view.line.name, ended.line) if view.line else "all"
    clauses = [
        f"{way} {_share(share)}"
        for way, share in ended.shares.items()
        if share.mean > 0 or way == CONFIRMED
    ]
    return f"{name}: {listing(clauses)}"


def _apart(endings: Endings, finding: Finding, stop: Level) -> str:
    """Difference between the shares confirmed, in percentage points."""
    found = endings.difference(finding.first, finding.second, stop)
    if not np.isfinite(found.low) or found.mean == 0:
        return ""
    first, second = (level_name(finding.factor, x) for x in (finding.first, finding.second))
    sign = 1 if found.mean > 0 else -1
    low, high = sorted(sign * max(-1.0, min(end, 1.0)) for end in (found.low, found.high))
    ends = f" ({number(100 * low)} to {number(100 * high)})" if low < high else ""
    return (
        f" In the share confirmed {first} lies {number(100 * abs(found.mean))} percentage points "
        f"{'above' if sign > 0 else 'below'} {second}{ends}."
    )


def _share(found: Interval) -> str:
    """With its interval, where there are enough persons for one."""
    if not np.isfinite(found.low):
        return percent(found.mean)
    low = percent(found.low).removesuffix("\N{NO-BREAK SPACE}%")
    return f"{percent(found.mean)} ({low} to {percent(found.high)})"
