"""The assumed numbers that move an answer most, and which way: a figure and its text."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from dva_sim.experiments.analysis.screening import Screening
from dva_sim.experiments.report.figures import style
from dva_sim.experiments.report.figures.palette import FAINT, INK, SINGLE_LOOK
from dva_sim.experiments.study.screening import rule_of
from dva_sim.experiments.study.study import Study
from dva_sim.kernel.assumed import Assumption
from dva_sim.kernel.units import unit_of
from dva_sim.kernel.wording import without_unit
from dva_sim.simulation.labels import factor_name, level_name, measure_name

FIGURE = "screening.png"
_ROW = 0.42  # height of a number [in]


def draw_screening(study: Study, screening: Screening, folder: Path) -> Iterator[str]:
    """Draw the few that move the answer most into a folder; the text that belongs to it."""
    _, answer = rule_of(study)
    first, second = (level_name(answer.factor, level) for level in answer.contrast)
    words = measure_name(answer.measure)
    unit = unit_of(answer.measure)
    most = screening.most_moving
    with style.styled():
        _draw(screening, f"{first} minus {second} in {words} [{unit}]", folder / FIGURE)
    yield (
        f"{first} minus {second} in {words}: {screening.usual:.3g} {unit} on average over "
        f"{screening.points} points within the bands of {len(screening.numbers)} assumed numbers, "
        f"{screening.persons} persons each."
    )
    still = sum(each.size == 0.0 for _, each in screening.numbers)
    yield f"{still} of the numbers do not move it at all. Those that move it most:"
    for number, each in most:
        direction = "up" if each.mean.mean > 0 else "down"
        sure = each.mean.low > 0 or each.mean.high < 0
        certainty = "" if sure else " (which way is not certain)"
        yield (
            f"  {number.key} from {_band(number)}: by {each.size:.3g} {unit} either way, "
            f"{direction} by {abs(each.mean.mean):.3g} {unit} on average{certainty}"
        )
    yield f"Figure: {folder / FIGURE}"


def _draw(screening: Screening, label: str, path: Path) -> None:
    most = screening.most_moving
    figure, ((ax,),) = style.panels(1, 1, 1.1 + _ROW * max(len(most), 1))
    rows = list(range(len(most)))[::-1]
    for row, (_, each) in zip(rows, most, strict=True):
        mean = each.mean
        ax.barh(row, 2 * each.size, left=-each.size, height=0.55, color=FAINT, zorder=1)
        ax.plot([mean.low, mean.high], [row, row], color=INK, linewidth=1.5, zorder=2)
        ax.plot([mean.mean], [row], "o", color=SINGLE_LOOK.colour, zorder=3)
    ax.axvline(0.0, color=INK, linewidth=0.8)
    ax.set_yticks(rows, [f"{_called(number)}\n{_band(number)}" for number, _ in most])
    ax.set_xlabel(f"Effect of the whole band on\n{label}")
    ax.set_title("Assumed numbers that move the answer most", loc="left")
    note = "Bar: mean size, either way. Dot and line: mean effect and its 95 % interval."
    figure.supxlabel(note, fontsize="small")
    figure.savefig(path, metadata={"Software": None})


def _called(number: Assumption) -> str:
    """Return the name of a number without what all names have in common."""
    parts = number.key.removesuffix(".median").split(".")
    words = [part for part in parts[1:] if part not in ("habits", "traits")]
    name = factor_name(number.key) if len(parts) < 2 else without_unit(words[-1])
    group = " ".join(words[:-1]).replace("_", " ") or parts[0]
    return f"{group}: {name.replace('_', ' ')}"


def _band(number: Assumption) -> str:
    return f"{number.low:g} to {number.high:g} {number.unit}".rstrip()
