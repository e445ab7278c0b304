"""The page of each model whose studies are reported otherwise than drives.

Only our models have one: a results folder loads no code of a user's.
"""

from collections.abc import Iterable, Mapping
from typing import Any

from dva_sim.experiments.report.middleware_page import MiddlewarePage
from dva_sim.experiments.report.model_page import ModelPage
from dva_sim.experiments.report.shift_page import ShiftPage
from dva_sim.experiments.report.transport_page import TransportPage

PAGES: dict[str, type[ModelPage]] = {
    "timed": ShiftPage,
    "transports": TransportPage,
    "middleware": MiddlewarePage,
}


def page_of(scenarios: Iterable[Mapping[str, Any]]) -> type[ModelPage]:
    """The page of a study: that of the first of its models that has one of its own."""
    models = (str(scenario.get("model")) for scenario in scenarios)
    return next((PAGES[model] for model in models if model in PAGES), ModelPage)
