"""Figure of a choice map: excess cost of each choice over the best, by situation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.choice_table import (
    NEVER,
    facts_of,
    regret_number,
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
_FAINT, _STRONG = 0.12, 0.85  # how much colour the least and the greatest regret have
_DECADES = 2.0  # from the least coloured regret to the full colour


class ChoiceMapFigure(style.ReportFigure):
    name = "map"
    title = "What each choice costs beyond the best one"
    pages = ("driving",)

    def applies(self, view: StudyView, reading: Reading) -> bool:
        """Return True where the study declares a map whose cells have all been run."""
        return super().applies(view, reading) and reading.map is not None

    def draw(self, view: StudyView, reading: Reading) -> style.Drawn | None:
        """Draw a row for each situation and a column for each choice."""
        found = reading.map
        if found is None:
            return None
        rows = len(found.given.levels)
        figure, ((ax,),) = style.panels(1, 1, 1.2 + _ROW * (rows + 1))
        _paint(ax, found)
        choices = [level_name(found.choice.name, x, short=True) for x in found.choice.levels]
        ax.set_xticks(range(len(choices)), [style.wrapped(name, 14) for name in choices])
        ax.xaxis.tick_top()
        situations = [situation_name(found, g) for g in range(rows)]
        ax.set_yticks(range(rows + 1), [*situations, "worst of these"])
        ax.set_xlim(-0.5, len(choices) - 0.5)
        ax.set_ylim(rows + 0.6, -0.5)
        ax.grid(False)
        ax.tick_params(length=0)
        unit = f" [{found.unit}]" if found.unit else ""
        words = caption("map", **facts_of(found))
        title = (
            f"{capital(measure_name(found.measure))} beyond the best choice{unit}, by "
            f"{factor_name(found.given.name)}"
        )
        return self.finish(figure, words, _numbers(found), title=title)


def _paint(ax: Axes, found: ChoiceMap) -> None:
    rows = len(found.given.levels)
    for (g, c), worst in np.ndenumerate(found.worst):
        is_best = not found.is_worse[g, c]
        _cell(ax, c, g, _shade(found, float(worst), is_best), regret_text(found, g, c), is_best)
    ax.axhline(rows - 0.5, color=SOFT, linewidth=0.8)
    for c, worst in enumerate(found.overall):
        text = _overall_text(found, c)
        is_best = found.choice.levels[c] == found.advised
        _cell(ax, c, rows, _shade(found, float(worst), is_best=False), text, is_best)


def _cell(ax: Axes, x: int, y: int, shade: float, text: str, is_best: bool) -> None:
    from matplotlib.patches import Rectangle

    place = (x - 0.47, y - 0.44)
    colour = ONE.colour
    ax.add_patch(Rectangle(place, 0.94, 0.88, facecolor=colour, alpha=shade, edgecolor="none"))
    ax.text(
        x,
        y,
        text,
        ha="center",
        va="center",
        fontsize=8.5,
        fontweight="bold" if is_best else "normal",
        color=PAPER if shade > 0.6 else INK,
    )


def _shade(found: ChoiceMap, worst: float, is_best: bool) -> float:
    """Strength of the colour, by the logarithm of the regret; none for the best."""
    least = max(found.smallest, 1e-9)
    if is_best or worst <= least:
        return 0.0
    share = min(1.0, np.log10(worst / least) / _DECADES)
    return float(_FAINT + (_STRONG - _FAINT) * share)


def _overall_text(found: ChoiceMap, choice: int) -> str:
    worst = float(found.overall[choice])
    if found.never[int(np.argmax(found.clear_worst[:, choice])), choice]:
        return NEVER
    return regret_number(worst)


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
