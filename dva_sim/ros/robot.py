"""A ROS robot as a device of the DVA: the usual robot controller behind a rosbridge server."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any, Final

from dva_sim.agents.robot.controller import Limits, RobotController
from dva_sim.agents.robot.emergency_latch import EmergencyLatch
from dva_sim.agents.robot.field_of_view import FieldOfView
from dva_sim.agents.robot.robot import RobotAgent, RobotSetup
from dva_sim.agents.robot.sensors import SensorPort
from dva_sim.network.realtime import LiveClock
from dva_sim.ros.body import RosBody
from dva_sim.ros.client import RosbridgeClient, Subscribed
from dva_sim.ros.fitness import NO_ODOMETRY, Fitness
from dva_sim.ros.profile import RosProfile
from dva_sim.ros.readings import BadReading, RosMotion, RosReader
from dva_sim.ros.websocket import WebSocketUrl
from dva_sim.simulation.full.stage import DVA, Stage
from dva_sim.worlds.drives import Differential, DriveSpec
from dva_sim.worlds.physics import World

LOOK: Final = 0.05  # design: interval of checks whether it can be driven [s]
ODOMETRY_MS: Final = 20  # design: shortest interval between two readings of odometry [ms]
PICTURES_MS: Final = 50  # design: shortest interval between two pictures [ms]
SMALL: Final = 100_000  # design: maximum size of a message other than a picture or a scan [B]
SCANS: Final = 1_000_000  # design: maximum size of a scan [B]
TELL_AGAIN: Final = 10.0  # design: shortest interval between two reports of one refused topic [s]
ENABLE_AGAIN: Final = 2.0  # design: pause before calling a refused enable service again [s]
SENSOR_HZ: Final = 10.0
RANGE_M: Final = 12.0  # assumed: range of the camera; no objects are recognised in its pictures


class RosRobot:
    """One robot.

    Args:
        stage: Stage on which its device is made; positions are in the frame of its site.
        number: Number of the robot.
        profile: Profile of the connection.
        url: Address of the rosbridge server.
        namespace: Namespace of its topics.

    Attributes:
        agent: Agent that obeys the DVA and the driver.
        bridge: Client of its rosbridge server.
        on_picture: Callback for each picture, as JPEG.
    """

    def __init__(
        self, stage: Stage, number: int, profile: RosProfile, url: WebSocketUrl, namespace: str
    ) -> None:
        clock = stage.clock
        assert isinstance(clock, LiveClock)
        self._stage = stage
        self._profile = profile
        self._clock = clock
        self._reader = RosReader(profile)
        self.fitness = Fitness(profile.limits)
        self._namespace = namespace
        self._command = profile.topic(namespace, profile.topics.command)
        self._motion: RosMotion | None = None
        self._charge = 1.0
        self._ranges = tuple[float, ...]()
        self._pictured = -math.inf
        self._reported_at: dict[str, float] = {}
        self._is_registered = False
        self.on_picture: Callable[[bytes], object] = lambda _: None
        self.bridge = RosbridgeClient(
            clock,
            url,
            self._topics(),
            {self._command: profile.type_name("geometry_msgs", profile.command)},
            on_change=self._bridge_changed,
            on_bad=self._refused,
        )
        self.agent = self._make_agent(number)
        self.agent.unfit = NO_ODOMETRY
        self.agent.takes_missions = False
        clock.every(LOOK, self._look)

    def _make_agent(self, number: int) -> RobotAgent:
        stage = self._stage
        profile = self._profile
        limits = self._profile.limits
        device = stage.device("robot", number)
        world = World(stage.site)
        spec = DriveSpec(
            mass=1.0,
            radius=profile.radius_m,
            max_speed=limits.max_speed_mps,
            max_turn_rate=limits.max_turn_rate_rad_s,
            max_acceleration=limits.max_deceleration_mps2,
            max_deceleration=limits.max_deceleration_mps2,
            max_turn_acceleration=math.pi,
            motor_time_constant=0.1,
            drive=Differential,
        )
        self.body = RosBody(
            world, device.label, spec, self._clock, 1.0 / profile.command_hz, self._send
        )
        offset = float(stage.streams[f"{device.label}/clock"].uniform(10.0, 100_000.0))
        controller = RobotController(
            device.id_tag,
            DVA,
            Limits(limits.watchdog_s, limits.max_age_s),
            camera_url=stage.cameras.url(device.label, device.address),
            clock_offset=offset,
            latch=EmergencyLatch(stage.release),
        )
        return RobotAgent(
            device,
            controller,
            world=world,
            body=self.body,
            planner=stage.planner,
            setup=self._setup(),
            drive_of=stage.recorder.newest_drive.get,
        )

    def _setup(self) -> RobotSetup:
        stage = self._stage
        profile = self._profile
        sensors = {}
        if profile.topics.battery is not None:
            sensors["battery"] = SensorPort("1", lambda _: (self._charge,), SENSOR_HZ)
        if profile.topics.scan is not None:
            sensors["lidar"] = SensorPort("m", lambda _: self._ranges, SENSOR_HZ)
        angle = math.radians(profile.camera_deg)
        return RobotSetup(
            pattern=stage.pattern(),
            service=lambda: 0.0,  # processing takes real time here, so none is simulated
            frame_rate=profile.frame_hz,
            frame_bytes=stage.scenario.camera.frame_bytes,
            view=FieldOfView(angle, RANGE_M, stage.planner.line_of_sight, hazy=lambda: False),
            hazards=lambda _: [],
            sensors=sensors,
            charge=lambda: self._charge,
        )

    def _topics(self) -> dict[str, Subscribed]:
        profile = self._profile
        topics = self._profile.topics
        name = partial(profile.topic, self._namespace)
        type_name = profile.type_name
        sensor_type = partial(type_name, "sensor_msgs")
        picture = 4 * profile.largest_picture_bytes // 3 + 1000  # base64 adds a third
        subscriptions = {
            topics.battery: Subscribed(sensor_type("BatteryState"), self._on_battery, SMALL),
            topics.picture: Subscribed(
                sensor_type("CompressedImage"), self._on_picture, picture, PICTURES_MS
            ),
            topics.scan: Subscribed(
                sensor_type("LaserScan"), self._on_scan, SCANS, int(1000 / SENSOR_HZ)
            ),
        }
        if topics.odometry is not None:
            odometry_type = type_name("nav_msgs", "Odometry")
            subscriptions[topics.odometry] = Subscribed(
                odometry_type, self._on_odometry, SMALL, ODOMETRY_MS
            )
        else:
            subscriptions[topics.tf] = Subscribed(
                type_name("tf2_msgs", "TFMessage"), self._on_tf, SMALL
            )
        return {name(topic): each for topic, each in subscriptions.items() if topic is not None}

    def begin(self) -> None:
        """Connect to the bridge; the robot registers once its odometry is valid and fresh."""
        self.bridge.connect()

    def close(self) -> None:
        """Tell the robot to stand, and end the connection."""
        self.body.stand()
        self.bridge.close()

    # --- messages from the robot ---------------------------------------------------------

    def _on_odometry(self, message: Any) -> None:
        self._move(self._reader.odometry, message)

    def _on_tf(self, message: Any) -> None:
        self._move(lambda transforms: self._reader.transform(transforms, self._motion), message)

    def _move(self, read: Callable[[Any], RosMotion | None], message: Any) -> None:
        try:
            motion = read(message)
        except BadReading as error:
            self.fitness.refused(str(error))
            self._refused("odometry", str(error))
            return
        if motion is not None:
            self._motion = motion
            self.body.place(motion)
            self.fitness.moved(self._clock.now, motion.stamp)
            self._look()

    def _on_battery(self, message: Any) -> None:
        try:
            self._charge = self._reader.charge(message)
        except BadReading as error:
            self._refused("battery", str(error))

    def _on_scan(self, message: Any) -> None:
        try:
            self._ranges = self._reader.scan(message)
        except BadReading as error:
            self._refused("scan", str(error))

    def _on_picture(self, message: Any) -> None:
        try:
            picture = self._reader.picture(message)
        except BadReading as error:
            self._refused("picture", str(error))
            return
        self._pictured = self._clock.now
        self.on_picture(picture)

    def _refused(self, topic: str, why: str) -> None:
        """Count a refused message; report the same refusal only every `TELL_AGAIN`."""
        device = self.agent.device
        now = self._clock.now
        device.recorder.counters[f"refused from the robot: {topic or 'a message'}"] += 1
        if now - self._reported_at.get(topic, -math.inf) > TELL_AGAIN:
            self._reported_at[topic] = now
            device.tell(f"{topic or 'a message'} refused: {why}", "link")

    # --- messages to the robot ---------------------------------------------------------

    def _send(self, speed: float, turn_rate: float) -> bool:
        units = self._profile.units
        twist = {
            "linear": {"x": speed / units.metres, "y": 0.0, "z": 0.0},
            "angular": {"x": 0.0, "y": 0.0, "z": turn_rate / units.radians},
        }
        if self._profile.command == "Twist":
            return self.bridge.publish(self._command, twist)
        # Zero means "no time": the robot's clock is unknown here.
        names = ("secs", "nsecs") if self._profile.ros == 1 else ("sec", "nanosec")
        stamp = dict.fromkeys(names, 0)
        header = {"stamp": stamp, "frame_id": self._profile.frames.base}
        return self.bridge.publish(self._command, {"header": header, "twist": twist})

    # --- readiness for driving -----------------------------------------------------------

    def _bridge_changed(self, why: str) -> None:
        if why:
            self.fitness.lost(why)
        else:
            self.fitness.connected()
            self.agent.device.tell("is connected to its bridge", "link")
            self.body.stand()  # cancels commands from before the bridge was lost
            self._enable()
        self._look()

    def _enable(self) -> None:
        """Call the service that lets the robot be driven, until it succeeds."""
        if self._profile.enable is None or not self.bridge.is_connected:
            return
        service = self._profile.topic(self._namespace, self._profile.enable)

        def answered(done: bool, text: str) -> None:
            self.fitness.disabled("" if done else f"{service} says {text!r}")
            self._look()
            if not done:
                self._clock.call_after(ENABLE_AGAIN, self._enable)

        self.fitness.disabled(f"{service} has not answered")
        self.bridge.call(service, answered)

    def _look(self) -> None:
        now = self._clock.now
        agent = self.agent
        body = self.body
        self.fitness.obeys(now, body.stopped_at, body.has_stood)
        problem = self.fitness.problem(now)
        late = self._profile.topics.picture is not None and now - self._pictured
        agent.blind = bool(problem) or late > self._profile.limits.picture_within_s
        if problem and problem != agent.unfit:
            self._withdraw(problem)
        elif not problem and agent.unfit:
            self._return_to_service()
        if self.fitness.needs_another_bridge(now):
            self.bridge.renew("odometry stays late")

    def _withdraw(self, problem: str) -> None:
        if self.agent.device.withdrawn or not self._is_registered:
            if problem != self.agent.unfit:
                self.agent.device.tell(f"cannot be driven: {problem}", "mode")
            self.agent.unfit = problem
            return
        self.agent.withdraw(problem)

    def _return_to_service(self) -> None:
        self.agent.return_to_service()
        if not self._is_registered:
            self._is_registered = True
            self.agent.device.register(self.agent.start)
            self._check_place()

    def _check_place(self) -> None:
        """Report a robot outside of the site: the profile's origin may be wrong."""
        west, south, east, north = self._stage.site.extent
        x = self.body.x
        y = self.body.y
        if not (west <= x <= east and south <= y <= north):
            site = self._stage.site.name
            self.agent.device.tell(
                f"stands at {x:.1f}, {y:.1f} m, beside site {site!r}: see origin in the profile",
                "link",
            )
