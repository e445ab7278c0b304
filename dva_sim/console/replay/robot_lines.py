"""Windows of a robot at a recorded moment; what a recording does not hold stays open."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable

from dva_sim.console.robots.latencies import KEPT_TIMES, Latencies
from dva_sim.console.robots.robot_windows import WHEEL
from dva_sim.console.robots.shown_mode import EMERGENCY_LAPSES, emergency_shown
from dva_sim.console.wire.rows import (
    EmergencyShown,
    FaultsShown,
    LatencyFigures,
    RobotRow,
    RobotWindowLine,
)
from dva_sim.console.wire.scenes import ThingBody
from dva_sim.kernel.recorder import Applied, DriveLog, Sent
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode

_EMERGENCY = b"<RobotEmergency>"
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


class RobotLines:
    """The windows of one robot.

    Args:
        drives: Drives of this robot.
        traffic: All messages of the run, by time.
        robot: Its id.
        labels: Labels of all devices, by id.
    """

    def __init__(
        self,
        drives: Iterable[DriveLog],
        traffic: Iterable[Sent],
        robot: str,
        labels: dict[str, str],
    ) -> None:
        applied = [one for drive in drives for one in drive.applied]
        self._applied: list[Applied] = sorted(applied, key=lambda one: one.time)
        self._labels = labels
        self._emergencies = [
            (sent.time, body)
            for sent in traffic
            if sent.source == robot
            and isinstance(sent.payload, bytes)
            and _EMERGENCY in sent.payload
            and isinstance(body := decode(sent.payload).body, m.RobotEmergency)
        ]

    def line(self, row: RobotRow, speed: float, turn_rate: float, now: float) -> RobotWindowLine:
        """Return the windows at a moment.

        Args:
            row: Public state of the robot at that moment.
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
            "one_way": self._one_way(now),
            "loop": None,
            "replies": None,
            "faults": _NO_FAULTS,
            "sensors": [],
        }

    def emergency(self, now: float) -> EmergencyShown | None:
        """Return the emergency that held the robot then, as it reported each second."""
        end = bisect_right(self._emergencies, now, key=lambda entry: entry[0])
        reported, emergency = self._emergencies[end - 1] if end else (-math.inf, None)
        if emergency is None or now - reported > EMERGENCY_LAPSES:
            return None
        return emergency_shown(emergency, reported, self._labels)

    def _one_way(self, now: float) -> LatencyFigures | None:
        """Return the one-way delays of the newest commands that had taken effect by then."""
        end = bisect_right(self._applied, now, key=lambda one: one.time)
        figures = Latencies()
        for one in self._applied[max(0, end - KEPT_TIMES) : end]:
            figures.add(one.arrived - one.sent)
        return figures.line()
