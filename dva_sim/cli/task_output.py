"""What the command line tells and draws of a task: its trials, and one of them as a picture."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from dva_sim.cli.verbose_details import tell_measures
from dva_sim.experiments.report.figures.palette import FAINT, INK, SOFT
from dva_sim.experiments.report.figures.style import panels, styled
from dva_sim.experiments.study.labels import capital
from dva_sim.simulation.task import TaskScenario, Trace, play, trace_of
from dva_sim.simulation.task.measures import Row, run_row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


SHOWN = 20  # trials in the table; the lines below it count them all
LONGEST = 30.0  # of what moves on a line, in a picture [s]
SMOOTH = (0.5, 1.0, 1.0, 1.0, 0.5)  # speeds are averaged so: readings of a device come in steps
BODY_EVERY = 3.0  # half widths of a body between those that are drawn
PATH, TOUCHED = "#0072B2", "#D55E00"


class Unit(NamedTuple):
    """Of length, in a picture."""

    name: str
    per_m: float


COLUMNS = {
    "id_bits": "index\n[bit]",
    "steering_id": "index",
    "movement_time_s": "time\n[s]",
    "error": "error",
    "overshoots": "over-\nshoots",
    "wall_crossings": "crossings",
    "path_error_rms_m": "off the\nmiddle,\nrms [m]",
    "tracking_error_rms_m": "off the\ntarget,\nrms [m]",
    "crossover_rad_s": "crossover\n[rad/s]",
    "phase_margin_deg": "phase\nmargin\n[deg]",
    "waits": "waits",
    "delay_felt_s": "delay\nfelt\n[s]",
}
"""Columns of the trials that are told, as far as the task has them, with their heads."""


def tell(scenario: TaskScenario, seed: int, console: Console) -> None:
    """Play a block of trials and print it."""
    started = time.perf_counter()
    trials = play(scenario, seed)
    took = time.perf_counter() - started
    console.rule(f"{scenario.task.kind}, {scenario.operator.strategy}, seed {seed}")
    console.print(_table(trials))
    if len(trials) > SHOWN:
        console.print(f"... and {len(trials) - SHOWN} more")
    row = run_row(trials)
    console.print(f"{_count(row['trials'])}: {', '.join(_lines(row))}", soft_wrap=True)
    if row["plugin_failures"]:
        failures = row["plugin_failures"]
        console.print(f"{failures} times a strategy or filter of yours gave no answer")
    console.print(f"{row['simulated_s']:.0f} s simulated in {took:.2f} s", soft_wrap=True)
    tell_measures(row, "task")


def _count(trials: int) -> str:
    return "1 trial" if trials == 1 else f"{trials} trials"


def _table(trials: list[Row]) -> Table:
    there = {name: head for name, head in COLUMNS.items() if name in trials[0]}
    table = Table(box=None, pad_edge=False)
    conditions = [_head(key) for key in list(trials[0])[2:4]]
    for heading in ("trial", *conditions, *there.values()):
        table.add_column(Text(heading), justify="right", no_wrap=True)
    for trial in trials[:SHOWN]:
        first, second = list(trial.values())[2:4]
        values = (_number(trial[name]) for name in there)
        table.add_row(str(trial["number"] + 1), f"{first:.4g}", f"{second:.4g}", *values)
    return table


def _head(key: str) -> str:
    """A column of a condition as a head, with its unit."""
    name, unit = _name_and_unit(key)
    return f"{name}\n[{unit}]"


def _name_and_unit(key: str) -> tuple[str, str]:
    """What `length_m` or `bandwidth_rad_s` is, and in which unit."""
    name, _, unit = key.partition("_")
    return name, unit.replace("_", "/")


def _number(value: Any) -> str:
    if isinstance(value, int):
        return str(value)
    return f"{value:.3g}" if math.isfinite(value) else "–"


def _lines(row: Row) -> list[str]:
    parts = [f"{100 * row['completed_share']:.0f} % done"]
    if "error_share" in row:
        parts.append(f"{100 * row['error_share']:.0f} % with an error")
    parts.append(f"{row['movement_time_s']:.2f} s on average")
    if math.isfinite(row.get("throughput_bps", math.nan)):
        parts.append(f"{row['throughput_bps']:.2f} bit/s")
    parts.append(f"{row['waits']:.1f} waits in each")
    return parts


def draw(scenario: TaskScenario, seed: int, path: Path, number: int = 0) -> None:
    """Draw one trial: the way that was taken, and the speed over time.

    Args:
        scenario: The task.
        seed: Of the block.
        path: Where to; its ending says in which form.
        number: Which of the trials that are kept.
    """
    with styled():
        picture(scenario, *trace_of(scenario, seed, number)).savefig(path)


def picture(scenario: TaskScenario, row: Row, trace: Trace) -> Figure:
    """Of a trial: the way that was taken, and the speed over time.

    Args:
        scenario: The task.
        row: What was measured.
        trace: What was kept of it.
    """
    unit = _unit_of(trace)
    with styled():
        figure, ((way, speed),) = panels(1, 2, 3.8)
        _speed(speed, trace, unit)
        _mark_timed(speed, row)
        if any(y for _, y in trace.places):
            _way(way, trace, unit, scenario)
        else:
            _place(way, trace, unit)
            speed.set_xlim(way.get_xlim())
        figure.suptitle(_title(scenario, row), x=0.01, ha="left", fontsize=9.5, color=INK)
    return figure


def _unit_of(trace: Trace) -> Unit:
    """Millimetres for what is smaller than a metre."""
    shown = [*trace.places, *((x, y) for x, y, _ in trace.marks)]
    return Unit("mm", 1000.0) if np.ptp(shown, axis=0).max() < 1.0 else Unit("m", 1.0)


def _title(scenario: TaskScenario, row: Row) -> str:
    link, kind = scenario.link, capital(scenario.task.kind)
    count = len(list(scenario.task.conditions())) * scenario.trials
    conditions = ", ".join(_told(key, row[key]) for key in list(row)[2:4])
    done = "done" if row["completed"] else "not done"
    late = f"delay {link.up.delay_s:g} s up and {link.down.delay_s:g} s down"
    return (
        f"{kind}, {conditions}, trial {row['number'] + 1} of {count}: "
        f"{done} in {row['movement_time_s']:.2f} s\n"
        f"{scenario.operator.strategy}, {late}, {scenario.frames.rate_hz:g} frames/s"
    )


def _told(key: str, value: float) -> str:
    """A condition in words: `width 6.8 mm`."""
    name, unit = _name_and_unit(key)
    if unit == "m" and value < 1.0:
        value, unit = 1000.0 * value, "mm"
    return f"{name} {value:.4g} {unit}"


def _way(ax: Axes, trace: Trace, unit: Unit, scenario: TaskScenario) -> None:
    from matplotlib.patches import Circle

    for line in trace.walls:
        ax.plot(*_scaled(line, unit), color=SOFT, lw=1.2)
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


def _scaled(places: Sequence[tuple[float, float]], unit: Unit) -> list[list[float]]:
    """x and y of places [m] in a unit."""
    return [[unit.per_m * value for value in values] for values in zip(*places, strict=True)]


def _bodies(ax: Axes, trace: Trace, radius: float) -> None:
    """The vehicle's body, as wide as it is, every few widths of the way [m]."""
    from matplotlib.patches import Circle

    last = None
    for place in trace.places:
        if last is None or math.dist(place, last) > BODY_EVERY * radius:
            ax.add_patch(Circle(place, radius, facecolor="none", edgecolor=PATH, lw=0.6, alpha=0.5))
            last = place


