"""A system that runs elsewhere as one whose robots people drive; see `DrivenSystem`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from typing_extensions import override

from dva_sim.agents.device import AgentDevice
from dva_sim.agents.operator.handheld import Console
from dva_sim.agents.operator.strategies import Reach
from dva_sim.agents.robot.controller import Mode
from dva_sim.console.asking.refusal import OnResult
from dva_sim.console.attached.system import AttachedSystem
from dva_sim.console.driving.driven_system import DrivenSystem
from dva_sim.console.driving.seating import Seating
from dva_sim.console.views.published_rows import emergency_of
from dva_sim.console.views.things import UNKNOWN_ROBOT
from dva_sim.network.patterns import Pattern, load_pattern
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import OPERATOR
from dva_sim.simulation.full.control_room import setup_by
from dva_sim.simulation.scenario import Scenario, phone_profile
from dva_sim.worlds.geo import GeoFrame
from dva_sim.worlds.site import Site

REACH: Final = Reach(UNKNOWN_ROBOT["max_speed_mps"], UNKNOWN_ROBOT["max_turn_rate_radps"])


class DrivenAttached(DrivenSystem):
    """Robots that a DVA elsewhere lists, for people in seats.

    Commands carry the tick of a robot's newest status: they are as old as that.

    Args:
        system: System to which the console is attached.
        author: Name of the person at a page.

    Attributes:
        stoppers: Device and name of the person who stopped a robot from a page, by its id.
    """

    seeks_orders = False

    def __init__(self, system: AttachedSystem, author: Callable[[str], str]) -> None:
        self._system = system
        self._author = author
        self.clock = system.clock
        scenario = system.scenario
        self.own_pattern = scenario.pattern
        self.stale_s = scenario.robot.max_age_s
        self._patterns: dict[str, str] = {}
        self.on_held: Callable[[set[str]], object] = lambda _: None
        self.free_seat: Callable[[str], object] = lambda _: None
        self.stoppers: dict[str, tuple[str, str]] = {}
        self.seating = Seating(self._make_seat, self._console(scenario), lambda _: None)

    def _console(self, scenario: Scenario) -> Console:
        setup = setup_by(scenario, pattern=self._pattern_for, topic=lambda _: None)
        return Console(setup=setup, phone=phone_profile(scenario), reach=self.reach)

    def _pattern_for(self, robot: str) -> Pattern:
        return load_pattern(self.pattern_of(robot))()

    def _make_seat(self, number: int) -> AgentDevice:
        device = self._system.new_seat(number, OPERATOR)
        for robot in self.robots():
            if self.hears(robot):
                device.connect(robot)  # an emergency does not wait for a connection
        return device

    # --- see `DrivenSystem` ----------------------------------------------------------------

    @property
    @override
    def now_ms(self) -> int:
        return self._system.now_ms

    @property
    @override
    def emergency_device(self) -> AgentDevice:
        return self._system.device

    @override
    def robots(self) -> list[str]:
        return self._system.robots()

    @override
    def number_of(self, robot: str) -> int | None:
        return self._system.numbers.get(robot)

    @override
    def label_of(self, device: str) -> str:
        return self._system.label_of(device)

    @override
    def mode_of(self, robot: str) -> str:
        entry = self._system.state.devices.get(robot)
        status = None if entry is None else entry.status
        return status.mode if isinstance(status, m.RobotStatus) else ""

    @override
    def pattern_of(self, robot: str) -> str:
        return self._patterns.get(robot, self.own_pattern)

    @override
    def reach(self, robot: str) -> Reach:
        return REACH

    @property
    @override
    def site(self) -> Site | None:
        return self._system.site

    @property
    @override
    def frame(self) -> GeoFrame:
        return self._system.frame

    @override
    def stopped(self) -> list[str]:
        now = self.clock.now
        devices = self._system.state.devices.items()
        return [id_tag for id_tag, entry in devices if emergency_of(entry, now, {}) is not None]

    @override
    def hears(self, robot: str) -> bool:
        return not self._system.is_fake(robot)

    @override
    def introduce(self, device: AgentDevice, robots: Sequence[str]) -> None:
        for robot in robots:
            device.introduce(robot, self._system.state.devices[robot].device.address)

    @override
    def note_emergency(self, robots: Sequence[str], device: AgentDevice, client: str) -> None:
        for robot in robots:
            entry = self._system.state.devices[robot]
            if entry.emergency is None or entry.emergency[0].released is not None:
                self.stoppers[robot] = device.id_tag, self._author(client)

    @override
    def change_pattern(self, robot: str, name: str, on_result: OnResult) -> None:
        label = self.label_of(robot)
        if self.mode_of(robot) == Mode.TELEOPERATION.value:
            on_result(False, f"{label} is driven: it has to be stopped first")
            return
        self._patterns[robot] = name
        self._system.recorder.tell(self.clock.now, label, f"is driven by {name} from here", "link")
        on_result(True, "")
