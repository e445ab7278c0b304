"""The link under the sliders: what a person asks for, made into what a link can be."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from dva_sim.kernel.config import validate
from dva_sim.kernel.errors import ConfigError
from dva_sim.network.link import LinkConfig
from dva_sim.simulation.scenario import Scenario, start_needs_s, time_out_s

_LAWS = ("delay_law", "delay_log")  # of which jitter takes the place


def changed(link: LinkConfig, wanted: Mapping[str, float]) -> LinkConfig:
    """A link with other numbers in both directions; jitter is kept within the delay.

    Raises:
        ConfigError: what cannot be, such as a rate where a recorded trace gives it.
    """
    if "rate_bps" in wanted and (link.trace_up or link.trace_down):
        raise ConfigError("the recorded trace gives this link's rate")
    values = {key: value for key, value in wanted.items() if key in LinkConfig.model_fields}
    delay = values.get("delay_s", link.delay_s)
    values["jitter_s"] = min(values.get("jitter_s", link.jitter_s), delay)
    ways = {}
    for way in ("up", "down"):
        special = getattr(link, way)
        if special is not None:
            ways[way] = special.model_copy(update=dict.fromkeys(values))
    gone: dict[str, Any] = dict.fromkeys(_LAWS) if wanted.get("jitter_s") else {}
    if gone:
        ways = {way: special.model_copy(update=gone) for way, special in ways.items()}
    if wanted.get("loss") is not None:
        gone["bursts"] = None
        ways = {way: special.model_copy(update={"bursts": None}) for way, special in ways.items()}
    made = link.model_copy(update=values | gone | ways)
    return validate(LinkConfig, made.model_dump(), lambda problem, _: ConfigError(problem))


def with_link(scenario: Scenario, link: LinkConfig, processing: float | None) -> Scenario:
    """A scenario over another link, with time-outs as they are, or as long as that needs."""
    robot = scenario.robot
    if processing is not None:
        robot = robot.model_copy(update={"processing_s": processing})
    made = scenario.model_copy(update={"link": link, "robot": robot})
    needed = time_out_s(start_needs_s(made))
    waits = {
        key: getattr(scenario, key).model_copy(
            update={"timeout_s": max(needed, getattr(scenario, key).timeout_s or 0.0)}
        )
        for key in ("request", "command")
    }
    return made.model_copy(update=waits)
