"""Figure of a choice map: excess cost of each choice over the best, by situation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.choice_table import (
    WORST,
    facts_of,
    overall_text,
    regret_text,
    situation_name,
)
from dva_sim.experiments.report.figures import style
from dva_sim.experiments.report.figures.csv_numbers import Numbers, in_units
from dva_sim.experiments.report.figures.palette import INK, ONE, PAPER, SOFT
from dva_sim.experiments.report.prose import caption
from dva_sim.kernel.wording import capital
from dva_sim.simulation.labels import factor_name, level_name, measure_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from dva_sim.experiments.analysis.choice_map import ChoiceMap
    from dva_sim.experiments.report.summary import Reading

_ROW = 0.36  # height of a situation [in]
_ACROSS = 100  # characters that the heads of all columns hold side by side
_WORDS = 8.5  # in a cell [pt]
_SMALL_WORDS = 6.8  # in a cell where there are many columns side by side [pt]
_MANY = 8  # columns
_FAINT = 0.12  # colour of the least regret
_STRONG = 0.85  # colour of the greatest regret
_DECADES = 2.0  # from the least coloured regret to the full colour


class ChoiceMapFigure(style.ReportFigure):
    name = "map"
    title = "What each choice costs beyond the best one"
    pages = ("driving",)

    def applies(self, view: StudyView, reading: Reading) -> bool:
        """Return True where the study declares a map whose cells have all been run."""
        return super().applies(view, reading) and reading.map is not None

    def draw(self, view: StudyView, reading: Reading) -> style.Drawn | None:
        """Draw a row for each situation and a column for each choice, or the other way round."""
        found = reading.map
        if found is None:
            return None
        choices = [level_name(found.choice.name, x, short=True) for x in found.choice.levels]
        situations = [*(situation_name(found, g) for g in range(len(found.given.levels))), WORST]
        across, down = (situations, choices) if found.is_tall else (choices, situations)
        figure, ((ax,),) = style.panels(1, 1, 1.2 + _ROW * len(down))
        ax.set_xlim(-0.5, len(across) - 0.5)
        _paint(ax, found)
        width = min(14, _ACROSS // len(across))
        ax.set_xticks(range(len(across)), [style.wrapped(name, width) for name in across])
        ax.xaxis.tick_top()
        ax.set_yticks(range(len(down)), down)
        ax.set_ylim(len(down) - 0.4, -0.5)
        ax.grid(False)
        ax.tick_params(length=0)
        unit = f" [{found.unit}]" if found.unit else ""
        key = f"Beyond the best choice{unit}. Shaded: worse, by the simultaneous 95 % band"
        figure.supxlabel(key, fontsize=_WORDS, color=SOFT)
        words = caption("map", **facts_of(found))
        title = (
            f"{capital(measure_name(found.measure))} beyond the best choice{unit}, by "
            f"{factor_name(found.given.name)}"
        )
        return self.finish(figure, words, _numbers(found), title=title)


def _paint(ax: Axes, found: ChoiceMap) -> None:
    last = len(found.given.levels)
    for (g, c), worst in np.ndenumerate(found.worst):
        is_best = bool(found.is_best[g, c])
        shade = _shade(found, float(worst), is_plain=not found.is_shaded[g, c])
        _cell(ax, _place(found, g, c), shade, regret_text(found, g, c), is_best)
    border = ax.axvline if found.is_tall else ax.axhline
    border(last - 0.5, color=SOFT, linewidth=0.8)
    for c, worst in enumerate(found.overall):
        is_best = found.choice.levels[c] == found.advised
        shade = _shade(found, float(worst), is_plain=False)
        _cell(ax, _place(found, last, c), shade, overall_text(found, c), is_best)


def _place(found: ChoiceMap, situation: int, choice: int) -> tuple[int, int]:
    """Return the column and row of a cell."""
    return (situation, choice) if found.is_tall else (choice, situation)


def _cell(ax: Axes, place: tuple[int, int], shade: float, text: str, is_best: bool) -> None:
    from matplotlib.patches import Rectangle

    x, y = place
    is_narrow = ax.get_xlim()[1] > _MANY
    corner = (x - 0.47, y - 0.44)
    colour = ONE.colour
    ax.add_patch(Rectangle(corner, 0.94, 0.88, facecolor=colour, alpha=shade, edgecolor="none"))
    ax.text(
        x,
        y,
        text,
        ha="center",
        va="center",
        fontsize=_SMALL_WORDS if is_narrow else _WORDS,
        fontweight="bold" if is_best else "normal",
        color=PAPER if shade > 0.6 else INK,
    )


def _shade(found: ChoiceMap, worst: float, is_plain: bool) -> float:
    """Return the strength of the colour, by the logarithm of the regret.

    None where none was shown.
    """
    least = max(found.smallest, 1e-9)
    if is_plain or worst <= least:
        return 0.0
    share = min(1.0, np.log10(worst / least) / _DECADES)
    return float(_FAINT + (_STRONG - _FAINT) * share)


def _numbers(found: ChoiceMap) -> Numbers:
    numbers = Numbers()
    for (g, c, m), regret in np.ndenumerate(found.regret):
        where = {
            found.given.name: found.given.levels[g],
            found.choice.name: found.choice.levels[c],
            found.models.name: found.models.levels[m],
        }
        columns = in_units(found.measure, mean=found.mean[g, c, m], regret=regret)
        numbers.row(where, **columns, is_clear=bool(found.is_clear[g, c, m]))
    return numbers
