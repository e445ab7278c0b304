"""Figures of a validation: what is simulated beside what was published, with its bands.

First all published lines at once, then each experiment; what is exact stands in the tables.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dva_sim.agents.operator.published import LineKind, TargetLine
from dva_sim.experiments.report.figures.palette import FAINT, INK, SOFT
from dva_sim.experiments.report.figures.style import Drawn, panels, styled
from dva_sim.simulation.task.movement_laws import FittedLine, fit_line
from dva_sim.validation.frame import captioned
from dva_sim.validation.operators import experiments as of
from dva_sim.validation.operators.people_figures import draw_curves
from dva_sim.validation.operators.trials import Cells, Floats, Trials, mean, person_means
from dva_sim.validation.operators.verdicts import LineVerdict

if TYPE_CHECKING:
    from matplotlib.axes import Axes


TIME = "movement_time_s"
BLUE = "#0072B2"
ORANGE = "#D55E00"
GREEN = "#009E73"
_RING: dict[str, Any] = {"marker": "o", "mfc": "none", "mec": ORANGE, "ms": 9, "mew": 1.5, "ls": ""}


def by(trials: Trials, key: str) -> tuple[Floats, Floats]:
    """Mean movement time of each value of a column."""
    rows = [(value, some[TIME].mean()) for (value,), some in trials.by(key)]
    values, times = np.array(rows).T
    return values, times


def against(axes: Axes, x: Sequence[float], own: Sequence[Trials], reference: Trials) -> None:
    """Mean movement times against that of a reference; intervals are each person's ratios."""
    first = person_means(reference, TIME)
    times = [person_means(trials, TIME) for trials in own]
    paired(axes, x, [t.mean() / first.mean() for t in times], [t / first for t in times])


def points(axes: Axes, x: Sequence[float], persons: Sequence[Floats], colour: str = BLUE) -> None:
    """Means over persons with their intervals, and a line through them."""
    paired(axes, x, [p.mean() for p in persons], persons, colour)


def paired(
    axes: Axes,
    x: Sequence[float],
    means: Sequence[float],
    persons: Sequence[Floats],
    colour: str = BLUE,
) -> None:
    """Plot given means with 95 % intervals computed from the persons."""
    halves = [float(1.96 * p.std(ddof=1) / np.sqrt(len(p))) for p in persons]
    look: dict[str, Any] = {"fmt": "o-", "color": colour, "ms": 5, "lw": 1.2, "elinewidth": 1.4}
    axes.errorbar(x, means, yerr=halves, clip_on=False, **look)


def through(axes: Axes, line: FittedLine, ends: tuple[float, float], **look: Any) -> None:
    """A fitted line from one end to the other."""
    axes.plot(ends, [line.intercept + line.slope * end for end in ends], **look)


def straight(axes: Axes, x: Floats, y: Floats, verdict: LineVerdict) -> None:
    """Points and the line through them, with how straight they are."""
    through(axes, fit_line(x, y), (0.0, x.max()), color=SOFT, lw=1.0, zorder=1)
    axes.plot(x, y, "o", color=BLUE, ms=5)
    low = verdict.line.low
    text = f"R² {verdict.found.value:.3f}, published at least {low:g}"
    axes.text(0.04, 0.95, text, transform=axes.transAxes, va="top", fontsize=8)
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=0)


def bar(axes: Axes, x: float, line: TargetLine, width: float) -> None:
    """A band as a grey bar."""
    low = line.low or 0.0
    high = line.high or 0.0
    axes.bar([x], [high - low], width, bottom=low, color=FAINT, alpha=0.8, lw=0, zorder=0)


def compared(axes: Axes, x: float, verdict: LineVerdict) -> None:
    """A band, the published number if there is one, and what is simulated, also in words."""
    line = verdict.line
    found = verdict.found
    bar(axes, x, line, 0.5)
    if line.target is not None:
        axes.plot([x], [line.target], **_RING)
    axes.plot([x, x], [found.low, found.high], color=BLUE, lw=1.4)
    axes.plot([x], [found.value], "o", color=BLUE, ms=6, clip_on=False, zorder=3)
    beside: dict[str, Any] = {"va": "center", "fontsize": 8, "color": INK}
    axes.annotate(
        f"{found.value:.2f}", (x, found.value), (9, 0), textcoords="offset points", **beside
    )


