"""Figures of the experiments: simulated persons beside published ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from dva_sim.experiments.figures.style import FAINT, INK, SOFT, Drawn, finish, panels
from dva_sim.experiments.validation.operators import experiments as of
from dva_sim.experiments.validation.operators.judging import Verdict
from dva_sim.experiments.validation.operators.targets import Line
from dva_sim.experiments.validation.operators.trials import Cells, Floats, Trials, person_means
from dva_sim.tasks.measures import fit_line

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SHADES = ("#56B4E9", "#0072B2", "#009E73", "#D55E00")  # from little to much
_TIME = "movement_time_s"
_BLUE, _ORANGE = "#0072B2", "#D55E00"
_PUBLISHED_MS = {"8.3": 911, "25": 934, "75": 1059}

ByLine = Mapping[str, Verdict]


def draw_people(verdicts: Sequence[Verdict], played: Mapping[str, Cells]) -> list[Drawn]:
    """One figure for each experiment."""
    lines = {v.line.id: v for v in verdicts}
    return [
        _lag(lines, played["lag"]),
        _tilt(lines, played["tilt"]),
        _steering(lines, played["steering"], played["latency"]),
        _waiting(lines, played["waiting"], played["excavator"]),
        _frames(lines, played["frames"]),
        _tracking(lines, played["tracking"]),
    ]


def _lag(lines: ByLine, cells: Cells) -> Drawn:
    figure, [[left, right]] = panels(1, 2, 3.1)
    for (lag, trials), colour in zip(cells.items(), _SHADES, strict=True):
        bits, times = _by(trials, "id_bits")
        line = fit_line(bits, times)
        left.plot(bits, times, "o", color=colour, ms=4)
        ends = np.array([bits.min(), bits.max()])
        left.plot(ends, line.intercept + line.slope * ends, color=colour, label=f"{lag} ms")
    left.set_xlabel("index of difficulty [bit]")
    left.set_ylabel("movement time [s]")
    left.set_title("Fitts' law by lag")
    left.legend(loc="upper left", fontsize=8, title="lag")
    _ratios(right, lines, cells)
    slope = lines["S8/slope"]
    text = (
        "Pointing with a mouse whose cursor is late (MacKenzie & Ware 1993). Left: means of each "
        "condition and lines through them. Right: movement time against that at 8.3 ms; rings are "
        f"published, grey are the bands. A millisecond of lag costs {slope.found.value:.2f} ms at "
        f"4 bits; the band is {slope.line.low:g} to {slope.line.high:g}."
    )
    return finish(figure, "lag", "Pointing under lag", text)


def _ratios(axes: Axes, lines: ByLine, cells: Cells) -> None:
    """Movement times by lag, against the shortest lag."""
    shortest = _PUBLISHED_MS[of.SHORTEST_LAG]
    first = person_means(cells[of.SHORTEST_LAG], _TIME).mean()
    for lag, published in _PUBLISHED_MS.items():
        axes.plot([float(lag)], [published / shortest], "o", mfc="none", mec=_ORANGE, ms=9, mew=1.5)
    for lag in ("25", "75"):
        _bar(axes, float(lag), lines[f"S7/{lag}"].line, 7.0)
    lags = [float(lag) for lag in cells]
    means = [person_means(t, _TIME).mean() / first for t in cells.values()]
    _paired(axes, lags, means, _ratios_of(cells, of.SHORTEST_LAG))
    axes.plot([], [], "o-", color=_BLUE, ms=5, label="simulated")
    axes.plot([], [], "o", mfc="none", mec=_ORANGE, ms=9, mew=1.5, label="published")
    axes.set_xlabel("lag [ms]")
    axes.set_ylabel("movement time, 8.3 ms = 1")
    axes.set_title("What lag costs")
    axes.legend(loc="upper left", fontsize=8)


def _tilt(lines: ByLine, cells: Cells) -> Drawn:
    figure, [axes] = panels(1, 3, 2.9)
    for place, name in enumerate(of.SELECTIONS):
        verdict = lines[f"S9/{name}"]
        _bar(axes[0], place, verdict.line, 0.5)
        _ring(axes[0], place, verdict.line)
        _value(axes[0], place, verdict)
    axes[0].set_xticks([0, 1], ["first entry", "dwell 0.5 s"])
    axes[0].set_xlim(-0.6, 1.6)
    axes[0].set_ylim(bottom=0)
    axes[0].set_ylabel("throughput [bit/s]")
    axes[0].set_title("Throughput at a gain of 50")
    for (name, _), colour in zip(of.SELECTIONS.items(), (_BLUE, "#009E73"), strict=True):
        own = {gain: cells[of.tilt_cell(gain, name)] for gain in of.GAINS}
        label = name.replace("-", " ")
        _curve(axes[1], own, _TIME, 1.0, colour, label)
        _curve(axes[2], own, "hand_most", 180.0 / np.pi, colour, label)
    axes[1].set_ylim(bottom=0)
    axes[1].set_ylabel("movement time [s]")
    axes[1].set_title("Which gain is best")
    axes[1].axvspan(50, 100, color=FAINT, alpha=0.55, lw=0)
    line = lines["S10/most-tilt"].line
    axes[2].axhspan(line.low or 0.0, line.high or 0.0, color=FAINT, alpha=0.55, lw=0)
    axes[2].set_ylim(bottom=0)
    axes[2].set_ylabel("largest tilt [deg]")
    axes[2].set_title("How far the hand tilts")
    for one in axes[1:]:
        one.set_xscale("log", base=2)
        one.set_xticks(list(of.GAINS), [str(g) for g in of.GAINS])
        one.set_xlabel("gain [pixels/s per degree]")
        one.legend(fontsize=8)
    text = (
        "Pointing by tilt with velocity control (MacKenzie & Teather 2012), which the operators "
        "were fitted to: shown, not counted. Rings are published, grey are bands."
    )
    return finish(figure, "tilt", "Pointing by tilt", text)


def _steering(lines: ByLine, tunnel: Cells, latency: Cells) -> Drawn:
    figure, [axes] = panels(1, 3, 2.9)
    ids, times, variances = of.steering_points(tunnel["tunnel"])
    _straight(axes[0], ids, times, lines["S11/mean"])
    axes[0].set_xlabel("index of difficulty, length / width")
    axes[0].set_ylabel("movement time [s]")
    axes[0].set_title("Mean")
    _straight(axes[1], ids**2, variances, lines["S11/variance"])
    axes[1].set_xlabel("its square")
    axes[1].set_ylabel("variance of it [s²]")
    axes[1].set_title("Variance")
    first = person_means(latency["as it is"], _TIME).mean()
    names = {"less": -1000 * of.STEP_S, "as it is": 0.0, "more": 1000 * of.STEP_S}
    for name in ("less", "more"):
        _bar(axes[2], names[name], lines[f"S12/{name}"].line, 6.0)
    means = [person_means(latency[name], _TIME).mean() / first for name in names]
    _paired(axes[2], list(names.values()), means, _ratios_of(latency, "as it is"))
    axes[2].set_xlabel("latency, more or less [ms]")
    axes[2].set_ylabel("movement time, as it is = 1")
    axes[2].set_title("Latency")
    text = (
        "Steering through tunnels. Left: the steering law. Middle: the variance grows with the "
        "square of the index (Wang et al. 2021). Right: movement time with 16.7 ms less or more of "
        "latency; of the published effect only the sign is asked for, grey are the bands."
    )
    return finish(figure, "steering", "Steering through tunnels", text)


def _waiting(lines: ByLine, cells: Cells, excavator: Cells) -> Drawn:
    figure, [axes] = panels(1, 3, 2.9, width_ratios=[1.6, 1, 1])
    delays = np.array([float(name) for name in cells])
    means = [person_means(trials, _TIME) for trials in cells.values()]
    _points(axes[0], delays.tolist(), means, _BLUE)
    line = fit_line(delays, [m.mean() for m in means])
    ends = np.array([delays.min(), delays.max()])
    axes[0].plot(ends, line.intercept + line.slope * ends, color=SOFT, lw=1.0, zorder=1)
    axes[0].set_ylim(bottom=0)
    axes[0].set_xlabel("delay [s]")
    axes[0].set_ylabel("completion time [s]")
    axes[0].set_title(f"Completion time: slope {line.slope:.2f}, R² {line.r2:.4f}")
    _points(axes[1], delays.tolist(), [person_means(t, "waits") for t in cells.values()], _BLUE)
    axes[1].axhspan(line.slope - 0.5, line.slope + 0.5, color=FAINT, alpha=0.55, lw=0)
    axes[1].set_ylim(bottom=0)
    axes[1].set_xlabel("delay [s]")
    axes[1].set_ylabel("waits in a trial")
    axes[1].set_title("Waits, and the slope ± 0.5")
    verdict = lines["S17/increase"]
    _bar(axes[2], 0, verdict.line, 0.5)
    _ring(axes[2], 0, verdict.line)
    _value(axes[2], 0, verdict)
    axes[2].set_xlim(-0.8, 0.8)
    axes[2].set_ylim(bottom=0)
    axes[2].set_xticks([0], ["at 1.5 s"])
    axes[2].set_ylabel("time added, share")
    axes[2].set_title("Excavator")
    text = (
        "Left and middle: positioning over delays of 1 s and more (Ferrell 1965); if one moves, "
        "waits for what it did and moves again, each wait adds a delay, so the slope is the number "
        "of waits. Right: an excavator at 1.5 s; the ring is published, grey is its band."
    )
    return finish(figure, "waiting", "Moving and waiting", text)


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
    right.set_title(f"On one line: R² {lines['S15/collapse'].found.value:.3f}")
    text = (
        "Pointing at several frame rates and delays. If a frame rate acts as a delay of a share c "
        "of the time between frames, all lie on one curve. From memory in part, so not counted."
    )
    return finish(figure, "frames", "Frame rate as delay", text)


def _tracking(lines: ByLine, cells: Cells) -> Drawn:
    figure, [[axes]] = panels(1, 1, 3.0)
    trials = cells["tracking"]
    crossover, margin = lines["S14/crossover"].line, lines["S14/margin"].line
    low, high = crossover.low or 0.0, crossover.high or 0.0
    below, above = margin.low or 0.0, margin.high or 0.0
    axes.fill_between([low, high], below, above, color=FAINT, alpha=0.55, lw=0, label="band")
    axes.plot(trials["crossover_rad_s"], trials["phase_margin_deg"], "o", color=_BLUE, ms=5)
    axes.set_xlim(0, max(5.4, 1.1 * np.nanmax(trials["crossover_rad_s"], initial=0.0)))
    axes.set_ylim(0, max(95.0, 1.1 * np.nanmax(trials["phase_margin_deg"], initial=0.0)))
    axes.set_xlabel("crossover frequency [rad/s]")
    axes.set_ylabel("phase margin [deg]")
    axes.legend(loc="upper right", fontsize=8)
    text = (
        "Following a target that moves as a sum of sines: each mark is a person, read off the "
        "open loop. The band is from memory, so this is not counted."
    )
    return finish(figure, "tracking", "Following a moving target", text)


# --- strokes ---------------------------------------------------------------------------------


def _by(trials: Trials, key: str) -> tuple[Floats, Floats]:
    """Mean movement time of each value of a column."""
    rows = [(value, some[_TIME].mean()) for (value,), some in trials.by(key)]
    values, times = np.array(rows).T
    return values, times


def _ratios_of(cells: Cells, reference: str) -> list[Floats]:
    """Each person's mean time in each cell, against its own in one of them."""
    own = person_means(cells[reference], _TIME)
    return [person_means(trials, _TIME) / own for trials in cells.values()]


