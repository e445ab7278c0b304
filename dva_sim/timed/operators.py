"""Operators: each drives one robot at a time."""

from __future__ import annotations

from dva_sim.protocol import messages as m
from dva_sim.timed.units import DONE, Unit


class Operator:
    """A person who drives one robot at a time.

    Args:
        device: Its id.
        robots: By id.
    """

    def __init__(self, device: str, robots: dict[str, Unit]) -> None:
        self.device, self._robots = device, robots
        self._robot: Unit | None = None

    def take(self, body: m.Body) -> bool:
        """Hear the DVA; False declines."""
        if isinstance(body, m.OrderProgress):
            robot = self._robot
            return robot is None or robot.take(body)
        if not isinstance(body, m.Order) or body.device is None:
            return False
        robot = self._robots[body.device]
        former, self._robot = self._robot, robot
        job = None if former is None or former is robot else former.job
        if former is not None and job is not None and job.voice == self.device:
            former.take(m.OrderProgress(job.order.event_id, DONE))
        return robot.order(body, self.device)
