"""Figures of what is exact: delayed loops, and the dissertation's median."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from dva_sim.experiments.figures.style import INK, SOFT, Drawn, finish, panels
from dva_sim.experiments.validation.operators import loops, median
from dva_sim.experiments.validation.operators.exact import SMITH

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_BLUE, _ORANGE, _GREEN = "#0072B2", "#D55E00", "#009E73"
_SHARES = {0.85: _GREEN, 1.0: INK, 1.15: _ORANGE}  # of the critical value
_SHOWN = 24  # delays


def draw_exact() -> list[Drawn]:
    """Both figures."""
    return [_loops(), _median()]


def _loops() -> Drawn:
    figure, [axes] = panels(1, 3, 2.7)
    _around(axes[0], loops.integrator, math.pi / 2, "Cursor: gain x delay")
    _around(axes[1], loops.pure_pursuit, 0.5205, "Pursuit: speed x delay / look-ahead")
    axes[0].set_ylabel("error, first one = 1")
    _smith(axes[2])
    text = (
        "Left and middle: loops that the strategies close themselves just below, at and above the "
        "critical value that theory gives. Right: the strategy Predictor as a Smith predictor "
        "(cursor, gain 4 /s, delay 0.5 s) answers a step as if there were no delay, only later; "
        "the ring is the published value."
    )
    return finish(figure, "loops", "Where delayed loops become unstable", text)


def _around(axes: Axes, loop: loops.Loop, critical: float, title: str) -> None:
    """Errors over time for values around the critical one."""
    times = np.arange(1, _SHOWN * loops.STEPS + 1) / loops.STEPS
    for share, colour in reversed(_SHARES.items()):
        errors = np.array(loop(share * critical))[: len(times)]
        axes.plot(times, errors / abs(errors[0]), color=colour, lw=1.3, label=f"{share:g}")
    axes.set_ylim(-4.2, 4.2)
    axes.set_title(title)
    axes.set_xlabel("time [delays]")
    below = (0.5, -0.22)  # where it hides no curve
    title = "share of the critical value"
    axes.legend(loc="upper center", bbox_to_anchor=below, ncols=3, fontsize=8, title=title)


def _smith(axes: Axes) -> None:
    gain, delay, at = SMITH
    places = np.array(loops.smith_response(gain, delay, 2.0))
    times = np.arange(1, len(places) + 1) * delay / loops.SMITH_STEPS
    theory = np.where(times > delay, 1.0 - np.exp(-gain * (times - delay)), 0.0)
    axes.plot(times, theory, color=SOFT, lw=4, alpha=0.35, label="theory")
    axes.plot(times, places, color=_BLUE, lw=1.3, label="simulated")
    axes.plot([at], [0.982], "o", mfc="none", mec=_ORANGE, ms=9, mew=1.5, label="published")
    axes.set_title("Smith predictor: step")
    axes.set_xlabel("time [s]")
    axes.legend(loc="lower right", fontsize=8)


def _median() -> Drawn:
    figure, [axes] = panels(1, 2, 2.7, width_ratios=[2.2, 1])
    steps, ages = axes
    levels, look = np.array(median.STEP_LEVELS), median.STEP_LOOK
    steps.plot(np.arange(len(levels)) / median.RATE, levels, color=SOFT, lw=1.2, label="asked for")
    for name, colour in ((median.COPY, _BLUE), (median.IN_PLACE, _ORANGE)):
        outputs = median.step_outputs(name)
        times = look * np.arange(1, len(outputs) + 1)
        steps.step(times, outputs, where="post", color=colour, lw=1.8, label=name)
    steps.set_xlabel("time [s]")
    steps.set_ylabel("speed level")
    steps.set_title("Longest delay 0.2 s: frozen, and ratcheting")
    steps.legend(loc="center right", fontsize=8)
    _ages(ages)
    text = (
        "The dissertation's median over 20 slots of which 7 are fresh at a time. A copy that is "
        "sorted never leaves 0; sorting in place keeps the largest values and never comes down. "
        "Right: mean age of the command in force with a longest delay of 0.5 s; grey: published "
        "bands."
    )
    return finish(figure, "median", "The dissertation's filter", text)


def _ages(axes: Axes) -> None:
    bands = {"clean": (0.44, 0.50), "stale": (0.485, 0.545)}
    for place, (name, age) in enumerate(median.ages().items()):
        low, high = bands[name]
        axes.bar([place], [high - low], 0.7, bottom=low, color=SOFT, alpha=0.25, lw=0)
        axes.plot([place], [age], "o", color=_BLUE, ms=7)
        axes.text(place + 0.12, age, f"{age:.3f}", va="center", fontsize=8)
    axes.set_xticks([0, 1], ["fresh slots\nonly", "3 stale\nslots"])
    axes.set_xlim(-0.6, 1.8)
    axes.set_ylim(0.40, 0.58)
    axes.set_ylabel("mean age [s]")
    axes.set_title("Age, longest delay 0.5 s")
