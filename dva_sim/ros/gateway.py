"""Robots of a DVA for clients of ROS: received over the network, driven by permission.

Nothing here reads a robot's true state: all data has come in messages over the link of the run.
Each client that takes control is a device of its own, with a session of its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Final

from dva_sim.agents.device import AgentDevice
from dva_sim.agents.observation import FRAME, CameraFrame
from dva_sim.agents.operator.handheld import Console, OnResult
from dva_sim.agents.operator.person_at_console import PersonAgent
from dva_sim.agents.operator.steps import ask_emergency, give_back, start
from dva_sim.agents.robot.sensors import sensor_topic
from dva_sim.agents.tilt.velocity import GivenVelocity
from dva_sim.network.messaging import Subscription
from dva_sim.network.realtime import LiveClock
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import ROBOT
from dva_sim.ros.mjpeg import MjpegReader
from dva_sim.ros.published import make_namespace
from dva_sim.simulation.full.control_room import console_of
from dva_sim.simulation.full.stage import Stage

LOOK_AROUND: Final = 2.0  # design: interval of looks at the registered devices [s]
MAX_ROBOTS: Final = 64
MAX_DRIVERS: Final = 8  # maximum clients in control at a time
SILENT: Final = 0.5  # design: a robot without a command for this long is stopped [s]
TAKE_TRIES: Final = 3  # design: attempts; connecting over a long link takes a permission's time
SCAN_HZ: Final = 5.0
RENEW: Final = 30.0  # design: interval of renewals of a subscription to a sensor [s]
LIDAR: Final = "lidar"


class KnownRobot:
    """Robot as its clients know it.

    Attributes:
        id_tag: Its id.
        name: Its namespace.
        label: Its name for people.
    """

    def __init__(self, id_tag: str, name: str, label: str) -> None:
        self.id_tag = id_tag
        self.name = name
        self.label = label
        self.frames: Subscription | None = None
        self.scan: ScanReader | None = None
        self.pictures: MjpegReader | None = None
        self.is_asked = False


class ScanReader:
    """Reads the lidar of a robot, with a permission to do so, until `end`.

    Args:
        device: Device that subscribes.
        robot: Id of the robot.
        take: Callback for ranges [m].
    """

    def __init__(
        self, device: AgentDevice, robot: str, take: Callable[[tuple[float, ...]], object]
    ) -> None:
        self._device = device
        self._robot = robot
        self._take = take
        self._session = 0
        self._is_over = False
        topic = sensor_topic(LIDAR, device.id_tag)
        self._subscription = device.network.subscribe(device.id_tag, robot, topic, self._on_value)
        self._ask()

    def _ask(self) -> None:
        if not self._is_over:
            request = m.PermissionRequest(self._robot, "sensors", (LIDAR,))
            self._device.ask(self._device.dva, request, self._answered)
            self._device.clock.call_after(RENEW, self._ask)

    def _answered(self, reply: m.Reply) -> None:
        if not isinstance(reply.content, m.Permission):
            return
        self._session = reply.content.session
        if self._is_over:
            give_back(self._device, self._robot, self._session)
            return
        start(
            self._device,
            self._robot,
            m.DevSub(LIDAR, SCAN_HZ),
            lambda: self._session,
            wanted=lambda: not self._is_over,
            begun=lambda: None,
            refused=lambda _: None,
            lost=lambda: None,
        )

    def _on_value(self, data: bytes) -> None:
        message = self._device.read(data, self._robot)
        if message is not None and isinstance(message.body, m.SensorValue):
            self._take(message.body.values)

    def end(self) -> None:
        """Give the permission back."""
        self._is_over = True
        self._subscription.close()
        if self._session:
            self._device.ask(self._robot, m.DevSub(LIDAR, 0.0), session=self._session)
            give_back(self._device, self._robot, self._session)


class RosDriver:
    """A client that is in control of robots, or was.

    Args:
        device: Device of the client.
        console: Function that returns pattern, rate and limits of the next drive.
    """

    def __init__(self, device: AgentDevice, console: Callable[[], Console]) -> None:
        phone = console().phone
        self._person = PersonAgent(device, console(), lambda: GivenVelocity(phone))
        self._console = console
        self._number = 0
        self._requested: set[str] = set()
        self._newest: dict[str, int] = {}
        device.register()

    @property
    def device(self) -> AgentDevice:
        """Device of the client."""
        return self._person.device

    def take(self, robot: str, on_result: OnResult) -> None:
        """Request permission from the DVA, then start driving the robot."""
        self._requested.add(robot)
        self._take(robot, on_result, TAKE_TRIES)

    def _take(self, robot: str, on_result: OnResult, tries: int) -> None:
        def taken(done: bool, text: str) -> None:
            control = self._person.robots.get(robot)
            if not done or control is None:
                on_result(False, text)
            elif control.is_driven:
                on_result(True, text)
            else:
                control.start(begun)

        def begun(done: bool, text: str) -> None:
            if done:
                on_result(True, text)
            else:  # later: the handler that ended the start first updates who holds the robot
                self.device.clock.call_after(0.0, not_begun, text)

        def not_begun(text: str) -> None:
            control = self._person.robots.get(robot)
            if control is not None:
                control.give_back()
                on_result(False, text)
            elif tries > 1 and robot in self._requested:
                # The permission ran out while connections were made over a long link.
                self._take(robot, on_result, tries - 1)
            else:
                on_result(False, f"{text}; call take_control again")

        self._person.attended = True
        self._person.console = self._console()
        self._person.take([robot], taken)

    def release(self, robot: str, on_result: OnResult) -> None:
        """Stop a robot, and return its permission."""
        self._requested.discard(robot)
        control = self._person.robots.get(robot)
        if control is None:
            on_result(False, "it is not yours")
            return
        control.give_back()
        on_result(True, "given back")

    @property
    def is_driving(self) -> bool:
        """True if the client controls a robot."""
        return bool(self._person.robots)

    def release_all(self) -> None:
        """Stop all robots and return their permissions, since the client is gone."""
        self._requested.clear()
        self._person.release(lambda *_: None)

    def drive(self, robot: str, speed: float, turn_rate: float) -> str:
        """Command a speed [m/s] and turn rate [rad/s]; return the reason of a refusal, or "".

        What is beyond the robot's reach counts as the reach.
        """
        control = self._person.robots.get(robot)
        if control is None or not control.is_driven:
            why = self._person.alert
            return f"it is not yours{f' ({why})' if why else ''}: call take_control first"
        reach = self._person.console.reach(robot)
        self._number += 1
        turn = turn_rate / reach.turn_rate
        speed_share = min(max(0.0, speed) / reach.speed, 1.0)
        control.want(self._number, speed_share, min(max(turn, -1.0), 1.0))
        self._newest[robot] = self._number
        self.device.clock.call_after(SILENT, self._fell_silent, robot, self._number)
        return ""

    def _fell_silent(self, robot: str, number: int) -> None:
        """Stop a robot if no command has followed the one of this number."""
        control = self._person.robots.get(robot)
        if self._newest.get(robot) == number and control is not None and control.is_driven:
            self._number += 1
            control.want(self._number, 0.0, 0.0)


class RosGateway:
    """The devices through which clients of ROS receive data from robots and drive them.

    Args:
        stage: Stage on which the devices are made.
        console: Function that returns pattern, rate and limits of the next drive; None: those of
            the scenario.

    Attributes:
        robots: Robots on the DVA's device list, by namespace.
        on_frame: Callback for the robot and a camera frame of it.
        on_scan: Callback for the robot, and ranges [m].
        on_picture: Callback for the robot, a JPEG, and its capture time [s].
        camera_base: URL of this console's own picture server; empty: none.
        camera_token: Token for that server, sent to no other; empty: none.
    """

    def __init__(self, stage: Stage, console: Callable[[], Console] | None = None) -> None:
        self._stage = stage
        self.clock = stage.clock
        self._console = console or (lambda: console_of(stage, stage.scenario))
        self.device = stage.device("ros", 1)
        self.device.call("rosbridge")
        self.device.serve(lambda message: m.Reply(message.message_id, m.NOT_SUPPORTED, ""))
        self.robots: dict[str, KnownRobot] = {}
        self._free: list[RosDriver] = []
        self._drivers: list[RosDriver] = []
        self.on_frame: Callable[[KnownRobot, CameraFrame], object] = lambda *_: None
        self.on_scan: Callable[[KnownRobot, tuple[float, ...]], object] = lambda *_: None
        self.on_picture: Callable[[KnownRobot, bytes, float], object] = lambda *_: None
        self.camera_base = ""
        self.camera_token = ""
        self._free.append(self._new_driver())
        self.device.register(self._look_around)

    # --- the device list -----------------------------------------------------------------

    def _look_around(self) -> None:
        self.device.ask(self.device.dva, m.GetDeviceList(), self._listed)
        self.clock.call_after(LOOK_AROUND, self._look_around)

    def _listed(self, reply: m.Reply) -> None:
        if not isinstance(reply.content, m.DeviceList):
            return
        id_tags = {robot.id_tag for robot in self.robots.values()}
        for device in reply.content.devices:
            if device.device_type != ROBOT or len(self.robots) >= MAX_ROBOTS:
                continue
            if device.id_tag in id_tags:
                self.device.introduce(device.id_tag, device.address)
            else:
                name = make_namespace(device.label)
                while name in self.robots:
                    name += "_"
                self.robots[name] = KnownRobot(device.id_tag, name, device.label)
                # Neither an emergency nor a drive waits for a connection over a long link.
                for each in (self.device, *(driver.device for driver in self._drivers)):
                    each.introduce(device.id_tag, device.address)
                    each.connect(device.id_tag)

    # --- subscriptions -------------------------------------------------------------------

    def listen(self, name: str, *, frames: bool, scan: bool, pictures: bool) -> None:
        """Subscribe to the data of a robot that clients want, and end all other subscriptions."""
        robot = self.robots[name]
        self._look(robot, pictures)
        if frames and robot.frames is None:
            hear = partial(self._on_frame, robot)
            robot.frames = self.device.network.subscribe(
                self.device.id_tag, robot.id_tag, FRAME, hear
            )
        elif not frames and robot.frames is not None:
            robot.frames.close()
            robot.frames = None
        if scan and robot.scan is None:
            robot.scan = ScanReader(self.device, robot.id_tag, partial(self._on_scan, robot))
        elif not scan and robot.scan is not None:
            robot.scan.end()
            robot.scan = None

    def _look(self, robot: KnownRobot, pictures: bool) -> None:
        """Open or close the picture stream of a robot, which is asked for its address."""
        if not pictures and robot.pictures is not None:
            robot.pictures.close()
            robot.pictures = None
        if not pictures or robot.pictures is not None or robot.is_asked:
            return
        robot.is_asked = True

        def answered(reply: m.Reply) -> None:
            robot.is_asked = False
            if isinstance(reply.content, m.SensorInfo) and robot.pictures is None:
                take = partial(self._on_jpeg, robot)
                url = reply.content.camera_url
                assert isinstance(self.clock, LiveClock)
                is_own = bool(self.camera_base) and url.startswith(self.camera_base)
                token = self.camera_token if is_own else ""
                robot.pictures = MjpegReader(self.clock, url, token, take, is_trusted=is_own)

        def unanswered() -> None:
            robot.is_asked = False

        self.device.ask(robot.id_tag, m.GetSensorInfo(), answered, unanswered)

    def _on_jpeg(self, robot: KnownRobot, jpeg: bytes, captured: float | None) -> None:
        self.on_picture(robot, jpeg, self.clock.now if captured is None else captured)

    def _on_frame(self, robot: KnownRobot, data: CameraFrame | bytes) -> None:
        frame = data if isinstance(data, CameraFrame) else CameraFrame.unpack(data)
        if frame is not None and math.isfinite(frame.captured):
            self.on_frame(robot, frame)

    def _on_scan(self, robot: KnownRobot, ranges: tuple[float, ...]) -> None:
        self.on_scan(robot, ranges)

    # --- drivers -------------------------------------------------------------------------

    def driver(self) -> RosDriver | None:
        """Return a driver for a client; None if too many are in control."""
        if self._free:
            return self._free.pop()
        return self._new_driver() if len(self._drivers) < MAX_DRIVERS else None

    def _new_driver(self) -> RosDriver:
        number = 2 + len(self._drivers)
        driver = RosDriver(self._stage.device("ros", number), self._console)
        self._drivers.append(driver)
        return driver

    @property
    def is_driving(self) -> bool:
        """True if any client controls a robot."""
        return any(driver.is_driving for driver in self._drivers)

    def retire(self, driver: RosDriver) -> None:
        """Stop the robots of a client that has left; the next client gets its device."""
        driver.release_all()
        self._free.append(driver)

    def emergency(self, name: str, on_result: OnResult) -> None:
        """Stop a robot, regardless of its driver."""
        ask_emergency(self.device, self.robots[name].id_tag, 0, on_result)
