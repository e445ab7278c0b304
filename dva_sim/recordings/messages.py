"""What a recording's messages are made of: time stamps, poses, colours; and their JSON Schemas.

Where Foxglove has a message type for something, its name and fields are used, so that viewers
know what to draw; the others begin with `dva_sim.`. Times are whole seconds and nanoseconds of
virtual time since the start of the run; lengths are metres, angles radians. The schemas stand
here, and are not taken from Foxglove's SDK: it has them for Protobuf only, in 54 MB; as JSON a
recording can be read with any tool, and with the eye.

References:
    Foxglove, "Message schemas", and MCAP, "Specification": names, fields and encodings.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
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


class ChannelMessage(NamedTuple):
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


Schema = dict[str, Any]

_NUMBER: Schema = {"type": "number"}
_WORDS: dict[str, Schema] = {
    "number": _NUMBER,
    "maybe": {"type": ["number", "null"]},
    "text": {"type": "string"},
    "flag": {"type": "boolean"},
    "count": {"type": "integer", "minimum": 0},
    "nsec": {"type": "integer", "minimum": 0, "maximum": 999_999_999},
    "bytes": {"type": "string", "contentEncoding": "base64"},
    "none": {"type": "array", "maxItems": 0},
    "nine": {"type": "array", "items": _NUMBER, "minItems": 9, "maxItems": 9},
}
"""Types of fields by the word that stands for them below; the types made there come on top."""

# A type a paragraph: its name, what it tells, then its fields. `a b: type` are two fields, `type*`
# is a list, `A=0 B=1` are named values. A type is known by its last word to those after it.
_PARTS = """
time | Virtual time since the start of the run
sec: count; nsec: nsec

duration | A span of time; zero for without end
sec: count; nsec: nsec

foxglove.Vector3 | A vector or point [m]
x y z: number

foxglove.Vector2 | Lengths along x and y [m]
x y: number

foxglove.Quaternion | An orientation
x y z w: number

foxglove.Color | Red, green, blue and opacity, 0 to 1
r g b a: number

foxglove.Point3 | A point [m]
x y z: number

foxglove.Pose | Where and how turned
position: Vector3; orientation: Quaternion

foxglove.FrameTransform | Where a body's own frame lies in another
timestamp: time; parent_frame_id child_frame_id: text; translation: Vector3; rotation: Quaternion

foxglove.LinePrimitive | Lines between points
type: LINE_STRIP=0 LINE_LOOP=1 LINE_LIST=2; pose: Pose; thickness: number; scale_invariant: flag;
points: Point3*; color: Color; colors: Color*; indices: count*

foxglove.CylinderPrimitive | An upright cylinder or cone
pose: Pose; size: Vector3; bottom_scale top_scale: number; color: Color

foxglove.ArrowPrimitive | An arrow along x
pose: Pose; shaft_length shaft_diameter head_length head_diameter: number; color: Color

foxglove.TextPrimitive | Words in the scene
pose: Pose; billboard: flag; font_size: number; scale_invariant: flag; color: Color; text: text

foxglove.KeyValuePair | A remark
key value: text

foxglove.SceneEntity | Something to draw; takes the place of what had the same id
timestamp: time; frame_id id: text; lifetime: duration; frame_locked: flag; metadata: KeyValuePair*;
arrows: ArrowPrimitive*; cubes spheres: none; cylinders: CylinderPrimitive*; lines: LinePrimitive*;
triangles: none; texts: TextPrimitive*; models: none

foxglove.SceneEntityDeletion | Something to draw no longer
timestamp: time; type: MATCHING_ID=0 ALL=1; id: text

foxglove.PackedElementField | One number of a cell
name: text; offset: count; type: FLOAT32=7

dva_sim.SeenHazard | In view
kind: text; x_m y_m: number
"""
_MESSAGES = """
foxglove.Log | A line of the story; `kind` is event, order, drive, mode, link or safety
timestamp: time; level: DEBUG=1 INFO=2 WARNING=3; message name file: text; line: count; kind: text

foxglove.PoseInFrame | Where somebody is, or is believed to be
timestamp: time; frame_id: text; pose: Pose

foxglove.FrameTransforms | Where those are who moved
transforms: FrameTransform*

foxglove.LocationFix | Where a robot is on earth [deg], its height unknown
timestamp: time; frame_id: text; latitude longitude altitude: number; position_covariance: nine;
position_covariance_type: UNKNOWN=0

foxglove.SceneUpdate | What is drawn: the site, everybody on it, what burns, leaks or floods
deletions: SceneEntityDeletion*; entities: SceneEntity*

foxglove.Grid | A hazard as a field over the floor; cells outside are zero
timestamp: time; frame_id: text; pose: Pose; column_count: count; cell_size: Vector2;
row_stride cell_stride: count; fields: PackedElementField*; data: bytes

foxglove.GeoJSON | The plan of the site
geojson: text

dva_sim.Activity | What somebody does from now on: a robot's mode, what a guard or bystander is \
about
timestamp: time; activity: text

dva_sim.Shown | A frame comes onto an operator's screen; `drive` counts the drives of the run from 0
timestamp: time; drive: count; robot: text; captured_s: number

dva_sim.Command | The phone makes a command from the tilt; `drive` counts the drives of the run \
from 0
timestamp: time; drive: count; robot: text; speed_m_s turn_rate_rad_s: number

dva_sim.Applied | A command takes effect at the robot; the times on its way, and of the picture \
behind it
timestamp: time; made_s sent_s arrived_s: number; until_s captured_s: maybe

dva_sim.Frame | A camera's frame sets out to somebody: what a person makes of it stands for the \
picture
timestamp: time; to: text; size_bytes: count; captured_s x_m y_m heading_rad visibility_m: number;
hazards: SeenHazard*

dva_sim.Decision | A line of the trace of a robot or the DVA, by which its decisions are replayed
timestamp: time; line: text

dva_sim.Hazard | What burns, leaks or floods, once a second while it goes on; `number` counts from 1
timestamp: time; number: count; kind room: text; x_m y_m radius_m danger_radius_m severity: number
"""


def _read(text: str, known: dict[str, Schema]) -> dict[str, Schema]:
    """The types of a text by their full names, and with what is known by their last words."""
    types: dict[str, Schema] = {}
    for paragraph in text.strip().split("\n\n"):
        head, _, body = paragraph.partition("\n")
        title, _, told = head.partition(" | ")
        fields: dict[str, Schema] = {}
        for group in body.split(";"):
            names, _, kind = group.partition(":")
            fields |= dict.fromkeys(names.split(), _type(kind.strip(), known))
        types[title] = known[title.rpartition(".")[2]] = {
            "title": title,
            "description": told,
            "type": "object",
            "properties": fields,
            "required": list(fields),
        }
    return types


def _type(kind: str, known: Mapping[str, Schema]) -> Schema:
    if "=" in kind:
        values = [value.split("=") for value in kind.split()]
        return {"oneOf": [{"title": name, "const": int(number)} for name, number in values]}
    if kind.endswith("*"):
        return {"type": "array", "items": known[kind[:-1]]}
    return known[kind]


_read(_PARTS, _WORDS)
SCHEMAS = _read(_MESSAGES, _WORDS)
