"""Figures of the comparison: predicted against measured, z, and what each mechanism is worth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from dva_sim.experiments.report.figures.palette import FAINT, INK, SOFT
from dva_sim.experiments.report.figures.style import Drawn, panels, styled
from dva_sim.validation.frame import captioned
from dva_sim.validation.network.comparison import NetworkComparison
from dva_sim.validation.network.pooling import standard_error
from dva_sim.validation.network.verdicts import (
    BOUNDED_SHARE,
    BY_NAME,
    KINDS,
    SHARES,
    TIME_MS,
    ComparedCell,
    ConditionKind,
    Floats,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure


_GOOD = "#0072B2"
_BAD = "#D55E00"
_PALE = "#9a9a9a"
_PAIRS = (
    ("applied_hz", None, "commands applied [1/s]"),
    ("age_p50", "age_p95", "age when applied [ms]"),
    ("stale_p50", "stale_p95", "age while in force [ms]"),
    ("rtt_p50", "rtt_p95", "round trip [ms]"),
)
_ROWS: dict[ConditionKind, str] = {
    "lossless": "without loss",
    "overload": "overload",
    "single": "single, under loss",
    "pooled": "pooled, under loss",
}
_WIDE = 60.0  # a logarithmic axis from here on shows tens only
_FARTHEST_Z = 6.5  # what is farther off stands at the edge
_FARTHEST = 1.6  # the same of predicted over measured


def draw_all(comparison: NetworkComparison) -> list[Drawn]:
    """Every figure there is something to draw for."""
    with styled():
        drawn = [_scatter(comparison), _ratios(comparison)]
        if comparison.pooled.scored:
            drawn.append(_scores(comparison))
        if comparison.controls:
            drawn.append(_variants(comparison))
    return drawn


def _scatter(comparison: NetworkComparison) -> Drawn:
    """Predicted against measured, a row for each kind of condition."""
    figure, axes = panels(len(KINDS), len(_PAIRS), 2.5)
    for panel in _panels(comparison, axes):
        for cell, marker, colour in panel.marks:
            bar = _bar(panel.kind, cell)
            _mark(panel.axes, cell.real, cell.model, bar, marker, colour, faint=0.5)
        if panel.marks:
            _diagonal(panel.axes, panel.kind, panel.is_time)
    _label(figure, axes, "predicted")
    return captioned(
        figure,
        "scatter",
        lossless=100 * SHARES["lossless"],
        overload=100 * SHARES["overload"],
        bounded=100 * BOUNDED_SHARE,
        time=TIME_MS,
    )


def _ratios(comparison: NetworkComparison) -> Drawn:
    """Ratios of predicted to measured, which make deviations visible."""
    figure, axes = panels(len(KINDS), len(_PAIRS), 1.9)
    for panel in _panels(comparison, axes):
        for cell, marker, colour in panel.marks:
            clipped = min(max(cell.model / cell.real, 1 / _FARTHEST), _FARTHEST)
            low, high = (value / cell.real for value in _bar(panel.kind, cell))
            _mark(panel.axes, cell.real, clipped, (low, high), marker, colour, faint=0.4)
        if panel.marks:
            _level(panel.axes, panel.kind, panel.is_time)
    _label(figure, axes, "predicted / measured")
    return captioned(figure, "ratios", farthest=_FARTHEST)


def _mark(
    axes: Axes,
    x: float,
    y: float,
    bar: tuple[float, float],
    marker: str,
    colour: str,
    faint: float,
) -> None:
    """A mark on the bar that the model expects it on, if that has a length."""
    if bar[1] > bar[0]:
        axes.plot([x] * 2, bar, color=colour, lw=0.6, alpha=faint)
    axes.plot(x, y, marker, color=colour, ms=3, mew=0, alpha=0.85)


@dataclass(frozen=True)
class _Panel:
    """One kind of condition and one pair of measures; each mark with its shape and colour."""

    axes: Axes
    kind: ConditionKind
    is_time: bool
    marks: list[tuple[ComparedCell, str, str]]


def _panels(comparison: NetworkComparison, axes: list[list[Axes]]) -> list[_Panel]:
    outside = comparison.outside
    shown = {id(v.cell) for v in comparison.verdicts if v.word == "shown only"}
    cells = [v.cell for v in comparison.verdicts]
    cells += [scored.cell for scored in comparison.pooled.scored]
    found = []
    for row, kind in zip(axes, KINDS, strict=True):
        for ax, (median, tail, label) in zip(row, _PAIRS, strict=True):
            marks = []
            for c in cells:
                if c.group.kind != kind or c.measure.name not in (median, tail):
                    continue
                if c.model > 0 and c.real > 0:
                    colour = _BAD if id(c) in outside else _PALE if id(c) in shown else _GOOD
                    marks.append((c, "^" if c.measure.is_tail else "o", colour))
            found.append(_Panel(ax, kind, label.endswith("[ms]"), marks))
    return found


def _label(figure: Figure, axes: list[list[Axes]], text: str) -> None:
    """Label rows and columns, and draw the legend."""
    for row, kind in zip(axes, KINDS, strict=True):
        row[0].set_ylabel(f"{_ROWS[kind]}\n{text}")
        for ax in row:
            if not ax.lines:
                ax.set(xticks=[], yticks=[])
    for ax, (_, _, label) in zip(axes[0], _PAIRS, strict=True):
        ax.set_title(label)
    for ax in axes[-1]:
        ax.set_xlabel("measured")
    corner = axes[0][0]
    for marker, words in (("o", "median, or rate"), ("^", "95th percentile")):
        corner.plot([], [], marker, color=_GOOD, ms=4, label=words)
    for colour, words in ((_BAD, "outside its band, or significant"), (_PALE, "not judged")):
        corner.plot([], [], "o", color=colour, ms=4, label=words)
    figure.legend(*corner.get_legend_handles_labels(), loc="outside upper left", ncols=4)


def _bar(kind: ConditionKind, cell: ComparedCell) -> tuple[float, float]:
    """Range in which the model expects the measured value."""
    least = 0.02 * cell.model  # a logarithmic axis has no zero
    if kind == "single":
        low, high = np.percentile(cell.predicted, (2.5, 97.5))
        return max(float(low), least), float(high)
    if kind == "pooled":
        half = 1.96 * standard_error(cell)
        return max(cell.model - half, least), cell.model + half
    return cell.model, cell.model


def _diagonal(axes: Axes, kind: ConditionKind, is_time: bool) -> None:
    """Draw the line of equality and the band around it."""
    axes.set(xscale="log", yscale="log")
    low = min(axes.get_xlim()[0], axes.get_ylim()[0])
    high = max(axes.get_xlim()[1], axes.get_ylim()[1])
    x = np.geomspace(low, high, 60)
    if kind in ("lossless", "overload"):
        half = SHARES[kind] * x + (TIME_MS if is_time and kind == "lossless" else 0.0)
        axes.fill_between(x, np.maximum(x - half, low), x + half, color=FAINT, alpha=0.8, lw=0)
        if kind == "overload":
            for side in (-1, 1):
                axes.plot(x, x * (1 + side * BOUNDED_SHARE), color=SOFT, lw=0.5, ls="--")
    axes.plot(x, x, color=SOFT, lw=0.6, zorder=0)
    axes.set(xlim=(low, high), ylim=(low, high), aspect="equal")
    for axis in (axes.xaxis, axes.yaxis):
        _log_ticks(axis, high / low)


def _level(axes: Axes, kind: ConditionKind, is_time: bool) -> None:
    """Draw the line of equality and its band, for predicted over measured."""
    from matplotlib.ticker import FixedLocator, NullLocator

    axes.set(xscale="log", yscale="log")
    low, high = axes.get_xlim()
    x = np.geomspace(low, high, 60)
    if kind in ("lossless", "overload"):
        half = SHARES[kind] + (TIME_MS / x if is_time and kind == "lossless" else 0.0 * x)
        least = np.maximum(1 - half, 0.1)
        axes.fill_between(x, least, 1 + half, color=FAINT, alpha=0.8, lw=0)
        if kind == "overload":
            for side in (-1, 1):
                axes.axhline(1 + side * BOUNDED_SHARE, color=SOFT, lw=0.5, ls="--")
    axes.axhline(1, color=SOFT, lw=0.6, zorder=0)
    axes.set(xlim=(low, high), ylim=(0.97 / _FARTHEST, 1.03 * _FARTHEST))
    _log_ticks(axes.xaxis, high / low)
    axes.yaxis.set_major_locator(FixedLocator([0.7, 0.8, 0.9, 1.0, 1.1, 1.25, 1.5]))
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_locator(NullLocator())


def _log_ticks(axis: Axis, reach: float) -> None:
    """Round places, as many as the reach wants."""
    from matplotlib.ticker import LogLocator, NullLocator

    subs = (1.0, 2.0, 5.0) if reach < _WIDE else (1.0,)
    axis.set_major_locator(LogLocator(subs=subs, numticks=5))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_locator(NullLocator())


def _scores(comparison: NetworkComparison) -> Drawn:
    """Distribution of z, overall and by measure."""
    pooled = comparison.pooled
    figure, [[left, right]] = panels(1, 2, 3.2, width_ratios=(1, 1.3))
    far = _FARTHEST_Z
    z = np.clip([scored.z for scored in pooled.scored], -far, far)
    edges = np.arange(-far - 0.5, far + 0.75, 0.5)
    counts, *_ = left.hist(z, edges.tolist(), color=_GOOD, alpha=0.8)
    left.set_ylim(0, 1.35 * float(np.max(counts)))  # room for the words
    x = np.linspace(-4, 4, 200)
    normal = 0.5 * len(z) * np.exp(-(x**2) / 2) / np.sqrt(2 * np.pi)
    left.plot(x, normal, color=INK, lw=1.0, label="normal law")
    low, high = pooled.expected
    words = f"root mean square {pooled.rms:.2f}\nexpected {low:.2f} to {high:.2f}"
    left.text(0.03, 0.96, words, transform=left.transAxes, va="top", fontsize=8)
    left.set(
        xlabel="z: predicted minus measured, in standard errors", ylabel="measures of conditions"
    )
    left.legend(loc="upper right", fontsize=8)
    significant = {id(scored) for scored in pooled.significant}
    names = [name for name in BY_NAME if any(s.cell.measure.name == name for s in pooled.scored)]
    for place, name in enumerate(reversed(names)):
        own = [s for s in pooled.scored if s.cell.measure.name == name]
        spread = _spread(len(own))
        for scored, offset in zip(sorted(own, key=lambda s: s.z), spread, strict=True):
            colour = _BAD if id(scored) in significant else _GOOD
            marker = "o" if abs(scored.z) < far else ">" if scored.z > 0 else "<"
            at = min(max(scored.z, -far), far)
            size = 3 if marker == "o" else 5
            right.plot(at, place + offset, marker, color=colour, ms=size, mew=0, alpha=0.85)
    right.axvspan(-1.96, 1.96, color=FAINT, alpha=0.5, lw=0)
    right.axvline(0, color=SOFT, lw=0.7)
    right.set_yticks(range(len(names)), [BY_NAME[name].words for name in reversed(names)])
    right.set_xlabel("z")
    right.grid(visible=False)
    return captioned(figure, "scores", far=far)


def _spread(count: int) -> Floats:
    """Small steps up and down, so that marks do not hide each other; the same each time."""
    return np.asarray(0.28 * (np.arange(count) * 0.618034 % 1.0 * 2 - 1))


def _variants(comparison: NetworkComparison) -> Drawn:
    """Root mean square of z with something left out."""
    found = {"nothing left out": comparison.pooled, **comparison.controls}
    found |= {f"without {name}": pooled for name, pooled in comparison.ablated.items()}
    ordered = sorted(found.items(), key=lambda item: item[1].rms)
    figure, [[axes]] = panels(1, 1, 0.9 + 0.27 * len(ordered))
    low, high = comparison.pooled.expected
    axes.axvspan(low, high, color=FAINT, lw=0)
    for place, (_, pooled) in enumerate(ordered):
        colour = _GOOD if pooled.passes else _BAD
        axes.plot([pooled.rms], [place], "o", color=colour, ms=7)
        where: dict[str, Any] = {"textcoords": "offset points", "va": "center"}
        axes.annotate(f"{pooled.rms:.2f}", (pooled.rms, place), (8, 0), **where)
    axes.set(
        xscale="log", xlim=(min(0.5, 0.9 * low), 2.0 * max(pooled.rms for pooled in found.values()))
    )
    axes.xaxis.set_major_formatter("{x:g}")
    axes.set_xlabel("root mean square of z over pooled runs under loss")
    axes.set_yticks(range(len(ordered)), [name for name, _ in ordered])
    axes.set_ylim(-0.6, len(ordered) - 0.4)
    axes.grid(visible=False)
    return captioned(figure, "variants")
