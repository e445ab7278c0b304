"""Reasons why a robot stands, in words for the page."""

from __future__ import annotations

from dva_sim.agents.robot.controller import STANDSTILL, Mode
from dva_sim.agents.robot.robot import RobotAgent

STANDS_BELOW = 0.02  # slower it stands [m/s, rad/s]
HELD_BACK = 0.25  # of the speed that was asked for: what creeps in contact is held back
LAG = "held: this machine cannot keep up with real time"


def stop_reason(robot: RobotAgent, now: float, held_by_lag: bool) -> str:
    """Return why a robot stands; empty if it moves.

    Args:
        now: [s]
        held_by_lag: True if nobody may drive now because the run lags.
    """
    body = robot.body
    controller = robot.controller
    point = robot.set_point
    if body.jammed:
        return "it is stuck against something"
    commanded = abs(point.speed) if now < point.until else 0.0
    if body.in_contact and STANDS_BELOW < commanded > abs(body.speed) / HELD_BACK:
        return "something is in its way"
    if abs(body.speed) > STANDS_BELOW or abs(body.turn_rate) > STANDS_BELOW:
        return ""
    if not body.powered:
        return "its battery is empty"
    if controller.latch.holds:
        return "emergency stop"
    if controller.mode is Mode.TELEOPERATION:
        if point == STANDSTILL and not robot.stale:
            return "waits for the first command: its connection is being opened"
        if now >= point.until:
            return _without_command(robot, now)
        if abs(point.speed) < STANDS_BELOW and abs(point.turn_rate) < STANDS_BELOW:
            return "it is asked to stand"
        return "it sets off, or is held back"
    if held_by_lag:
        return LAG
    if controller.by_hand is not None:
        return "its manual driver asks it to stand"
    if controller.mode is Mode.MISSION:
        return controller.mission_status.reason or "its mission has it wait"
    if controller.grant is None:
        return "nobody holds it"
    return "it is held, and not started"


def _without_command(robot: RobotAgent, now: float) -> str:
    """Return True if its watchdog has stopped it, or the age limit of what it was told."""
    silent = now - robot.controller.last_valid
    if robot.stale:
        return f"commands are older than {robot.controller.limits.max_age:g} s when they come"
    return f"no command for {silent:.0f} s: its watchdog stopped it"
