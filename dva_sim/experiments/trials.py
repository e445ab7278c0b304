"""What the command line tells and draws of a task: its trials, and one of them as a picture."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Console
from rich.table import Table

from dva_sim.experiments.figures.style import FAINT, INK, SOFT, capital, panels, styled
from dva_sim.tasks import TaskScenario, Trace, play, trace_of
from dva_sim.tasks.summary import Row, run_row

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHOWN = 20  # trials in the table; the lines below it count them all
LONGEST = 30.0  # of what moves on a line, in a picture [s]
SMOOTH = 5  # speeds that are averaged for the picture: readings of a device come in steps
PATH, TOUCHED = "#0072B2", "#D55E00"
COLUMNS = {
    "id_bits": "bits",
    "steering_id": "index",
    "movement_time_s": "time [s]",
    "error": "error",
    "overshoots": "overshoots",
    "wall_crossings": "crossings",
    "path_error_rms_m": "off the middle, rms [m]",
    "tracking_error_rms_m": "off the target, rms [m]",
    "crossover_rad_s": "crossover [rad/s]",
    "phase_margin_deg": "phase margin [deg]",
    "waits": "waits",
    "delay_felt_s": "delay felt [s]",
}
"""Columns of the trials that are told, as far as the task has them, with their heads."""


def tell(scenario: TaskScenario, seed: int, console: Console) -> None:
    """Play a block of trials and print it."""
    started = time.perf_counter()
    trials = play(scenario, seed)
    took = time.perf_counter() - started
    console.rule(f"{scenario.task.kind}, {scenario.operator.strategy}, seed {seed}")
    console.print(_table(trials))
    row = run_row(trials)
    console.print(f"{row['trials']} trials: {', '.join(_lines(row))}", soft_wrap=True)
    console.print(f"{row['simulated_s']:.0f} s simulated in {took:.2f} s", soft_wrap=True)


def _table(trials: list[Row]) -> Table:
    there = {name: head for name, head in COLUMNS.items() if name in trials[0]}
    table = Table(box=None, pad_edge=False)
    for heading in ("trial", *list(trials[0])[2:4], *there.values()):
        table.add_column(heading, justify="right")
    for trial in trials[:SHOWN]:
        first, second = list(trial.values())[2:4]
        values = (_number(trial[name]) for name in there)
        table.add_row(str(trial["number"] + 1), f"{first:.4g}", f"{second:.4g}", *values)
    return table


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
    row, trace = trace_of(scenario, seed, number)
    with styled():
        figure, ((way, speed),) = panels(1, 2, 3.6)
        _speed(speed, trace)
        if any(y for _, y in trace.places):
            _way(way, trace)
        else:
            _place(way, trace)
            speed.set_xlim(way.get_xlim())
        figure.suptitle(_title(scenario, row), x=0.01, ha="left", fontsize=9.5, color=INK)
        figure.savefig(path)


def _title(scenario: TaskScenario, row: Row) -> str:
    link = scenario.link
    late = f"delay {link.up.delay_s:g} s up and {link.down.delay_s:g} s down"
    done = "done" if row["completed"] else "not done"
    what = f"{capital(scenario.task.kind)}, {scenario.operator.strategy}, {late}, "
    return f"{what}{scenario.frames.rate_hz:g} frames/s: {done} in {row['movement_time_s']:.2f} s"


def _way(ax: Axes, trace: Trace) -> None:
    from matplotlib.patches import Circle

    for line in trace.walls:
        ax.plot(*zip(*line, strict=True), color=SOFT, lw=1.2)
    for x, y, radius in trace.marks:
        ax.add_patch(Circle((x, y), radius, facecolor=FAINT, edgecolor=SOFT, lw=0.8))
    ax.plot(*zip(*trace.places, strict=True), color=PATH, lw=1.4)
    ax.plot(*trace.places[0], "o", color=PATH, ms=4)
    if trace.touched:
        ax.plot(*zip(*trace.touched, strict=True), "x", color=TOUCHED, ms=6, mew=1.6)
    ax.set_aspect("equal", adjustable="datalim")
    ax.grid(False)
    ax.set(title="Way", xlabel="x [m]", ylabel="y [m]")


def _place(ax: Axes, trace: Trace) -> None:
    """Of what moves on a line: where it is over time, and its target."""
    for target in trace.walls:
        ax.plot(*zip(*target, strict=True), color=SOFT, lw=1.2, label="target")
    for x, _, radius in trace.marks:
        ax.axhspan(x - radius, x + radius, color=FAINT, lw=0, label="target")
    ax.plot(trace.times, [x for x, _ in trace.places], color=PATH, lw=1.4, label="cursor")
    ax.set(title="Place", xlabel="Time [s]", ylabel="x [m]")
    ax.set_xlim(0, min(LONGEST, trace.times[-1]))
    ax.legend(loc="best")


def _speed(ax: Axes, trace: Trace) -> None:
    whole, part = np.ones(SMOOTH), np.array(trace.speeds)
    smooth = np.convolve(part, whole, "same") / np.convolve(np.ones(len(part)), whole, "same")
    ax.plot(trace.times, smooth[: len(part)], color=PATH, lw=1.2)
    ax.set(title="Speed", xlabel="Time [s]", ylabel="Speed [m/s]")
    ax.set_ylim(bottom=0)
    ax.set_xlim(0, max(trace.times[-1], 1e-3))
