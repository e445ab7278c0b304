"""Conditions of robots that need somebody to act: lost, stopped, or out of power."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Final

from dva_sim.agents.robot.controller import Mode
from dva_sim.console.events.alarms import AlarmCondition
from dva_sim.console.wire.rows import RobotRow

UNHEARD: Final = "nothing is heard of it"  # why a robot stands whose messages alone are known
LOW, EMPTY = 0.25, 0.1  # charge of a battery, as a share

Named = Callable[[str], str]


def robot_conditions(robots: Sequence[RobotRow], named: Named) -> Iterator[AlarmCondition]:
    """Yield the conditions of all robots.

    Args:
        robots: Rows of the robots, as on pages.
        named: Function that returns the name of a robot by its number, as in `"0"`.
    """
    yield from _stopped(robots, named)
    for row in robots:
        label = named(str(row["i"]))
        if why := _lost(row):
            text = f"{label} is lost: {why}"
            yield AlarmCondition(f"lost {label}", "robot lost", "high", place="", text=text)
        if (charge := row.get("battery")) is not None and charge < LOW:
            priority = "high" if charge < EMPTY else "medium"
            text = f"{label}: battery at {100 * charge:.0f} %"
            key = f"battery {label}"
            yield AlarmCondition(key, "low battery", priority, place="", text=text)


def _lost(row: RobotRow) -> str:
    """Return why a robot counts as lost: to the DVA, or in a drive; empty if it does not."""
    if row.get("silent"):
        return "the DVA hears nothing of it"
    if row["mode"] != Mode.TELEOPERATION.value:
        return ""
    if row["watchdog_left_s"] == 0.0 and "first command" not in row["stop_reason"]:
        return "its watchdog stopped it in a drive"
    return f"{UNHEARD} in a drive" if row["stop_reason"] == UNHEARD else ""


def _stopped(robots: Sequence[RobotRow], named: Named) -> Iterator[AlarmCondition]:
    """Yield one condition for all robots that an emergency holds."""
    stopped = [row for row in robots if row.get("emergency") is not None]
    if stopped:
        count = f"{len(stopped)} of {len(robots)} robots"
        who = named(str(stopped[0]["i"])) if len(stopped) == 1 else count
        text = f"Emergency stop: {who} stopped until released"
        yield AlarmCondition("stopped", "emergency stop", "high", place="", text=text)
