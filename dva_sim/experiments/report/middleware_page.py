"""The words and tables of a report about commands over real middleware."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.cell_table import Summary
from dva_sim.experiments.report.model_page import ModelPage
from dva_sim.experiments.report.prose import paragraphs
from dva_sim.kernel.wording import number, percent

SUMMARIES: tuple[Summary, ...] = (
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
    summaries: ClassVar[tuple[Summary, ...]] = SUMMARIES
    has_support: ClassVar[bool] = False
    assumed: ClassVar[tuple[str, ...]] = ()
    ends_by_event: ClassVar[bool] = False

    @classmethod
    def fits(cls, view: StudyView) -> bool:
        """True if the runs measure the lateness of the link itself."""
        return view.part.has("late_p99_s")

    def method(self, correlation: float | None) -> list[str] | None:
        """Describe how commands were sent and measured."""
        return paragraphs("method_middleware")
