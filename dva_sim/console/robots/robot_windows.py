"""Windows of a robot: its motion, its driver, and the latency of its messages.

A robot's own clock tells how old the picture was behind a command (`SeenTick`): from the robot to
its driver and back. The one-way time of a message is known only if its sender is a device of
this process, as no two clocks agree.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Protocol

from dva_sim.agents.robot.controller import Mode
from dva_sim.agents.robot.faults import RobotFaults
from dva_sim.agents.robot.manual_control import ManualControl
from dva_sim.agents.robot.robot import RobotAgent
from dva_sim.console.robots.latencies import Latencies
from dva_sim.console.wire.rows import RobotRow, RobotWindowLine, SensorShown, StationShown
from dva_sim.console.wire.scenes import ThingBody
from dva_sim.kernel.recorder import Recorder
from dva_sim.network.tap import Exchange
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode
from dva_sim.protocol.errors import ProtocolError
from dva_sim.worlds.drives import ThreeWay

WHEEL = 1 / 3  # radius of a wheel, as a share of that of the footprint; assumed, for the picture
SENSING = 1.0  # from one look at the sensors to the next [s]


class RobotStation(Protocol):
    """Station of a robot: off, registered, listening."""

    def line(self) -> StationShown:
        """Return the state, the address at which it listens, and that of the DVA."""


class AlwaysListening:
    """The station of a robot that registers by itself, and listens from the beginning."""

    def __init__(self, robot: RobotAgent) -> None:
        self._robot = robot

    def line(self) -> StationShown:
        """Implement `RobotStation`."""
        device = self._robot.device
        state = "listening" if self._robot.body.powered else "off"
        return {"state": state, "address": device.address, "dva": None, "problem": ""}


@dataclass
class RobotWindow:
    """Facts about one robot for its windows.

    Attributes:
        robot: The robot.
        station: Progress of the robot from off to listening.
        faults: Injected faults.
        hand: Manual control at the robot.
        number: Number of the page in manual control; None: nobody.
        notice: Reason why manual control last ended.
        one_way: From its driver to it.
        loop: From it to its driver and back, by pictures and the commands behind them.
        replies: From a request to the reply.
    """

    robot: RobotAgent
    station: RobotStation
    faults: RobotFaults
    hand: ManualControl
    number: int | None = None
    notice: str = ""
    one_way: Latencies = field(default_factory=Latencies)
    loop: Latencies = field(default_factory=Latencies)
    replies: Latencies = field(default_factory=Latencies)
    newest: int = 0  # of the messages that it has heard
    _sensed: tuple[float, list[SensorShown]] = field(default_factory=lambda: (-math.inf, []))

    def sensors(self, now: float) -> list[SensorShown]:
        """Return the newest values of its sensors, looked at once a second."""
        if now - self._sensed[0] >= SENSING or now < self._sensed[0]:
            self._sensed = now, [*self._read(now)]
        return self._sensed[1]

    def _read(self, now: float) -> Iterator[SensorShown]:
        for name, port in self.robot.sensors.items():
            values = port.read(now)
            stuck = name in self.faults.stuck
            line: SensorShown = {"name": name, "unit": port.unit, "stuck": stuck}
            if len(values) > 3:
                line["least"] = min(values)
            elif values:
                line["values"] = list(values)
            yield line


class RobotWindows:
    """The windows of all robots of a run.

    Args:
        recorder: Recorder of the run.
        robots: By id.
        sent_at: Send time of a message, by its bytes [s]; None: not sent by this process.
        lost: Callback for each dropped reply.
    """

    def __init__(
        self,
        recorder: Recorder,
        robots: Mapping[str, RobotAgent],
        sent_at: Callable[[bytes], float | None],
        lost: Callable[[str, bytes], object],
    ) -> None:
        self._recorder = recorder
        self._sent_at = sent_at
        self.by_id = {
            id_tag: RobotWindow(
                robot, AlwaysListening(robot), RobotFaults(robot, lost), ManualControl(robot)
            )
            for id_tag, robot in robots.items()
        }

    def about(self, id_tag: str) -> ThingBody:
        """Return what does not change of a robot, for the scene: what its pictures are drawn by."""
        spec = self.by_id[id_tag].robot.body.spec
        motors = self.by_id[id_tag].robot.body.motors
        return {
            "wheel_radius_m": round(WHEEL * spec.radius, 3),
            "corners_m": [list(corner) for corner in spec.corners],
            "steering": "three_way" if isinstance(motors, ThreeWay) else "free",
            "sensors": list(self.by_id[id_tag].robot.sensors),
        }

    def set_usual(self, id_tag: str, seconds: float) -> None:
        """Let a message usually take a robot's computer so long from now on [s]."""
        self.by_id[id_tag].faults.usually(lambda: seconds)

    def heard(self, id_tag: str, exchange: Exchange) -> None:
        """Note that a robot has heard a message, or has answered one that it had heard before."""
        window = self.by_id[id_tag]
        again = exchange.number <= self.by_id[id_tag].newest
        if exchange.reply is not None and exchange.service_s is not None:
            window.replies.add(exchange.service_s)
        if not again:
            window.newest = exchange.number
            self._arrived(window, exchange)

    def _arrived(self, window: RobotWindow, exchange: Exchange) -> None:
        try:
            message = decode(exchange.data)
        except ProtocolError:
            return
        sent = self._sent_at(exchange.data)
        if sent is not None:
            window.one_way.add(exchange.arrived - sent)
        if isinstance(message.body, m.SetTeleOp) and message.body.seen_tick is not None:
            age = window.robot.controller.tick(exchange.arrived) - message.body.seen_tick
            if age >= 0:
                window.loop.add(age / 1000)

    def look(self) -> None:
        """Look for what has ended by itself since the last look."""
        for window in self.by_id.values():
            controller = window.robot.controller
            if window.number is not None and controller.by_hand is None:
                window.number = None
                stopped = controller.latch.holds
                why = "an emergency stop" if stopped else "nothing was heard for long"
                if window.faults.frozen:
                    why = "its computer is frozen"
                window.notice = f"manual control has ended: {why}"
                window.robot.device.tell(window.notice, "mode")

    def lines(
        self, watched: Iterable[str], row_of: Callable[[str], RobotRow]
    ) -> Iterator[RobotWindowLine]:
        """Yield a line for each robot that somebody looks at.

        Args:
            watched: Those, by id.
            row_of: Function that returns the row of a robot.
        """
        for id_tag in watched:
            yield self._line(self.by_id[id_tag], row_of(id_tag))

    def _line(self, window: RobotWindow, row: RobotRow) -> RobotWindowLine:
        robot = window.robot
        now = window.robot.device.clock.now
        point = robot.set_point
        body = robot.body
        faults = window.faults
        in_force = now < point.until
        command = (point.speed, point.turn_rate) if in_force else (0.0, 0.0)
        speed, turn = body.motors.set_point(*self._limited(robot, *command))
        return {
            "k": "robot",
            "t": round(1000 * now),
            "i": row["i"],
            "station": window.station.line(),
            "mode": row["mode"],
            "hand": window.number,
            "holder": row["holder_label"],
            "stop_reason": row["stop_reason"],
            "link_lost": robot.controller.mode is Mode.TELEOPERATION and 0.0 < point.until <= now,
            "notice": window.notice,
            "speed_mps": round(speed, 3),
            "turn_rate_radps": round(turn, 4),
            "now_mps": round(body.speed, 2),
            "now_radps": round(body.turn_rate, 2),
            "watchdog_left_s": round(point.until - now, 1) if in_force else None,
            "one_way": window.one_way.line(),
            "loop": window.loop.line(),
            "replies": window.replies.line(),
            "faults": {
                "processing_s": faults.processing_s,
                "replies": faults.drops_replies,
                "freeze": faults.frozen,
                "camera": faults.camera_lost,
            },
            "sensors": window.sensors(now),
        }

    @staticmethod
    def _limited(robot: RobotAgent, speed: float, turn: float) -> tuple[float, float]:
        spec = robot.body.spec
        most = spec.max_turn_rate
        return min(speed, spec.max_speed), min(max(turn, -most), most)
