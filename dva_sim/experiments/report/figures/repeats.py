"""The contrast under other models of the persons: every repeat with its interval."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dva_sim.experiments.analysis.robustness import Repeat, RepeatedAnswer, RepeatedStop
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures import style
from dva_sim.experiments.report.figures.csv_numbers import Numbers, in_units
from dva_sim.experiments.report.figures.palette import FAINT, INK, ONE, PAPER, SOFT
from dva_sim.experiments.report.prose import caption
from dva_sim.experiments.study.parts import STRATEGY
from dva_sim.simulation.labels import factor_name, level_name, measure_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from dva_sim.experiments.report.summary import Reading


_ROW = 0.14  # height of a repeat [in]


_GAP = 1.5  # rows between two strategies


class RepeatsFigure(style.ReportFigure):
    name = "robustness"
    title = "The contrast under other models of the persons"
    pages = ("driving",)

    def draw(self, view: StudyView, reading: Reading) -> style.Drawn | None:
        """Draw it."""
        robustness = reading.robustness
        if robustness is None:
            return None
        stops = [stop for stop in robustness.stops if stop.repeats]
        if not stops or view.contrast is None or view.line is None:
            return None
        rows = max(len(stop.repeats) for stop in stops) + _GAP * (len(robustness.strategies) + 1)
        figure, (axes,) = style.panels(1, len(stops), max(2.4, _ROW * rows + 0.9), sharey=True)
        first, second = (level_name(view.line.name, level) for level in view.contrast)
        for ax, stop in zip(axes, stops, strict=True):
            _own(ax, stop)
            _groups(ax, stop, robustness.strategies)
            ax.set_title(
                f"{factor_name(robustness.over)} {level_name(robustness.over, stop.level)}"
            )
            ax.set_xlabel(style.axis_label(view.measure, f"{first} minus {second}"))
            style.lying(ax)
        is_beyond = any(repeat.is_beyond for stop in stops for repeat in stop.repeats)
        words = caption("robustness", is_beyond=is_beyond)
        title = f"The contrast in {measure_name(view.measure)} under other models of the persons"
        return self.finish(figure, words, _numbers(view, robustness), title=title)


def _numbers(view: StudyView, robustness: RepeatedAnswer) -> Numbers:
    """Every repeat, as drawn."""
    numbers = Numbers()
    for stop in robustness.stops:
        for repeat in stop.repeats:
            edges = {"mean": repeat.mean, "low": repeat.low, "high": repeat.high}
            columns = in_units(view.measure, **edges)
            who = {"strategy": repeat.strategy, "parameters": repeat.parameters}
            flags = {"is_own": repeat.is_own, "is_extrapolated": repeat.is_beyond}
            numbers.row({robustness.over: stop.level}, **who, **columns, **flags)
    return numbers


def _own(ax: Axes, stop: RepeatedStop) -> None:
    if stop.smallest is not None:
        ax.axvspan(-stop.smallest, stop.smallest, color=FAINT, alpha=0.5, lw=0, zorder=0)
    ax.axvspan(stop.low, stop.high, color=ONE.colour, alpha=0.15, lw=0, zorder=0)
    ax.axvline(stop.found, color=ONE.colour, lw=1, zorder=1)
    ax.axvline(0, color=INK, lw=0.8, zorder=1)


def _groups(ax: Axes, stop: RepeatedStop, strategies: tuple[str, ...]) -> None:
    """A block of rows for each strategy, named at its middle."""
    names = strategies or ("",)
    row, ticks = 0.0, []
    for name in names:
        block = sorted((r for r in stop.repeats if r.strategy == name), key=lambda r: r.mean)
        for place, repeat in enumerate(block):
            _row(ax, row + place, repeat)
        ticks.append(row + (len(block) - 1) / 2)
        row += len(block) + _GAP
    ax.set_yticks(ticks, [level_name(STRATEGY, name) if name else "" for name in names])
    ax.set_ylim(row - _GAP, -1)


def _row(ax: Axes, y: float, repeat: Repeat) -> None:
    colour = INK if repeat.is_own else SOFT
    ax.hlines(y, repeat.low, repeat.high, color=colour, lw=1, alpha=0.6)
    usual = repeat.parameters == 0
    edge = colour if repeat.is_beyond else INK if usual else SOFT
    ax.plot(
        repeat.mean,
        y,
        "D" if usual else "o",
        ms=5 if usual else 3.5,
        color=PAPER if repeat.is_beyond else colour,
        mec=edge,
        mew=1.0 if repeat.is_beyond else 0.5,
    )
