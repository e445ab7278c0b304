"""Figures of raw human data: curves of people with their intervals, and ours beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from dva_sim.agents.operator.published import CurveConfig, load_targets
from dva_sim.experiments.report.figures.style import Drawn, panels, styled
from dva_sim.validation.figure import captioned
from dva_sim.validation.operators import experiments as of
from dva_sim.validation.operators.trials import Cells, Floats, person_means, person_medians

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BLUE = "#0072B2"
ORANGE = "#D55E00"


def draw_curves(played: Mapping[str, Cells]) -> list[Drawn]:
    """Return one figure for each kind of raw data."""
    curves = load_targets().curves
    with styled():
        return [
            _moving(curves, played["moving"]),
            _pushed(curves, played["pushed"]),
            _looks(curves, played["heading"], played["looks"]),
        ]


def _people(axes: Axes, curve: CurveConfig, *, joined: bool = True) -> None:
    """Draw points of people, with their intervals where these are known."""
    ends = (
        [np.subtract(curve.y, curve.low), np.subtract(curve.high, curve.y)] if curve.low else None
    )
    axes.errorbar(
        curve.x,
        curve.y,
        yerr=ends,
        fmt="o-" if joined else "o",
        color=ORANGE,
        mfc="none",
        ms=5,
        lw=1.0,
        label="people",
    )


def _ours(axes: Axes, x: Sequence[float], persons: Sequence[Floats], *, log: bool = False) -> None:
    """Draw means over simulated persons with 95 % intervals."""
    values = [np.log(each) if log else each for each in persons]
    means = np.array([each.mean() for each in values])
    halves = np.array([1.96 * each.std(ddof=1) / np.sqrt(len(each)) for each in values])
    low = means - halves
    high = means + halves
    if log:
        means = np.exp(means)
        low = np.exp(low)
        high = np.exp(high)
    ends = [means - low, high - means]
    axes.errorbar(x, means, yerr=ends, fmt="o-", color=BLUE, ms=5, lw=1.2, label="simulated")


def _moving(curves: Mapping[str, CurveConfig], cells: Cells) -> Drawn:
    figure, [[every, slow, presses]] = panels(1, 3, 3.0)
    added = of.ADDED_S
    speeds = of.SPEEDS_MPS
    ratios = [of.moving_ratios(cells, lag, speeds) for lag in added]
    slowest = [of.moving_ratios(cells, lag, speeds[:1]) for lag in added]
    clicks = [
        np.mean([person_means(cells[of.moving_cell(lag, v)], "presses") for v in speeds], axis=0)
        for lag in added
    ]
    panels_of = (
        (every, curves["lag"], ratios, "time, none added = 1", "All targets"),
        (slow, curves["lag-slow"], slowest, "time, none added = 1", "Slow targets"),
    )
    for axes, curve, values, label, title in panels_of:
        _people(axes, curve)
        _ours(axes, added, values, log=True)
        axes.set(xlabel="added lag [s]", ylabel=label, title=title)
    _people(presses, curves["presses"])
    _ours(presses, added, clicks)
    presses.set(xlabel="added lag [s]", ylabel="clicks per hit", title="Misses")
    every.legend(loc="upper left", fontsize=8)
    return captioned(figure, "moving")


def _pushed(curves: Mapping[str, CurveConfig], cells: Cells) -> Drawn:
    figure, [[axes]] = panels(1, 1, 3.0)
    trials = cells["pushed"]
    frequency = person_means(trials, "crossover_rad_s")
    _people(axes, curves["tracking"], joined=False)
    margins = person_means(trials, "phase_margin_deg")
    axes.plot(frequency, margins, "o", color=BLUE, ms=5, label="simulated")
    axes.set(xlabel="crossover frequency [rad/s]", ylabel="phase margin [deg]")
    axes.set_xlim(left=0.0)
    axes.legend(loc="upper right", fontsize=8)
    return captioned(figure, "pushed")


def _looks(curves: Mapping[str, CurveConfig], heading: Cells, looks: Cells) -> Drawn:
    figure, [[left, right]] = panels(1, 2, 3.0)
    errors = heading["heading"].by("heading_error_deg")
    _people(left, curves["heading"])
    medians = [person_medians(own, "reaction_s") for _, own in errors]
    _ours(left, [error for (error,), _ in errors], medians)
    left.set(xlabel="error of the heading [deg]", ylabel="first steering [s]", title="Reaction")
    left.set_ylim(bottom=0.0)
    left.legend(loc="lower left", fontsize=8)
    _people(right, curves["looks"])
    lasted = np.sort(looks["two"]["look_s"])
    right.plot(lasted, np.linspace(0.0, 1.0, len(lasted)), color=BLUE, lw=1.2)
    right.set(xlabel="look [s]", ylabel="share of shorter looks", title="One of two screens")
    right.set_xlim(0.0, 60.0)
    return captioned(figure, "looks")
