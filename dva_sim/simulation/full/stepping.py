"""Robot driven from outside the run, in steps of virtual time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

from dva_sim.agents.observation import CameraFrame
from dva_sim.agents.operator.held_robot import HeldRobot
from dva_sim.agents.operator.person_at_console import ARRIVED_WITHIN_M, PersonAgent
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.recorder import Recorder
from dva_sim.simulation.full.control_room import console_of
from dva_sim.simulation.full.run import Run, Watched
from dva_sim.simulation.full.stage import id_of
from dva_sim.simulation.scenario import Scenario

Outcome = Literal["", "arrived", "lost"]

PERMISSION_WAIT_S = 60.0  # maximum wait for permission, answer and first picture of the robot [s]
LOOK = 0.1  # interval of checks for them [s]


class SteppedDrive:
    """A drive of `robot-1` to the first event, by the DVA's permission and over the modelled link.

    The place of the operator is taken by a console: it asks the DVA for the robot, starts it, sends
    commands by the scenario's pattern, and sees what the robot's camera sends, when that arrives.

    Args:
        scenario: Scenario to run; one of its operators drives no robot.
        seed: Random seed of the whole run.

    Attributes:
        run: The run.
        goal: Place of the event [m].

    Raises:
        ConfigError: the site cannot hold the team, or the scenario has no robot, operator or event.
    """

    def __init__(self, scenario: Scenario, seed: int) -> None:
        if not (scenario.robot.count and scenario.operator.count and scenario.events):
            raise ConfigError("to drive, a scenario needs a robot, an operator and an event")
        self.run = Run(scenario, seed, watched=Watched(Clock(), Recorder(False), seats=1))
        stage = self.run.stage
        self._person = PersonAgent(stage.device("console", 1), console_of(stage, scenario))
        self._person.device.register(self._begin_shift)
        self._is_known = False
        self._robot = id_of("robot", 1)
        self._refusal = ""
        self._inputs = 0
        x, y = self.run.field.incidents[0].hazard.position
        self.goal: tuple[float, float] = float(x), float(y)

    @property
    def now(self) -> float:
        """Virtual time [s]."""
        return self.run.clock.now

    @property
    def held(self) -> HeldRobot | None:
        """The robot, while the DVA lets this console have it."""
        return self._person.robots.get(self._robot)

    @property
    def frame(self) -> CameraFrame | None:
        """The newest picture that has arrived."""
        return None if self.held is None else self.held.frame

    @property
    def limits(self) -> tuple[float, float]:
        """The robot's top speed [m/s] and turn rate [rad/s]."""
        reach = self.run.stage.reach(self._robot)
        return reach.speed, reach.turn_rate

    def begin(self) -> CameraFrame:
        """Be given the robot, start it, and wait for its first picture.

        Raises:
            ConfigError: nobody answers, or one of them refuses.
        """
        robots = self.run.dva.core.registry.entries
        is_ready = lambda: self._is_known and self._robot in robots  # noqa: E731
        self._pass_until(is_ready, "the DVA does not come to know the robot and its driver")
        self._person.sit_down()
        self._person.take([self._robot], self._on_result)
        self._pass_until(self._holds("held"), "the DVA gives no permission")
        self._person.start(self._on_result)
        self._pass_until(self._holds("driving"), "the robot does not start")
        self._pass_until(lambda: self.frame is not None, "no picture arrives")
        assert self.frame is not None
        return self.frame

    def step(self, speed: float, turn: float, dt: float) -> Outcome:
        """Request a speed and a turn rate, as shares of the limits, for a time [s].

        Returns:
            `arrived` once the event is near in the picture; `lost` if the drive is over otherwise.
        """
        self._inputs += 1
        self._person.want(self._inputs, speed, turn)
        self.run.clock.run(self.now + dt)
        if self.held is None or not self.held.is_driven:
            return "lost"
        return "arrived" if self._is_there() else ""

    def _is_there(self) -> bool:
        observation = None if self.frame is None else self.frame.observation
        if observation is None:
            return False
        dx = observation.x - self.goal[0]
        dy = observation.y - self.goal[1]
        return dx * dx + dy * dy < ARRIVED_WITHIN_M * ARRIVED_WITHIN_M

    def _begin_shift(self) -> None:
        self._is_known = True

    def _holds(self, phase: str) -> Callable[[], bool]:
        return lambda: self.held is not None and self.held.phase == phase

    def _on_result(self, done: bool, text: str) -> None:
        self._refusal = "" if done else text

    def _pass_until(self, reached: Callable[[], bool], otherwise: str) -> None:
        end = self.now + PERMISSION_WAIT_S
        while not reached():
            if self._refusal or self.now >= end:
                raise ConfigError(self._refusal or f"{otherwise} within {PERMISSION_WAIT_S:g} s")
            self.run.clock.run(self.now + LOOK)