_SHADES = ("#56B4E9", BLUE, GREEN, ORANGE)  # from little to much

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
        left.plot(bits, times, "o", color=colour, ms=4)
        ends = bits.min(), bits.max()
        through(left, fit_line(bits, times), ends, color=colour, label=f"{lag} ms")
    left.set(
        xlabel="index of difficulty [bit]", ylabel="movement time [s]", title="Fitts' law by lag"
    )
    left.legend(loc="upper left", fontsize=8, title="lag")
    _ratios(right, lines, cells)
    slope = lines["S8/slope"]
    return captioned(
        figure,
        "lag",
        slope=slope.found.value,
        low=slope.line.low,
        high=slope.line.high,
        first=mean(cells[of.SHORTEST_LAG], TIME),
        published=0.001 * (lines["S7/time-8.3"].line.target or 0.0),
    )


def _ratios(axes: Axes, lines: ByLine, cells: Cells) -> None:
    """Movement times by lag, against the shortest lag."""
    published = [lines[f"S7/time-{lag}"].line.target or 0.0 for lag in of.PUBLISHED_LAGS]
    for lag, time in zip(of.PUBLISHED_LAGS, published, strict=True):
        ratio = time / published[0]  # the shortest lag's
        axes.plot([float(lag)], [ratio], **_RING)
    for lag in ("25", "75"):
        bar(axes, float(lag), lines[f"S7/{lag}"].line, 7.0)
    against(axes, [float(lag) for lag in cells], list(cells.values()), cells[of.SHORTEST_LAG])
    axes.plot([], [], "o-", color=BLUE, ms=5, label="simulated")
    axes.plot([], [], **_RING, label="published")
    axes.set(xlabel="lag [ms]", ylabel="movement time, 8.3 ms = 1", title="What lag costs")
    axes.legend(loc="upper left", fontsize=8)


def _tilt(lines: ByLine, cells: Cells) -> Drawn:
    figure, [[rates, times, tilts]] = panels(1, 3, 2.9)
    for place, name in enumerate(of.SELECTIONS):
        compared(rates, place, lines[f"S9/{name}"])
    rates.set_xticks([0, 1], ["first entry", "dwell 0.5 s"])
    rates.set(xlim=(-0.6, 1.6), ylabel="throughput [bit/s]", title="Throughput at a gain of 50")
    best = lines["S10/best"].line
    most = lines["S10/most-tilt"].line
    times.axvspan(best.low or 0.0, best.high or 0.0, color=FAINT, alpha=0.55, lw=0)
    tilts.axhspan(most.low or 0.0, most.high or 0.0, color=FAINT, alpha=0.55, lw=0)
    _by_gain(times, cells, TIME, 1.0)
    _by_gain(tilts, cells, "tilt_max_rad", 180.0 / np.pi)
    times.set(ylabel="movement time [s]", title="Which gain is best")
    tilts.set(ylabel="largest tilt [deg]", title="How far the hand tilts")
    for axes in (rates, times, tilts):
        axes.set_ylim(bottom=0)
    for axes in (times, tilts):
        axes.set_ylim(top=1.3 * axes.get_ylim()[1])  # room for the legend above the data
    return captioned(figure, "tilt")


def _by_gain(axes: Axes, cells: Cells, name: str, scale: float) -> None:
    """A column by gain, a line for each way of selecting."""
    for selection, colour in zip(of.SELECTIONS, (BLUE, GREEN), strict=True):
        own = {gain: cells[of.tilt_cell(gain, selection)] for gain in of.GAINS}
        persons = [scale * person_means(trials, name) for trials in own.values()]
        points(axes, list(own), persons, colour)
        axes.plot([], [], "o-", color=colour, ms=5, label=selection.replace("-", " "))
    axes.set_xscale("log", base=2)
    axes.set_xticks(list(of.GAINS), [str(gain) for gain in of.GAINS])
    axes.set_xlabel("gain [pixels/s per degree]")
    axes.legend(fontsize=8, loc="upper left")


def _steering(lines: ByLine, tunnel: Cells, latency: Cells) -> Drawn:
    figure, [axes] = panels(1, 3, 2.9)
    ids, times, variances = of.steering_points(tunnel["tunnel"])
    straight(axes[0], ids, times, lines["S11/mean"])
    axes[0].set(
        xlabel="index of difficulty, length / width", ylabel="movement time [s]", title="Mean"
    )
    straight(axes[1], ids**2, variances, lines["S11/variance"])
    axes[1].set(xlabel="its square", ylabel="variance of it [s²]", title="Variance")
    names = {"less": -1000 * of.STEP_S, "as it is": 0.0, "more": 1000 * of.STEP_S}
    for name in ("less", "more"):
        bar(axes[2], names[name], lines[f"S12/{name}"].line, 6.0)
    own = [latency[name] for name in names]
    against(axes[2], list(names.values()), own, latency["as it is"])
    axes[2].set(
        xlabel="latency, more or less [ms]", ylabel="movement time, as it is = 1", title="Latency"
    )
    return captioned(figure, "steering")


