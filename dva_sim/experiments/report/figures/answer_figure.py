"""The figure that answers: the declared difference alone, level by level, with its band."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from dva_sim.experiments.analysis.answer import Finding, too_few
from dva_sim.experiments.analysis.run_grid import Factor, Floats, present
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures import style
from dva_sim.experiments.report.figures.csv_numbers import Numbers, in_units
from dva_sim.experiments.report.figures.cut_bars import Bars, fit_to, mark_cuts
from dva_sim.experiments.report.figures.palette import FAINT, INK, PAPER, SINGLE_LOOK, SOFT
from dva_sim.experiments.report.prose import caption
from dva_sim.kernel.wording import capital, number
from dva_sim.simulation.labels import level_name, measure_name, setting

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from dva_sim.experiments.report.summary import Reading


_SIZE = (5.8, 3.5)  # [in]: small, so that its text stays legible beside words and on a phone
_FONT = 10.5
_MAX_LABELS = 8
_ROOM = 0.05  # of the width, for the figures beside the outer marks
_MIN_SHARE = 0.02  # of the height, below which what is too small to matter is not drawn


class AnswerFigure(style.ReportFigure):
    name = "answer"
    title = "The declared contrast"

    def draw(self, view: StudyView, reading: Reading) -> style.Drawn | None:
        """Draw the figure."""
        if view.contrast is None or reading.worded_finding is None:
            return None
        return self.contrast(
            reading.worded_finding, view.difference(view.panels[0], *view.contrast)
        )

    def contrast(self, finding: Finding, differences: Floats) -> style.Drawn | None:
        """Return the difference alone; None where no interval can be given.

        Args:
            finding: The answer.
            differences: First minus second as person means `(persons, stops)`.
        """
        if not np.isfinite(finding.low).any():
            return None
        from matplotlib import rc_context

        with rc_context({"font.size": _FONT}):
            return self._drawn(finding, differences)

    def _drawn(self, finding: Finding, differences: Floats) -> style.Drawn:
        from matplotlib.figure import Figure

        figure = Figure(figsize=_SIZE, dpi=150, layout="constrained")
        ax = figure.add_subplot()
        over = Factor(finding.over, finding.levels) if finding.over else None
        _marks(ax, finding, over)
        style.stops_axis(ax, over)
        left, right = ax.get_xlim()
        room = _ROOM * (right - left)
        ax.set_xlim(left - room, right + room)
        cut = fit_to(ax, present(np.append(differences, 0.0)))
        grey = _too_small(ax, finding)
        _values(ax, finding)
        x = np.arange(len(finding.mean), dtype=np.float64)
        mark_cuts([Bars(ax, x, finding.low, finding.high, SINGLE_LOOK.colour)])
        sides = (finding.first, finding.second)
        first, second = (level_name(finding.factor, side) for side in sides)
        unit = f" [{finding.unit}]" if finding.unit else ""
        ax.set_ylabel(style.wrapped(f"{capital(first)} minus {second}{unit}", 34))
        title = f"{capital(first)} minus {second}: {measure_name(finding.measure)}"
        within = f"with {setting(finding.within)}" if finding.within else ""
        title = f"{title}, {within}" if within else title
        few = too_few(finding.persons, finding.cluster) if finding.has_too_few else ""
        words = caption(
            "answer",
            first=first,
            is_more="takes longer" if finding.unit == "s" else "is larger",
            persons=f"{finding.persons} {finding.cluster}{'s' * (finding.persons != 1)}",
            is_band=len(finding.levels) > 1,
            grey=bool(grey),
            few=capital(few),
        )
        return self.finish(figure, words, _table(finding), title=title, reads=(cut,))


def _marks(ax: Axes, f: Finding, over: Factor | None) -> None:
    """Draw a bar for the band and a mark for the mean, whose filling a key explains."""
    from matplotlib.lines import Line2D

    x = np.arange(len(f.mean))
    differs = f.differs
    is_open = f.is_open
    ax.axhline(0, color=INK, lw=0.8, zorder=1)
    if over is not None and over.is_numeric and style.is_to_scale(over):
        ax.plot(x, f.mean, color=SINGLE_LOOK.colour, lw=1, alpha=0.5, zorder=2)
    ax.vlines(x, f.low, f.high, color=SINGLE_LOOK.colour, lw=2.2, zorder=3)
    has_band = np.isfinite(f.low)
    little = "too little to matter" if f.smallest_effect else "not shown to differ"
    kinds = {
        "differs from zero": (differs, SINGLE_LOOK.colour),
        f"open: {too_few(f.persons, f.cluster)}": (is_open, PAPER),
        little: (has_band & ~differs & ~is_open, FAINT),
        "without an interval": (np.isfinite(f.mean) & ~has_band, PAPER),
    }
    look: dict[str, Any] = {
        "color": SINGLE_LOOK.colour,
        "ms": 7,
        "mew": 1.5,
        "marker": "o",
        "ls": "",
    }
    handles = []
    for name, (chosen, fill) in kinds.items():
        if chosen.any():
            ax.plot(x[chosen], f.mean[chosen], mfc=fill, zorder=4, **look)
            handles.append(Line2D([], [], mfc=fill, label=name, **look))
    ax.figure.legend(handles=handles, loc="outside upper left", ncols=2, fontsize=8.5)


def _too_small(ax: Axes, f: Finding) -> bool:
    """Return the grey where a difference was declared too small to matter, if that can be seen."""
    bottom, top = ax.get_ylim()
    if f.smallest_effect is None or f.smallest_effect < _MIN_SHARE * (top - bottom):
        return False
    ax.axhspan(-f.smallest_effect, f.smallest_effect, color=FAINT, alpha=0.6, lw=0, zorder=0)
    ax.set_ylim(bottom, top)
    return True


def _values(ax: Axes, f: Finding) -> None:
    """Write each mean in figures, beside its mark."""
    if len(f.mean) > _MAX_LABELS:
        return
    means = present(f.mean)
    rises = bool(f.over) and means[-1] > means[0]  # then the line is in the way on the right
    for x, (mean, differs) in enumerate(zip(f.mean, f.differs, strict=True)):
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


def _table(f: Finding) -> Numbers:
    numbers = Numbers()
    along = {f.over: f.levels} if f.over else {}
    band = {"mean": f.mean, "band_low": f.low, "band_high": f.high}
    numbers.add({}, along | in_units(f.measure, **band))
    return numbers
