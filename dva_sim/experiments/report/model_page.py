"""Model-specific parts of a report: texts, tables and figures.

`ModelPage` is the usual page, of persons who drive; a model whose runs are something else has a
page of its own, derived from it (`model_pages`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar

from dva_sim.experiments.analysis.answer import Answer, Finding
from dva_sim.experiments.analysis.answer_sentences import answer
from dva_sim.experiments.analysis.conditions import conditions
from dva_sim.experiments.analysis.run_grid import Factor, RunGrid, Table
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.cell_table import SUMMARIES, CellTable, Summary


class ModelPage:
    """The usual page.

    Args:
        events: Columns of the table `events`, if there is one.

    Attributes:
        name: Figures say by it which pages they belong to.
        cluster: Unit of resampling: person or shift.
        summaries: Columns of the cell table besides the measure.
        has_support: True if published data tell which delays are covered.
        assumed: Keys that an answer depends on most, reported where a study does not vary them.
        ends_by_event: True if a run's outcome is that of its events, where the answer is about
            them.
    """

    name: ClassVar[str] = "driving"
    cluster: ClassVar[str] = "person"
    summaries: ClassVar[tuple[Summary, ...]] = SUMMARIES
    has_support: ClassVar[bool] = True
    assumed: ClassVar[tuple[str, ...]] = ("pattern", "phone.profile", "control", "robot.profile")
    ends_by_event: ClassVar[bool] = True

    def __init__(self, view: StudyView, events: Table | None = None) -> None:
        self.view = view

    @classmethod
    def fits(cls, view: StudyView) -> bool:
        """True if the page suits this kind of study."""
        return True

    def worded(self, finding: Finding) -> Finding:
        """The finding in the words of this page."""
        return replace(finding, cluster=self.cluster)

    def answer(self, finding: Finding | None) -> Answer:
        """Return the study's answer."""
        if finding is None:
            return Answer(
                "The contrast that would answer the question was not declared or not run; "
                "the figures and the table show what was."
            )
        return answer(self.worded(finding))

    def cells(self, part: RunGrid) -> CellTable | None:
        """Every cell of a part, where the page has a table of its own for it."""
        return None

    def conditions(
        self,
        scenarios: Mapping[str, Mapping[str, Any]],
        factors: Sequence[Factor],
        changed: Sequence[str],
    ) -> list[tuple[str, list[str]]]:
        """All settings, part by part."""
        return conditions(scenarios, factors, changed)

    def method(self, correlation: float | None) -> list[str] | None:
        """Remarks on method; None for the default ones.

        Args:
            correlation: Correlation between the two sides of the contrast at the last level, if
                known.
        """
        return None


def correlated(correlation: float | None) -> str:
    """Remark on the correlation of a contrast's two sides; empty if unknown."""
    if correlation is None:
        return ""
    return f"The two sides of the contrast correlate with {correlation:.2f} at the last level."
