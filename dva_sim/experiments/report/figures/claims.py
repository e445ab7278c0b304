"""Figure of registered hypotheses: results with their intervals, and the claims."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from dva_sim.experiments.analysis.hypothesis_tests import Tested, Verdict
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures import style
from dva_sim.experiments.report.figures.csv_numbers import Numbers, in_units
from dva_sim.experiments.report.figures.palette import INK, PAPER, SINGLE_LOOK, SOFT
from dva_sim.experiments.report.hypothesis_tables import verdict_of_name
from dva_sim.experiments.report.prose import caption
from dva_sim.experiments.results.manifest import status_of
from dva_sim.kernel.units import unit_of
from dva_sim.kernel.wording import signed
from dva_sim.simulation.labels import measure_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Drawing

    from dva_sim.experiments.report.summary import Reading

_ROW = 0.75  # height of a hypothesis [in]
_WIDTH = 6.4  # of the figure, as of the one that answers [in]
_FONT = 12.0  # for a figure that is shown at about half its size
_FILLED: tuple[Verdict, ...] = ("held",)


class ClaimsFigure(style.ReportFigure):
    name = "claims"
    title = "Registered hypotheses"

    def applies(self, view: StudyView, reading: Reading) -> bool:
        """Return True for a registered run whose hypotheses are all about one measure."""
        tested = reading.judgement.tested
        return (
            status_of(reading.manifest).kind == "confirmatory"
            and len({claim.contrast.measure for claim in tested}) == 1
            and all(claim.difference is not None for claim in tested)
        )

    def draw(self, view: StudyView, reading: Reading) -> style.Drawn | None:
        """Draw a row for each hypothesis."""
        from matplotlib import rc_context

        tested = reading.judgement.tested
        measure = tested[0].contrast.measure
        with rc_context({"font.size": _FONT}):
            figure, ax = _axes(len(tested))
            for row, claim in enumerate(tested):
                _mark(ax, row, claim)
            ax.axvline(0, color=INK, lw=1)
            ax.margins(x=0.12)
            ax.set_xlim(ax.get_xlim())
            for row, claim in enumerate(tested):
                _claimed(ax, row, claim)
            ax.set_yticks(range(len(tested)), [verdict_of_name(claim) for claim in tested])
            ax.set_ylim(len(tested) - 0.4, -0.6)
            ax.set_xlabel(style.axis_label(measure, "difference"))
            style.lying(ax)
            title = f"Registered hypotheses: difference in {measure_name(measure)}"
            return self.finish(figure, caption("claims"), _numbers(tested), title=title)


def _axes(rows: int) -> tuple[Drawing, Axes]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(_WIDTH, 1.2 + _ROW * rows), dpi=150, layout="constrained")
    return figure, figure.add_subplot()


def _mark(ax: Axes, row: int, claim: Tested) -> None:
    difference = claim.difference
    assert difference is not None
    face = SINGLE_LOOK.colour if claim.verdict in _FILLED else PAPER
    ax.hlines(row, difference.low, difference.high, color=SINGLE_LOOK.colour, lw=2.5)
    ax.plot(difference.mean, row, "o", ms=9, color=face, mec=SINGLE_LOOK.colour, mew=2, zorder=3)
    text = signed(difference.mean, unit_of(claim.contrast.measure))
    ax.annotate(text, (difference.mean, row), (0, 9), textcoords="offset points", ha="center")


def _claimed(ax: Axes, row: int, claim: Tested) -> None:
    """Shade the claim, from the margin to the edge of the axes."""
    margin = claim.hypothesis.margin
    left, right = ax.get_xlim()
    low, high = {
        "above": (margin, max(right, margin)),
        "below": (min(left, -margin), -margin),
        "same": (-margin, margin),
    }[claim.hypothesis.direction]
    ax.fill_betweenx([row - 0.4, row + 0.4], low, high, color=SOFT, alpha=0.2, lw=0, zorder=0)


def _numbers(tested: Sequence[Tested]) -> Numbers:
    numbers = Numbers()
    for claim in tested:
        difference = claim.difference
        assert difference is not None
        edges = {"mean": difference.mean, "low": difference.low, "high": difference.high}
        claimed = {"direction": claim.hypothesis.direction, "margin": claim.hypothesis.margin}
        columns = in_units(claim.contrast.measure, **edges)
        numbers.row({"hypothesis": claim.name}, **claimed, **columns, verdict=claim.verdict)
    return numbers
