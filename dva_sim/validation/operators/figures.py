"""Figures of a validation: what is simulated beside what was published, with its bands.

First what is exact (delayed loops, the dissertation's median), then the experiments, then all.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dva_sim.agents.operator.published import LineKind, TargetLine
from dva_sim.experiments.report.figures.palette import FAINT, INK, SOFT
from dva_sim.experiments.report.figures.style import Drawn, finish, panels, styled
from dva_sim.simulation.task.measures import fit_line
from dva_sim.validation.operators import exact
from dva_sim.validation.operators import experiments as of
from dva_sim.validation.operators.exact import SMITH
from dva_sim.validation.operators.verdicts import (
    Cells,
    Floats,
    LineVerdict,
    Trials,
    mean,
    person_means,
)

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
    _around(axes[0], exact.integrator, math.pi / 2, "Cursor: gain x delay")
    _around(axes[1], exact.pure_pursuit, 0.5205, "Pursuit: speed x delay / look-ahead")
    axes[0].set_ylabel("error, first one = 1")
    _smith(axes[2])
    text = (
        "Left and middle: loops that the strategies close themselves just below, at and above the "
        "critical value that theory gives. Right: the strategy Predictor as a Smith predictor "
        "(cursor, gain 4 /s, delay 0.5 s) answers a step as if there were no delay, only later; "
        "the ring is the published value."
    )
    return finish(figure, "loops", "Where delayed loops become unstable", text)


def _around(axes: Axes, loop: exact.Loop, critical: float, title: str) -> None:
    """Errors over time for values around the critical one."""
    times = np.arange(1, _SHOWN * exact.STEPS + 1) / exact.STEPS
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
    places = np.array(exact.smith_response(gain, delay, 2.0))
    times = np.arange(1, len(places) + 1) * delay / exact.SMITH_STEPS
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
    levels, look = np.array(exact.STEP_LEVELS), exact.STEP_LOOK
    steps.plot(np.arange(len(levels)) / exact.RATE, levels, color=SOFT, lw=1.2, label="asked for")
    for name, colour in ((exact.COPY, _BLUE), (exact.IN_PLACE, _ORANGE)):
        outputs = exact.step_outputs(name)
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
    for place, (name, age) in enumerate(exact.ages().items()):
        low, high = bands[name]
        axes.bar([place], [high - low], 0.7, bottom=low, color=SOFT, alpha=0.25, lw=0)
        axes.plot([place], [age], "o", color=_BLUE, ms=7)
        axes.text(place + 0.12, age, f"{age:.3f}", va="center", fontsize=8)
    axes.set_xticks([0, 1], ["fresh slots\nonly", "3 stale\nslots"])
    axes.set_xlim(-0.6, 1.8)
    axes.set_ylim(0.40, 0.58)
    axes.set_ylabel("mean age [s]")
    axes.set_title("Age, longest delay 0.5 s")


TIME = "movement_time_s"
BLUE, ORANGE = "#0072B2", "#D55E00"


def by(trials: Trials, key: str) -> tuple[Floats, Floats]:
    """Mean movement time of each value of a column."""
    rows = [(value, some[TIME].mean()) for (value,), some in trials.by(key)]
    values, times = np.array(rows).T
    return values, times


def ratios_of(cells: Cells, reference: str) -> list[Floats]:
    """Each person's mean time in each cell, against its own in one of them."""
    own = person_means(cells[reference], TIME)
    return [person_means(trials, TIME) / own for trials in cells.values()]


def half(values: Floats) -> float:
    """Half of a 95 % interval of a mean over persons."""
    return float(1.96 * values.std(ddof=1) / np.sqrt(len(values)))


def points(axes: Axes, x: list[float], persons: Sequence[Floats], colour: str) -> None:
    """Means over persons with their intervals, and a line through them."""
    paired(axes, x, [p.mean() for p in persons], persons, colour)


def paired(
    axes: Axes,
    x: list[float],
    means: Sequence[float],
    persons: Sequence[Floats],
    colour: str = BLUE,
) -> None:
    """The same with the means given, and intervals from the persons."""
    halves = [half(p) for p in persons]
    look: dict[str, Any] = {"fmt": "o-", "color": colour, "ms": 5, "lw": 1.2, "elinewidth": 1.4}
    axes.errorbar(x, means, yerr=halves, clip_on=False, **look)


def curve(
    axes: Axes, own: Mapping[int, Trials], name: str, scale: float, colour: str, label: str
) -> None:
    """A column by gain, named for the key."""
    points(
        axes, list(map(float, own)), [scale * person_means(t, name) for t in own.values()], colour
    )
    axes.plot([], [], "o-", color=colour, ms=5, label=label)


def straight(axes: Axes, x: Floats, y: Floats, verdict: LineVerdict) -> None:
    """Points and the line through them, with how straight they are."""
    line = fit_line(x, y)
    ends = np.array([0.0, x.max()])
    axes.plot(ends, line.intercept + line.slope * ends, color=SOFT, lw=1.0, zorder=1)
    axes.plot(x, y, "o", color=BLUE, ms=5)
    low = verdict.line.low
    text = f"R² {verdict.found.value:.3f}, published at least {low:g}"
    axes.text(0.04, 0.95, text, transform=axes.transAxes, va="top", fontsize=8)
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=0)


