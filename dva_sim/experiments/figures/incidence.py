"""How it ended, and when: the ways compete, so they are stacked and fill the whole."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.dispatch.outcomes import CUT, incidence
from dva_sim.experiments.effects import Floats, Setting, View
from dva_sim.experiments.endings import NOTHING, Endings
from dva_sim.experiments.figures.keys import box, key
from dva_sim.experiments.figures.numbers import Numbers
from dva_sim.experiments.figures.palette import FATES, PAPER
from dva_sim.experiments.figures.style import Drawn, finish, panels, wrapped
from dva_sim.experiments.labels import Level, brief, capital, level_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MOST_STOPS, _MOST_LINES, _POINTS = 4, 3, 241
_TITLE = 70  # characters that the width holds


def endings_in_time(endings: Endings, view: View) -> Drawn | None:
    """Cumulative incidence of each way, stacked; None where all went right."""
    lines = _lines(endings, view)
    stops = [stop for stop in view.stops if not _all_right(endings, lines, [stop])][-_MOST_STOPS:]
    if not stops:
        return None
    figure, axes = panels(len(lines), len(stops), 1.9, sharex=True, sharey=True)
    times, numbers = np.linspace(0.0, endings.horizon, _POINTS), Numbers()
    for row, line in zip(axes, lines, strict=True):
        for ax, stop in zip(row, stops, strict=True):
            mask = endings.under(line, stop)
            if mask.any():
                shares = _shares(endings, mask, times)
                _stack(ax, shares, times)
                where = view.setting(view.panels[0], line) | _stop(view, stop)
                numbers.add(where, {"t_s": times} | shares)
            ax.grid(False)
        name = level_name(view.line.name, line) if view.line else ""
        row[0].set_ylabel(f"{wrapped(name, 24)}\nshare of events".strip())
    axes[0][0].set(xlim=(0, endings.horizon), ylim=(0, 1))
    axes[0][0].yaxis.set_major_formatter(lambda y, _: f"{100 * y:.0f} %")
    for ax, stop in zip(axes[0], stops, strict=True):
        ax.set_title(wrapped(capital(brief(_stop(view, stop))), _TITLE // len(stops)))
    for ax in axes[-1]:
        ax.set_xlabel("Since the report [s]")
    key(figure, [box(FATES[way]) for way in endings.ways], [_named(w) for w in endings.ways])
    place = f" with {brief(view.panels[0])}" if view.panels[0] else ""
    caption = (
        f"Share of the events of part {view.part.name}{place} that had ended in each way by each "
        "moment (cumulative incidence, Aalen-Johansen), where not all were confirmed. The shares "
        "at the right edge stand in the table, with intervals."
    )
    return finish(figure, "endings", "How it ended, and when", caption, numbers)


def _lines(endings: Endings, view: View) -> tuple[Level, ...]:
    """The two that are compared, and others of which not all went right."""
    others = [line for line in view.lines if not _all_right(endings, [line], view.stops)]
    return tuple(dict.fromkeys([*(view.contrast or ()), *others]))[:_MOST_LINES]


def _all_right(endings: Endings, lines: Sequence[Level], stops: Sequence[Level]) -> bool:
    places = itertools.product(lines, stops)
    return all(bool(endings.is_right[endings.under(*place)].all()) for place in places)


def _stop(view: View, stop: Level) -> Setting:
    return {view.over.name: stop} if view.over else {}


def _shares(endings: Endings, mask: NDArray[np.bool_], times: Floats) -> dict[str, Floats]:
    """Cumulative incidence of each way at some times, and the share to which nothing happened."""
    ways = endings.ways[:-1]
    codes = {way: number for number, way in enumerate(ways, 1)}
    causes = np.array([codes.get(way, CUT) for way in endings.way[mask]], dtype=np.intp)
    curve = incidence(endings.time[mask], causes, len(ways))
    shares = {way: curve.at(times, code) for way, code in codes.items()}
    return shares | {NOTHING: 1.0 - sum(shares.values(), np.zeros_like(times))}


def _stack(ax: Axes, shares: dict[str, Floats], times: Floats) -> None:
    floor = np.zeros_like(times)
    for way, share in shares.items():
        fill, top = FATES[way], floor + share
        look: dict[str, Any] = {"facecolor": fill.colour, "hatch": fill.hatch, "edgecolor": PAPER}
        ax.fill_between(times, floor, top, step="post", lw=0.6, **look)
        floor = top


def _named(way: str) -> str:
    return "nothing yet" if way == NOTHING else way