def _numbers(ax: Axes, trace: Trace, unit: Unit) -> None:
    """In which order the places are gone to, beside them, away from the others."""
    middle = float(np.mean([x for x, _, _ in trace.marks]))
    for number, (x, y, radius) in enumerate(trace.marks, 1):
        side = -1.0 if x < middle else 1.0
        at = unit.per_m * (x + 1.2 * side * radius), unit.per_m * y
        ax.text(*at, str(number), ha="right" if side < 0 else "left", va="center", color=INK)


def _place(ax: Axes, trace: Trace, unit: Unit) -> None:
    """Of what moves on a line: where it is over time, and its target."""
    for target in trace.walls:
        times, at = zip(*target, strict=True)
        ax.plot(times, unit.per_m * np.array(at), color=SOFT, lw=1.2, label="target")
    for x, _, radius in trace.marks:
        low, high = unit.per_m * (x - radius), unit.per_m * (x + radius)
        ax.axhspan(low, high, color=FAINT, lw=0, label="target")
    places = [unit.per_m * x for x, _ in trace.places]
    ax.plot(trace.times, places, color=PATH, lw=1.4, label="cursor")
    ax.set(title="Place", xlabel="Time [s]", ylabel=f"x [{unit.name}]")
    ax.set_xlim(0, min(LONGEST, trace.times[-1]))
    ax.legend(loc="best")


def _speed(ax: Axes, trace: Trace, unit: Unit) -> None:
    part = unit.per_m * np.array(trace.speeds)
    smooth = np.convolve(part, SMOOTH, "same") / np.convolve(np.ones(len(part)), SMOOTH, "same")
    ax.plot(trace.times, smooth[: len(part)], color=PATH, lw=1.2)
    ax.set(title="Speed", xlabel="Time [s]", ylabel=f"Speed [{unit.name}/s]")
    ax.set_ylim(bottom=0)
    ax.set_xlim(0, max(trace.times[-1], 1e-3))


def _mark_timed(ax: Axes, row: Row) -> None:
    """From when the movement time counts, unless that is the whole trial."""
    begun = row["trial_time_s"] - row["movement_time_s"]
    if begun > 0.0:
        ax.axvspan(0.0, begun, color=FAINT, lw=0, label="not timed")
        ax.legend(loc="best")
