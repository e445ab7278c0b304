"""Frames of watched robots, noted when they are taken and passed on when they have arrived.

They arrive over the modelled link, at the seat that holds the robot or at a screen of the console.
The figures of a frame are those at its capture time.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Callable
from functools import partial
from typing import Any, Protocol

from dva_sim.agents.observation import FRAME, CameraFrame
from dva_sim.agents.people.bystander import SAFE
from dva_sim.cameras.lines import FrameLine
from dva_sim.kernel.clock import Clock
from dva_sim.network.messaging import Subscription, Transport
from dva_sim.simulation.full.physical_world import Field
from dva_sim.simulation.scenario import Scenario

MAX_UNDER_WAY = 400  # maximum frames of a robot under way
PEOPLE_RANGE_FACTOR = 2.0  # range in which people are drawn, relative to the camera's range
MIN_SEEN = 25.0  # distance within which people are drawn in any case [m]


class FilmedRun(Protocol):
    """A run whose robots have cameras."""

    @property
    def scenario(self) -> Scenario:
        """Return the scenario of the run."""

    @property
    def clock(self) -> Clock:
        """Return the clock of the run."""

    @property
    def network(self) -> Transport:
        """Return the transport of its frames."""

    @property
    def field(self) -> Field:
        """Return the positions of all bodies."""


class Screens:
    """The watched cameras of a run.

    Args:
        screen: Id of the device that receives frames.
        numbers: Numbers of all agents, by id or name.
        tell: Callback for the line of each frame that has arrived, and the robot's number.
    """

    def __init__(
        self,
        run: FilmedRun,
        screen: str,
        numbers: dict[str, int],
        tell: Callable[[FrameLine, int], object],
    ) -> None:
        self._run = run
        self._screen = screen
        self._numbers = numbers
        self._tell = tell
        self._under_way: dict[str, OrderedDict[int, tuple[int, list[Any]]]] = {}
        self._count: dict[str, int] = {}
        self._subscribed: dict[str, Subscription] = {}
        self._watched: set[str] = set()
        self._held_robots: set[str] = set()
        self._range = max(MIN_SEEN, PEOPLE_RANGE_FACTOR * run.scenario.camera.range_m)
        for robot in run.field.robots.values():
            robot.filmed = self._film

    def watch(self, robots: set[str]) -> None:
        """Set the robots that are being watched, by id."""
        self._watched = robots & self._run.field.robots.keys()
        self._subscribe()

    @property
    def watched(self) -> list[str]:
        """Robots that are being watched, by id."""
        return sorted(self._watched)

    def hold(self, robots: set[str]) -> None:
        """Set the robots whose frames a seat receives anyway, by id."""
        self._held_robots = robots
        self._subscribe()

    def arrived(self, robot: str, data: CameraFrame | bytes) -> None:
        """Handle a frame that has arrived over the link."""
        under_way = self._under_way.get(robot)
        frame = data if isinstance(data, CameraFrame) else CameraFrame.unpack(data)
        if robot not in self._watched or under_way is None or frame is None:
            return
        tick = frame.observation.tick
        now = self._run.clock.now
        entry = under_way.get(tick)
        if entry is None:
            return
        number, figures = entry
        while next(iter(under_way)) != tick:  # drop older frames
            under_way.popitem(last=False)
        observation = frame.observation
        line: FrameLine = {
            "k": "frame",
            "t": round(1000 * now),
            "robot": self._numbers[robot],
            "number": number,
            "captured_ms": round(1000 * frame.captured),
            "pose": [
                round(observation.x, 3),
                round(observation.y, 3),
                round(observation.heading, 4),
            ],
            "figures": figures,
        }
        self._tell(line, self._numbers[robot])

    def _subscribe(self) -> None:
        robots = self._watched - self._held_robots
        for robot in self._subscribed.keys() - robots:
            self._subscribed.pop(robot).close()
        for robot in sorted(robots - self._subscribed.keys()):
            arrived = partial(self.arrived, robot)
            self._subscribed[robot] = self._run.network.subscribe(
                self._screen, robot, FRAME, arrived
            )
        for robot in self._under_way.keys() - self._watched:
            del self._under_way[robot]

    def _film(self, robot: str, frame: CameraFrame) -> None:
        """Count a frame; note the figures nearby if its robot is watched."""
        self._count[robot] = number = self._count.get(robot, 0) + 1
        if robot not in self._watched:
            return
        under_way = self._under_way.setdefault(robot, OrderedDict())
        under_way[frame.observation.tick] = number, self._figures(robot, frame)
        if len(under_way) > MAX_UNDER_WAY:
            under_way.popitem(last=False)

    def _figures(self, robot: str, frame: CameraFrame) -> list[Any]:
        """Return the figures that may be visible: kind, number, position, heading, activity."""
        field = self._run.field
        observation = frame.observation
        position = (observation.x, observation.y)
        figures = list[Any]()
        for id_tag, other in field.robots.items():
            pose = other.body.pose()
            if id_tag != robot and math.dist(position, (pose.x, pose.y)) < self._range:
                mode = other.controller.mode.value
                figures.append(self._figure("robot", id_tag, pose.x, pose.y, pose.heading, mode))
        for name, agent in field.people():
            x, y = agent.walking.place
            if agent.activity != SAFE and math.dist(position, (x, y)) < self._range:
                kind = "guard" if hasattr(agent, "device") else "bystander"
                figures.append(self._figure(kind, name, x, y, agent.heading, agent.activity))
        return figures

    def _figure(
        self, kind: str, name: str, x: float, y: float, heading: float, doing: str
    ) -> list[Any]:
        place = round(x, 3), round(y, 3), round(heading, 3)
        return [kind, self._numbers[name], *place, doing]


class OwnScreens(Screens):
    """Cameras observed at the robots themselves, without a network."""

    def _subscribe(self) -> None:
        """Subscribe to nothing: `look` takes the pictures directly."""

    def look(self) -> None:
        """Take a picture with each camera that is watched and works."""
        now = self._run.clock.now
        for id_tag in self._watched:
            robot = self._run.field.robots[id_tag]
            if not robot.blind and not robot.device.silent:
                frame = CameraFrame(robot.observe(), now)
                self._film(id_tag, frame)
                self.arrived(id_tag, frame)


def camera_url(base: str, label: str) -> str:
    """Return the address of a robot's pictures for a browser."""
    return f"{base}camera/{label}.mjpg"


def topic_of(url: str) -> str | None:
    """Return the frames' topic for a URL that is for browsers, as a console's are; else None."""
    return FRAME if url.startswith("http") else None
