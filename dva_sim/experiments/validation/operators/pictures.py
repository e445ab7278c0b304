"""Figures of a validation: what is simulated beside what was published, with its bands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from dva_sim.experiments.figures.style import FAINT, INK, SOFT, Drawn, finish, panels, styled
from dva_sim.experiments.validation.operators.judging import Verdict
from dva_sim.experiments.validation.operators.pictures_exact import draw_exact
from dva_sim.experiments.validation.operators.pictures_people import draw_people
from dva_sim.experiments.validation.operators.targets import Kind
from dva_sim.experiments.validation.operators.trials import Cells

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLOURS = {"passes": "#0072B2", "misses": "#D55E00", "shown only": SOFT}
_PEOPLE: tuple[Kind, ...] = ("held-out", "fitted", "remembered")
_TITLES = {
    "held-out": "Held out: counted",
    "fitted": "Fitted to: shown only",
    "remembered": "From memory: shown only",
}
_ROW = 0.27  # [in]
_LIMIT = 1.6  # half widths of the band shown; what is further off stands at the edge


def draw_all(verdicts: Sequence[Verdict], played: Mapping[str, Cells]) -> list[Drawn]:
    """Every figure."""
    with styled():
        return [_overview(verdicts), *draw_people(verdicts, played), *draw_exact()]


def _overview(verdicts: Sequence[Verdict]) -> Drawn:
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


def _mark(axes: Axes, row: float, verdict: Verdict) -> None:
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