def bar(axes: Axes, x: float, line: TargetLine, width: float) -> None:
    """A band as a grey bar."""
    low, high = line.low or 0.0, line.high or 0.0
    axes.bar([x], [high - low], width, bottom=low, color=FAINT, alpha=0.8, lw=0, zorder=0)


def ring(axes: Axes, x: float, line: TargetLine) -> None:
    """The published number, if there is one."""
    if line.target is not None:
        axes.plot([x], [line.target], "o", mfc="none", mec=ORANGE, ms=9, mew=1.5)


def value(axes: Axes, x: float, verdict: LineVerdict) -> None:
    """A simulated value with its interval, and in words."""
    found = verdict.found
    axes.plot([x, x], [found.low, found.high], color=BLUE, lw=1.4)
    axes.plot([x], [found.value], "o", color=BLUE, ms=6, clip_on=False, zorder=3)
    axes.annotate(
        f"{found.value:.2f}",
        (x, found.value),
        (9, 0),
        textcoords="offset points",
        va="center",
        fontsize=8,
        color=INK,
    )


_SHADES = ("#56B4E9", "#0072B2", "#009E73", "#D55E00")  # from little to much

ByLine = Mapping[str, LineVerdict]


def draw_people(verdicts: Sequence[LineVerdict], played: Mapping[str, Cells]) -> list[Drawn]:
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


def _excavator(axes: Axes, verdict: LineVerdict) -> None:
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


_COLOURS = {"passes": "#0072B2", "misses": "#D55E00", "shown only": SOFT}
_PEOPLE: tuple[LineKind, ...] = ("held-out", "fitted", "remembered")
_TITLES = {
    "held-out": "Held out: counted",
    "fitted": "Fitted to: shown only",
    "remembered": "From memory: shown only",
}
_ROW = 0.27  # [in]
_LIMIT = 1.6  # half widths of the band shown; what is further off stands at the edge


def draw_all(verdicts: Sequence[LineVerdict], played: Mapping[str, Cells]) -> list[Drawn]:
    """Every figure."""
    with styled():
        return [_overview(verdicts), *draw_people(verdicts, played), *draw_exact()]


def _overview(verdicts: Sequence[LineVerdict]) -> Drawn:
    """All that was measured on persons, each line by its own band."""
    shown = [v for kind in _PEOPLE for v in verdicts if v.line.kind == kind]
    figure, [[axes]] = panels(1, 1, 0.9 + _ROW * (len(shown) + 2 * len(_PEOPLE)))
    axes.axvspan(-1, 1, color=FAINT, alpha=0.55, lw=0)
    axes.axvline(0, color="white", lw=1.0)
    row, ticks, labels = 0.0, [], []
    for kind in _PEOPLE:
        own = [v for v in shown if v.line.kind == kind]
        row += 1.0
        axes.text(-_LIMIT - 0.02, row, _TITLES[kind], ha="right", va="center", weight="bold")
        for verdict in own:
            row += 1.0
            ticks.append(row)
            labels.append(f"{verdict.line.what}  ({verdict.line.check})")
            _mark(axes, row, verdict)
        row += 0.6
    axes.set_yticks(ticks, labels)
    axes.set_ylim(row + 0.2, 0.3)
    axes.set_xlim(-_LIMIT, _LIMIT)
    axes.set_xticks([-1, 0, 1], ["low end", "middle of the band", "high end"])
    axes.grid(visible=False)
    axes.tick_params(axis="y", length=0)
    for word, colour in _COLOURS.items():
        axes.plot([], [], "o-", color=colour, ms=5, lw=1.4, label=word)
    axes.plot([], [], "|", color=INK, ms=9, mew=1.4, label="published number")
    axes.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=4, fontsize=8, borderpad=0)
    text = (
        "Each line is a published number; its band is drawn to one width, in grey. Marks are "
        "simulated, with 95 % Monte Carlo intervals over persons; an arrow points to what lies "
        "further off."
    )
    return finish(figure, "overview", "Simulated persons in the bands of published ones", text)


def _mark(axes: Axes, row: float, verdict: LineVerdict) -> None:
    low, high = verdict.line.low, verdict.line.high
    if low is None or high is None:
        return
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    colour = _COLOURS[verdict.word]
    value, left, right = (
        (x - middle) / half for x in (verdict.found.value, verdict.found.low, verdict.found.high)
    )
    if abs(value) > _LIMIT:
        side = _LIMIT - 0.06 if value > 0 else 0.06 - _LIMIT
        marker = ">" if value > 0 else "<"
        axes.plot([side], [row], marker, color=colour, ms=7, clip_on=False)
        return
    axes.plot([max(left, -_LIMIT), min(right, _LIMIT)], [row, row], color=colour, lw=1.4)
    if verdict.line.target is not None:
        axes.plot([(verdict.line.target - middle) / half], [row], "|", color=INK, ms=11, mew=1.4)
    axes.plot([value], [row], "o", color=colour, ms=6, clip_on=False, zorder=3)
