"""A console's own run as the system whose robots people drive; see `DrivenSystem`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final

from typing_extensions import override

from dva_sim.agents.device import AgentDevice
from dva_sim.agents.operator.held_robot import HeldRobot
from dva_sim.agents.operator.strategies import Reach
from dva_sim.agents.robot.controller import Mode
from dva_sim.cameras.screens import Screens
from dva_sim.console.asking.refusal import OnResult
from dva_sim.console.driving.driven_system import DrivenSystem
from dva_sim.console.driving.seating import Seating
from dva_sim.console.robots.robot_actions import RobotActions
from dva_sim.console.run.lag import LagRule
from dva_sim.console.views.feed import Feed
from dva_sim.console.views.foreign_devices import ForeignDevices
from dva_sim.network.realtime import PacedClock
from dva_sim.simulation.full.control_room import console_of
from dva_sim.simulation.full.run import Run
from dva_sim.worlds.geo import GeoFrame
from dva_sim.worlds.site import Site

PEOPLE: Final = 1  # operators of the scenario whose places people take


class DrivenRun(DrivenSystem):
    """Robots of a run, and those that have joined it from outside, for people in seats.

    Args:
        run: The run.
        clock: Its time, at its pace.
        feed: Numbers of everybody.
        lag: Rule that holds drives while the run lags.
        foreign: Robots from outside.
        screens: Cameras that somebody looks at.
        author: Name of the person at a page.
        is_fake: Predicate: True for a device that was added by hand.

    Attributes:
        hands: Manual control at the robots, once there is any.
    """

    def __init__(
        self,
        run: Run,
        *,
        clock: PacedClock,
        feed: Feed,
        lag: LagRule,
        foreign: ForeignDevices,
        screens: Screens,
        author: Callable[[str], str],
        is_fake: Callable[[str], bool],
    ) -> None:
        self._run = run
        self.clock = clock
        self._feed = feed
        self._lag = lag
        self._foreign = foreign
        self._screens = screens
        self._author = author
        self._is_fake = is_fake
        self.hands: RobotActions | None = None
        self.on_held = screens.hold
        self.free_seat: Callable[[str], object] = lambda _: None
        self.own_pattern = run.scenario.pattern
        self.stale_s = run.scenario.robot.max_age_s
        self.seeks_orders = True
        self.seating = Seating(
            self._make_seat, console_of(run.stage, run.scenario), self._watch_robot
        )
        for number in range(max(PEOPLE, len(run.persons))):
            self.seating.person(number)

    def _make_seat(self, number: int) -> AgentDevice:
        device = self._run.stage.device("console", number)
        for robot in self._run.field.robots:
            device.connect(robot)  # an emergency does not wait for a connection
        self._feed.things.add(device.id_tag, device.label, "operator")
        return device

    def _watch_robot(self, held: HeldRobot) -> None:
        """Frames of a robot in somebody's hands are those that the seat gets."""
        usual = held.on_frame

        def on_frame(held: HeldRobot, frame: Any) -> None:
            usual(held, frame)
            self._screens.arrived(held.robot, frame)

        held.on_frame = on_frame

    # --- see `DrivenSystem` ----------------------------------------------------------------

    @property
    @override
    def now_ms(self) -> int:
        return self._feed.now_ms

    @property
    @override
    def emergency_device(self) -> AgentDevice:
        return self.seating.person(0).device

    @override
    def robots(self) -> list[str]:
        return [*self._run.field.robots, *self._foreign.addresses()]

    @override
    def number_of(self, robot: str) -> int | None:
        return self._feed.numbers.get(robot)

    @override
    def label_of(self, device: str) -> str:
        return self._run.stage.labels.get(device, device)

    @override
    def mode_of(self, robot: str) -> str:
        agent = self._run.field.robots.get(robot)
        return "" if agent is None else agent.controller.mode.value

    @override
    def pattern_of(self, robot: str) -> str:
        return self._feed.pattern_of(robot)

    @override
    def reach(self, robot: str) -> Reach:
        return self._run.stage.reach(robot)

    @property
    @override
    def site(self) -> Site:
        return self._run.stage.site

    @property
    @override
    def frame(self) -> GeoFrame:
        return self.site.frame

    @override
    def stopped(self) -> list[str]:
        here = self._run.field.robots.items()
        latched = (robot for robot, agent in here if agent.controller.latch.holds)
        return [*latched, *self._foreign.stopped()]

    @override
    def hears(self, robot: str) -> bool:
        return not self._is_fake(robot)

    @override
    def introduce(self, device: AgentDevice, robots: Sequence[str]) -> None:
        for robot, address in self._foreign.addresses().items():
            if robot in robots:
                device.introduce(robot, address)

    @override
    def why_not(self) -> str:
        if self._lag.held:
            return "held: this machine cannot keep up with real time"
        return "The simulation is paused. Resume it first." if self.clock.paused else ""

    @override
    def note_emergency(self, robots: Sequence[str], device: AgentDevice, client: str) -> None:
        if self.hands is not None:
            self.hands.stop(robots)
        here = self._run.field.robots
        for robot in robots:
            if robot in here and not here[robot].controller.latch.holds:
                self._feed.stoppers[robot] = device.id_tag, self._author(client)

    @override
    def change_pattern(self, robot: str, name: str, on_result: OnResult) -> None:
        run = self._run
        label = self.label_of(robot)
        agent = run.field.robots.get(robot)
        if agent is not None and agent.controller.mode is Mode.TELEOPERATION:
            on_result(False, f"{label} is driven: it has to be stopped first")
            return
        run.stage.pattern_names[robot] = name
        if agent is not None:
            agent.expect(run.stage.pattern_for(robot))
        run.recorder.tell(run.clock.now, label, f"is driven by {name}", "link")
        on_result(True, "")
