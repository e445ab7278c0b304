"""Windows of a robot at a recorded moment; what a recording does not hold stays open."""

from __future__ import annotations

from collections.abc import Iterable

from dva_sim.console.robots.latencies import KEPT_TIMES, Latencies
from dva_sim.console.robots.robot_windows import WHEEL
from dva_sim.console.wire.rows import (
    FaultsShown,
    LatencyFigures,
    RobotRow,
    RobotWindowLine,
)
from dva_sim.console.wire.scenes import ThingBody
from dva_sim.kernel.recorder import DriveLog

_NO_FAULTS: FaultsShown = {
    "processing_s": None,
    "replies": False,
    "freeze": False,
    "camera": False,
}


def about(radius: float) -> ThingBody:
    """Return what a robot's pictures are drawn by, as far as known: its radius [m]."""
    return {
        "radius_m": radius,
        "wheel_radius_m": round(WHEEL * radius, 3),
        "corners_m": [],
        "steering": "free",
        "sensors": [],
    }


def robot_window(
    row: RobotRow, drives: Iterable[DriveLog], *, speed: float, turn_rate: float, now: float
) -> RobotWindowLine:
    """Return the windows of a robot at a moment.

    Args:
        row: Public state of the robot at that moment.
        drives: Its drives.
        speed: Recorded speed [m/s].
        turn_rate: Recorded turn rate [rad/s].
        now: The moment [s].
    """
    return {
        "k": "robot",
        "t": round(1000 * now),
        "i": row["i"],
        "station": {"state": "listening", "address": None, "dva": None, "problem": ""},
        "mode": row["mode"],
        "hand": None,
        "holder": row["holder_label"],
        "stop_reason": row["stop_reason"],
        "link_lost": False,
        "notice": "",
        "speed_mps": row["set_speed_mps"],
        "turn_rate_radps": row["set_turn_rate_radps"],
        "now_mps": round(speed, 2),
        "now_radps": round(turn_rate, 2),
        "watchdog_left_s": None,
        "one_way": _one_way(drives, now),
        "loop": None,
        "replies": None,
        "faults": _NO_FAULTS,
        "sensors": [],
    }


def _one_way(drives: Iterable[DriveLog], now: float) -> LatencyFigures | None:
    """Return the one-way delays of the newest commands that had taken effect by then."""
    applied = (one for drive in drives for one in drive.applied if one.time <= now)
    figures = Latencies()
    for one in sorted(applied, key=lambda one: one.time)[-KEPT_TIMES:]:
        figures.add(one.arrived - one.sent)
    return figures.line()