def _half(values: Floats) -> float:
    """Half of a 95 % interval of a mean over persons."""
    return float(1.96 * values.std(ddof=1) / np.sqrt(len(values)))


def _points(axes: Axes, x: list[float], persons: Sequence[Floats], colour: str) -> None:
    """Means over persons with their intervals, and a line through them."""
    _paired(axes, x, [p.mean() for p in persons], persons, colour)


def _paired(
    axes: Axes,
    x: list[float],
    means: Sequence[float],
    persons: Sequence[Floats],
    colour: str = _BLUE,
) -> None:
    halves = [_half(p) for p in persons]
    axes.errorbar(x, means, yerr=halves, fmt="o-", color=colour, ms=5, lw=1.2, elinewidth=1.4)


def _curve(
    axes: Axes, own: Mapping[int, Trials], name: str, scale: float, colour: str, label: str
) -> None:
    _points(
        axes, list(map(float, own)), [scale * person_means(t, name) for t in own.values()], colour
    )
    axes.plot([], [], "o-", color=colour, ms=5, label=label)


def _straight(axes: Axes, x: Floats, y: Floats, verdict: Verdict) -> None:
    line = fit_line(x, y)
    ends = np.array([0.0, x.max()])
    axes.plot(ends, line.intercept + line.slope * ends, color=SOFT, lw=1.0, zorder=1)
    axes.plot(x, y, "o", color=_BLUE, ms=5)
    low = verdict.line.low
    text = f"R² {verdict.found.value:.3f}, published at least {low:g}"
    axes.text(0.04, 0.95, text, transform=axes.transAxes, va="top", fontsize=8)
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=0)


def _bar(axes: Axes, x: float, line: Line, width: float) -> None:
    """A band as a grey bar."""
    low, high = line.low or 0.0, line.high or 0.0
    axes.bar([x], [high - low], width, bottom=low, color=FAINT, alpha=0.8, lw=0, zorder=0)


def _ring(axes: Axes, x: float, line: Line) -> None:
    """The published number, if there is one."""
    if line.target is not None:
        axes.plot([x], [line.target], "o", mfc="none", mec=_ORANGE, ms=9, mew=1.5)


def _value(axes: Axes, x: float, verdict: Verdict) -> None:
    """A simulated value with its interval, and in words."""
    found = verdict.found
    axes.plot([x, x], [found.low, found.high], color=_BLUE, lw=1.4)
    axes.plot([x], [found.value], "o", color=_BLUE, ms=6)
    axes.annotate(
        f"{found.value:.2f}",
        (x, found.value),
        (9, 0),
        textcoords="offset points",
        va="center",
        fontsize=8,
        color=INK,
    )
