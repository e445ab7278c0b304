"""Report page for studies of transports: texts and tables."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.cell_table import Summary
from dva_sim.experiments.report.model_page import ModelPage, correlated
from dva_sim.experiments.report.prose import paragraphs
from dva_sim.kernel.wording import number, percent

SUMMARIES: tuple[Summary, ...] = (
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
    summaries: ClassVar[tuple[Summary, ...]] = SUMMARIES
    assumed: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def fits(cls, view: StudyView) -> bool:
        """True if the runs measure a session's throughput."""
        return view.part.has("session_down_bps")

    def method(self, correlation: float | None) -> list[str] | None:
        """Describe how the network and the drives over it were simulated."""
        return paragraphs("method_transport", correlated=correlated(correlation))
