"""Endings and their times: competing causes, stacked so that they fill the whole."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.analysis.competing_risks import NOTHING, Endings
from dva_sim.experiments.analysis.run_grid import Floats
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures import style
from dva_sim.experiments.report.figures.csv_numbers import Numbers
from dva_sim.experiments.report.figures.legend import box, key
from dva_sim.experiments.report.figures.palette import FATES, PAPER, Fill
from dva_sim.experiments.report.prose import caption
from dva_sim.experiments.study.parts import Level
from dva_sim.kernel.wording import capital
from dva_sim.simulation.labels import brief, level_name
from dva_sim.statistics import CUT, incidence

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from dva_sim.experiments.report.summary import Reading


_MAX_STOPS = 4
_MAX_LINES = 3
_POINTS = 241
_TITLE = 70  # characters that the width holds


class EndingsInTime(style.ReportFigure):
    name = "endings"
    title = "How it ended, and when"
    pages = ("driving",)
    tables = ("runs", "events")

    def draw(self, view: StudyView, reading: Reading) -> style.Drawn | None:
        """Draw the figure."""
        endings = reading.endings
        if endings is None:
            return None
        with_failures = [
            level for level in view.series if not _all_right(endings, [level], view.stops)
        ]
        levels = tuple(dict.fromkeys([*(view.contrast or ()), *with_failures]))[:_MAX_LINES]
        stops = [stop for stop in view.stops if not _all_right(endings, levels, [stop])][
            -_MAX_STOPS:
        ]
        if not stops:
            return None
        figure, axes = style.panels(len(levels), len(stops), 1.9, sharex=True, sharey=True)
        times = np.linspace(0.0, endings.horizon, _POINTS)
        numbers = Numbers()
        for row, level in zip(axes, levels, strict=True):
            for ax, stop in zip(row, stops, strict=True):
                mask = endings.under(level, stop)
                if mask.any():
                    shares = _shares(endings, mask, times)
                    stack_in_time(ax, shares, times)
                    where = view.setting(view.panels[0], level) | style.stop_of(view, stop)
                    numbers.add(where, {"t_s": times} | shares)
                ax.grid(False)
            name = level_name(view.series_factor.name, level) if view.series_factor else ""
            words = style.wrapped(name, 24)
            row[0].set_ylabel(f"{words}\nshare of events".strip())
        axes[0][0].set(xlim=(0, endings.horizon), ylim=(0, 1))
        axes[0][0].yaxis.set_major_formatter(lambda y, _: f"{100 * y:.0f} %")
        for ax, stop in zip(axes[0], stops, strict=True):
            ax.set_title(
                style.wrapped(capital(brief(style.stop_of(view, stop))), _TITLE // len(stops))
            )
        for ax in axes[-1]:
            ax.set_xlabel("Since the report [s]")
        key(
            figure,
            [box(FATES[ending]) for ending in endings.ways],
            ["nothing yet" if ending == NOTHING else ending for ending in endings.ways],
        )
        words = caption("endings", part=view.part.name, place=brief(view.panels[0]))
        return self.finish(figure, words, numbers)


def _all_right(endings: Endings, lines: Sequence[Level], stops: Sequence[Level]) -> bool:
    places = itertools.product(lines, stops)
    return all(bool(endings.is_right[endings.under(*address)].all()) for address in places)


def _shares(endings: Endings, mask: NDArray[np.bool_], times: Floats) -> dict[str, Floats]:
    """Cumulative incidence of each way at some times, and the share to which nothing happened."""
    ways = endings.ways[:-1]
    codes = {ending: number for number, ending in enumerate(ways, 1)}
    causes = np.array([codes.get(ending, CUT) for ending in endings.way[mask]], dtype=np.intp)
    curve = incidence(endings.time[mask], causes, len(ways))
    shares = {ending: curve.at(times, code) for code, ending in enumerate(ways, 1)}
    return shares | {NOTHING: 1.0 - sum(shares.values(), np.zeros_like(times))}


def stack_in_time(
    ax: Axes, shares: dict[str, Floats], times: Floats, fills: Mapping[str, Fill] = FATES
) -> None:
    """Stack shares that add up to one, one above the other."""
    floor = np.zeros_like(times)
    for ending, share in shares.items():
        fill = fills[ending]
        top = floor + share
        look: dict[str, Any] = {"facecolor": fill.colour, "hatch": fill.hatch, "edgecolor": PAPER}
        ax.fill_between(times, floor, top, step="post", lw=0.6, **look)
        floor = top
