"""Main effects of the factors, and the interactions of two."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dva_sim.experiments.analysis.run_grid import Factor
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures import style
from dva_sim.experiments.report.figures.csv_numbers import Numbers, in_units
from dva_sim.experiments.report.figures.palette import INK, SOFT
from dva_sim.experiments.report.prose import caption
from dva_sim.experiments.study.parts import Level
from dva_sim.simulation.labels import factor_name, level_name, measure_name
from dva_sim.statistics import Effect, factorial_effects

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from dva_sim.experiments.report.summary import Reading


_MOST = 30  # effects that one figure has room for
_ROW = 0.21  # height of each [in]
_ARROW = "→"


class FactorialEffects(style.ReportFigure):
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


def _numbers(view: StudyView, found: Sequence[Effect]) -> Numbers:
    numbers = Numbers()
    for effect in found:
        interval = effect.interval
        edges = {"mean": interval.mean, "low": interval.low, "high": interval.high}
        columns = in_units(view.measure, **edges)
        words = {
            "factors": " x ".join(effect.factors),
            "from": " x ".join(str(_plain(word)) for word in effect.baselines),
            "to": " x ".join(str(_plain(word)) for word in effect.levels),
        }
        numbers.row(words, **columns, is_found=effect.is_found)
    return numbers
