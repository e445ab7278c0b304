"""Checks of the safety rules from outside: nothing here trusts what a robot says of itself.

What a robot may do follows from the log of commands with their true times, and from the
body in the world; a robot that trusts a command too long is found out.
"""

from __future__ import annotations

from collections.abc import Iterator

from dva_sim.agents.robot.controller import Mode
from dva_sim.agents.robot.robot import RobotAgent
from dva_sim.core.events import ACT_STEPS, STEPS, EventBook
from dva_sim.kernel.recorder import Applied, DriveLog
from dva_sim.simulation.scenario import RobotConfig
from dva_sim.worlds.bodies import G

MOVING = 0.05  # above this a robot is going somewhere [m/s]
SLACK = 1.02  # measured speeds may exceed a limit by so much
PENDING_SLACK = 2.0  # the desk looks at deadlines once a second [s]

Broken = tuple[str, str]


def broken_rules(
    robot: RobotAgent,
    drive: DriveLog | None,
    command: Applied | None,
    config: RobotConfig,
    last_mission: float,
    now: float,
) -> Iterator[Broken]:
    """Rules that do not hold for a robot now, each with what was seen.

    Args:
        robot: The robot.
        drive: Its newest drive, over or not.
        command: The newest one that took effect; its drive may be over and another ordered.
        config: Its limits as the scenario states them.
        last_mission: When it was last seen on a mission, driving by itself [s].
        now: Time [s].
    """
    spec, speed, turn_rate = robot.body.spec, robot.body.speed, robot.body.turn_rate
    mode = robot.controller.mode
    braking = min(spec.max_deceleration, robot.body.grip * G)
    stopping = spec.max_speed / braking + 4 * spec.motor_time_constant
    # What another robot has pushed moves on, until its own brakes have stopped it.
    pushed = robot.body.last_touch + stopping >= now
    if mode is not Mode.MISSION and abs(speed) > MOVING and not pushed:
        allowed = max(_allowed_until(command, config), last_mission)
        if now > allowed + stopping:
            yield "S1", f"moves at {speed:.2f} m/s, {now - allowed:.1f} s after it had to stop"
    driven = mode is Mode.TELEOPERATION and robot.body.powered
    if driven and drive is not None and drive.ended is None:
        if robot.controller.owner != drive.operator:
            yield "S2", f"is owned by {robot.controller.owner}, driven by {drive.operator}"
        if _moved_by_the_past(robot, drive):
            yield "S3", "obeys a session from before the emergency"
    # Comparisons that a nan fails, too; nobody drives backwards.
    forward = -MOVING <= speed <= spec.max_speed * SLACK
    within = forward and abs(turn_rate) <= spec.max_turn_rate * SLACK
    if not within and not pushed:
        yield "S4", f"moves at {speed:.2f} m/s and {turn_rate:.2f} rad/s"


def _allowed_until(command: Applied | None, config: RobotConfig) -> float:
    """When a command ceases to hold, by its true age and its reception [s]."""
    if command is None:
        return 0.0
    return min(command.arrived + config.watchdog_s, command.issued + config.max_age_s)


def _moved_by_the_past(robot: RobotAgent, drive: DriveLog) -> bool:
    emergency = robot.controller.emergency_at
    if emergency < 0 or not drive.applied or drive.started is None:
        return False
    return drive.applied[-1].time > emergency > drive.started


def broken_event_rules(book: EventBook, deadline: float, now: float) -> Iterator[Broken]:
    """Events that wait beyond their deadline [s] or are miscounted (S6), or out of order (S7)."""
    if sum(book.counts.values()) != book.total:
        yield "S6", f"{book.total} events, but {sum(book.counts.values())} in some state"
    for event in (*book.open.values(), *book.closed.values()):
        waited = now - event.waiting_since
        if event.waits_for is not None and waited > deadline + PENDING_SLACK:
            yield "S6", f"event {event.number} is {event.state} after {waited:.0f} s"
        for steps in (STEPS, ACT_STEPS):
            times = [event.times[step] for step in steps if step in event.times]
            if times != sorted(times):
                yield "S7", f"times of event {event.number} are out of order"
