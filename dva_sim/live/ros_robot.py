"""One robot of ROS as a program: from the command line to its last word to the robot."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from dva_sim.agents.observation import Cameras
from dva_sim.cameras.screens import topic_of
from dva_sim.cameras.service import PictureService
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.recorder import Recorder
from dva_sim.live.line_writer import LineWriter
from dva_sim.live.process import ending_when_asked
from dva_sim.network.addresses import check_address
from dva_sim.network.keys import KeyRing
from dva_sim.network.realtime import LiveClock
from dva_sim.network.sockets import SocketNetwork
from dva_sim.ros.profile import DEFAULT, RosProfile, load_ros_profile
from dva_sim.ros.robot import RosRobot
from dva_sim.ros.websocket import WebSocketUrl
from dva_sim.simulation.full.stage import DVA, Stage, id_of
from dva_sim.simulation.scenario import Scenario
from dva_sim.simulation.scenario.lone_robot import lone_robot

LAST_WORDS: Final = 0.3  # for the last command to stand [s]
TELL_PERIOD: Final = 0.1  # between two looks at what there is to be told [s]
NAMESPACE: Final = "robot_1"
_NAMESPACE = re.compile(r"/?[A-Za-z][A-Za-z0-9_]*(/[A-Za-z][A-Za-z0-9_]*)*/?")
EVERYWHERE: Final = "0.0.0.0", "::"

Say = Callable[[str], object]


@dataclass(frozen=True, kw_only=True)
class RosRobotOptions:
    """Options of a ROS robot: its name, its bridge, and its DVA.

    Attributes:
        ros: Address of the rosbridge server, `ws://HOST:PORT`.
        namespace: Namespace of the robot's topics.
        profile: Name or path.
        number: Number of the robot at the DVA, from 1.
        dva: Address of the DVA, `HOST:PORT`.
        host: Address of this machine to listen on.
        listen: Port of its requests; its publications have the next one. 0: any two that are free.
        keys: Folder with the keys of the devices; None to run without.
        seed: Random seed.
        changes: Changes of the scenario, `KEY=VALUE`, such as the messaging pattern.
    """

    ros: str
    namespace: str = NAMESPACE
    profile: str = DEFAULT
    number: int = 1
    dva: str = ""
    host: str = "127.0.0.1"
    listen: int = 0
    keys: Path | None = None
    seed: int = 1
    changes: tuple[str, ...] = ()

    def scenario(self, profile: RosProfile) -> Scenario:
        """Return what the robot is to the DVA's devices: site, pattern and limits.

        Raises:
            ConfigError: there is no such site, or a change makes no sense.
        """
        site = profile.site.model_dump(exclude_defaults=True)
        return lone_robot({"site": site, "robot": {"count": self.number}}, self.changes)


def run_ros_robot(options: RosRobotOptions, say: Say) -> None:
    """Run the device until Ctrl-C or SIGTERM, then stop the robot.

    Raises:
        ConfigError: profile, address, site or keys are not as they should be.
        NetworkError: no port can be had.
    """
    profile, url = load_ros_profile(options.profile), WebSocketUrl(options.ros, "--ros")
    if not options.dva:
        raise ConfigError("--ros needs --dva HOST:PORT: the DVA that the robot registers with")
    check_address(options.dva, "--dva ")
    if options.host in EVERYWHERE:
        raise ConfigError(
            f"--host {options.host}: give the address by which others find this machine"
        )
    if not _NAMESPACE.fullmatch(options.namespace):
        raise ConfigError(f"--namespace {options.namespace!r} should be a name, as in robot_1")
    scenario = options.scenario(profile)
    ring = None if options.keys is None else KeyRing(options.keys)
    clock, recorder, writer = LiveClock(), Recorder(), LineWriter(say)

    def tell(line: str) -> None:
        recorder.tell(clock.now, "network", line, "link")

    network = SocketNetwork(clock, ring, tell, scenario.zeromq, None)
    pictures: PictureService | None = None
    try:
        if profile.topics.picture is not None:
            pictures = PictureService(options.host, 0, clock, tell)
        stage = stage_of(options, scenario, network, recorder, pictures)
        robot = RosRobot(stage, options.number, profile, url, options.namespace)
        if pictures is not None:
            pictures.serve(robot.agent.device.label)
            robot.on_picture = pictures.show
        network.introduce(DVA, options.dva)
        writer(f"Robot: {robot.agent.device.address}")
        clock.every(TELL_PERIOD, lambda: _say_news(recorder, writer))
        robot.begin()
        with ending_when_asked(clock, supervised=False) as ending:
            try:
                if not ending.is_asked:
                    clock.run()
            finally:  # whatever ends this program, the robot stands
                robot.close()
                clock.run(clock.now + LAST_WORDS)
        _say_news(recorder, writer)
    finally:
        writer.close()
        if pictures is not None:
            pictures.close()
        network.close()


def stage_of(
    options: RosRobotOptions,
    scenario: Scenario,
    network: SocketNetwork,
    recorder: Recorder,
    pictures: PictureService | None,
) -> Stage:
    """Return where the robot's device is made; its pictures are where `pictures` serves them."""

    def join(kind: str, number: int) -> str:
        return network.join(id_of(kind, number), options.host, options.listen)

    started = time.time() - network.clock.now
    local = time.localtime(started)
    since_midnight = local.tm_hour * 3600 + local.tm_min * 60 + local.tm_sec + started % 1.0
    url = (lambda *_: "") if pictures is None else pictures.url
    cameras = Cameras(url, topic_of)
    return Stage(
        *(scenario, options.seed, network, recorder, join, (since_midnight, True)),
        cameras=cameras,
        attended=True,
    )


def _say_news(recorder: Recorder, say: Say) -> None:
    news, recorder.timeline = recorder.timeline, []
    for moment in news:
        say(f"{moment.time:8.1f} s  {moment.who}  {moment.what}")
