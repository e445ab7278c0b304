"""The body of a ROS robot, placed by its odometry and moved by velocity commands."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from typing_extensions import override

from dva_sim.network.realtime import LiveClock
from dva_sim.ros.readings import RosMotion
from dva_sim.worlds.bodies import RobotBody
from dva_sim.worlds.drives import DriveSpec
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.physics import World

STOP_REPEATED: Final = (
    1.0  # design: the stop command is repeated for this time after each drive [s]
)
STANDS_BELOW: Final = 0.02  # a slower robot counts as standing [m/s, rad/s]


class RosBody(RobotBody):
    """A body outside of the physics: `place` sets its pose, and `send` passes its commands on.

    A command is repeated while it is in force. After its end the robot gets stop commands until it
    stands, and for at least `STOP_REPEATED`; then nothing is published, so that other programs may
    drive it.

    Args:
        world: The site; its physics does not act on this body.
        name: Label of the robot.
        spec: Limits that commands are clamped to.
        clock: Real time.
        period: Interval of repetitions of a command [s].
        send: Callback for speed [m/s] and turn rate [rad/s]; returns False if they could not be
            sent.

    Attributes:
        stopped_at: Time at which the robot was last told to stand [s].
        has_stood: True if it has stood since then.
    """

    def __init__(
        self,
        world: World,
        name: str,
        spec: DriveSpec,
        clock: LiveClock,
        period: float,
        send: Callable[[float, float], bool],
    ) -> None:
        super().__init__(world, name, spec, Pose(0.0, 0.0, 0.0))
        self._clock = clock
        self._send = send
        self._set_point = 0.0, 0.0, 0.0
        self.stopped_at = self._stop_until = -math.inf
        self.has_stood = True
        self._is_asked_to_move = False
        clock.every(period, self._repeat)

    @property
    @override
    def asked(self) -> tuple[float, float, float]:
        speed, turn_rate, until = self._set_point
        return speed, turn_rate, until if speed or turn_rate else 0.0

    def place(self, motion: RosMotion) -> None:
        """Set pose and velocity as odometry reports them.

        The physics counts full turns, odometry does not: the angle nearest the previous one is set.
        """
        body = self.body
        heading = motion.heading
        turns = round((body.angle - heading) / (2.0 * math.pi))
        body.position = (motion.x, motion.y)
        body.angle = heading + 2.0 * math.pi * turns
        ahead = math.cos(heading), math.sin(heading)
        body.velocity = motion.speed * ahead[0], motion.speed * ahead[1]
        body.angular_velocity = motion.turn_rate
        if abs(motion.speed) <= STANDS_BELOW and abs(motion.turn_rate) <= STANDS_BELOW:
            self.has_stood = True

    @override
    def drive(self, speed: float, turn_rate: float, until: float) -> None:
        max_speed = self.spec.max_speed
        max_turn_rate = self.spec.max_turn_rate
        now = self._clock.now
        if not (math.isfinite(speed) and math.isfinite(turn_rate)) or math.isnan(until):
            speed = turn_rate = 0.0
        # NaN was replaced above: it would pass these comparisons.
        speed = 0.0 if speed < 0.0 else max_speed if speed > max_speed else speed
        if not -max_turn_rate <= turn_rate <= max_turn_rate:
            turn_rate = math.copysign(max_turn_rate, turn_rate)
        self._set_point = speed, turn_rate, until
        moves = (speed != 0.0 or turn_rate != 0.0) and until > now
        if not moves:
            self.stand()
            return
        self._is_asked_to_move = True
        self._send(speed, turn_rate)
        if not math.isinf(until):
            self._clock.call_at(until, self._expire)

    def stand(self) -> None:
        """Tell the robot to stand."""
        now = self._clock.now
        if self._is_asked_to_move or now >= self._stop_until:
            self.stopped_at = now
            self.has_stood = self.has_stood and not self._is_asked_to_move
        self._is_asked_to_move = False
        self._stop_until = now + STOP_REPEATED
        self._set_point = 0.0, 0.0, now
        self._send(0.0, 0.0)

    def _expire(self) -> None:
        if self._is_asked_to_move and self._clock.now >= self._set_point[2]:
            self.stand()

    def _repeat(self) -> None:
        self._expire()
        if self._is_asked_to_move:
            self._send(*self._set_point[:2])
        elif not self.has_stood or self._clock.now < self._stop_until:
            self._send(0.0, 0.0)
