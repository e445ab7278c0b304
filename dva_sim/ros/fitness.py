"""Fitness of a ROS robot for driving: bridge up, odometry fresh, commands obeyed.

Pure: it takes events with their times, and returns what is wrong.
"""

from __future__ import annotations

import math
from typing import Final

from dva_sim.ros.profile import RosLimits

DRIFT: Final = 1e-4  # design: clocks of robot and bench differ in rate by less than this
BACKLOG: Final = 3.0  # design: lateness of odometry after which the bridge is renewed [s]
NO_ODOMETRY: Final = "no odometry has come"
NO_BRIDGE: Final = "the bridge is not connected"


class Fitness:
    """Reasons for not driving a robot, from its messages and the state of the bridge.

    Odometry is late when none has arrived for `odometry_within_s`, or when its delay has grown by
    that much above the smallest delay so far: a bridge with a growing queue delivers old messages
    at a steady rate.

    Args:
        limits: Times of the profile.
    """

    def __init__(self, limits: RosLimits) -> None:
        self._limits = limits
        self._bridge = NO_BRIDGE
        self._refused = ""
        self._odometry_at = -math.inf
        self._least_delay = math.inf
        self._least_delay_at = 0.0
        self._extra_delay = 0.0
        self._late_since = math.inf
        self._does_not_stop = False
        self._disabled = ""

    def connected(self) -> None:
        """Note that the bridge is connected; odometry of earlier connections no longer counts."""
        self._bridge = self._refused = ""
        self._odometry_at = -math.inf
        self._least_delay = math.inf
        self._extra_delay = 0.0
        self._late_since = math.inf

    def lost(self, why: str) -> None:
        """Note that the bridge is lost or unreachable, and the first reason until it is back."""
        if self._bridge in ("", NO_BRIDGE):
            self._bridge = f"the bridge is lost: {why}"

    def moved(self, now: float, stamp: float | None) -> None:
        """Take odometry, measured at `stamp` by the robot's clock [s]."""
        self._odometry_at = now
        self._refused = ""
        if stamp is not None:
            # The clocks are not synchronised: only the growth of the offset shows a delay. The
            # smallest one may rise slowly, as the robot's clock may be faster or slower.
            offset = now - stamp
            self._least_delay = min(
                offset, self._least_delay + DRIFT * (now - self._least_delay_at)
            )
            self._least_delay_at = now
            self._extra_delay = offset - self._least_delay

    def refused(self, why: str) -> None:
        """Note that unusable odometry has arrived, and why."""
        self._refused = why

    def disabled(self, why: str) -> None:
        """Note why the robot is not enabled yet; an empty text once it is."""
        self._disabled = why

    def obeys(self, now: float, stopped_at: float, has_stood: bool) -> None:
        """Note whether the robot has stood since it was ordered to stop, at `stopped_at` [s]."""
        self._does_not_stop = not has_stood and now - stopped_at > self._limits.stands_within_s

    def problem(self, now: float) -> str:
        """Return why the robot cannot be driven; empty if it can."""
        if self._bridge:
            return self._bridge
        if self._odometry_at == -math.inf:
            return f"odometry is refused: {self._refused}" if self._refused else NO_ODOMETRY
        late = self._limits.odometry_within_s
        if now - self._odometry_at > late or self._extra_delay > late:
            self._late_since = min(self._late_since, now)
            why = f": {self._refused}" if self._refused else ""
            return f"odometry is more than {late:g} s late{why}"
        self._late_since = math.inf
        if self._disabled:
            return f"it is not enabled: {self._disabled}"
        if self._does_not_stop:
            return f"it does not stop within {self._limits.stands_within_s:g} s"
        return ""

    def needs_another_bridge(self, now: float) -> bool:
        """Return True if odometry has been late for so long that a new connection may help."""
        return not self._bridge and self._extra_delay > 0 and now - self._late_since > BACKLOG
