"""What each factor does on average, and which two depend on each other.

The effect over two factors at once: where it turns round, and where that can be told.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dva_sim.experiments.analysis.run_grid import Factor, Floats, Setting
from dva_sim.experiments.analysis.study_view import MOST_PANELS, StudyView
from dva_sim.experiments.report.figures import style
from dva_sim.experiments.report.figures.palette import DIVERGING, INK, PAPER, SOFT
from dva_sim.experiments.report.prose import caption
from dva_sim.experiments.study.parts import Level
from dva_sim.kernel.wording import capital, number
from dva_sim.simulation.labels import factor_name, level_name, measure_name
from dva_sim.statistics import Effect, band, factorial_effects

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh

    from dva_sim.experiments.report.summary import Reading


_MOST = 30  # effects that one figure has room for
_ROW = 0.21  # height of each [in]
_ARROW = "→"


class FactorialEffects(style.ReportFigure):
    """Main effects and two-way interactions of a full factorial, with simultaneous intervals."""

    name = "factorial_effects"
    title = "Main effects and two-way interactions"
    pages = ("driving",)

    def applies(self, view: StudyView, reading: Reading) -> bool:
        """Also, every level must have met every other."""
        return super().applies(view, reading) and not reading.study.get("design")

    def draw(self, view: StudyView, reading: Reading) -> style.Drawn | None:
        """Draw it."""
        factors = [f for f in view.part.factors if len(f.levels) > 1]
        if len(factors) < 2 or not view.part.ran.all():
            return None
        found = _effects(view, factors)
        if not any(np.isfinite(e.interval.low) for e in found):
            return None
        shown = _worth_showing(found)
        figure, ((ax,),) = style.panels(1, 1, 1.0 + _ROW * (len(shown) + 1))
        rows = _rows(ax, shown)
        ax.axvline(0, color=INK, lw=0.8, zorder=1)
        style.lying(ax)
        ax.set_ylim(rows + 0.2, -0.8)
        ax.set_xlabel(style.axis_label(view.measure, f"Change of the {measure_name(view.measure)}"))
        words = caption("factorial_effects", left_out=len(found) - len(shown))
        title = f"Main effects and two-way interactions on the {measure_name(view.measure)}"
        return self.finish(figure, words, _numbers(view, found), title=title)


def _effects(view: StudyView, factors: Sequence[Factor]) -> tuple[Effect, ...]:
    """Each factor beside its first level, the compared one beside what it is compared with."""
    values, levels = view.values, {}
    for axis, factor in enumerate(view.part.factors):
        order = _baseline_first(view, factor)
        values = np.take(values, [factor.levels.index(level) for level in order], axis=axis)
        if factor in factors:
            shape = [-1 if a == axis else 1 for a in range(values.ndim)]
            names = np.array([repr(level) for level in order]).reshape(shape)
            levels[factor.name] = np.broadcast_to(names, values.shape).ravel()
    person = np.broadcast_to(view.part.persons[:, np.newaxis], values.shape).ravel()
    return factorial_effects(levels, values.ravel(), person)


def _baseline_first(view: StudyView, factor: Factor) -> list[Level]:
    if view.line is not factor or view.contrast is None:
        return list(factor.levels)
    baseline = view.contrast[1]
    return [baseline, *(level for level in factor.levels if level != baseline)]


def _worth_showing(found: Sequence[Effect]) -> list[Effect]:
    """All main effects, and of the interactions the largest."""
    main = [e for e in found if not e.is_interaction]
    rest = [e for e in found if e.is_interaction]
    largest = sorted(rest, key=lambda e: -abs(np.nan_to_num(e.interval.mean)))
    kept = largest[: max(0, _MOST - len(main))]
    return [*main, *(e for e in rest if e in kept)]


def _rows(ax: Axes, shown: Sequence[Effect]) -> float:
    """A row for each effect, a gap between the two kinds; gives the last row."""
    ticks, names, row = [], [], 0.0
    for before, effect in zip([shown[0], *shown], shown, strict=False):
        row += 0.7 * (effect.is_interaction != before.is_interaction)
        interval = effect.interval
        ax.hlines(row, interval.low, interval.high, color=INK if effect.is_found else SOFT, lw=1.4)
        fill = INK if effect.is_found else "white"
        mark = "D" if effect.is_interaction else "o"
        ax.plot(interval.mean, row, mark, ms=5, mfc=fill, mec=INK, mew=0.9, zorder=3)
        ticks.append(row)
        names.append(_name(effect))
        row += 1
    ax.set_yticks(ticks, names)
    return row - 0.5


def _name(effect: Effect) -> str:
    """`delay 0 → 1 s`, or two of them joined by a times."""
    steps = zip(effect.factors, effect.baselines, effect.levels, strict=True)
    return " × ".join(_step(name, beside, level) for name, beside, level in steps)


def _step(name: str, beside: str, level: str) -> str:
    first, second = (level_name(name, _plain(word), short=True) for word in (beside, level))
    is_word = _plain(level).__class__ is str
    return (
        f"{first} {_ARROW} {second}"
        if is_word
        else f"{factor_name(name)} {first} {_ARROW} {second}"
    )


def _plain(word: str) -> Level:
    """A level from how it is written."""
    import ast

    level: Level = ast.literal_eval(word)
    return level


def _numbers(view: StudyView, found: Sequence[Effect]) -> style.Numbers:
    numbers = style.Numbers()
    for effect in found:
        interval = effect.interval
        edges = {"mean": interval.mean, "low": interval.low, "high": interval.high}
        told = style.in_units(view.measure, **edges)
        words = {
            "factors": " x ".join(effect.factors),
            "from": " x ".join(str(_plain(word)) for word in effect.baselines),
            "to": " x ".join(str(_plain(word)) for word in effect.levels),
        }
        numbers.row(words, **told, is_found=effect.is_found)
    return numbers


_FEWEST = 3  # levels of a second factor, below which panels say it all
_MOST_WRITTEN = 12  # levels along x, beyond which numbers have no room
_DARK = 0.65  # of the strongest colour, from where on writing is white
_ABOVE, _BELOW = "▲", "▼"


@dataclass(frozen=True)
class EffectField:
    """An effect at every pair of levels `(levels of the second, levels along x)`.

    Attributes:
        second: The factor along y.
        panel: Levels of all factors that are not along an axis.
        mean: First minus second level of the contrast.
        low: Lower edge of the band that covers all pairs at once.
        high: Its upper edge.
    """

    second: Factor
    panel: Setting
    mean: Floats
    low: Floats
    high: Floats


class HeatMap(style.ReportFigure):
    """The declared contrast over two factors; None where there is no second one worth it."""

    name = "heat_map"
    title = "The contrast over two factors"
    pages = ("driving",)

    def draw(self, view: StudyView, reading: Reading) -> style.Drawn | None:
        """Draw it."""
        fields = _fields(view)
        if not fields or view.over is None or view.line is None or view.contrast is None:
            return None
        second = fields[0].second
        figure, grid = style.panels(
            len(fields), 1, max(2.4, 1.0 + 0.38 * len(second.levels)), sharex=True
        )
        axes = [ax for (ax,) in grid]
        first, other = (level_name(view.line.name, level) for level in view.contrast)
        reach = max(float(np.nanmax(abs(field.mean))) for field in fields) or 1.0
        has_zero = False
        for ax, field in zip(axes, fields, strict=True):
            image = _colours(ax, field.mean, reach)
            has_zero |= _contours(ax, field)
            _write(ax, field, image, reach)
            style.level_axis(ax, second)
            style.stops_axis(ax, view.over)
            style.panel_title(ax, field.panel)
            ax.grid(False)
        for ax in axes[:-1]:
            ax.set_xlabel("")
        bar = figure.colorbar(image, ax=axes, pad=0.02)
        bar.set_label(style.axis_label(view.measure, f"{first}\nminus {other}"))
        title = f"{capital(first)} minus {other} in {measure_name(view.measure)}, over two factors"
        marks = {"above": _ABOVE, "below": _BELOW}
        words = caption("heat_map", first=first, second=other, has_zero=has_zero, **marks)
        return self.finish(figure, words, _heat_numbers(view, fields), title=title)


def _fields(view: StudyView) -> list[EffectField]:
    """One for each setting of the factors that are not shown, as many as there is room for."""
    second = _second(view)
    if second is None or view.contrast is None:
        return []
    rest = [{k: v for k, v in panel.items() if k != second.name} for panel in view.panels]
    settings = [panel for n, panel in enumerate(rest) if panel not in rest[:n]]
    fields = [_field(view, second, view.contrast, panel) for panel in settings[:MOST_PANELS]]
    return [field for field in fields if np.isfinite(field.mean).any()]


def _field(
    view: StudyView, second: Factor, contrast: tuple[Level, Level], panel: Setting
) -> EffectField:
    columns = [view.difference(panel | {second.name: x}, *contrast) for x in second.levels]
    values = np.stack(columns, axis=1)  # (persons, levels of the second, stops)
    found, shape = band(values.reshape(len(values), -1)), values.shape[1:]
    mean, low, high = (x.reshape(shape) for x in (found.mean, found.low, found.high))
    return EffectField(second, panel, mean, low, high)


def _second(view: StudyView) -> Factor | None:
    """The other factor with most levels; of equal ones a quantity first."""
    if view.line is None or view.over is None or len(view.over.levels) < 2:
        return None
    others = [f for f in view.part.factors if f not in (view.line, view.over)]
    worth = [f for f in others if len(f.levels) >= _FEWEST]
    return max(worth, key=lambda f: (len(f.levels), f.is_numeric), default=None)


def _colours(ax: Axes, mean: Floats, reach: float) -> QuadMesh:
    """Fields from purple, below zero, over white to orange: far apart for every eye."""
    return ax.pcolormesh(
        *np.meshgrid(np.arange(mean.shape[1] + 1) - 0.5, np.arange(mean.shape[0] + 1) - 0.5),
        np.ma.masked_invalid(mean),
        cmap=DIVERGING,
        vmin=-reach,
        vmax=reach,
        edgecolor=PAPER,
        linewidth=0.5,
    )


def _write(ax: Axes, field: EffectField, image: QuadMesh, reach: float) -> None:
    """Numbers and marks: no colour is needed to read them, nor is it in a print."""
    for (y, x), mean in np.ndenumerate(field.mean):
        if not np.isfinite(mean):
            continue
        paint = image.to_rgba(np.asarray(mean))
        told = _mark(float(field.low[y, x]), float(field.high[y, x]))
        text = number(float(mean)) if field.mean.shape[1] <= _MOST_WRITTEN else ""
        ax.text(
            x,
            y,
            " ".join(filter(None, (told, text))),
            ha="center",
            va="center",
            fontsize=8,
            fontweight="bold" if told else "normal",
            color=PAPER if abs(mean) > _DARK * reach else INK,
            bbox={"fc": paint, "ec": "none", "pad": 0.6},  # no line through it
            zorder=5,
        )


def _mark(low: float, high: float) -> str:
    return _ABOVE if low > 0 else _BELOW if high < 0 else ""


def _contours(ax: Axes, field: EffectField) -> bool:
    """The line of no effect with those of the band's edges; whether there is one."""
    has_zero = False
    for values, dashes, width in (
        (field.mean, "-", 2.2),
        (field.low, "--", 1),
        (field.high, "--", 1),
    ):
        known = values[np.isfinite(values)]
        crosses = len(known) > 0 and known.min() < 0 < known.max()
        if crosses and min(values.shape) > 1:
            ax.contour(
                np.ma.masked_invalid(values), [0.0], colors=INK, linestyles=dashes, linewidths=width
            )
            has_zero |= dashes == "-"
    return has_zero


def _heat_numbers(view: StudyView, fields: Sequence[EffectField]) -> style.Numbers:
    numbers = style.Numbers()
    for field in fields:
        edges = {"mean": field.mean, "band_low": field.low, "band_high": field.high}
        columns = style.in_units(view.measure, **edges)
        for row, level in enumerate(field.second.levels):
            told = {name: values[row] for name, values in columns.items()}
            numbers.add(field.panel | {field.second.name: level}, view.along_x() | told)
    return numbers
