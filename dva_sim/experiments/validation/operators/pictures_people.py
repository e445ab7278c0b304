"""Figures of the experiments: simulated persons beside published ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from dva_sim.experiments.figures.style import FAINT, SOFT, Drawn, finish, panels
from dva_sim.experiments.validation.operators import experiments as of
from dva_sim.experiments.validation.operators.judging import Verdict
from dva_sim.experiments.validation.operators.strokes import (
    BLUE,
    ORANGE,
    TIME,
    bar,
    by,
    curve,
    paired,
    points,
    ratios_of,
    ring,
    straight,
    value,
)
from dva_sim.experiments.validation.operators.trials import Cells, mean, person_means
from dva_sim.tasks.measures import fit_line

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SHADES = ("#56B4E9", "#0072B2", "#009E73", "#D55E00")  # from little to much

ByLine = Mapping[str, Verdict]


def draw_people(verdicts: Sequence[Verdict], played: Mapping[str, Cells]) -> list[Drawn]:
    """One figure for each experiment."""
    lines = {v.line.id: v for v in verdicts}
    return [
        _lag(lines, played["lag"]),
        _tilt(lines, played["tilt"]),
        _steering(lines, played["steering"], played["latency"]),
        _waiting(lines, played["waiting"]),
        _frames(lines, played["frames"]),
        _tracking(lines, played["tracking"]),
    ]


def _lag(lines: ByLine, cells: Cells) -> Drawn:
    figure, [[left, right]] = panels(1, 2, 3.1)
    for (lag, trials), colour in zip(cells.items(), _SHADES, strict=True):
        bits, times = by(trials, "id_bits")
        line = fit_line(bits, times)
        left.plot(bits, times, "o", color=colour, ms=4)
        ends = np.array([bits.min(), bits.max()])
        left.plot(ends, line.intercept + line.slope * ends, color=colour, label=f"{lag} ms")
    left.set_xlabel("index of difficulty [bit]")
    left.set_ylabel("movement time [s]")
    left.set_title("Fitts' law by lag")
    left.legend(loc="upper left", fontsize=8, title="lag")
    _ratios(right, lines, cells)
    slope, first = lines["S8/slope"], mean(cells[of.SHORTEST_LAG], TIME)
    text = (
        "Pointing with a mouse whose cursor is late (MacKenzie & Ware 1993). Left: means of each "
        "condition and lines through them. Right: movement time against that at 8.3 ms; rings are "
        f"published, grey are the bands. A millisecond of lag costs {slope.found.value:.2f} ms at "
        f"4 bits; the band is {slope.line.low:g} to {slope.line.high:g}. Only such differences are "
        f"compared: simulated persons need {first:.2f} s at 8.3 ms, published ones needed "
        f"{0.001 * (lines['S7/time-8.3'].line.target or 0.0):.2f} s."
    )
    return finish(figure, "lag", "Pointing under lag", text)


def _ratios(axes: Axes, lines: ByLine, cells: Cells) -> None:
    """Movement times by lag, against the shortest lag."""
    published = [lines[f"S7/time-{lag}"].line.target or 0.0 for lag in of.PUBLISHED_LAGS]
    first = person_means(cells[of.SHORTEST_LAG], TIME).mean()
    for lag, time in zip(of.PUBLISHED_LAGS, published, strict=True):
        ratio = time / published[0]  # the shortest lag's
        axes.plot([float(lag)], [ratio], "o", mfc="none", mec=ORANGE, ms=9, mew=1.5)
    for lag in ("25", "75"):
        bar(axes, float(lag), lines[f"S7/{lag}"].line, 7.0)
    lags = [float(lag) for lag in cells]
    means = [person_means(t, TIME).mean() / first for t in cells.values()]
    paired(axes, lags, means, ratios_of(cells, of.SHORTEST_LAG))
    axes.plot([], [], "o-", color=BLUE, ms=5, label="simulated")
    axes.plot([], [], "o", mfc="none", mec=ORANGE, ms=9, mew=1.5, label="published")
    axes.set_xlabel("lag [ms]")
    axes.set_ylabel("movement time, 8.3 ms = 1")
    axes.set_title("What lag costs")
    axes.legend(loc="upper left", fontsize=8)


def _tilt(lines: ByLine, cells: Cells) -> Drawn:
    figure, [[rates, times, tilts]] = panels(1, 3, 2.9)
    for place, name in enumerate(of.SELECTIONS):
        verdict = lines[f"S9/{name}"]
        bar(rates, place, verdict.line, 0.5)
        ring(rates, place, verdict.line)
        value(rates, place, verdict)
    rates.set_xticks([0, 1], ["first entry", "dwell 0.5 s"])
    rates.set_xlim(-0.6, 1.6)
    rates.set_ylabel("throughput [bit/s]")
    rates.set_title("Throughput at a gain of 50")
    best, most = lines["S10/best"].line, lines["S10/most-tilt"].line
    times.axvspan(best.low or 0.0, best.high or 0.0, color=FAINT, alpha=0.55, lw=0)
    tilts.axhspan(most.low or 0.0, most.high or 0.0, color=FAINT, alpha=0.55, lw=0)
    _by_gain(times, cells, TIME, 1.0)
    _by_gain(tilts, cells, "tilt_max_rad", 180.0 / np.pi)
    times.set_ylabel("movement time [s]")
    times.set_title("Which gain is best")
    tilts.set_ylabel("largest tilt [deg]")
    tilts.set_title("How far the hand tilts")
    for axes in (rates, times, tilts):
        axes.set_ylim(bottom=0)
    for axes in (times, tilts):
        axes.set_ylim(top=1.3 * axes.get_ylim()[1])  # room for the legend above the data
    text = (
        "Pointing by tilt with velocity control (MacKenzie & Teather 2012), which the operators "
        "were fitted to: shown, not counted. Rings are published, grey are bands."
    )
    return finish(figure, "tilt", "Pointing by tilt", text)


def _by_gain(axes: Axes, cells: Cells, name: str, scale: float) -> None:
    """A column by gain, a line for each way of selecting."""
    for selection, colour in zip(of.SELECTIONS, (BLUE, "#009E73"), strict=True):
        own = {gain: cells[of.tilt_cell(gain, selection)] for gain in of.GAINS}
        curve(axes, own, name, scale, colour, selection.replace("-", " "))
    axes.set_xscale("log", base=2)
    axes.set_xticks(list(of.GAINS), [str(gain) for gain in of.GAINS])
    axes.set_xlabel("gain [pixels/s per degree]")
    axes.legend(fontsize=8, loc="upper left")


def _steering(lines: ByLine, tunnel: Cells, latency: Cells) -> Drawn:
    figure, [axes] = panels(1, 3, 2.9)
    ids, times, variances = of.steering_points(tunnel["tunnel"])
    straight(axes[0], ids, times, lines["S11/mean"])
    axes[0].set_xlabel("index of difficulty, length / width")
    axes[0].set_ylabel("movement time [s]")
    axes[0].set_title("Mean")
    straight(axes[1], ids**2, variances, lines["S11/variance"])
    axes[1].set_xlabel("its square")
    axes[1].set_ylabel("variance of it [s²]")
    axes[1].set_title("Variance")
    first = person_means(latency["as it is"], TIME).mean()
    names = {"less": -1000 * of.STEP_S, "as it is": 0.0, "more": 1000 * of.STEP_S}
    for name in ("less", "more"):
        bar(axes[2], names[name], lines[f"S12/{name}"].line, 6.0)
    means = [person_means(latency[name], TIME).mean() / first for name in names]
    paired(axes[2], list(names.values()), means, ratios_of(latency, "as it is"))
    axes[2].set_xlabel("latency, more or less [ms]")
    axes[2].set_ylabel("movement time, as it is = 1")
    axes[2].set_title("Latency")
    text = (
        "Steering through tunnels. Left: the steering law. Middle: the variance grows with the "
        "square of the index (Wang et al. 2021). Right: movement time with 16.7 ms less or more of "
        "latency; of the published effect only the sign is asked for, grey are the bands."
    )
    return finish(figure, "steering", "Steering through tunnels", text)


def _waiting(lines: ByLine, cells: Cells) -> Drawn:
    figure, [[times, waits, added]] = panels(1, 3, 2.9, width_ratios=[1.6, 1, 1])
    delays = np.array([float(name) for name in cells])
    means = [person_means(trials, TIME) for trials in cells.values()]
    line = fit_line(delays, [m.mean() for m in means])
    points(times, delays.tolist(), means, BLUE)
    ends = np.array([delays.min(), delays.max()])
    times.plot(ends, line.intercept + line.slope * ends, color=SOFT, lw=1.0, zorder=1)
    times.set_ylabel("completion time [s]")
    r2 = lines["S13/linear"].found.value
    times.set_title(f"Completion time: slope {round(line.slope, 2) + 0.0:.2f}, R² {_said(r2, 4)}")
    points(waits, delays.tolist(), [person_means(t, "waits") for t in cells.values()], BLUE)
    waits.axhspan(line.slope - 0.5, line.slope + 0.5, color=FAINT, alpha=0.55, lw=0)
    waits.set_ylabel("waits in a trial")
    waits.set_title("Waits, and the slope ± 0.5")
    for axes in (times, waits):
        axes.set_ylim(bottom=0)
        axes.set_xlabel("delay [s]")
    _excavator(added, lines["S17/increase"])
    text = (
        "Left and middle: positioning over delays of 1 s and more (Ferrell 1965); if one moves, "
        "waits for what it did and moves again, each wait adds a delay, so the slope is the number "
        "of waits. Right: an excavator at 1.5 s; the ring is published, grey is its band."
    )
    return finish(figure, "waiting", "Moving and waiting", text)


def _excavator(axes: Axes, verdict: Verdict) -> None:
    """What the delay adds to its time."""
    bar(axes, 0, verdict.line, 0.5)
    ring(axes, 0, verdict.line)
    value(axes, 0, verdict)
    axes.set_xlim(-0.8, 0.8)
    axes.set_ylim(bottom=0)
    axes.set_xticks([0], ["at 1.5 s"])
    axes.set_ylabel("time added, share")
    axes.set_title("Excavator")


def _frames(lines: ByLine, cells: Cells) -> Drawn:
    figure, [[left, right]] = panels(1, 2, 3.0, sharey=True)
    delays, gaps, times = of.frame_points(cells)
    c = lines["S15/c"].found.value
    for rate, colour in zip(of.FRAME_RATES, reversed(_SHADES), strict=True):
        own = np.isclose(gaps, 1.0 / rate)
        left.plot(delays[own], times[own], "o-", color=colour, ms=5, lw=1.2, label=f"{rate} /s")
        right.plot(delays[own] + c * gaps[own], times[own], "o", color=colour, ms=5)
    x = delays + c * gaps
    grid = np.linspace(x.min(), x.max(), 100)
    right.plot(grid, np.polyval(np.polyfit(x, times, 2), grid), color=SOFT, lw=1.0, zorder=1)
    left.set_xlabel("delay [s]")
    left.set_ylabel("movement time [s]")
    left.set_title("By frame rate")
    left.legend(fontsize=8, title="frames")
    right.set_xlabel(f"delay + {c:.2f} / frame rate [s]")
    edge = ", factor at the edge of what was tried" if c in of.TRIED["S15/c"] else ""
    right.set_title(f"On one line: R² {_said(lines['S15/collapse'].found.value, 3)}{edge}")
    text = (
        "Pointing at several frame rates and delays. If a frame rate acts as a delay of a share c "
        "of the time between frames, all lie on one curve. From memory in part, so not counted."
    )
    return finish(figure, "frames", "Frame rate as delay", text)


def _said(value: float, digits: int) -> str:
    """A number, if it is one."""
    return "none" if np.isnan(value) else f"{value:.{digits}f}"


def _tracking(lines: ByLine, cells: Cells) -> Drawn:
    figure, [[axes]] = panels(1, 1, 3.0)
    trials = cells["tracking"]
    crossover, margin = lines["S14/crossover"].line, lines["S14/margin"].line
    low, high = crossover.low or 0.0, crossover.high or 0.0
    below, above = margin.low or 0.0, margin.high or 0.0
    axes.fill_between([low, high], below, above, color=FAINT, alpha=0.55, lw=0, label="band")
    axes.plot(trials["crossover_rad_s"], trials["phase_margin_deg"], "o", color=BLUE, ms=5)
    axes.set_xlim(0, max(5.4, 1.1 * np.nanmax(trials["crossover_rad_s"], initial=0.0)))
    axes.set_ylim(0, 95)
    axes.set_xlabel("crossover frequency [rad/s]")
    axes.set_ylabel("phase margin [deg]")
    axes.legend(loc="upper right", fontsize=8)
    text = (
        "Following a target that moves as a sum of sines: each mark is a person, read off the "
        "open loop. The band is from memory, so this is not counted."
    )
    return finish(figure, "tracking", "Following a moving target", text)
