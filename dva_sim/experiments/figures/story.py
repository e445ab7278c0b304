"""The whole story: who responded, how soon, and what became of every event."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.effects import (
    Floats,
    Setting,
    Table,
    View,
    as_floats,
    codes_of,
)
from dva_sim.experiments.figures.numbers import Numbers
from dva_sim.experiments.figures.style import (
    Drawn,
    bars,
    colours,
    dodge,
    finish,
    legend,
    outer_labels,
    panels,
    stops_axis,
    wrapped,
)
from dva_sim.experiments.labels import Level, level_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_TIMES = {
    "Guard arrives": ("guard", "response_s"),
    "Robot arrives": ("robot", "response_s"),
    "Guard confirms": ("guard", "confirmation_s"),
    "Robot confirms": ("robot", "confirmation_s"),
}
# What may become of an event, the best first; blue is confirmed.
_FATES = {
    "confirmed by a robot": "#0b559f",
    "confirmed by a guard": "#75b4d8",
    "refuted": "#CC79A7",
    "escalated": "#E69F00",
    "expired": "#8c4a00",
    "undetected": "#3b3b3b",
    "open at the end": "#a8a8a8",
    "other": "#e3e3e3",
}


def fates(outcome: NDArray[Any], responder_kind: NDArray[Any]) -> NDArray[np.str_]:
    """What became of each event, in words of `_FATES`; outcomes it does not know are `other`."""
    words = np.char.add("confirmed by a ", responder_kind.astype(str))
    words = np.where(np.isin(outcome, ("confirmed", "contained")), words, outcome.astype(str))
    words = np.where(words == "open", "open at the end", words)
    return np.where(np.isin(words, list(_FATES)), words, "other")


class Events:
    """The events of one part, picked by what they happened under.

    Args:
        table: Columns of the table `events`.
        part: Which part.
        view: Names the factors and their levels.
    """

    def __init__(self, table: Table, part: str, view: View) -> None:
        rows = {key: np.asarray(values) for key, values in table.items()}
        here = (rows["part"] == part) & ~rows["is_reference"].astype(bool)
        self.rows = {key: values[here] for key, values in rows.items()}
        self._view = view
        self._codes = {
            factor.name: (factor, codes_of(self.rows, factor))
            for factor in view.part.factors
            if factor.name in self.rows
        }

    def __len__(self) -> int:
        return len(self.rows["part"])

    def under(self, panel: Setting, line: Level, stop: Level) -> NDArray[np.bool_]:
        """Which events happened under these levels `(n,)`."""
        view = self._view
        wanted = dict(panel)
        wanted |= {f.name: v for f, v in ((view.line, line), (view.over, stop)) if f}
        mask = np.ones(len(self), dtype=bool)
        for name, (factor, codes) in self._codes.items():
            mask &= codes == factor.levels.index(wanted[name])
        return mask

    def by(self, responder: str) -> NDArray[np.bool_]:
        """Which events were answered by this kind of responder `(n,)`."""
        return np.asarray(self.rows["responder_kind"].astype(str) == responder)

    def times(self, column: str, mask: NDArray[np.bool_]) -> Floats:
        """The times of some events [s], of those that have one."""
        values = as_floats(self.rows[column])[mask]
        return values[np.isfinite(values)]

    def shares(self, mask: NDArray[np.bool_]) -> dict[str, float]:
        """Share of each fate; they add up to one, or all are nan where nothing happened."""
        if not mask.any():
            return dict.fromkeys(_FATES, np.nan)
        found = fates(self.rows["outcome"][mask], self.rows["responder_kind"][mask])
        return {fate: float(np.mean(found == fate)) for fate in _FATES}

    def kinds_of_times(self) -> dict[str, tuple[str, str]]:
        """Those of `_TIMES` that at least one event has."""
        return {
            title: (kind, column)
            for title, (kind, column) in _TIMES.items()
            if len(self.times(column, self.by(kind)))
        }

    def one_fate(self) -> str | None:
        """What became of every event, if it was the same for all."""
        found = np.unique(fates(self.rows["outcome"], self.rows["responder_kind"]))
        return str(found[0]) if len(found) == 1 else None


def story_part(table: Table, view: View) -> str | None:
    """The part that tells a story: the one with events that the answer is not about."""
    parts = sorted({str(p) for p in table["part"]})
    others = [part for part in parts if part != view.part.name]
    return next(iter(others or parts), None)


def responses(view: View, events: Events) -> Drawn | None:
    """Times of the events that were reached, guards and robots apart; of those who came."""
    shown, met, numbers = view.shown, events.kinds_of_times(), Numbers()
    if not met:
        return None
    figure, axes = panels(len(shown), len(met), 2.4, sharex=True, sharey=True)
    paint = colours(view.line)
    for row, panel in zip(axes, shown, strict=True):
        for ax, (title, (kind, column)) in zip(row, met.items(), strict=True):
            for level, offset in dodge(view.lines):
                masks = [events.by(kind) & events.under(panel, level, v) for v in view.stops]
                times = [events.times(column, mask) for mask in masks]
                _quartiles(ax, offset, times, paint[level])
                where = view.setting(panel, level) | {"responder_kind": kind, "time": column}
                numbers.add(where, view.along_x() | _quantiles(times))
            stops_axis(ax, view.over)
            ax.set_title(title if row is axes[0] else "")
    axes[0][0].set_ylim(bottom=0)
    outer_labels(axes, shown, "Since detection [s]")
    legend(figure, view.line, paint)
    caption = (
        "Dot, the median; bar, the middle half. Only events that were reached or confirmed have "
        f"such a time{_what_else_came(events)}."
    )
    return finish(figure, "story_times", "Response, by who responded", caption, numbers)


def outcomes(view: View, events: Events) -> Drawn | None:
    """What became of every event, as shares that add up to one; None if all met one fate."""
    if events.one_fate() is not None:
        return None
    shown, numbers = view.shown, Numbers()
    figure, axes = panels(len(shown), len(view.lines), 2.3, sharex=True, sharey=True)
    for row, panel in zip(axes, shown, strict=True):
        for ax, level in zip(row, view.lines, strict=True):
            shares = [events.shares(events.under(panel, level, v)) for v in view.stops]
            _stack(ax, shares)
            told = {fate: [share[fate] for share in shares] for fate in _FATES}
            numbers.add(view.setting(panel, level), view.along_x() | told)
            stops_axis(ax, view.over)
            if view.line and row is axes[0]:
                ax.set_title(wrapped(level_name(view.line.name, level), 70 // len(view.lines)))
    axes[0][0].yaxis.set_major_formatter(lambda y, _: f"{100 * y:.0f} %")
    axes[0][0].set_ylim(0, 1)
    outer_labels(axes, shown, "Share of events")
    _key(figure, events)
    caption = f"All {len(events):,} events, none left out: each has one of these outcomes."
    return finish(figure, "story_outcomes", "What became of the events", caption, numbers)


def _what_else_came(events: Events) -> str:
    """What became of all events, or where that is to be seen."""
    if (fate := events.one_fate()) is not None:
        return f"; all {len(events):,} were {fate}" if len(events) > 1 else f"; it was {fate}"
    return ", so this is to be read beside the outcomes: a fast median may hide misses"


def _quartiles(ax: Axes, offset: float, times: list[Floats], colour: str) -> None:
    """Median and middle half of each stop; nothing where nobody came."""
    met = [stop for stop, values in enumerate(times) if len(values)]
    if not met:
        return
    low, middle, high = np.array([np.quantile(times[stop], [0.25, 0.5, 0.75]) for stop in met]).T
    x = np.array(met) + offset
    ax.vlines(x, low, high, color=colour, lw=2.4, alpha=0.55)
    ax.plot(x, middle, "o", color=colour, ms=3.2)


def _quantiles(times: list[Floats]) -> dict[str, Any]:
    """How many events of each stop have a time, and its quartiles [s]."""
    found = [np.quantile(t, [0.25, 0.5, 0.75]) if len(t) else np.full(3, np.nan) for t in times]
    names = ("p25_s", "p50_s", "p75_s")
    quartiles = {name: [float(q[i]) for q in found] for i, name in enumerate(names)}
    return {"events": [len(t) for t in times]} | quartiles


def _stack(ax: Axes, shares: list[dict[str, float]]) -> None:
    """A bar for each stop, its fates on top of each other."""
    floor = np.zeros(len(shares))
    for fate, colour in _FATES.items():
        heights = np.nan_to_num([share[fate] for share in shares])
        if heights.any():
            bars(ax, floor, floor + heights, colour)
        floor = floor + heights


def _key(figure: Figure, events: Events) -> None:
    """Name the fates that occur."""
    from matplotlib.patches import Patch

    met = events.shares(np.ones(len(events), dtype=bool))
    handles = [Patch(color=colour, label=fate) for fate, colour in _FATES.items() if met[fate]]
    figure.legend(handles=handles, loc="outside upper left", ncols=4, handlelength=1.2)
