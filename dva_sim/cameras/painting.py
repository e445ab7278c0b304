"""Draws the camera pictures that are watched, in a process or a thread of its own.

The run sends the frames that arrived, the picture server the robots that are watched; the newest
frame of each watched robot is drawn in turn. No process waits for another: frames and pictures for
which there is no time are dropped and counted.
"""

from __future__ import annotations

import base64
import select
import time
from typing import Any

from dva_sim.cameras.drawing import Eyes
from dva_sim.cameras.frames import ALIVE, Picture, pack
from dva_sim.serving.pipes import PipeEnd

NICENESS = 3  # lower priority: the run goes first
ALIVE_S = 1.0  # heartbeat period [s]
IDLE_S = 0.25  # polling period [s]
RATE_ROOM = 1.25  # maximum rate of pictures relative to the frames of a run in real time
MIN_RATE = 12.0  # rate of pictures of a robot that is always allowed [1/s]

Line = dict[str, Any]


class Painter:
    """Draws the newest frame of each watched camera.

    Attributes:
        drawn: Pictures that were drawn.
        dropped: Number of frames replaced by newer ones before they were drawn, and of pictures
            that the server did not take.
    """

    def __init__(self) -> None:
        self._eyes: Eyes | None = None
        self._only_passes = False
        self._frames: dict[int, Line] = {}
        self._due: dict[int, float] = {}
        self._watched: frozenset[int] = frozenset()
        self.drawn = self.dropped = 0

    @property
    def is_ready(self) -> bool:
        """True once the site is built, which takes seconds, or where nothing is drawn."""
        return self._eyes is not None or self._only_passes

    def hear(self, line: Line) -> None:
        """Handle a line from the run or the picture server."""
        kind = line.get("k")
        if "watch" in line:
            self._watch(frozenset(line["watch"]))
        elif kind == "scene":
            self._eyes = Eyes(line["scenario"], line["seed"])
        elif kind == "contain" and self._eyes is not None:
            self._eyes.contain(line["n"], line["t"] / 1000)
        elif kind == "ready":
            self._only_passes = True
        elif kind in ("frame", "picture") and line["robot"] in self._watched:
            self.dropped += self._frames.pop(line["robot"], None) is not None
            self._frames[line["robot"]] = line

    def _watch(self, robots: frozenset[int]) -> None:
        self._watched = robots
        self._frames = {robot: f for robot, f in self._frames.items() if robot in robots}
        self._due = {robot: due for robot, due in self._due.items() if robot in robots}

    def wait(self, now: float) -> float:
        """Return the time until a picture is due [s]."""
        due = [self._due.get(robot, now) - now for robot in self._frames]
        return max(0.0, min([*due, IDLE_S]))

    def draw(self, now: float) -> Picture | None:
        """Draw the picture that has waited longest, if one is due at `now` [s]."""
        ready = [robot for robot in self._frames if self._due.get(robot, now) <= now]
        if not self.is_ready or not ready:
            return None
        robot = min(ready, key=lambda robot: self._due.get(robot, 0.0))
        frame = self._frames.pop(robot)
        rate = 0.0 if self._eyes is None else self._eyes.rate
        self._due[robot] = now + 1.0 / max(MIN_RATE, RATE_ROOM * rate)
        self.drawn += 1
        jpeg = self._jpeg(frame)
        captured = round(frame["captured_ms"])
        arrived = round(frame["t"])
        return Picture(robot, frame["number"], captured, arrived, jpeg)

    def _jpeg(self, frame: Line) -> bytes:
        """Return the JPEG of a frame, drawn or taken by a real camera."""
        if "jpeg" in frame:
            return base64.b64decode(frame["jpeg"])
        assert self._eyes is not None
        return self._eyes.jpeg(frame)


def run(world: PipeEnd, web: PipeEnd) -> Painter:
    """Draw until either pipe closes."""
    painter = Painter()
    alive = 0.0
    while world.is_open and web.is_open:
        wait = painter.wait(time.monotonic())
        ready, _, _ = select.select([world, web], [], [], wait)
        for end in ready:
            for line in end.lines():
                painter.hear(line)
        now = time.monotonic()
        if (
            painter.is_ready
            and now - alive >= ALIVE_S
            and web.offer(pack(Picture(ALIVE, painter.drawn, 0, 0, b"")))
        ):
            alive = now
        picture = painter.draw(now) if web.flush() else None
        if picture is not None and not web.offer(pack(picture)):
            painter.dropped += 1
    return painter
