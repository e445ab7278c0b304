"""One trial of a task as a picture: the way that was taken, and the speed over time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dva_sim.experiments.report.figures.palette import FAINT, INK, LOOKS, SOFT
from dva_sim.experiments.report.figures.style import panels, styled
from dva_sim.kernel.wording import capital
from dva_sim.simulation.measures.commands import Row
from dva_sim.simulation.task import TaskScenario, Trace, trace_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


LONGEST = 30.0  # of what moves on a line, in a picture [s]
SMOOTH = (0.5, 1.0, 1.0, 1.0, 0.5)  # speeds are averaged so: readings of a device come in steps
BODY_EVERY = 3.0  # half widths of a body between those that are drawn
PATH = LOOKS[0].colour
TOUCHED = LOOKS[1].colour


class LengthUnit(NamedTuple):
    """Unit of length used in a figure."""

    name: str
    per_m: float


def draw_trial(scenario: TaskScenario, seed: int, path: Path, number: int = 0) -> None:
    """Draw one trial: the way that was taken, and the speed over time.

    Args:
        scenario: The task.
        seed: Seed of the block.
        path: Output file; its suffix decides the format.
        number: Number of the trial among those kept.
    """
    with styled():
        trial_figure(scenario, *trace_of(scenario, seed, number)).savefig(path)


def trial_figure(scenario: TaskScenario, row: Row, trace: Trace) -> Figure:
    """Draw a trial: its path, and speed over time.

    Args:
        scenario: The task.
        row: Measures of the trial.
        trace: Recorded motion of the trial.
    """
    points = [*trace.places, *((x, y) for x, y, _ in trace.marks)]
    unit = LengthUnit("mm", 1000.0) if np.ptp(points, axis=0).max() < 1.0 else LengthUnit("m", 1.0)
    with styled():
        figure, ((path, speed),) = panels(1, 2, 3.8)
        _speed(speed, trace, unit)
        _mark_timed(speed, row)
        if any(y for _, y in trace.places):
            _way(path, trace, unit, scenario)
        else:
            _place(path, trace, unit)
            speed.set_xlim(path.get_xlim())
        figure.suptitle(_title(scenario, row), x=0.01, ha="left", fontsize=9.5, color=INK)
    return figure


def _title(scenario: TaskScenario, row: Row) -> str:
    link = scenario.link
    kind = capital(scenario.task.kind)
    count = len(list(scenario.task.conditions())) * scenario.trials
    conditions = ", ".join(_condition_text(key, row[key]) for key in list(row)[2:4])
    done = "done" if row["completed"] else "not done"
    late = f"delay {link.up.delay_s:g} s up and {link.down.delay_s:g} s down"
    return (
        f"{kind}, {conditions}, trial {row['number'] + 1} of {count}: "
        f"{done} in {row['movement_time_s']:.2f} s\n"
        f"{scenario.operator.strategy}, {late}, {scenario.frames.rate_hz:g} frames/s"
    )


def name_and_unit(key: str) -> tuple[str, str]:
    """Split a key such as `length_m` or `bandwidth_rad_s` into name and unit."""
    name, _, unit = key.partition("_")
    return name, unit.replace("_", "/")


def _condition_text(key: str, value: float) -> str:
    """Return a condition in words: `width 6.8 mm`."""
    name, unit = name_and_unit(key)
    if unit == "m" and value < 1.0:
        value = 1000.0 * value
        unit = "mm"
    return f"{name} {value:.4g} {unit}"


def _way(ax: Axes, trace: Trace, unit: LengthUnit, scenario: TaskScenario) -> None:
    from matplotlib.patches import Circle

    for wall in trace.walls:
        ax.plot(*_scaled(wall, unit), color=SOFT, lw=1.2)
    circle = {"facecolor": FAINT, "edgecolor": SOFT, "lw": 0.8}
    for x, y, radius in trace.marks:
        ax.add_patch(Circle((x * unit.per_m, y * unit.per_m), radius * unit.per_m, **circle))
    if scenario.is_driven:
        _bodies(ax, trace, 0.5 * scenario.plant.width_m)
    if scenario.task.kind == "reach":
        _numbers(ax, trace, unit)
    ax.plot(*_scaled(trace.places, unit), color=PATH, lw=1.4)
    ax.plot(*_scaled(trace.places[:1], unit), "o", color=PATH, ms=4)
    if trace.touched:
        ax.plot(*_scaled(trace.touched, unit), "x", color=TOUCHED, ms=6, mew=1.6)
    ax.set_aspect("equal", adjustable="datalim")
    ax.grid(False)
    ax.set(title="Way", xlabel=f"x [{unit.name}]", ylabel=f"y [{unit.name}]")


def _scaled(places: Sequence[tuple[float, float]], unit: LengthUnit) -> list[list[float]]:
    """Return x and y of places [m] in a unit."""
    return [[unit.per_m * value for value in values] for values in zip(*places, strict=True)]


def _bodies(ax: Axes, trace: Trace, radius: float) -> None:
    """Draw the vehicle's body in its true width, every few widths along the path [m]."""
    from matplotlib.patches import Circle

    last = None
    for place in trace.places:
        if last is None or math.dist(place, last) > BODY_EVERY * radius:
            ax.add_patch(Circle(place, radius, facecolor="none", edgecolor=PATH, lw=0.6, alpha=0.5))
            last = place


def _numbers(ax: Axes, trace: Trace, unit: LengthUnit) -> None:
    """Write the order of the places beside them, away from the other labels."""
    middle = float(np.mean([x for x, _, _ in trace.marks]))
    for number, (x, y, radius) in enumerate(trace.marks, 1):
        side = -1.0 if x < middle else 1.0
        at = unit.per_m * (x + 1.2 * side * radius), unit.per_m * y
        ax.text(*at, str(number), ha="right" if side < 0 else "left", va="center", color=INK)


def _place(ax: Axes, trace: Trace, unit: LengthUnit) -> None:
    """Draw position and target over time, for one-dimensional motion."""
    for target in trace.walls:
        times, at = zip(*target, strict=True)
        ax.plot(times, unit.per_m * np.array(at), color=SOFT, lw=1.2, label="target")
    for x, _, radius in trace.marks:
        low = unit.per_m * (x - radius)
        high = unit.per_m * (x + radius)
        ax.axhspan(low, high, color=FAINT, lw=0, label="target")
    places = [unit.per_m * x for x, _ in trace.places]
    ax.plot(trace.times, places, color=PATH, lw=1.4, label="cursor")
    ax.set(title="Place", xlabel="Time [s]", ylabel=f"x [{unit.name}]")
    ax.set_xlim(0, min(LONGEST, trace.times[-1]))
    ax.legend(loc="best")


def _speed(ax: Axes, trace: Trace, unit: LengthUnit) -> None:
    part = unit.per_m * np.array(trace.speeds)
    smooth = np.convolve(part, SMOOTH, "same") / np.convolve(np.ones(len(part)), SMOOTH, "same")
    ax.plot(trace.times, smooth[: len(part)], color=PATH, lw=1.2)
    ax.set(title="Speed", xlabel="Time [s]", ylabel=f"Speed [{unit.name}/s]")
    ax.set_ylim(bottom=0)
    ax.set_xlim(0, max(trace.times[-1], 1e-3))


def _mark_timed(ax: Axes, row: Row) -> None:
    """Mark from when the movement time counts, unless that is the whole trial."""
    begun = row["trial_time_s"] - row["movement_time_s"]
    if begun > 0.0:
        ax.axvspan(0.0, begun, color=FAINT, lw=0, label="not timed")
        ax.legend(loc="best")
