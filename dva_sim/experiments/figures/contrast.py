"""The figure that answers: the declared difference alone, level by level, with its band."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.answer import Finding
from dva_sim.experiments.answer_places import condition
from dva_sim.experiments.effects import Factor, Floats, present
from dva_sim.experiments.figures.numbers import Numbers, with_unit
from dva_sim.experiments.figures.palette import FAINT, INK, ONE, PAPER, SOFT
from dva_sim.experiments.figures.style import Drawn, finish, fit_to, stops_axis, wrapped
from dva_sim.experiments.labels import capital, level_name, measure_name, number

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NAME = "answer"
_SIZE = (5.8, 3.5)  # [in]: small, so that its text stays legible beside words and on a phone
_FONT = 10.5
_MOST_LABELS = 8
_ROOM = 0.05  # of the width, for the figures beside the outer marks
_LEAST_SHARE = 0.02  # of the height, below which what is too small to matter is not drawn


def contrast(finding: Finding, differences: Floats) -> Drawn | None:
    """The difference that answers the question; None where no interval can be given.

    Args:
        finding: The answer.
        differences: First minus second as person means `(persons, stops)`.
    """
    if not np.isfinite(finding.low).any():
        return None
    from matplotlib import rc_context

    with rc_context({"font.size": _FONT}):
        return _drawn(finding, differences)


def _drawn(finding: Finding, differences: Floats) -> Drawn:
    from matplotlib.figure import Figure

    figure = Figure(figsize=_SIZE, dpi=150, layout="constrained")
    ax = figure.add_subplot()
    over = Factor(finding.over, finding.levels) if finding.over else None
    _marks(ax, finding, over)
    stops_axis(ax, over)
    left, right = ax.get_xlim()
    room = _ROOM * (right - left)
    ax.set_xlim(left - room, right + room)
    cut = fit_to(ax, present(np.append(differences, 0.0)))
    grey = _too_small(ax, finding)
    _values(ax, finding)
    first, second = _names(finding)
    unit = f" [{finding.unit}]" if finding.unit else ""
    ax.set_ylabel(wrapped(f"{capital(first)} minus {second}{unit}", 34))
    caption = _caption(finding, grey)
    title = f"{capital(first)} minus {second}: {measure_name(finding.measure)}"
    within = condition(finding, inside=True).removesuffix(", ")
    title = f"{title}, {within}" if within else title
    return finish(figure, NAME, title, caption, _table(finding), (cut,))


def _names(f: Finding) -> tuple[str, str]:
    return level_name(f.factor, f.first), level_name(f.factor, f.second)


def _marks(ax: Axes, f: Finding, over: Factor | None) -> None:
    """A bar for the band, a mark for the mean: filled where it differs from zero."""
    x, differs = np.arange(len(f.mean)), _differs(f)
    ax.axhline(0, color=INK, lw=0.8, zorder=1)
    if over is not None and over.is_numeric:
        ax.plot(x, f.mean, color=ONE.colour, lw=1, alpha=0.5, zorder=2)
    ax.vlines(x, f.low, f.high, color=ONE.colour, lw=2.2, zorder=3)
    for chosen, fill in ((differs, ONE.colour), (~differs, PAPER)):
        ax.plot(x[chosen], f.mean[chosen], "o", color=ONE.colour, mfc=fill, ms=7, mew=1.5, zorder=4)


def _differs(f: Finding) -> NDArray[np.bool_]:
    return np.asarray((f.low > 0) | (f.high < 0))


def _too_small(ax: Axes, f: Finding) -> bool:
    """Grey where a difference was declared too small to matter, if that can be seen."""
    bottom, top = ax.get_ylim()
    if f.smallest_effect is None or f.smallest_effect < _LEAST_SHARE * (top - bottom):
        return False
    ax.axhspan(-f.smallest_effect, f.smallest_effect, color=FAINT, alpha=0.6, lw=0, zorder=0)
    ax.set_ylim(bottom, top)
    return True


def _values(ax: Axes, f: Finding) -> None:
    """Each mean in figures, beside its mark."""
    if len(f.mean) > _MOST_LABELS:
        return
    there = present(f.mean)
    rises = bool(f.over) and there[-1] > there[0]  # then the line is in the way on the right
    for x, (mean, differs) in enumerate(zip(f.mean, _differs(f), strict=True)):
        if np.isfinite(mean):
            sign = "+" if mean > 0 and number(mean) != "0" else ""
            ax.annotate(
                f"{sign}{number(float(mean))}",
                (x, mean),
                xytext=(-6 if rises else 7, 4),
                textcoords="offset points",
                ha="right" if rises else "left",
                va="bottom",
                color=INK if differs else SOFT,
                weight="bold" if differs else "normal",
                annotation_clip=True,
            )


def _caption(f: Finding, grey: bool) -> str:
    over = "the 95 % band, which holds for all levels at once" if len(f.levels) > 1 else "95 %"
    cluster = f.cluster if f.persons == 1 else f"{f.cluster}s"
    first, _ = _names(f)
    more = "takes longer" if f.unit == "s" else "is larger"
    words = (
        f"Above zero {first} {more}. Mark: mean of {f.persons} {cluster}, filled where it differs "
        f"from zero. Bar: {over}."
    )
    return f"{words}{' Grey: too small to matter.' * grey}"


def _table(f: Finding) -> Numbers:
    numbers = Numbers()
    along = {f.over: f.levels} if f.over else {}
    ends = {"mean": f.mean, "band_low": f.low, "band_high": f.high}
    columns: dict[str, Any] = {with_unit(n, f.measure): values for n, values in ends.items()}
    numbers.add({}, along | columns)
    return numbers