def _waiting(lines: ByLine, cells: Cells) -> Drawn:
    figure, [[times, waits, added]] = panels(1, 3, 2.9, width_ratios=[1.6, 1, 1])
    delays = np.array([float(name) for name in cells])
    means = [person_means(trials, TIME) for trials in cells.values()]
    line = fit_line(delays, [m.mean() for m in means])
    points(times, delays.tolist(), means)
    through(times, line, (delays.min(), delays.max()), color=SOFT, lw=1.0, zorder=1)
    times.set_ylabel("completion time [s]")
    r2 = lines["S13/linear"].found.value
    times.set_title(f"Completion time: slope {round(line.slope, 2) + 0.0:.2f}, R² {_fixed(r2, 4)}")
    points(waits, delays.tolist(), [person_means(t, "waits") for t in cells.values()])
    waits.axhspan(line.slope - 0.5, line.slope + 0.5, color=FAINT, alpha=0.55, lw=0)
    waits.set(ylabel="waits in a trial", title="Waits, and the slope ± 0.5")
    for axes in (times, waits):
        axes.set_ylim(bottom=0)
        axes.set_xlabel("delay [s]")
    _excavator(added, lines["S17/increase"])
    return captioned(figure, "waiting")


def _excavator(axes: Axes, verdict: LineVerdict) -> None:
    """Plot the time added by the delay."""
    compared(axes, 0, verdict)
    axes.set_xlim(-0.8, 0.8)
    axes.set_ylim(bottom=0)
    axes.set_xticks([0], ["at 1.5 s"])
    axes.set(ylabel="time added, share", title="Excavator")


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
    left.set(xlabel="delay [s]", ylabel="movement time [s]", title="By frame rate")
    left.legend(fontsize=8, title="frames")
    right.set_xlabel(f"delay + {c:.2f} / frame rate [s]")
    edge = ", factor at the edge of what was tried" if c in of.TRIED["S15/c"] else ""
    right.set_title(f"On one line: R² {_fixed(lines['S15/collapse'].found.value, 3)}{edge}")
    return captioned(figure, "frames")


def _fixed(value: float, digits: int) -> str:
    """A number, if it is one."""
    return "none" if np.isnan(value) else f"{value:.{digits}f}"


def _tracking(lines: ByLine, cells: Cells) -> Drawn:
    figure, [[axes]] = panels(1, 1, 3.0)
    trials = cells["tracking"]
    crossover = lines["S14/crossover"].line
    margin = lines["S14/margin"].line
    low = crossover.low or 0.0
    high = crossover.high or 0.0
    below = margin.low or 0.0
    above = margin.high or 0.0
    axes.fill_between([low, high], below, above, color=FAINT, alpha=0.55, lw=0, label="band")
    axes.plot(trials["crossover_rad_s"], trials["phase_margin_deg"], "o", color=BLUE, ms=5)
    axes.set_xlim(0, max(5.4, 1.1 * np.nanmax(trials["crossover_rad_s"], initial=0.0)))
    axes.set_ylim(0, 95)
    axes.set_xlabel("crossover frequency [rad/s]")
    axes.set_ylabel("phase margin [deg]")
    axes.legend(loc="upper right", fontsize=8)
    return captioned(figure, "tracking")


_COLOURS = {"passes": BLUE, "misses": ORANGE, "shown only": SOFT}
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
        return [_overview(verdicts), *draw_people(verdicts, played), *draw_curves(played)]


def _overview(verdicts: Sequence[LineVerdict]) -> Drawn:
    """All that was measured on persons, each line by its own band."""
    shown = [v for kind in _PEOPLE for v in verdicts if v.line.kind == kind]
    figure, [[axes]] = panels(1, 1, 0.9 + _ROW * (len(shown) + 2 * len(_PEOPLE)))
    axes.axvspan(-1, 1, color=FAINT, alpha=0.55, lw=0)
    axes.axvline(0, color="white", lw=1.0)
    row = 0.0
    ticks = []
    labels = []
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
    axes.set(ylim=(row + 0.2, 0.3), xlim=(-_LIMIT, _LIMIT))
    axes.set_xticks([-1, 0, 1], ["low end", "middle of the band", "high end"])
    axes.grid(visible=False)
    axes.tick_params(axis="y", length=0)
    for word, colour in _COLOURS.items():
        axes.plot([], [], "o-", color=colour, ms=5, lw=1.4, label=word)
    axes.plot([], [], "|", color=INK, ms=9, mew=1.4, label="published number")
    axes.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=4, fontsize=8, borderpad=0)
    return captioned(figure, "overview")


def _mark(axes: Axes, row: float, verdict: LineVerdict) -> None:
    low = verdict.line.low
    high = verdict.line.high
    if low is None or high is None:
        return
    middle = 0.5 * (low + high)
    half = 0.5 * (high - low)
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
