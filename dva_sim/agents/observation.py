"""Operators' view of the world: observations, frames, and visibility in smoke.

A robot's camera makes them (`robot.field_of_view`); operators see only these.

References:
    T. Jin: Visibility and human behavior in fire smoke. SFPE Handbook of Fire Protection
    Engineering (what does not shine is made out through an optical depth of 3).
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import NamedTuple

from dva_sim.kernel.makers import maker

Point = tuple[float, float]

CAMERA_SCHEME = "zmq+tcp://"  # host, port, topic: where simulated robots publish their frames
FRAME = "frame|"  # topic of the frames
IN_VIEW = "in view"  # end of a robot's finding while it inspects a place
CLEAR = 1000.0  # design: visibility without smoke [m]
SEEN_THROUGH = 3.0
"""Source: Jin: optical depth of smoke through which what does not shine is still made out. Smoke
itself counts as a sign of fire, so it never hides one."""


class SeenHazard(NamedTuple):
    """A hazard in the picture.

    Attributes:
        kind: `fire`, `gas_leak` or `flood`.
        x: Position to the east, judged from the picture and the map [m].
        y: Position to the north [m].
        distance: Distance from the camera [m].
        angle: Apparent size: the angle that it fills [rad].
        contrast: Share of its contrast that the smoke before it leaves.
    """

    kind: str
    x: float
    y: float
    distance: float
    angle: float
    contrast: float


class Observation(NamedTuple):
    """Content of a frame that a person uses.

    Attributes:
        tick: Robot's clock at capture [ms]; not synchronised with any other clock.
        x: Position of the robot to the east, judged from the picture and the map [m].
        y: Position to the north [m].
        heading: Heading [rad].
        speed: Speed seen in the picture [m/s].
        turn_rate: Turn rate seen in the picture [rad/s].
        hazards: Fires, leaks and floods in view.
        visibility: Distance at which the camera sees what does not shine, through the smoke before
            it [m]; `CLEAR` without smoke.
    """

    tick: int
    x: float
    y: float
    heading: float
    speed: float
    turn_rate: float
    hazards: tuple[SeenHazard, ...]
    visibility: float = CLEAR


make_observation = maker(Observation)


class CameraFrame(NamedTuple):
    """An observation in transit; `captured` [s] is for the recorder, not for the operator.

    It replaces a picture by the information that a person would take from it.
    """

    observation: Observation
    captured: float

    def pack(self, size: int) -> bytes:
        """Return the frame as JSON, filled up with spaces to the size of a picture [B]."""
        return json.dumps((self.observation, self.captured)).encode().ljust(size)

    @classmethod
    def unpack(cls, data: bytes) -> CameraFrame | None:
        """Return the frame in `data`; None if it is not one."""
        try:
            (*values, hazards, visibility), captured = json.loads(data)
            tick, *pose = (float(value) for value in values)
            x, y, heading, speed, turn_rate = pose
            sights = tuple(_hazard(*hazard) for hazard in hazards)
            at = Observation(
                tick=int(tick),
                x=x,
                y=y,
                heading=heading,
                speed=speed,
                turn_rate=turn_rate,
                hazards=sights,
                visibility=float(visibility),
            )
            sound = 0 <= tick < 2**53 and math.isfinite(sum(pose) + at.visibility)
            return cls(at, float(captured)) if sound else None
        except (ValueError, TypeError, OverflowError, RecursionError):
            return None


make_frame = maker(CameraFrame)


def _hazard(kind: object, *numbers: float) -> SeenHazard:
    """Return a hazard out of a message that may be anything.

    Raises:
        ValueError: a value is not a finite number.
    """
    values = [float(number) for number in numbers]
    if not math.isfinite(sum(values)):
        raise ValueError("not a number")
    return SeenHazard(str(kind), *values)


class Cameras(NamedTuple):
    """Sources of robots' pictures, and the addresses where an operator's screen finds them.

    Attributes:
        url: Function that returns the URL of a robot's camera, by its label and address.
        topic: Function from a camera's URL to the topic of its frames; None if it has none.
    """

    url: Callable[[str, str], str]
    topic: Callable[[str], str | None]


def topic_in(url: str) -> str | None:
    """Return the topic of frames that a URL of ours ends with."""
    return url.rpartition("/")[2] if url.startswith(CAMERA_SCHEME) else None


OVER_ZMQ = Cameras(lambda label, address: f"{CAMERA_SCHEME}{address}/{FRAME}", topic_in)
"""Frames alone, as everywhere but in a console, whose pictures a browser can show."""


def no_smoke(a: Point, b: Point) -> float:
    """Return the optical depth where nothing burns."""
    return 0.0
