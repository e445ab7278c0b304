"""The program that connects a ROS robot to a DVA, and stops the robot at its end."""

from __future__ import annotations

import queue
import re
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Final

from dva_sim.agents.observation import Cameras
from dva_sim.cameras.screens import topic_of
from dva_sim.cameras.service import PictureService
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.recorder import Recorder
from dva_sim.live.process import ending_when_asked
from dva_sim.network.addresses import check_address
from dva_sim.network.keys import KeyRing
from dva_sim.network.realtime import LiveClock
from dva_sim.network.sockets import SocketNetwork
from dva_sim.options.runs import RobotOptions
from dva_sim.ros.profile import DEFAULT, RosProfile, load_ros_profile
from dva_sim.ros.robot import RosRobot
from dva_sim.ros.websocket import WebSocketUrl
from dva_sim.simulation.full.stage import DVA, Stage, id_of
from dva_sim.simulation.scenario import Scenario
from dva_sim.simulation.scenario.lone_robot import lone_robot

MAX_WAITING: Final = 1000  # maximum waiting lines; further ones are dropped
OTHER_NUMBER: Final = "--number gives the robot another id"
LAST_LINES: Final = 0.5  # time for printing waiting lines at the end [s]


class LineWriter:
    """Prints lines in a thread of its own, in their order.

    Args:
        say: Callback for each line, which may block, as a paused terminal does, and fail.
    """

    def __init__(self, say: Callable[[str], object]) -> None:
        self._lines: queue.Queue[str | None] = queue.Queue(MAX_WAITING)
        self._thread = threading.Thread(target=self._say, args=(say,), daemon=True)
        self._thread.start()

    def __call__(self, line: str) -> None:
        """Queue a line, or drop it if too many wait."""
        with suppress(queue.Full):
            self._lines.put_nowait(line)

    def _say(self, say: Callable[[str], object]) -> None:
        with suppress(OSError):  # the reader has gone
            while (line := self._lines.get()) is not None:
                say(line)

    def close(self) -> None:
        """Wait a moment for lines that are still queued."""
        with suppress(queue.Full):
            self._lines.put_nowait(None)
            self._thread.join(LAST_LINES)


LAST_WORDS: Final = 0.3  # time for the last stop command to arrive [s]
TELL_PERIOD: Final = 0.1  # interval of printing news [s]
_NAMESPACE = re.compile(r"/?[A-Za-z][A-Za-z0-9_]*(/[A-Za-z][A-Za-z0-9_]*)*/?")
EVERYWHERE: Final = "0.0.0.0", "::"

Say = Callable[[str], object]


def run_ros_robot(options: RobotOptions, say: Say) -> None:
    """Run the device until Ctrl-C or SIGTERM, then stop the robot.

    Raises:
        ConfigError: profile, address, site or keys are invalid.
        NetworkError: no port is available.
    """
    profile = load_ros_profile(options.profile or DEFAULT)
    url = WebSocketUrl(str(options.ros), "--ros")
    if not options.dva:
        raise ConfigError("--ros needs --dva HOST:PORT: the DVA that the robot registers with")
    check_address(options.dva, "--dva ")
    if options.host in EVERYWHERE:
        raise ConfigError(
            f"--host {options.host}: give the address by which others find this machine"
        )
    if not _NAMESPACE.fullmatch(options.namespace):
        raise ConfigError(f"--namespace {options.namespace!r} should be a name, as in robot_1")
    scenario = scenario_of(options, profile)
    ring = None if options.keys is None else KeyRing(options.keys)
    clock = LiveClock()
    recorder = Recorder()
    writer = LineWriter(say)

    def tell(line: str) -> None:
        recorder.tell(clock.now, "network", line, "link")

    network = SocketNetwork(clock, ring, tell, scenario.zeromq, None)
    pictures: PictureService | None = None
    try:
        if profile.topics.picture is not None:
            pictures = PictureService(options.host, 0, clock, tell)
        stage = make_stage(options, scenario, network, recorder, pictures)
        robot = RosRobot(stage, options.number, profile, url, options.namespace)
        if pictures is not None:
            pictures.serve(robot.agent.device.label)
            robot.on_picture = pictures.show
        network.introduce(DVA, options.dva)
        robot.agent.device.look_for_dva_at(options.dva)
        robot.agent.device.other_id = OTHER_NUMBER
        writer(f"Robot: {robot.agent.device.address}")
        clock.every(TELL_PERIOD, lambda: _say_news(recorder, writer))
        robot.begin()
        with ending_when_asked(clock, supervised=False) as ending:
            try:
                if not ending.is_asked:
                    clock.run()
            finally:  # the robot must stand however this program ends
                robot.close()
                clock.run(clock.now + LAST_WORDS)
        _say_news(recorder, writer)
    finally:
        writer.close()
        if pictures is not None:
            pictures.close()
        network.close()


def scenario_of(options: RobotOptions, profile: RosProfile) -> Scenario:
    """Return a scenario with the robot's site, pattern and limits.

    Raises:
        ConfigError: there is no such site, or a change is invalid.
    """
    site = profile.site.model_dump(exclude_defaults=True)
    return lone_robot({"site": site, "robot": {"count": options.number}}, options.set)


def make_stage(
    options: RobotOptions,
    scenario: Scenario,
    network: SocketNetwork,
    recorder: Recorder,
    pictures: PictureService | None,
) -> Stage:
    """Return the stage of the robot's device, with the pictures of `pictures`."""

    def join(kind: str, number: int) -> str:
        return network.join(id_of(kind, number), options.host, options.listen)

    started = time.time() - network.clock.now
    local = time.localtime(started)
    since_midnight = local.tm_hour * 3600 + local.tm_min * 60 + local.tm_sec + started % 1.0
    url = (lambda *_: "") if pictures is None else pictures.url
    cameras = Cameras(url, topic_of)
    return Stage(
        scenario,
        seed=options.seed,
        network=network,
        recorder=recorder,
        address=join,
        time_of_day=(since_midnight, True),
        cameras=cameras,
        attended=True,
    )


def _say_news(recorder: Recorder, say: Say) -> None:
    news = recorder.timeline
    recorder.timeline = []
    for moment in news:
        say(f"{moment.time:8.1f} s  {moment.who}  {moment.what}")
