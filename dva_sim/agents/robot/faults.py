"""Faults of a robot that can be injected and removed while it runs.

No fault is random, and none is active until it is injected: a run without faults stays as it was.
The start and end of each fault appear in the robot's story.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from dva_sim.agents.robot.robot import RobotAgent
from dva_sim.network.messaging import Request

SLOWEST = 3.0  # maximum injected processing time of a message, PiBot's longest [s]
Lost = Callable[[str, bytes], object]


class RobotFaults:
    """The faults of one robot.

    Args:
        lost: Callback for each dropped reply: the robot, and the bytes.

    Attributes:
        processing_s: Processing time of each message [s]; None: the usual one.
        drops_replies: True if all its replies are lost.
        frozen: True if its computer hangs: it neither hears nor sends.
        camera_lost: True if it takes no pictures.
        stuck: Sensors that give their last values for ever.
    """

    def __init__(self, robot: RobotAgent, lost: Lost = lambda *_: None) -> None:
        self._robot = robot
        self._lost = lost
        self.processing_s: float | None = None
        self.drops_replies = self.frozen = self.camera_lost = False
        self._sound = dict(robot.sensors)
        self.stuck: set[str] = set()
        self._usual = robot.inbox.service

    @property
    def any(self) -> bool:
        """True if any fault is active."""
        flags = self.drops_replies, self.frozen, self.camera_lost, self.stuck
        return self.processing_s is not None or any(flags)

    def slow_down(self, seconds: float | None) -> None:
        """Set the processing time of each message [s]; None: the usual one."""
        inbox = self._robot.inbox
        if self.processing_s is None:
            self._usual = inbox.service
        self.processing_s = seconds
        inbox.service = self._usual if seconds is None else lambda: seconds
        text = "as usual" if seconds is None else f"{seconds:g} s"
        self._tell(f"fault: processing of a message takes {text}")

    def usually(self, service: Callable[[], float]) -> None:
        """Set the usual processing time, which applies while no fault overrides it."""
        self._usual = service
        if self.processing_s is None:
            self._robot.inbox.service = service

    def drop_replies(self, on: bool) -> None:
        """Drop all replies, or none."""
        if on is self.drops_replies:
            return
        self.drops_replies = on
        robot = self._robot
        service = self._lose_the_answer if on else robot.inbox.request
        robot.device.network.serve(robot.device.id_tag, service)
        self._tell("fault: its replies are dropped" if on else "its replies are no longer dropped")

    def _lose_the_answer(self, request: Request) -> None:
        robot = self._robot.device.id_tag
        lost = request._replace(answer=lambda reply: self._lost(robot, reply))
        self._robot.inbox.request(lost)

    def freeze(self, on: bool) -> None:
        """Hang its computer, or restart it: idle, without a driver, with the latest settings."""
        if on is self.frozen:
            return
        self.frozen = on
        robot = self._robot
        if on:
            self._tell("fault: its computer is frozen")
            robot.hang()
        else:
            robot.device.silent = not robot.body.powered
            self._tell("its computer has restarted")

    def lose_camera(self, on: bool) -> None:
        """Disable or enable the camera."""
        if on is self.camera_lost:
            return
        self.camera_lost = self._robot.blind = on
        self._tell("fault: its camera is lost" if on else "its camera is back")

    def stick(self, sensor: str, on: bool) -> None:
        """Freeze a sensor at its last values, or let it measure again.

        Raises:
            KeyError: it has no such sensor.
        """
        port = self._sound[sensor]
        if on is (sensor in self.stuck):
            return
        if on:
            self.stuck.add(sensor)
            last = port.read(self._robot.device.clock.now)
            self._robot.sensors[sensor] = replace(port, read=lambda _: last)
        else:
            self.stuck.discard(sensor)
            self._robot.sensors[sensor] = port
        self._tell(f"{'fault: ' if on else ''}its {sensor} is {'stuck' if on else 'stuck no more'}")

    def _tell(self, what: str) -> None:
        self._robot.device.tell(what, "link")
