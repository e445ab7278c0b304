"""Building blocks of recorded messages: time stamps, poses, colours; and JSON Schemas.

Where Foxglove has a message type for something, its name and fields are used, so that viewers
know what to draw; the others begin with `dva_sim.`. Times are whole seconds and nanoseconds of
virtual time since the start of the run; lengths are metres, angles radians. The schemas stand
in a file beside this, and are not taken from Foxglove's SDK: it has them for Protobuf only, in
54 MB; as JSON a recording can be read with any tool, and with the eye.

References:
    Foxglove, "Message schemas", and MCAP, "Specification": names, fields and encodings.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

NS = 1_000_000_000
FRAME = "map"  # frame of the site: x east, y north [m]
PLACES = 4  # decimals of a length [m]
TURNS = 6  # decimals of a quaternion
XML = "xml"  # in place of a schema's name: the content is bytes of the protocol


class ChannelMessage(NamedTuple):
    """One message of a recording.

    Attributes:
        time: Time since the start of the run [s].
        topic: Its channel.
        schema: Name of its schema, or `XML`.
        content: A JSON object, or the bytes of the protocol.
    """

    time: float
    topic: str
    schema: str
    content: Any


def stamped(time: float, topic: str, schema: str, **content: Any) -> ChannelMessage:
    """Return a message that begins with its time [s]."""
    return ChannelMessage(time, topic, schema, {"timestamp": stamp(time), **content})


def nanoseconds(time: float) -> int:
    """Return virtual time [s] in nanoseconds, to the microsecond that the clock keeps."""
    return round(time * 1e6) * 1000


def stamp(time: float) -> dict[str, int]:
    """Return a moment [s] as a message's time stamp."""
    sec, nsec = divmod(nanoseconds(time), NS)
    return {"sec": sec, "nsec": nsec}


def point(x: float, y: float, z: float = 0.0) -> dict[str, float]:
    """Return a point or vector [m]."""
    return {"x": round(x, PLACES), "y": round(y, PLACES), "z": round(z, PLACES)}


def turned(heading: float) -> dict[str, float]:
    """Return a turn about the vertical [rad], as a quaternion."""
    z = round(math.sin(heading / 2), TURNS)
    w = round(math.cos(heading / 2), TURNS)
    return {"x": 0.0, "y": 0.0, "z": z, "w": w}


def heading_of(rotation: dict[str, float]) -> float:
    """Return the turn about the vertical [rad] that a quaternion stands for."""
    return 2.0 * math.atan2(rotation["z"], rotation["w"])


def pose(x: float, y: float, heading: float = 0.0, z: float = 0.0) -> dict[str, Any]:
    """Return a pose: position [m] and heading [rad]."""
    return {"position": point(x, y, z), "orientation": turned(heading)}


ORIGIN_POSE = pose(0.0, 0.0)


def colour(code: str, opacity: float = 1.0) -> dict[str, float]:
    """Return a colour such as `#2f7fd0`."""
    r, g, b = (round(int(code[start : start + 2], 16) / 255, 3) for start in (1, 3, 5))
    return {"r": r, "g": g, "b": b, "a": opacity}


def finite(value: float) -> float | None:
    """Return a number for JSON: infinity, which stands for never, is null."""
    return value if math.isfinite(value) else None


Schema = dict[str, Any]

_NUMBER: Schema = {"type": "number"}
_WORDS: dict[str, Schema] = {
    "number": _NUMBER,
    "maybe": {"type": ["number", "null"]},
    "text": {"type": "string"},
    "words": {"type": ["string", "null"]},
    "flag": {"type": "boolean"},
    "count": {"type": "integer", "minimum": 0},
    "nsec": {"type": "integer", "minimum": 0, "maximum": 999_999_999},
    "bytes": {"type": "string", "contentEncoding": "base64"},
    "none": {"type": "array", "maxItems": 0},
    "list": {"type": ["array", "null"]},
    "object": {"type": ["object", "null"]},
    "nine": {"type": "array", "items": _NUMBER, "minItems": 9, "maxItems": 9},
}
"""Types of fields by the word that stands for them; the types made of them come on top."""


def _read(text: str, type_by_name: dict[str, Schema]) -> dict[str, Schema]:
    """Return the types of a text by full names, and by their last words where known."""
    types: dict[str, Schema] = {}
    for paragraph in text.strip().split("\n\n"):
        head, _, body = paragraph.partition("\n")
        title, _, version = head.partition(" | ")
        fields: dict[str, Schema] = {}
        for group in body.split(";"):
            names, _, kind = group.partition(":")
            fields |= dict.fromkeys(names.split(), _type(kind.strip(), type_by_name))
        types[title] = type_by_name[title.rpartition(".")[2]] = {
            "title": title,
            "description": version,
            "type": "object",
            "properties": fields,
            "required": list(fields),
        }
    return types


def _type(kind: str, type_by_name: Mapping[str, Schema]) -> Schema:
    if "=" in kind:
        values = [value.split("=") for value in kind.split()]
        return {"oneOf": [{"title": name, "const": int(number)} for name, number in values]}
    if kind.endswith("*"):
        return {"type": "array", "items": type_by_name[kind[:-1]]}
    return type_by_name[kind]


def _schemas() -> dict[str, Schema]:
    """Return the schemas of all messages, by the names of their types.

    In `schemas.txt` parts of messages stand before the messages, a type a paragraph: its name,
    what it tells, then its fields. `a b: type` are two fields, `type*` is a list, `A=0 B=1` are
    named values. A type is known by its last word to those after it.
    """
    parts, _, whole = Path(__file__).with_name("schemas.txt").read_text().partition("----")
    type_by_name = dict(_WORDS)
    _read(parts, type_by_name)
    return _read(whole, type_by_name)


SCHEMAS = _schemas()
