"""The robots of a console's own run, as people in seats drive them from pages."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final

from typing_extensions import override

from dva_sim.agents.device import AgentDevice
from dva_sim.agents.operator.held_robot import HeldRobot
from dva_sim.agents.operator.strategies import Reach
from dva_sim.cameras.screens import Screens
from dva_sim.console.driving.driven_system import DrivenSystem
from dva_sim.console.driving.seating import Seating
from dva_sim.console.robots.robot_actions import RobotActions
from dva_sim.console.run.lag import LagRule
from dva_sim.console.system.known_system import KnownSystem
from dva_sim.simulation.full.control_room import SENSOR_ALARMS, console_of
from dva_sim.simulation.full.run import Run

PEOPLE: Final = 1  # operators of the scenario whose places people take


class DrivenRun(DrivenSystem):
    """Robots of a run, which can be prepared for a pattern, and held while the run lags.

    Args:
        run: The run.
        system: System of its DVA.
        lag: Rule that holds drives while the run lags.
        screens: Cameras that somebody looks at.
        author: Function that returns the name of the person at a page.

    Attributes:
        hands: Manual control at the robots, once there is any.
    """

    seeks_orders = True

    def __init__(
        self,
        run: Run,
        system: KnownSystem,
        *,
        lag: LagRule,
        screens: Screens,
        author: Callable[[str], str],
    ) -> None:
        super().__init__(system, run.scenario, run.stage.pattern_names, author)
        self._run = run
        self._lag = lag
        self._screens = screens
        self.hands: RobotActions | None = None
        self.on_held = screens.hold
        self.seating = Seating(
            self._make_seat, console_of(run.stage, run.scenario), self._watch_robot
        )
        for number in range(max(PEOPLE, len(run.persons))):
            self.seating.person(number)

    def _make_seat(self, number: int) -> AgentDevice:
        device = self._run.stage.device("console", number)
        for robot in self._run.field.robots:
            device.connect(robot)  # an emergency does not wait for a connection
        self.system.things.add(device.id_tag, device.label, "operator")
        return device

    def _watch_robot(self, held: HeldRobot) -> None:
        """Take the frames of a driven robot from what its seat gets."""
        usual = held.on_frame

        def on_frame(held: HeldRobot, frame: Any) -> None:
            usual(held, frame)
            self._screens.arrived(held.robot, frame)

        held.on_frame = on_frame

    # --- see `DrivenSystem` ----------------------------------------------------------------

    @property
    @override
    def emergency_device(self) -> AgentDevice:
        return self.seating.person(0).device

    @override
    def pattern_of(self, robot: str) -> str:
        return self._run.stage.pattern_name(robot)

    @override
    def alarm_at(self, sensor: str) -> float | None:
        alarm = SENSOR_ALARMS.get(sensor)
        return None if alarm is None else alarm.threshold

    @override
    def reach(self, robot: str) -> Reach:
        return self._run.stage.reach(robot)

    @override
    def why_not(self) -> str:
        if self._lag.held:
            return "held: this machine cannot keep up with real time"
        return "The simulation is paused. Resume it first." if self.clock.paused else ""

    @override
    def note_emergency(self, robots: Sequence[str], device: AgentDevice, client: str) -> None:
        if self.hands is not None:
            self.hands.stop(robots)
        super().note_emergency(robots, device, client)

    @override
    def expect(self, robot: str) -> None:
        agent = self._run.field.robots.get(robot)
        if agent is not None:
            agent.expect(self._run.stage.pattern_for(robot))
