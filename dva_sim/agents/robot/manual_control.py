"""Manual control at a robot itself: without messages, within the same limits and watchdog."""

from __future__ import annotations

from dva_sim.agents.robot.controller import Decision, RobotController
from dva_sim.agents.robot.decision_log import (
    LET_GO,
    PRESSED,
    RELEASED_BY_HAND,
    TAKEN_BY_HAND,
)
from dva_sim.agents.robot.robot import RobotAgent
from dva_sim.kernel.recorder import ByHand
from dva_sim.protocol import messages as m


class ManualControl:
    """Manual control of a robot by one person at a time; its controller decides."""

    def __init__(self, robot: RobotAgent) -> None:
        self._robot = robot

    @property
    def _controller(self) -> RobotController:
        return self._robot.controller

    def take(self, who: str) -> Decision:
        """Give a person manual control of the robot, if it is idle and nobody holds it."""
        robot = self._robot
        now = self._robot.device.clock.now
        if robot.device.silent or not robot.body.powered:
            return Decision(m.BUSY, "its computer does not answer")
        before = self._controller.by_hand
        decision = self._controller.take_by_hand(who, now, robot.is_moving)
        if decision.code != m.OK or before == who:
            return decision
        self._done(who, "takes", decision, now)
        if robot.trace is not None:
            robot.trace.happened(TAKEN_BY_HAND, now)
        robot.device.tell("is driven by hand from now on, at the robot itself", "mode")
        return decision

    def drive(self, who: str, speed: float, turn_rate: float) -> Decision:
        """Set the speed [m/s] and turn rate [rad/s] that the person commands."""
        robot = self._robot
        now = self._robot.device.clock.now
        if robot.device.silent:
            return Decision(m.BUSY, "its computer does not answer")
        decision = self._controller.drive_by_hand(who, speed, turn_rate, now)
        if decision.code == m.OK:
            self._done(who, "drives", decision, now)
        return decision

    def let_go(self, who: str) -> Decision:
        """Stop the robot, which the person gives up."""
        robot = self._robot
        now = self._robot.device.clock.now
        decision = self._controller.let_go(who)
        if decision.code != m.OK:
            return decision
        self._done(who, "lets go", decision, now)
        if robot.trace is not None:
            robot.trace.happened(LET_GO, now)
        robot.device.tell("is no longer driven by hand", "mode")
        return decision

    def press_emergency(self) -> None:
        """Press the button at the robot itself: it stands until it is released."""
        robot = self._robot
        now = self._robot.device.clock.now
        before = self._controller.mode
        decision = self._controller.stop(now)
        self._done("", "stops", decision, now)
        if robot.trace is not None:
            robot.trace.happened(PRESSED, now)
        robot.device.tell("is stopped by its own emergency button", "mode")
        if self._controller.mode is not before:
            robot.mode_changed("")
        robot.latch_changed()

    def release(self, who: str) -> Decision:
        """Release the robot at the robot itself, after an emergency."""
        robot = self._robot
        decision = self._controller.release_by_hand(who)
        if decision.code == m.OK:
            now = robot.device.clock.now
            self._done(who, "releases", decision, now)
            if robot.trace is not None:
                robot.trace.happened(RELEASED_BY_HAND, now)
            robot.latch_changed()
        return decision

    def _done(self, who: str, what: str, decision: Decision, now: float) -> None:
        """Apply a decision to the motors, and tell the safety audit."""
        robot = self._robot
        robot.device.recorder.on_hand(ByHand(robot.device.id_tag, who, what, now))
        if decision.set_point is not None:
            robot.move(decision.set_point)
