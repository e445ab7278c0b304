"""What a recording's messages are made of: time stamps, poses, colours, one message."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

NS = 1_000_000_000
FRAME = "map"  # the plane of the site: x east, y north [m]
PLACES = 4  # decimals of a length [m]
TURNS = 6  # decimals of a quaternion
HERE = {
    "position": {"x": 0.0, "y": 0.0, "z": 0.0},
    "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
}
XML = "xml"  # in the place of a schema's name: the content is bytes of the protocol


class Message(NamedTuple):
    """One message of a recording.

    Attributes:
        time: When, since the start of the run [s].
        topic: Its channel.
        schema: Name of its schema, or `XML`.
        content: A JSON object, or the bytes of the protocol.
    """

    time: float
    topic: str
    schema: str
    content: Any


def nanoseconds(time: float) -> int:
    """A moment of virtual time [s] in nanoseconds, to the microsecond that the clock keeps."""
    return round(time * 1e6) * 1000


def stamp(time: float) -> dict[str, int]:
    """A moment [s] as messages hold it."""
    sec, nsec = divmod(nanoseconds(time), NS)
    return {"sec": sec, "nsec": nsec}


def point(x: float, y: float, z: float = 0.0) -> dict[str, float]:
    """A point or vector [m]."""
    return {"x": round(x, PLACES), "y": round(y, PLACES), "z": round(z, PLACES)}


def turned(heading: float) -> dict[str, float]:
    """A turn about the vertical [rad], as a quaternion."""
    z, w = round(math.sin(heading / 2), TURNS), round(math.cos(heading / 2), TURNS)
    return {"x": 0.0, "y": 0.0, "z": z, "w": w}


def heading_of(rotation: dict[str, float]) -> float:
    """The turn about the vertical [rad] that a quaternion stands for."""
    return 2.0 * math.atan2(rotation["z"], rotation["w"])


def pose(x: float, y: float, heading: float = 0.0, z: float = 0.0) -> dict[str, Any]:
    """Where something is [m] and where it heads [rad]."""
    return {"position": point(x, y, z), "orientation": turned(heading)}


def colour(code: str, opacity: float = 1.0) -> dict[str, float]:
    """A colour such as `#2f7fd0`."""
    r, g, b = (round(int(code[start : start + 2], 16) / 255, 3) for start in (1, 3, 5))
    return {"r": r, "g": g, "b": b, "a": opacity}


def finite(value: float) -> float | None:
    """A number as JSON has it: what never comes is null."""
    return value if math.isfinite(value) else None
