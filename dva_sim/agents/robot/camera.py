"""What a robot's camera shows: the only thing an operator ever sees of the world.

References:
    T. Jin: Visibility and human behavior in fire smoke. SFPE Handbook of Fire Protection
    Engineering (what does not shine is made out through an optical depth of 3).
    Contrast falls with the optical depth as exp(-depth): H. Koschmieder, 1924.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import NamedTuple

from dva_sim.agents.route_following import wrap

Point = tuple[float, float]

CAMERA_SCHEME = "zmq+tcp://"  # host, port, topic: where simulated robots publish their frames


CLEAR = 1000.0  # visibility where there is no smoke [m]


class SeenHazard(NamedTuple):
    """A hazard in the picture.

    Attributes:
        kind: `fire`, `gas_leak` or `flood`.
        x: Where it is, judged from the picture and the map [m].
        y: The same to the north [m].
        distance: From the camera [m].
        angle: How large it looks: the angle that it fills [rad].
        contrast: Share of its contrast that the smoke before it leaves.
    """

    kind: str
    x: float
    y: float
    distance: float
    angle: float
    contrast: float


class Observation(NamedTuple):
    """One frame, as far as a person makes use of it.

    Attributes:
        tick: The robot's own clock when it was taken [ms]; it agrees with no other clock.
        x: Where the robot is, judged from the picture and the map [m].
        y: The same to the north [m].
        heading: Where it points [rad].
        speed: How fast the picture says it goes [m/s].
        turn_rate: How fast the picture says it turns [rad/s].
        hazards: What burns, leaks or floods in view.
        visibility: How far the camera sees what does not shine, through the smoke before it
            [m]; `CLEAR` where there is none.
    """

    tick: int
    x: float
    y: float
    heading: float
    speed: float
    turn_rate: float
    hazards: tuple[SeenHazard, ...]
    visibility: float = CLEAR


class Frame(NamedTuple):
    """An observation on its way; `captured` [s] is for the recorder, not for the operator.

    It stands in for a picture: what a person would make of the picture is what it holds.
    """

    observation: Observation
    captured: float

    def pack(self, size: int) -> bytes:
        """The frame as JSON, filled up with spaces to the size of a picture [B]."""
        return json.dumps((self.observation, self.captured)).encode().ljust(size)

    @classmethod
    def unpack(cls, data: bytes) -> Frame | None:
        """The frame in `data`; None if there is none."""
        try:
            (*values, hazards, visibility), captured = json.loads(data)
            tick, *pose = (float(value) for value in values)
            x, y, heading, speed, turn_rate = pose
            seen = tuple(_hazard(*hazard) for hazard in hazards)
            at = Observation(int(tick), x, y, heading, speed, turn_rate, seen, float(visibility))
            sound = 0 <= tick < 2**53 and math.isfinite(sum(pose) + at.visibility)
            return cls(at, float(captured)) if sound else None
        except (ValueError, TypeError, OverflowError, RecursionError):
            return None


def _hazard(kind: object, *numbers: float) -> SeenHazard:
    """A hazard out of a message that may be anything.

    Raises:
        ValueError: what is no finite number.
    """
    values = [float(number) for number in numbers]
    if not math.isfinite(sum(values)):
        raise ValueError("not a number")
    return SeenHazard(str(kind), *values)


class HazardSpot(NamedTuple):
    """A hazard as the camera may see it: kind, place and radius [m]."""

    kind: str
    x: float
    y: float
    radius: float


SEEN_THROUGH = 3.0
"""Optical depth of smoke through which what does not shine is still made out (Jin). Smoke hides no
fire: who sees it has found one."""
NEAR = 0.5  # smoke so far before the camera stands between it and everything [m]


def no_smoke(a: Point, b: Point) -> float:
    """The optical depth where nothing burns."""
    return 0.0


@dataclass(frozen=True)
class View:
    """Field of view and range of a camera.

    Attributes:
        angle: Whole angle of view [rad].
        range: How far a hazard can be recognised [m].
        line_of_sight: Whether no wall stands between two places.
        smoke: Optical depth of the smoke between two places now.
    """

    angle: float
    range: float
    line_of_sight: Callable[[Point, Point], bool]
    smoke: Callable[[Point, Point], float] = no_smoke

    def look(
        self, x: float, y: float, heading: float, hazards: Iterable[HazardSpot]
    ) -> tuple[SeenHazard, ...]:
        """Which hazards are in the picture taken from a pose [m, rad]."""
        seen = []
        for hazard in hazards:
            dx, dy = hazard.x - x, hazard.y - y
            distance = math.hypot(dx, dy)
            if distance - hazard.radius > self.range:
                continue
            bearing = wrap(math.atan2(dy, dx) - heading)
            half_width = math.atan2(hazard.radius, distance)
            if abs(bearing) - half_width > self.angle / 2:
                continue
            here, there = (x, y), (hazard.x, hazard.y)
            if not self.line_of_sight(here, there):
                continue
            depth = 0.0 if hazard.kind == "fire" else self.smoke(here, there)
            if depth < SEEN_THROUGH:
                looks = 2.0 * half_width, math.exp(-depth)
                seen.append(SeenHazard(hazard.kind, hazard.x, hazard.y, distance, *looks))
        return tuple(seen)

    def visibility(self, x: float, y: float, heading: float) -> float:
        """How far what does not shine is made out from a pose [m, rad], at most `CLEAR` [m].

        By the thicker of the smoke just before the camera and that along its axis: clean air
        beyond a wall lets nobody see through the smoke before it.
        """
        ahead = math.cos(heading), math.sin(heading)
        thickest = max(
            self.smoke((x, y), (x + far * ahead[0], y + far * ahead[1])) / far
            for far in (NEAR, self.range)
        )
        return min(SEEN_THROUGH / thickest, CLEAR) if thickest > 0.0 else CLEAR
