"""The whole story: who responded, how soon, and what became of every event."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.analysis.run_grid import Floats, Setting, Table, as_floats, codes_of
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures import style
from dva_sim.experiments.report.figures.csv_numbers import Numbers
from dva_sim.experiments.report.figures.legend import box, legend
from dva_sim.experiments.report.figures.palette import FATES, Look, looks
from dva_sim.experiments.report.figures.stacks import Stacks, stack
from dva_sim.experiments.report.prose import caption
from dva_sim.experiments.study.parts import Level

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from dva_sim.experiments.report.summary import Reading


_TIMES = {
    "Guard arrives": ("guard", "response_s"),
    "Robot arrives": ("robot", "response_s"),
    "Guard confirms": ("guard", "confirmation_s"),
    "Robot confirms": ("robot", "confirmation_s"),
}


_NAMES = {
    "refuted": "missed: refuted though real",
    "cleared": "cleared as a false alarm",
    "open": "open at the end",
}


_FATES = (  # as they are stacked
    *("confirmed by a robot", "confirmed by a guard", "cleared", "refuted"),
    *("false alarm confirmed", "escalated", "expired", "undetected", "open", "other"),
)


def fates(
    outcome: NDArray[Any], responder_kind: NDArray[Any], is_true: NDArray[np.bool_]
) -> NDArray[np.str_]:
    """Classify each event's outcome, in the words of `_FATES`; unknown outcomes are `other`."""
    words = np.char.add("confirmed by a ", responder_kind.astype(str))
    words = np.where(is_true, words, "false alarm confirmed")
    words = np.where(np.isin(outcome, ("confirmed", "contained")), words, outcome.astype(str))
    words = np.where((words == "refuted") & ~is_true, "cleared", words)
    return np.where(np.isin(words, _FATES), words, "other")


class Events:
    """The events of one part, picked by what they happened under.

    Args:
        table: Columns of the table `events`.
        view: Names the factors and their levels.
    """

    def __init__(self, table: Table, part: str, view: StudyView) -> None:
        rows = {key: np.asarray(values) for key, values in table.items()}
        self.part = part
        here = (rows["part"] == part) & ~rows["is_reference"].astype(bool)
        self.rows = {key: values[here] for key, values in rows.items()}
        self._view = view
        is_true = self.rows.get("is_true", np.ones(len(self), dtype=bool)).astype(bool)
        self._fates = fates(self.rows["outcome"], self.rows["responder_kind"], is_true)
        self._codes = {
            factor.name: (factor, codes_of(self.rows, factor))
            for factor in view.part.factors
            if factor.name in self.rows
        }

    def __len__(self) -> int:
        return len(self.rows["part"])

    def under(self, panel: Setting, line: Level, stop: Level) -> NDArray[np.bool_]:
        """Select the events under these levels `(n,)`."""
        wanted = self._view.setting(panel, line) | style.stop_of(self._view, stop)
        mask = np.ones(len(self), dtype=bool)
        for name, (factor, codes) in self._codes.items():
            mask &= codes == factor.levels.index(wanted[name])
        return mask

    def by(self, responder: str) -> NDArray[np.bool_]:
        """Select the events answered by this kind of responder `(n,)`."""
        return np.asarray(self.rows["responder_kind"].astype(str) == responder)

    def times(self, column: str, mask: NDArray[np.bool_]) -> Floats:
        """The times of some events [s], of those that have one."""
        values = as_floats(self.rows[column])[mask]
        return values[np.isfinite(values)]

    def shares(self, mask: NDArray[np.bool_]) -> dict[str, float]:
        """Share of each fate; they add up to one, or all are nan where nothing happened."""
        if not mask.any():
            return dict.fromkeys(_FATES, np.nan)
        found = self._fates[mask]
        return {fate: float(np.mean(found == fate)) for fate in _FATES}

    def kinds_of_times(self) -> dict[str, tuple[str, str]]:
        """Those of `_TIMES` that at least one event has."""
        return {
            title: (kind, column)
            for title, (kind, column) in _TIMES.items()
            if len(self.times(column, self.by(kind)))
        }

    def one_fate(self) -> str | None:
        """Outcome of every event, if all had the same."""
        found = np.unique(self._fates)
        return str(found[0]) if len(found) == 1 else None


def story_part(table: Table, view: StudyView) -> str | None:
    """The part that tells a story: the one with events that the answer is not about."""
    parts = sorted({str(p) for p in table["part"]})
    others = [part for part in parts if part != view.part.name]
    return next(iter(others or parts), None)


