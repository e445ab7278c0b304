"""Every message of a recording has the shape that its schema tells."""

import inspect
import json
import math
from collections import Counter

import jsonschema
import pytest
from recordings.runs import drill, drive, evacuation

from dva_sim.kernel.recorder import TrackPoint
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode
from dva_sim.recordings import messages
from dva_sim.recordings.channels import sparse
from dva_sim.recordings.messages import SCHEMAS, XML
from dva_sim.recordings.writing import every_message

EVERYDAY = {
    *("foxglove.Log", "foxglove.PoseInFrame", "foxglove.FrameTransforms", "foxglove.LocationFix"),
    *("foxglove.SceneUpdate", "foxglove.Grid", "dva_sim.Activity", "dva_sim.Shown"),
    *("dva_sim.Command", "dva_sim.Applied", "dva_sim.Frame", "dva_sim.Hazard", XML),
    *("dva_sim.Arrived", "dva_sim.Accepted", "dva_sim.Heard", "dva_sim.MotionNews"),
    *("dva_sim.PlaceNews", "dva_sim.BookNews"),
}


@pytest.mark.parametrize("schema", SCHEMAS.values(), ids=SCHEMAS)
def test_each_schema_is_one(schema):
    jsonschema.Draft202012Validator.check_schema(schema)


@pytest.mark.system
@pytest.mark.parametrize("run", [drive, drill, evacuation], ids=lambda run: run.__name__)
def test_every_message_is_valid_by_its_schema(run):
    validators = {
        name: jsonschema.Draft202012Validator(_strict(schema)) for name, schema in SCHEMAS.items()
    }
    seen = Counter()
    for message in every_message(run()):
        seen[message.schema] += 1
        if message.schema != XML and seen[message.schema] <= 100:
            content = json.loads(json.dumps(message.content, allow_nan=False))
            validators[message.schema].validate(content)
    if run is drill:
        assert set(seen) == EVERYDAY


def test_a_message_with_a_field_too_few_or_too_many_would_be_found():
    schema = _strict(SCHEMAS["dva_sim.Activity"])
    right = {"timestamp": messages.stamp(1.5), "activity": "walking"}
    jsonschema.validate(right, schema)
    for wrong in ({"activity": "walking"}, right | {"mood": "good"}, right | {"activity": 3}):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(wrong, schema)


@pytest.mark.parametrize("name", [name for name in SCHEMAS if name.startswith("foxglove.")])
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_foxglove_itself_knows_these_types_and_fields(name):
    import foxglove.messages as known

    assert list(_unknown(SCHEMAS[name], known)) == []


def test_raw_messages_are_those_of_the_protocol():
    bodies = [
        decode(message.content).body for message in every_message(drive()) if message.schema == XML
    ]
    assert {m.Registration, m.SetTeleOp, m.Heartbeat} <= {type(body) for body in bodies}


def test_times_are_kept_to_the_microsecond_and_what_never_comes_is_null():
    assert messages.nanoseconds(12.000001) == 12_000_001_000
    assert messages.stamp(12.000001) == {"sec": 12, "nsec": 1000}
    assert (messages.finite(math.inf), messages.finite(2.5)) == (None, 2.5)


def test_a_heading_survives_as_a_quaternion():
    for heading in (-3.1, -0.5, 0.0, 1.0, 3.1):
        assert messages.heading_of(messages.turned(heading)) == pytest.approx(heading, abs=1e-5)


def test_of_somebody_who_stands_still_a_pose_a_second_is_told():
    """Ten a second while walking from 2 s to 3 s, one a second before and after."""
    track = [
        TrackPoint(k / 10, min(max(k - 20, 0), 10) / 10, 0.0, 0.0, "walking") for k in range(61)
    ]
    times = [p.time for p in sparse(track)]
    assert times == [0.0, 1.0, *(k / 10 for k in range(20, 31)), 4.0, 5.0, 6.0]


def _strict(schema):
    """Schema without additional fields."""
    if schema.get("type") == "object":
        fields = {name: _strict(field) for name, field in schema["properties"].items()}
        return schema | {"properties": fields, "additionalProperties": False}
    if schema.get("type") == "array" and "items" in schema:
        return schema | {"items": _strict(schema["items"])}
    return schema


def _unknown(schema, known):
    """Types and fields of ours that Foxglove's own library does not have."""
    if schema.get("type") == "array":
        yield from _unknown(schema.get("items", {}), known)
    title = schema.get("title", "")
    if schema.get("type") != "object" or not title.startswith("foxglove."):
        return
    name = {"GeoJSON": "GeoJson"}.get(title[9:], title[9:])
    if not hasattr(known, name):
        yield title
        return
    theirs = inspect.signature(getattr(known, name)).parameters
    for field, inner in schema["properties"].items():
        if field not in theirs and (title, field) != ("foxglove.Log", "kind"):
            yield f"{title}.{field}"
        yield from _unknown(inner, known)
