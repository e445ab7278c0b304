"""What a recording's messages are made of: time stamps, poses, colours, one message.

The shapes of a recording's JSON messages, as JSON Schema.

Where Foxglove has a message type for something, its name and fields are used, so that viewers
know what to draw; the others begin with `dva_sim.`. Times are whole seconds and nanoseconds of
virtual time since the start of the run; lengths are metres, angles radians.

References:
    Foxglove, "Message schemas", and MCAP, "Specification": names, fields and encodings.
"""

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


Schema = dict[str, Any]

NUMBER: Schema = {"type": "number"}
MAYBE: Schema = {"type": ["number", "null"]}
TEXT: Schema = {"type": "string"}
FLAG: Schema = {"type": "boolean"}
COUNT: Schema = {"type": "integer", "minimum": 0}
BYTES: Schema = {"type": "string", "contentEncoding": "base64"}


def _object(title: str, what: str, /, **fields: Schema) -> Schema:
    return {
        "title": title,
        "description": what,
        "type": "object",
        "properties": fields,
        "required": list(fields),
    }


def _list(items: Schema) -> Schema:
    return {"type": "array", "items": items}


def _numbers(title: str, what: str, names: str) -> Schema:
    return _object(title, what, **dict.fromkeys(names, NUMBER))


def _one_of(**values: int) -> Schema:
    return {"oneOf": [{"title": name, "const": value} for name, value in values.items()]}


_NSEC = {"type": "integer", "minimum": 0, "maximum": 999_999_999}
TIME = _object("time", "Virtual time since the start of the run", sec=COUNT, nsec=_NSEC)
DURATION = _object("duration", "A span of time; zero for without end", sec=COUNT, nsec=_NSEC)
VECTOR = _numbers("foxglove.Vector3", "A vector or point [m]", "xyz")
PLANAR = _numbers("foxglove.Vector2", "Lengths along x and y [m]", "xy")
QUATERNION = _numbers("foxglove.Quaternion", "An orientation", "xyzw")
COLOUR = _numbers("foxglove.Color", "Red, green, blue and opacity, 0 to 1", "rgba")
POSE = _object("foxglove.Pose", "Where and how turned", position=VECTOR, orientation=QUATERNION)

_TRANSFORM = _object(
    "foxglove.FrameTransform",
    "Where a body's own frame lies in another",
    timestamp=TIME,
    parent_frame_id=TEXT,
    child_frame_id=TEXT,
    translation=VECTOR,
    rotation=QUATERNION,
)
_LINES = _object(
    "foxglove.LinePrimitive",
    "Lines between points",
    type=_one_of(LINE_STRIP=0, LINE_LOOP=1, LINE_LIST=2),
    pose=POSE,
    thickness=NUMBER,
    scale_invariant=FLAG,
    points=_list(_numbers("foxglove.Point3", "A point [m]", "xyz")),
    color=COLOUR,
    colors=_list(COLOUR),
    indices=_list(COUNT),
)
_CYLINDER = _object(
    "foxglove.CylinderPrimitive",
    "An upright cylinder or cone",
    pose=POSE,
    size=VECTOR,
    bottom_scale=NUMBER,
    top_scale=NUMBER,
    color=COLOUR,
)
_ARROW = _object(
    "foxglove.ArrowPrimitive",
    "An arrow along x",
    pose=POSE,
    shaft_length=NUMBER,
    shaft_diameter=NUMBER,
    head_length=NUMBER,
    head_diameter=NUMBER,
    color=COLOUR,
)
_WORDS = _object(
    "foxglove.TextPrimitive",
    "Words in the scene",
    pose=POSE,
    billboard=FLAG,
    font_size=NUMBER,
    scale_invariant=FLAG,
    color=COLOUR,
    text=TEXT,
)
_ENTITY = _object(
    "foxglove.SceneEntity",
    "Something to draw; takes the place of what had the same id",
    timestamp=TIME,
    frame_id=TEXT,
    id=TEXT,
    lifetime=DURATION,
    frame_locked=FLAG,
    metadata=_list(_object("foxglove.KeyValuePair", "A remark", key=TEXT, value=TEXT)),
    arrows=_list(_ARROW),
    cubes={"type": "array", "maxItems": 0},
    spheres={"type": "array", "maxItems": 0},
    cylinders=_list(_CYLINDER),
    lines=_list(_LINES),
    triangles={"type": "array", "maxItems": 0},
    texts=_list(_WORDS),
    models={"type": "array", "maxItems": 0},
)
_DELETION = _object(
    "foxglove.SceneEntityDeletion",
    "Something to draw no longer",
    timestamp=TIME,
    type=_one_of(MATCHING_ID=0, ALL=1),
    id=TEXT,
)
_ELEMENT = _object(
    "foxglove.PackedElementField",
    "One number of a cell",
    name=TEXT,
    offset=COUNT,
    type=_one_of(FLOAT32=7),
)

