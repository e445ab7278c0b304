"""Watched frames: noted when they are taken, passed on when they have arrived.

They come over the modelled link, to the seat that holds the robot, or else to a screen of the
console. The data of a frame are those of the time when it was taken.
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
        """Its time."""

    @property
    def network(self) -> Transport:
        """Return the transport of its frames."""

    @property
    def field(self) -> Field:
        """Return the positions of all bodies."""


class Screens:
    """The cameras of a run, as far as anybody looks at them.

    Args:
        screen: Id of a device of its own.
        numbers: Numbers of all agents, by id or name.
        tell: Callback for a line for each frame that has arrived, and the robot's number.
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
        self._taken: dict[str, OrderedDict[int, tuple[int, list[Any]]]] = {}
        self._count: dict[str, int] = {}
        self._subscribed: dict[str, Subscription] = {}
        self._watched: set[str] = set()
        self._held: set[str] = set()
        self._reach = max(MIN_SEEN, PEOPLE_RANGE_FACTOR * run.scenario.camera.range_m)
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
        """Hold robots whose frames a seat receives anyway."""
        self._held = robots
        self._subscribe()

    def arrived(self, robot: str, came: CameraFrame | bytes) -> None:
        """Take a frame that has come over the link."""
        taken = self._taken.get(robot)
        frame = came if isinstance(came, CameraFrame) else CameraFrame.unpack(came)
        if robot not in self._watched or taken is None or frame is None:
            return
        tick = frame.observation.tick
        now = self._run.clock.now
        entry = taken.get(tick)
        if entry is None:
            return
        number, figures = entry
        while next(iter(taken)) != tick:
            taken.popitem(last=False)
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
        robots = self._watched - self._held
        for robot in self._subscribed.keys() - robots:
            self._subscribed.pop(robot).close()
        for robot in sorted(robots - self._subscribed.keys()):
            arrived = partial(self.arrived, robot)
            self._subscribed[robot] = self._run.network.subscribe(
                self._screen, robot, FRAME, arrived
            )
        for robot in self._taken.keys() - self._watched:
            del self._taken[robot]

    def _film(self, robot: str, frame: CameraFrame) -> None:
        """Note the frame of a robot, and who was near if anybody will see it."""
        self._count[robot] = number = self._count.get(robot, 0) + 1
        if robot not in self._watched:
            return
        taken = self._taken.setdefault(robot, OrderedDict())
        taken[frame.observation.tick] = number, self._figures(robot, frame)
        if len(taken) > MAX_UNDER_WAY:
            taken.popitem(last=False)

    def _figures(self, robot: str, frame: CameraFrame) -> list[Any]:
        """Return the figures that may be in the picture: kind, number, place, heading, activity."""
        field = self._run.field
        observation = frame.observation
        here = (observation.x, observation.y)
        figures = list[Any]()
        for id_tag, other in field.robots.items():
            pose = other.body.pose()
            if id_tag != robot and math.dist(here, (pose.x, pose.y)) < self._reach:
                mode = other.controller.mode.value
                figures.append(self._figure("robot", id_tag, pose.x, pose.y, pose.heading, mode))
        for name, agent in field.people():
            x, y = agent.walking.place
            if agent.activity != SAFE and math.dist(here, (x, y)) < self._reach:
                kind = "guard" if hasattr(agent, "device") else "bystander"
                figures.append(self._figure(kind, name, x, y, agent.heading, agent.activity))
        return figures

    def _figure(
        self, kind: str, name: str, x: float, y: float, heading: float, doing: str
    ) -> list[Any]:
        place = round(x, 3), round(y, 3), round(heading, 3)
        return [kind, self._numbers[name], *place, doing]


class OwnScreens(Screens):
    """Cameras as seen at the robots themselves: without a network between."""

    def _subscribe(self) -> None:
        """Subscribe to nothing: nobody has to be asked for the pictures."""

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
    """Return the frames of a console's cameras, whose URL is one for browsers."""
    return FRAME if url.startswith("http") else None
