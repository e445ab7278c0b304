"""Model-specific parts of a report: texts, tables and figures.

`ModelPage` is the usual page, of persons who drive; a model whose runs are something else has a
page of its own, derived from it (`results_reading.page_of`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from dva_sim.experiments.analysis.answer import Answer, Finding
from dva_sim.experiments.analysis.conditions import conditions
from dva_sim.experiments.analysis.run_grid import Factor, RunGrid, Table
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.answer_sentences import answer
from dva_sim.experiments.report.cell_table import SUMMARIES, CellTable, Summary
from dva_sim.experiments.report.prose import paragraphs
from dva_sim.kernel.wording import number, percent


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
        """Return True if the page suits this kind of study."""
        return True

    def worded(self, finding: Finding) -> Finding:
        """Return the finding in the words of this page."""
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
        """Return every cell of a part, where the page has a table of its own for it."""
        return None

    def beside(self) -> list[CellTable]:
        """Return further tables that belong to no part."""
        return []

    def conditions(
        self,
        scenarios: Mapping[str, Mapping[str, Any]],
        factors: Sequence[Factor],
        changed: Sequence[str],
    ) -> list[tuple[str, list[str]]]:
        """Return all settings, part by part."""
        return conditions(scenarios, factors, changed)

    def method(self, correlation: float | None) -> list[str] | None:
        """Return remarks on method; None for the default ones.

        Args:
            correlation: Correlation between the two sides of the contrast at the last level, if
                known.
        """
        return None


def correlated(correlation: float | None) -> str:
    """Return the remark on the correlation of a contrast's two sides; empty if unknown."""
    if correlation is None:
        return ""
    return f"The two sides of the contrast correlate with {correlation:.2f} at the last level."


_OF_TRANSPORTS: tuple[Summary, ...] = (
    ("completed", "drives done", np.mean, percent),
    ("wall_crossings", "crossings per drive", np.mean, number),
    ("round_trip_mean_s", "round trip [s]", np.mean, number),
    ("round_trip_p95_s", "its 95th percentile [s]", np.mean, number),
    ("delivered_share", "commands delivered", np.mean, percent),
    ("crucial_delivered_share", "crucial ones", np.mean, percent),
    ("command_rate_hz", "applied [Hz]", np.mean, number),
    ("command_age_mean_s", "age when applied [s]", np.mean, number),
    ("age_in_force_mean_s", "age in force [s]", np.mean, number),
    ("picture_rate_hz", "pictures shown [Hz]", np.mean, number),
    ("picture_age_mean_s", "their age [s]", np.mean, number),
    ("session_up_bps", "session up [bit/s]", np.mean, number),
    ("session_down_bps", "session down [bit/s]", np.mean, number),
    ("bulk_down_bps", "a TCP flow down [bit/s]", np.mean, number),
    ("share_of_fair_down", "session, in equal shares", np.mean, number),
    ("bulk_use_down", "line used by TCP, down", np.mean, percent),
    ("jain_up", "Jain's index up", np.mean, number),
    ("jain_down", "Jain's index down", np.mean, number),
)


class TransportPage(ModelPage):
    """Report page for sessions that compete on a congested link."""

    name: ClassVar[str] = "transport"
    summaries: ClassVar[tuple[Summary, ...]] = _OF_TRANSPORTS
    assumed: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def fits(cls, view: StudyView) -> bool:
        """Return True if the runs measure a session's throughput."""
        return view.part.has("session_down_bps")

    def method(self, correlation: float | None) -> list[str] | None:
        """Describe how the network and the drives over it were simulated."""
        return paragraphs("method_transport", correlated=correlated(correlation))


_OF_MIDDLEWARE: tuple[Summary, ...] = (
    ("connected", "connected", np.mean, percent),
    ("age_in_force_p50_s", "age in force, median [s]", np.mean, number),
    ("age_in_force_p95_s", "95th percentile [s]", np.mean, number),
    ("too_old_share", "too old", np.mean, percent),
    ("longest_gap_s", "longest gap [s]", np.mean, number),
    ("command_rate_hz", "applied [Hz]", np.mean, number),
    ("false_stops", "false stops", np.mean, number),
    ("outdated_share", "out of order", np.mean, percent),
    ("picture_rate_hz", "pictures shown [Hz]", np.mean, number),
    ("picture_age_p95_s", "their age, p95 [s]", np.mean, number),
    ("up_bytes", "to the robot [B]", np.mean, number),
    ("down_bytes", "back [B]", np.mean, number),
    ("late_p99_s", "link late, p99 [s]", np.max, number),
    ("attempts", "attempts", np.max, number),
    ("disturbed", "disturbed", np.sum, number),
)


class MiddlewarePage(ModelPage):
    """Report page for commands measured in real time."""

    name: ClassVar[str] = "middleware"
    cluster: ClassVar[str] = "repeat"
    summaries: ClassVar[tuple[Summary, ...]] = _OF_MIDDLEWARE
    has_support: ClassVar[bool] = False
    assumed: ClassVar[tuple[str, ...]] = ()
    ends_by_event: ClassVar[bool] = False

    @classmethod
    def fits(cls, view: StudyView) -> bool:
        """Return True if the runs measure the lateness of the link itself."""
        return view.part.has("late_p99_s")

    def method(self, correlation: float | None) -> list[str] | None:
        """Describe how commands were sent and measured."""
        return paragraphs("method_middleware")
