"""The link of a running world under the sliders of its pages."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from dva_sim.console.run.real_links import EMULATED, TITLE
from dva_sim.console.wire.arguments import LINK_LIMITS
from dva_sim.console.wire.scenes import LinkShown
from dva_sim.kernel.config import validate
from dva_sim.kernel.errors import ConfigError
from dva_sim.network.link import LinkConfig
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.scenario import Scenario, mean_processing_s, start_needs_s, time_out_s

_LAWS = ("delay_law", "delay_log")  # of which jitter takes the place


def changed(link: LinkConfig, changes: Mapping[str, float]) -> LinkConfig:
    """Return a link with other numbers in both directions; jitter is kept within the delay.

    Raises:
        ConfigError: what cannot be, such as a rate where a recorded trace gives it.
    """
    if "rate_bps" in changes and (link.trace_up or link.trace_down):
        raise ConfigError("the recorded trace gives this link's rate")
    values = {key: value for key, value in changes.items() if key in LinkConfig.model_fields}
    delay = values.get("delay_s", link.delay_s)
    values["jitter_s"] = min(values.get("jitter_s", link.jitter_s), delay)
    ways = {}
    for way in ("up", "down"):
        special = getattr(link, way)
        if special is not None:
            ways[way] = special.model_copy(update=dict.fromkeys(values))
    gone: dict[str, Any] = dict.fromkeys(_LAWS) if changes.get("jitter_s") else {}
    if gone:
        ways = {way: special.model_copy(update=gone) for way, special in ways.items()}
    if changes.get("loss") is not None:
        gone["bursts"] = None
        ways = {way: special.model_copy(update={"bursts": None}) for way, special in ways.items()}
    made = link.model_copy(update=values | gone | ways)
    return validate(LinkConfig, made.model_dump(), lambda problem, _: ConfigError(problem))


def with_link(scenario: Scenario, link: LinkConfig, processing: float | None) -> Scenario:
    """Return a scenario over another link, with time-outs as they are, or as long as that needs."""
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


class LinkSliders:
    """Link of all robots, which can be changed while it carries messages.

    Args:
        set_usual: Callback with the usual processing time of a robot's computer, by its id [s].
        emulated: True if the scenario's link is emulated below real sockets.

    Attributes:
        link: Current settings of the link.
    """

    def __init__(
        self, run: Run, set_usual: Callable[[str, float], object], emulated: bool = False
    ) -> None:
        self._run = run
        self.link = run.scenario.link
        self._emulated = emulated
        self._set_usual = set_usual
        self._wanted: dict[str, float] = {}

    def line(self) -> LinkShown:
        """Return its settings for pages."""
        link = self.link
        run = self._run
        processing = self._wanted.get("processing_s", mean_processing_s(run.scenario))
        if run.is_real:
            line: LinkShown = {"kind": "real", "processing_s": processing}
            if self._emulated:
                line |= {"delay_s": link.delay_s, "loss": link.loss}
            return line
        return {
            "kind": "modelled",
            "delay_s": link.delay_s,
            "jitter_s": link.jitter_s,
            "jitter_wanted_s": self._wanted.get("jitter_s", link.jitter_s),
            "loss": link.loss,
            "rate_bps": link.rate_bps,
            "processing_s": processing,
            "trace": link.trace_up or link.trace_down or link.delay_log,
            "rate_trace": link.trace_up or link.trace_down,
        }

    def change(self, arguments: Mapping[str, Any]) -> tuple[str, Scenario]:
        """Change it: what is changed, in words, and a scenario with the time-outs it needs.

        Raises:
            ConfigError: what cannot be.
        """
        run = self._run
        values = {key: arguments[key] for key in LINK_LIMITS if key in arguments}
        if run.is_real and values.keys() - {"processing_s"}:
            raise ConfigError(EMULATED if self._emulated else TITLE)
        self.link = changed(run.scenario.link, self._wanted | values)
        self._wanted |= values
        now = run.clock.now
        for pair in run.links.values():
            for each in pair:
                each.change(now, self.link)
        if "processing_s" in values:
            self._change_processing(values["processing_s"])
        scenario = with_link(run.scenario, self.link, self._wanted.get("processing_s"))
        run.be_patient(scenario)
        text = ", ".join(f"{key} {value:g}" for key, value in values.items())
        if self.link.jitter_s < self._wanted.get("jitter_s", 0.0):
            text += f"; jitter is kept within the delay, at {self.link.jitter_s:g} s"
        run.recorder.tell(now, "console", f"link: {text}", "link")
        return text, scenario

    def _change_processing(self, seconds: float) -> None:
        for robot in self._run.field.robots:
            self._set_usual(robot, seconds)
        self._run.slowed(seconds)
