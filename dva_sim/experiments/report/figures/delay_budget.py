"""Origin of the delay: one stack of stages for each cell, beside the measured loop delay."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from dva_sim.experiments.analysis.run_grid import Factor, Floats, Setting, nan_mean
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures import style
from dva_sim.experiments.report.figures.csv_numbers import Numbers
from dva_sim.experiments.report.figures.legend import box
from dva_sim.experiments.report.figures.palette import INK, PAPER, STAGES
from dva_sim.experiments.report.figures.stacks import Stacks, stack
from dva_sim.experiments.report.prose import caption
from dva_sim.experiments.study.parts import Level

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

    from dva_sim.experiments.report.summary import Reading


_NAMES = {
    "delay_frame_s": "frame (until the next)",
    "delay_downlink_s": "down-link",
    "delay_human_s": "human (perception)",
    "delay_hand_s": "hand",
    "delay_filter_s": "filter",
    "delay_period_s": "command period (until the next)",
    "delay_wait_s": "pattern (waits for the reply)",
    "delay_uplink_s": "up-link",
    "delay_processing_s": "processing",
    "delay_motor_s": "motor",
}
_MEASURED = "loop_delay_measured_s"


class DelayBudget(style.ReportFigure):
    name = "delay_budget"
    title = "Where the delay comes from"
    pages = ("driving",)
    has_panels = True

    def draw(self, view: StudyView, reading: Reading) -> style.Drawn | None:
        """Draw it."""
        grids = stages_of(view)
        if not grids:
            return None
        view = _driven(view, next(iter(grids.values())))
        stacks, numbers = Stacks(view, "Delay [s]", _parts(list(grids))), Numbers()
        for ax, panel, level in stacks.panels():
            means = {stage: _means(view, grid, panel, level) for stage, grid in grids.items()}
            measured = _means(view, view.part.grid(_MEASURED), panel, level)
            stack(ax, means, STAGES)
            _mark(ax, measured)
            columns = view.along_x() | means | {_MEASURED: measured}
            numbers.add(view.setting(panel, level), columns)
        stacks.close()
        return self.finish(stacks.figure, caption("delay_budget"), numbers)


def stages_of(view: StudyView) -> dict[str, Floats]:
    """Each stage run by run, in the order of the loop; their sum is that of the columns.

    While a request is open no command goes: the phone's newer ones are replaced by the newest. So
    the command in force stands longer than the phone's own period, which is the pattern's doing
    and not the sampling's. In a run of which `commands_sent` went and others were replaced before
    they were sent, the phone alone would have filled that time with all of them.
    """
    part = view.part
    found = {name: part.grid(name) for name in _NAMES if part.has(name)}
    if not part.has("delay_sampling_s"):
        return found
    in_force, wait = part.grid("delay_sampling_s"), np.zeros_like(part.grid("delay_sampling_s"))
    if part.has("commands_superseded"):
        fates = ("sent", "superseded", "applied", "stale")
        sent, replaced, applied, stale = (
            np.nan_to_num(part.grid(f"commands_{fate}")) for fate in fates
        )
        # Of those replaced some were sent already, and skipped by the robot.
        unsent = np.maximum(replaced - np.maximum(sent - applied - stale, 0.0), 0.0)
        wait = in_force * unsent / np.maximum(sent + unsent, 1.0)
    before = part.grid("delay_pattern_s") if part.has("delay_pattern_s") else 0.0
    found |= {"delay_period_s": in_force - wait, "delay_wait_s": wait + before}
    return {name: found[name] for name in _NAMES if name in found}


def _driven(view: StudyView, grid: Floats) -> StudyView:
    """Without the lines under which nobody drove, such as guards without robots."""
    if view.line is None:
        return view
    name = view.line.name
    there = [v for v in view.lines if np.isfinite(view.part.where(grid, {name: v})).any()]
    return replace(view, line=Factor(name, tuple(there)))


def _means(view: StudyView, grid: Floats, panel: Setting, level: Level) -> Floats:
    """Over all runs of each stop."""
    values = view.curve(grid, panel, level)
    return nan_mean(values.reshape(len(values), -1), axis=1)


def _mark(ax: Axes, measured: Floats) -> None:
    """The whole as it was measured."""
    stops = range(len(measured))
    ax.plot(measured, stops, "D", ms=4.5, color=PAPER, mec=INK, mew=1.1, zorder=3)


def _parts(stages: list[str]) -> dict[str, Artist]:
    """For the key, in the order of the stack."""
    from matplotlib.lines import Line2D

    mark = Line2D([], [], marker="D", ms=4.5, ls="", color=PAPER, mec=INK)
    return {_NAMES[stage]: box(STAGES[stage]) for stage in stages} | {"as measured": mark}
