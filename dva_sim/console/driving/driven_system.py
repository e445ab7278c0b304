"""The robots of a system, as people in seats drive them from pages."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from dva_sim.agents.device import AgentDevice
from dva_sim.agents.operator.strategies import Reach
from dva_sim.agents.robot.controller import Mode
from dva_sim.console.asking.refusal import OnResult
from dva_sim.console.driving.seating import Seating
from dva_sim.console.events.decisions import UNKNOWN_ROOM
from dva_sim.console.system.known_system import KnownSystem
from dva_sim.console.system.things import UNKNOWN_ROBOT
from dva_sim.console.views.published_rows import emergency_of, mode_of
from dva_sim.protocol import messages as m
from dva_sim.simulation.scenario import Scenario
from dva_sim.worlds.geo import GeoFrame
from dva_sim.worlds.site import Site

REACH: Final = Reach(UNKNOWN_ROBOT["max_speed_mps"], UNKNOWN_ROBOT["max_turn_rate_radps"])


class DrivenSystem:
    """The robots that a DVA lists, for people in seats.

    Commands carry the tick of a robot's newest status: they are as old as that.

    Args:
        system: System of the robots.
        scenario: Scenario that says how they are driven.
        patterns: Pattern of the next drive of each robot whose pattern was changed, by its id.
        author: Function that returns the name of the person at a page.

    Attributes:
        clock: Its time.
        seating: Seats of the console; set by their maker.
        own_pattern: Pattern of its scenario.
        stale_s: Age above which robots refuse what a command was based on [s].
        seeks_orders: True if free seats take part while pages are open: the DVA may order them.
        revokers: Name of the person who took a robot from its driver, with the reason, by label.
        stoppers: Device and name of the person who stopped a robot from a page, by its id.
        on_held: Callback for the robots that are in somebody's hands, by id.
        free_seat: Callback for a page that sits nowhere any more.
        is_fake: Predicate: True for a device that was added by hand, and hears nothing.
    """

    seating: Seating
    seeks_orders = False

    def __init__(
        self,
        system: KnownSystem,
        scenario: Scenario,
        patterns: dict[str, str],
        author: Callable[[str], str],
    ) -> None:
        self.system = system
        self.clock = system.clock
        self.own_pattern = scenario.pattern
        self.stale_s = scenario.robot.max_age_s
        self.revokers: dict[str, str] = {}
        self.stoppers: dict[str, tuple[str, str]] = {}
        self.on_held: Callable[[set[str]], object] = lambda _: None
        self.free_seat: Callable[[str], object] = lambda _: None
        self.is_fake: Callable[[str], bool] = lambda _: False
        self._patterns = patterns
        self._author = author

    @property
    def now_ms(self) -> int:
        """Return the time for pages [ms]."""
        return self.system.now_ms

    @property
    def emergency_device(self) -> AgentDevice:
        """Return the device that stops robots for pages without a seat."""
        return self.system.device

    # --- what is known of robots -----------------------------------------------------------

    def robots(self) -> Sequence[str]:
        """Return the ids of all robots that pages show."""
        return self.system.robots()

    def number_of(self, robot: str) -> int | None:
        """Return the number by which pages know a robot."""
        return self.system.numbers.get(robot)

    def label_of(self, device: str) -> str:
        """Return the label of a device, by its id."""
        return self.system.label_of(device)

    def names_of(self, robot: str) -> set[object]:
        """Return the names that a line may give a robot: its id, number or label."""
        return {robot, self.number_of(robot), self.label_of(robot)}

    def mode_of(self, robot: str) -> str:
        """Return the mode of a robot; empty if it is unknown."""
        entry = self.system.state.devices.get(robot)
        return "" if entry is None else mode_of(entry)

    def pattern_of(self, robot: str) -> str:
        """Return the name of the pattern by which a robot is driven next, or now."""
        return self._patterns.get(robot, self.own_pattern)

    def alarm_at(self, _: str) -> float | None:
        """Return the value from which on a sensor gives the alarm; no message tells it."""
        return None

    def reach(self, _: str) -> Reach:
        """Return the limits of a robot; no message tells them."""
        return REACH

    def stopped(self) -> list[str]:
        """Return the ids of the robots that an emergency holds."""
        now = self.clock.now
        devices = self.system.state.devices.items()
        return [id_tag for id_tag, entry in devices if emergency_of(entry, now, {}) is not None]

    def hears(self, robot: str) -> bool:
        """Return False for a robot that was added by hand, and hears nothing."""
        return not self.is_fake(robot)

    # --- where they are --------------------------------------------------------------------

    @property
    def site(self) -> Site | None:
        """Return the site, if one is known."""
        return self.system.site

    @property
    def frame(self) -> GeoFrame:
        """Return the origin of the map."""
        return self.system.frame

    def place_of(self, position: m.Position) -> tuple[float, float, str | None]:
        """Return a position on the map [m], and its room."""
        x, y = self.frame.to_xy(position.latitude, position.longitude)
        return x, y, UNKNOWN_ROOM if self.site is None else self.site.room_at(x, y)

    # --- what is done to them --------------------------------------------------------------

    def introduce(self, device: AgentDevice, robots: Sequence[str]) -> None:
        """Let a device know where robots from outside are found."""
        for robot in robots:
            entry = self.system.state.devices.get(robot)
            if entry is not None and not self.system.state.is_own(robot):
                device.introduce(robot, entry.device.address)

    def why_not(self) -> str:
        """Return why nobody may drive now; empty if one may."""
        return ""

    def note_emergency(self, robots: Sequence[str], device: AgentDevice, client: str) -> None:
        """Note who stops robots from a page, before the robots hear of it."""
        stopped = self.stopped()
        for robot in robots:
            if robot not in stopped:
                self.stoppers[robot] = device.id_tag, self._author(client)

    def change_pattern(self, robot: str, name: str, on_result: OnResult) -> None:
        """Drive a robot by another pattern from the next drive on, unless it is driven."""
        label = self.label_of(robot)
        if self.mode_of(robot) == Mode.TELEOPERATION.value:
            on_result(False, f"{label} is driven: it has to be stopped first")
            return
        self._patterns[robot] = name
        self.expect(robot)
        self.system.recorder.tell(self.clock.now, label, f"is driven by {name}", "link")
        on_result(True, "")

    def expect(self, robot: str) -> None:
        """Prepare a robot for another pattern; one from outside learns it by the commands."""
