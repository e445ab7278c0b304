"""Which page a report has for each model of a run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Final

from dva_sim.experiments.report.model_page import ModelPage
from dva_sim.experiments.report.shift_page import ShiftPage
from dva_sim.experiments.report.transport_page import TransportPage

PAGES: Final[Mapping[str, type[ModelPage]]] = {"timed": ShiftPage, "transports": TransportPage}
"""Pages of models that do not have the usual one."""


def page_of(scenarios: Iterable[Mapping[str, Any]]) -> type[ModelPage]:
    """The page of a study: that of the first of its models that has one of its own."""
    own = [PAGES[name] for s in scenarios if (name := str(s.get("model"))) in PAGES]
    return own[0] if own else ModelPage
