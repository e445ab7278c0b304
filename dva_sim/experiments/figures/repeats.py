"""The contrast under other models of the persons: every repeat with its interval."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dva_sim.experiments.asking import STRATEGY
from dva_sim.experiments.effects import Factor, View
from dva_sim.experiments.figures.numbers import Numbers, with_unit
from dva_sim.experiments.figures.palette import FAINT, INK, ONE, PAPER, SOFT, colours
from dva_sim.experiments.figures.style import (
    Drawn,
    axis_label,
    finish,
    panels,
)
from dva_sim.experiments.labels import factor_name, level_name, measure_name
from dva_sim.experiments.robustness import Repeat, Robustness, Stop

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_ROW = 0.14  # height of a repeat [in]
_GAP = 1.5  # rows between two strategies


def repeats(view: View, robustness: Robustness) -> Drawn | None:
    """Effect and interval of every repeat, by strategy, sorted; the study's own as a band."""
    stops = [stop for stop in robustness.stops if stop.repeats]
    if not stops or view.contrast is None or view.line is None:
        return None
    rows = max(len(stop.repeats) for stop in stops) + _GAP * (len(robustness.strategies) + 1)
    figure, (axes,) = panels(1, len(stops), max(2.4, _ROW * rows + 0.9), sharey=True)
    first, second = (level_name(view.line.name, level) for level in view.contrast)
    for ax, stop in zip(axes, stops, strict=True):
        _own(ax, stop)
        _groups(ax, stop, robustness.strategies)
        ax.set_title(f"{factor_name(robustness.over)} {level_name(robustness.over, stop.level)}")
        ax.set_xlabel(axis_label(view.measure, f"{first} minus {second}"))
        ax.grid(axis="x")
        ax.grid(axis="y", visible=False)
    caption = (
        "Each row: the difference under one model of the persons, with its own 95 % interval. "
        "Diamonds have the usual parameters, dots another set. Line and blue band: the study's "
        "own result; black: its own model again, which does not count. Grey: declared too small "
        "to matter. Repeats have fewer persons, so their intervals are wider."
    )
    if any(repeat.is_beyond for stop in stops for repeat in stop.repeats):
        caption += " Hollow: extrapolated."
    title = f"The contrast in {measure_name(view.measure)} under other models of the persons"
    return finish(figure, "robustness", title, caption, _numbers(view, robustness))


def _numbers(view: View, robustness: Robustness) -> Numbers:
    """Every repeat, as drawn."""
    numbers = Numbers()
    for stop in robustness.stops:
        for repeat in stop.repeats:
            edges = {"mean": repeat.mean, "low": repeat.low, "high": repeat.high}
            told = {with_unit(name, view.measure): value for name, value in edges.items()}
            who = {"strategy": repeat.strategy, "parameters": repeat.parameters}
            flags = {"is_own": repeat.is_own, "is_extrapolated": repeat.is_beyond}
            numbers.row({robustness.over: stop.level}, **who, **told, **flags)
    return numbers


def _own(ax: Axes, stop: Stop) -> None:
    if stop.smallest is not None:
        ax.axvspan(-stop.smallest, stop.smallest, color=FAINT, alpha=0.5, lw=0, zorder=0)
    ax.axvspan(stop.low, stop.high, color=ONE.colour, alpha=0.15, lw=0, zorder=0)
    ax.axvline(stop.found, color=ONE.colour, lw=1, zorder=1)
    ax.axvline(0, color=INK, lw=0.8, zorder=1)


def _groups(ax: Axes, stop: Stop, strategies: tuple[str, ...]) -> None:
    """A block of rows for each strategy, named at its middle."""
    names = strategies or ("",)
    paint = colours(Factor(STRATEGY, names))
    row, ticks = 0.0, []
    for name in names:
        block = sorted((r for r in stop.repeats if r.strategy == name), key=lambda r: r.mean)
        for place, repeat in enumerate(block):
            _row(ax, row + place, repeat, paint[name])
        ticks.append(row + (len(block) - 1) / 2)
        row += len(block) + _GAP
    ax.set_yticks(ticks, [level_name(STRATEGY, name) if name else "" for name in names])
    ax.set_ylim(row - _GAP, -1)


def _row(ax: Axes, y: float, repeat: Repeat, colour: str) -> None:
    colour = INK if repeat.is_own else colour
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