class _Story(style.ReportFigure):
    """Figure of the events of one part."""

    pages = ("driving",)
    tables = ("runs", "events")
    has_panels = True

    def draw(self, view: StudyView, reading: Reading) -> style.Drawn | None:
        """Draw it, where there are events."""
        table = reading.table("events")
        part = story_part(table, view)
        events = Events(table, part, view) if part is not None else None
        return self.drawn(view, events) if events else None

    @abstractmethod
    def drawn(self, view: StudyView, events: Events) -> style.Drawn | None:
        """The figure; None where there is nothing to be seen."""


class StoryTimes(_Story):
    name = "story_times"
    title = "Response, by who responded"

    def drawn(self, view: StudyView, events: Events) -> style.Drawn | None:
        """Draw it."""
        shown, met, numbers = view.shown, events.kinds_of_times(), Numbers()
        if not met:
            return None
        figure, axes = style.panels(len(shown), len(met), 2.4, sharex=True, sharey=True)
        look, fate = looks(view.line), events.one_fate() or ""
        for row, panel in zip(axes, shown, strict=True):
            for ax, (title, (kind, column)) in zip(row, met.items(), strict=True):
                for level, offset in style.dodge(view.lines):
                    masks = [events.by(kind) & events.under(panel, level, v) for v in view.stops]
                    times = [events.times(column, mask) for mask in masks]
                    _quartiles(ax, offset, times, look[level])
                    where = view.setting(panel, level) | {"responder_kind": kind, "time": column}
                    numbers.add(where, view.along_x() | _quantiles(times))
                style.stops_axis(ax, view.over)
                ax.set_title(title if row is axes[0] else "")
        axes[0][0].set_ylim(bottom=0)
        style.outer_labels(axes, shown, "Since detection [s]")
        legend(figure, view.line)
        words = caption("story_times", events=f"{len(events):,}", fate=_NAMES.get(fate, fate))
        title = f"Part {events.part}: response, by who responded"
        return self.finish(figure, words, numbers, title=title)


class StoryOutcomes(_Story):
    name = "story_outcomes"
    title = "What became of the events"

    def drawn(self, view: StudyView, events: Events) -> style.Drawn | None:
        """Draw it."""
        if events.one_fate() is not None:
            return None
        met = events.shares(np.ones(len(events), dtype=bool))
        parts = {_NAMES.get(fate, fate): box(FATES[fate]) for fate in _FATES if met[fate]}
        stacks, numbers = Stacks(view, "Share of events", parts), Numbers()
        counts: list[int] = []
        for ax, panel, level in stacks.panels():
            masks = [events.under(panel, level, v) for v in view.stops]
            shares = [events.shares(mask) for mask in masks]
            counts += [int(mask.sum()) for mask in masks if mask.any()]
            columns = {fate: np.array([share[fate] for share in shares]) for fate in _FATES}
            stack(ax, columns, FATES)
            numbers.add(view.setting(panel, level), view.along_x() | columns)
        stacks.close()
        stacks.axes[0].set_xlim(0, 1)
        stacks.axes[0].set_xticks([0, 0.5, 1])
        stacks.axes[0].xaxis.set_major_formatter(lambda share, _: f"{100 * share:.0f} %")
        few = min(counts)
        facts = {"events": f"{len(events):,}", "share": f"{100 / few:.3g}"}
        words = caption("story_outcomes", part=events.part, few=few, **facts)
        title = f"Part {events.part}: what became of the events"
        return self.finish(stacks.figure, words, numbers, title=title)


def _quartiles(ax: Axes, offset: float, times: list[Floats], look: Look) -> None:
    """Median and middle half of each stop; nothing where nobody came."""
    met = [stop for stop, values in enumerate(times) if len(values)]
    if not met:
        return
    low, middle, high = np.array([np.quantile(times[stop], [0.25, 0.5, 0.75]) for stop in met]).T
    x = np.array(met) + offset
    ax.vlines(x, low, high, color=look.colour, lw=2.4, alpha=0.55)
    ax.plot(x, middle, look.mark, color=look.colour, ms=3.6)


def _quantiles(times: list[Floats]) -> dict[str, Any]:
    """Number of events with a time, and its quartiles [s], at each stop."""
    found = [np.quantile(t, [0.25, 0.5, 0.75]) if len(t) else np.full(3, np.nan) for t in times]
    names = ("p25_s", "p50_s", "p75_s")
    quartiles = {name: [float(q[i]) for q in found] for i, name in enumerate(names)}
    return {"events": [len(t) for t in times]} | quartiles
