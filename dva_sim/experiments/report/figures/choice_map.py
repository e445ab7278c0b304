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
from dva_sim.experiments.report.figures.palette import INK, PAPER, SINGLE_LOOK, SOFT
from dva_sim.experiments.report.prose import caption
from dva_sim.kernel.wording import capital
from dva_sim.simulation.labels import factor_name, level_name, measure_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from dva_sim.experiments.analysis.choice_map import ChoiceMap
    from dva_sim.experiments.report.summary import Reading

_ROW = 0.36  # height of a situation [in]
_HEAD_CHARACTERS = 100  # characters that the heads of all columns hold side by side
_WORDS = 8.5  # in a cell [pt]
_SMALL_WORDS = 6.8  # in a cell where there are many columns side by side [pt]
_TALL_FROM_COLUMNS = 8  # columns
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
        choice_map = reading.map
        if choice_map is None:
            return None
        choices = [
            level_name(choice_map.choice.name, x, short=True) for x in choice_map.choice.levels
        ]
        situations = [
            *(situation_name(choice_map, g) for g in range(len(choice_map.given.levels))),
            WORST,
        ]
        across, down = (situations, choices) if choice_map.is_tall else (choices, situations)
        figure, ((ax,),) = style.panels(1, 1, 1.2 + _ROW * len(down))
        ax.set_xlim(-0.5, len(across) - 0.5)
        _paint(ax, choice_map)
        width = min(14, _HEAD_CHARACTERS // len(across))
        ax.set_xticks(range(len(across)), [style.wrapped(name, width) for name in across])
        ax.xaxis.tick_top()
        ax.set_yticks(range(len(down)), down)
        ax.set_ylim(len(down) - 0.4, -0.5)
        ax.grid(False)
        ax.tick_params(length=0)
        unit = f" [{choice_map.unit}]" if choice_map.unit else ""
        key = f"Beyond the best choice{unit}. Shaded: worse, by the simultaneous 95 % band"
        figure.supxlabel(key, fontsize=_WORDS, color=SOFT)
        words = caption("map", **facts_of(choice_map))
        title = (
            f"{capital(measure_name(choice_map.measure))} beyond the best choice{unit}, by "
            f"{factor_name(choice_map.given.name)}"
        )
        return self.finish(figure, words, _numbers(choice_map), title=title)


def _paint(ax: Axes, choice_map: ChoiceMap) -> None:
    last = len(choice_map.given.levels)
    for (g, c), worst in np.ndenumerate(choice_map.worst):
        is_best = bool(choice_map.is_best[g, c])
        shade = _shade(choice_map, float(worst), is_plain=not choice_map.is_shaded[g, c])
        _cell(ax, _place(choice_map, g, c), shade, regret_text(choice_map, g, c), is_best)
    border = ax.axvline if choice_map.is_tall else ax.axhline
    border(last - 0.5, color=SOFT, linewidth=0.8)
    for c, worst in enumerate(choice_map.overall):
        is_best = choice_map.choice.levels[c] == choice_map.advised
        shade = _shade(choice_map, float(worst), is_plain=False)
        _cell(ax, _place(choice_map, last, c), shade, overall_text(choice_map, c), is_best)


def _place(choice_map: ChoiceMap, situation: int, choice: int) -> tuple[int, int]:
    """Return the column and row of a cell."""
    return (situation, choice) if choice_map.is_tall else (choice, situation)


def _cell(ax: Axes, place: tuple[int, int], shade: float, text: str, is_best: bool) -> None:
    from matplotlib.patches import Rectangle

    x, y = place
    is_narrow = ax.get_xlim()[1] > _TALL_FROM_COLUMNS
    corner = (x - 0.47, y - 0.44)
    colour = SINGLE_LOOK.colour
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


def _shade(choice_map: ChoiceMap, worst: float, is_plain: bool) -> float:
    """Return the strength of the colour, by the logarithm of the regret.

    None where none was shown.
    """
    least = max(choice_map.smallest, 1e-9)
    if is_plain or worst <= least:
        return 0.0
    share = min(1.0, np.log10(worst / least) / _DECADES)
    return float(_FAINT + (_STRONG - _FAINT) * share)


def _numbers(choice_map: ChoiceMap) -> Numbers:
    numbers = Numbers()
    for (g, c, m), regret in np.ndenumerate(choice_map.regret):
        where = {
            choice_map.given.name: choice_map.given.levels[g],
            choice_map.choice.name: choice_map.choice.levels[c],
            choice_map.models.name: choice_map.models.levels[m],
        }
        columns = in_units(choice_map.measure, mean=choice_map.mean[g, c, m], regret=regret)
        numbers.row(where, **columns, is_clear=bool(choice_map.is_clear[g, c, m]))
    return numbers