_FOXGLOVE = (
    _object(
        "foxglove.Log",
        "A line of the story; `kind` is event, order, drive, mode, link or safety",
        timestamp=TIME,
        level=_one_of(DEBUG=1, INFO=2, WARNING=3),
        message=TEXT,
        name=TEXT,
        file=TEXT,
        line=COUNT,
        kind=TEXT,
    ),
    _object(
        "foxglove.PoseInFrame",
        "Where somebody is, or is believed to be",
        timestamp=TIME,
        frame_id=TEXT,
        pose=POSE,
    ),
    _object(
        "foxglove.FrameTransforms",
        "Where those are who moved",
        transforms=_list(_TRANSFORM),
    ),
    _object(
        "foxglove.LocationFix",
        "Where a robot is on earth [deg], its height unknown",
        timestamp=TIME,
        frame_id=TEXT,
        latitude=NUMBER,
        longitude=NUMBER,
        altitude=NUMBER,
        position_covariance={"type": "array", "items": NUMBER, "minItems": 9, "maxItems": 9},
        position_covariance_type=_one_of(UNKNOWN=0),
    ),
    _object(
        "foxglove.SceneUpdate",
        "What is drawn: the site, everybody on it, what burns, leaks or floods",
        deletions=_list(_DELETION),
        entities=_list(_ENTITY),
    ),
    _object(
        "foxglove.Grid",
        "A hazard as a field over the floor; cells outside are zero",
        timestamp=TIME,
        frame_id=TEXT,
        pose=POSE,
        column_count=COUNT,
        cell_size=PLANAR,
        row_stride=COUNT,
        cell_stride=COUNT,
        fields=_list(_ELEMENT),
        data=BYTES,
    ),
    _object("foxglove.GeoJSON", "The plan of the site", geojson=TEXT),
)
_OWN = (
    _object(
        "dva_sim.Activity",
        "What somebody does from now on: a robot's mode, what a guard or bystander is about",
        timestamp=TIME,
        activity=TEXT,
    ),
    _object(
        "dva_sim.Shown",
        "A frame comes onto an operator's screen; `drive` counts the drives of the run from 0",
        timestamp=TIME,
        drive=COUNT,
        robot=TEXT,
        captured_s=NUMBER,
    ),
    _object(
        "dva_sim.Command",
        "The phone makes a command from the tilt; `drive` counts the drives of the run from 0",
        timestamp=TIME,
        drive=COUNT,
        robot=TEXT,
        speed_m_s=NUMBER,
        turn_rate_rad_s=NUMBER,
    ),
    _object(
        "dva_sim.Applied",
        "A command takes effect at the robot; the times on its way, and of the picture behind it",
        timestamp=TIME,
        made_s=NUMBER,
        sent_s=NUMBER,
        arrived_s=NUMBER,
        until_s=MAYBE,
        captured_s=MAYBE,
    ),
    _object(
        "dva_sim.Frame",
        "A camera's frame sets out to somebody: what a person makes of it stands for the picture",
        timestamp=TIME,
        to=TEXT,
        size_bytes=COUNT,
        captured_s=NUMBER,
        x_m=NUMBER,
        y_m=NUMBER,
        heading_rad=NUMBER,
        visibility_m=NUMBER,
        hazards=_list(_object("dva_sim.SeenHazard", "In view", kind=TEXT, x_m=NUMBER, y_m=NUMBER)),
    ),
    _object(
        "dva_sim.Hazard",
        "What burns, leaks or floods, once a second while it goes on; `number` counts from 1",
        timestamp=TIME,
        number=COUNT,
        kind=TEXT,
        room=TEXT,
        x_m=NUMBER,
        y_m=NUMBER,
        radius_m=NUMBER,
        danger_radius_m=NUMBER,
        severity=NUMBER,
    ),
)

SCHEMAS: dict[str, Schema] = {schema["title"]: schema for schema in (*_FOXGLOVE, *_OWN)}
