"""Effect of the factor on the measure: paired differences of its levels."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from dva_sim.agents.robot.command_queue import mean_of
from dva_sim.experiments.analysis.answer import too_few
from dva_sim.experiments.analysis.run_grid import Factor, Floats, present
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures import style
from dva_sim.experiments.report.figures.csv_numbers import Numbers, in_units
from dva_sim.experiments.report.figures.cut_bars import Bars, fit_to, mark_cuts
from dva_sim.experiments.report.figures.legend import Ends, legend, name_lines
from dva_sim.experiments.report.figures.palette import FAINT, INK, PAPER, SOFT, Look, looks
from dva_sim.experiments.report.prose import caption
from dva_sim.experiments.study.parts import Level
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.wording import capital
from dva_sim.network.patterns import PATTERNS
from dva_sim.simulation.labels import level_name, measure_name
from dva_sim.simulation.scenario import build, phone_profile
from dva_sim.statistics import Band, band

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from dva_sim.experiments.report.summary import Reading


_WIDER = 1.2  # of a logarithmic axis, lest marks lie on its edges
_STEP = 0.12  # between the bars of two lines, in stops


class Differences(style.ReportFigure):
    name = "differences"
    title = "Difference of each level against another"
    pages = ("driving", "transport")
    has_panels = True

    def draw(self, view: StudyView, reading: Reading) -> style.Drawn | None:
        """Draw the figure."""
        if view.contrast is None or view.series_factor is None:
            return None
        findings = cadences(view, reading.scenario_of(view.part.name))
        baseline = view.contrast[1]
        levels = tuple(level for level in view.series if level != baseline)
        name = level_name(view.series_factor.name, baseline)
        label = style.axis_label(view.measure, f"Difference against\n{name}")
        figure, axes, ends, bars, cut, numbers = _curves(view, levels, baseline, label)
        for ax, finding in zip(axes, findings, strict=True):
            ax.axhline(0, color=INK, lw=0.8, zorder=1)
            mark_boundary(ax, view.over, finding)
        zoomed = view.smallest_effect is not None and _zoom_on_small(axes, view.smallest_effect)
        mark_cuts(bars)
        _name(view, levels, figure, axes, ends)
        excess = "excess " if view.part.has_reference(view.measure) else ""
        title = f"Difference against {name} in {excess}{measure_name(view.measure)}"
        words = caption(
            "differences",
            baseline=name,
            zoomed=zoomed,
            is_marked=view.smallest_effect is not None,
            has_boundary=any(boundary(view.over, finding) is not None for finding in findings),
        )
        reads = (_intervals_words(view), style.hatch_words(view), cut, _few_words(reading))
        return self.finish(figure, words, numbers, title=title, reads=reads)


def _few_words(reading: Reading) -> str:
    """Warn that overlapping bars show no equality when there are too few persons."""
    finding = getattr(reading, "worded_finding", None)
    if finding is None or not finding.has_too_few:
        return ""
    few = capital(too_few(finding.persons, finding.cluster))
    return f"{few}: bars that overlap or include zero do not show equality."


def _curves(
    view: StudyView, lines: tuple[Level, ...], baseline: Level, ylabel: str
) -> tuple[Figure, list[Axes], list[Ends], list[Bars], str, Numbers]:
    """Draw a panel for each setting, and in it a line with its band for each level.

    Args:
        lines: Levels drawn.
        baseline: The level that they are compared with.
        ylabel: Label of the y axis.

    Returns:
        The figure, its axes, the end of each line, the bars, what a caption must say of those
        that are cut, and the numbers drawn.
    """
    figure, axes = style.panel_grid(view, 3.4)
    look = looks(view.series_factor)
    every = []
    drawn = [np.zeros(1)]
    numbers = Numbers()
    bars: list[Bars] = []
    draw = _band if style.has_lines(view) else _points
    for ax, panel in zip(axes, view.shown, strict=True):
        ends: Ends = {}
        for level, shift in _side_by_side(view, lines):
            matrix = view.difference(panel, level, baseline)
            bands = _possible(band(matrix, view.level), -view.widest, view.widest)
            drawn.append(matrix.ravel())
            ends[level] = draw(ax, bands, look[level], shift)
            at = _places(bands, shift)
            bars.append(Bars(ax, at, bands.low, bands.high, look[level].colour))
            numbers.add(
                view.setting(panel, level),
                view.along_x()
                | in_units(
                    view.measure,
                    mean=bands.mean,
                    band_low=bands.low,
                    band_high=bands.high,
                    low=bands.pointwise_low,
                    high=bands.pointwise_high,
                ),
            )
        style.hatch_stops(ax, view.stops_outside(panel))
        every.append(ends)
    style.label_panels(axes, view, ylabel)
    cut = fit_to(axes[0], present(np.concatenate(drawn)))
    return figure, axes, every, bars, cut, numbers


def _possible(bands: Band, least: float, most: float) -> Band:
    """Return the limits within the possible range of the measure."""
    edges = ("low", "high", "pointwise_low", "pointwise_high")
    return replace(bands, **{edge: np.clip(getattr(bands, edge), least, most) for edge in edges})


def _places(bands: Band, shift: float) -> Floats:
    """Return places along x, beside each stop."""
    return np.arange(len(bands.mean), dtype=np.float64) + shift


def _zoom_on_small(axes: list[Axes], smallest: float) -> bool:
    """Mark differences declared too small to matter; give them room, where they have none."""
    for ax in axes:
        ax.axhspan(-smallest, smallest, color=FAINT, alpha=0.5, lw=0, zorder=0)
    bottom, top = axes[0].get_ylim()
    if max(-bottom, top) < 10 * smallest:
        return False
    bottom, top = (_WIDER * end if abs(end) > smallest else end for end in (bottom, top))
    digits = (1, 2, 5) if max(-bottom, top) < 100 * smallest else (1,)
    steps = [smallest, *(k * 10.0**n for n in range(-3, 7) for k in digits)]
    steps = [step for step in dict.fromkeys(steps) if smallest <= step]
    axes[0].set_yscale("symlog", linthresh=2 * smallest)
    for ax in axes:
        if label := ax.get_ylabel():
            ax.set_ylabel(f"{label},\nlog scale beyond ±{2 * smallest:g}")
    ticks = [0.0, *steps, *(-step for step in steps)]
    axes[0].set_yticks([tick for tick in ticks if bottom <= tick <= top])
    axes[0].set_ylim(bottom, top)
    axes[0].yaxis.set_major_formatter("{x:g}")
    axes[0].minorticks_off()
    return True


def _side_by_side(view: StudyView, lines: tuple[Level, ...]) -> list[tuple[Level, float]]:
    """Return each level's place beside its stop.

    Close together where a line goes on to the next.
    """
    if not style.has_lines(view):
        return style.dodge(lines)
    return [(level, _STEP * (i - (len(lines) - 1) / 2)) for i, level in enumerate(lines)]


def _intervals_words(view: StudyView) -> str:
    if style.has_lines(view):
        return "Shaded: the 95 % band of a line. Bars: the 95 % interval of each level alone."
    return (
        "Thin bars: the 95 % band of all places of a mark. Thick bars: the interval of each alone."
    )


def _name(
    view: StudyView, lines: tuple[Level, ...], figure: Figure, axes: list[Axes], ends: list[Ends]
) -> None:
    """Name lines at their ends, and marks in a key."""
    if style.has_lines(view):
        name_lines(axes, ends, view.series_factor)
    elif view.series_factor is not None:
        legend(figure, view.series_factor, lines)


def _points(ax: Axes, bands: Band, look: Look, shift: float) -> float:
    """Return a mark with two bars at each stop: the wide interval thin, the narrow one thick."""
    x = _places(bands, shift)
    ax.vlines(x, bands.low, bands.high, color=look.colour, lw=1)
    ax.vlines(x, bands.pointwise_low, bands.pointwise_high, color=look.colour, lw=2.6)
    ax.plot(x, bands.mean, look.mark, color=look.colour, ms=6, mec=PAPER, mew=0.6, zorder=3)
    return math.nan  # no line, so no end


def _band(ax: Axes, bands: Band, look: Look, shift: float) -> float:
    """Draw one series with its band and bars; return the height of its last point."""
    x = _places(bands, shift)
    colour = look.colour
    ax.fill_between(x, bands.low, bands.high, color=colour, alpha=0.16, lw=0)
    ax.vlines(x, bands.pointwise_low, bands.pointwise_high, color=colour, lw=1.2)
    ax.plot(x, bands.mean, "-", marker=look.mark, color=colour, ms=4.5)
    means = present(bands.mean)
    return float(means[-1]) if len(means) else float("nan")


def cadences(view: StudyView, scenario: Mapping[str, Any]) -> list[Cadence | None]:
    """Return the cadence of each panel shown.

    None unless delay and a waiting pattern are varied.
    """
    waits = any(level in PATTERNS and PATTERNS[str(level)].in_step for level in view.series)
    if view.over is None or view.over.name != "link.delay_s" or not waits:
        return [None for _ in view.shown]
    return [cadence(scenario, panel) for panel in view.shown]


def boundary(over: Factor | None, cadence: Cadence | None) -> float | None:
    """Return the position on x where the wanted rate becomes too high; None if outside the levels.

    Where places are not to scale, between two levels is the middle between them.
    """
    index = style.place_of(over, cadence.boundary_s) if over and cadence else None
    if index is None or over is None or style.is_to_scale(over) or index.is_integer():
        return index
    return math.floor(index) + 0.5


def mark_boundary(ax: Axes, over: Factor | None, cadence: Cadence | None) -> None:
    """Mark the delay from which request/reply must fall behind the wanted rate."""
    index = boundary(over, cadence)
    if index is None or over is None or cadence is None:
        return
    ax.axvline(index, color=SOFT, lw=1, ls=(0, (4, 2)), zorder=1)
    ax.annotate(
        f"2d + P = T\n(d = {level_name(over.name, round(cadence.boundary_s, 4))})",
        (index, 0.98),
        xycoords=("data", "axes fraction"),
        xytext=(4, 0),
        textcoords="offset points",
        va="top",
        fontsize=8,
        color=SOFT,
    )


@dataclass(frozen=True)
class Cadence:
    """Send period of the phone, and the time a robot needs per command.

    Attributes:
        period_s: Wanted time between two commands; the shortest, where it is not constant.
        processing_s: Time a robot needs for one command, on average.
    """

    period_s: float
    processing_s: float

    @property
    def boundary_s(self) -> float:
        """One-way delay at which round trip and processing fill the wanted period.

        Beyond it a request waits for the reply to the one before: 2 d + P = T.
        """
        return (self.period_s - self.processing_s) / 2


def cadence(scenario: Mapping[str, Any], changes: Mapping[str, Level]) -> Cadence | None:
    """Return the cadence of a scenario under some levels; None where its profile is not to be had.

    A phone that looks only when its batch is full or its time is up wants no more than that.
    """
    try:
        resolved = build(scenario, changes)
        phone = phone_profile(resolved)
    except ConfigError:
        return None
    period = 1.0 / resolved.command.rate_hz
    if phone.send == "on_change":
        period = min(phone.max_delay_s, 20 / phone.sample_rate_hz)
    return Cadence(period, mean_of(resolved.robot.processing_s or 0.0))
