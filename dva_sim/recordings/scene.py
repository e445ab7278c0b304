"""What a viewer draws: walls and names of rooms, everybody's body, hazards as they grow."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from dva_sim.recordings import messages
from dva_sim.recordings.messages import FRAME, HERE, Message
from dva_sim.simulation import Playback

TOPIC, SCHEMA = "/scene", "foxglove.SceneUpdate"
WALL, INK, EXIT = "#3a3f47", "#2b3038", "#2f7d32"
BODIES = {"robot": "#2f7fd0", "guard": "#2f7d32", "bystander": "#8c6d5a"}
HAZARDS = {"fire": "#d1332e", "gas_leak": "#b59a00", "flood": "#2a7fb8"}
TALL = {"robot": 0.5, "guard": 1.75, "bystander": 1.7}  # as drawn [m]
PERSON = 0.25  # radius [m]
STEP_S = 1.0  # between updates of a hazard [s]
LEAST_GROWTH = 0.05  # less is not drawn anew [m]


def bodies(playback: Playback) -> Iterator[Message]:
    """Everybody, in a frame that moves with them; those who leave vanish."""
    tracks = playback.recorder.tracks
    for name, track in tracks.items():
        yield _update(track[0].time, _body(playback, name, track[0].time))
    gone = [(t[-1].time, n) for n, t in tracks.items() if t[-1].time < playback.duration]
    for time, name in sorted(gone):
        yield _removal(time, name)


def ground(playback: Playback) -> Iterator[Message]:
    """The site, which stands still."""
    site, middles = playback.site, [(r.name, r.polygon.mean(axis=0)) for r in playback.site.rooms]
    lines = [_lines(site.walls.tolist(), WALL), _lines([e.ends for e in site.exits], EXIT)]
    texts = [_words(name, float(x), float(y)) for name, (x, y) in middles]
    entity = _entity(0.0, "site", FRAME, lines=[line for line in lines if line["points"]])
    yield _update(0.0, entity | {"texts": texts})


def hazards(playback: Playback) -> Iterator[Message]:
    """What is real, from when it begins until it is dealt with or the run ends."""
    for number, incident in enumerate(playback.incidents):
        if incident.false_alarm:
            continue
        name, until = f"hazard-{number + 1}", playback.contained.get(number, math.inf)
        drawn = -math.inf
        for time in _steps(incident.start, min(until, playback.duration)):
            radius = incident.hazard.radius(time)
            if radius - drawn >= LEAST_GROWTH:
                drawn = radius
                yield _update(
                    time, _disc(name, time, incident.kind, incident.hazard.position, radius)
                )
        if until < playback.duration:
            yield _removal(until, name)


def states(playback: Playback) -> Iterator[Message]:
    """The same hazards as numbers, once a second."""
    for number, incident in enumerate(playback.incidents):
        until = min(playback.contained.get(number, math.inf), playback.duration)
        x, y = incident.hazard.position
        for time in _steps(incident.start, until) if not incident.false_alarm else ():
            content = {
                "timestamp": messages.stamp(time),
                "number": number + 1,
                "kind": incident.kind,
                "room": incident.room,
                "x_m": round(x, messages.PLACES),
                "y_m": round(y, messages.PLACES),
                "radius_m": round(incident.hazard.radius(time), 3),
                "danger_radius_m": round(incident.hazard.danger_radius(time), 3),
                "severity": round(incident.hazard.severity(time), 4),
            }
            yield Message(time, "/hazards", "dva_sim.Hazard", content)


def _steps(start: float, end: float) -> Iterator[float]:
    count = max(0, math.ceil((end - start) / STEP_S))
    return (start + number * STEP_S for number in range(count))


def _update(time: float, entity: dict[str, Any]) -> Message:
    return Message(time, TOPIC, SCHEMA, {"deletions": [], "entities": [entity]})


def _removal(time: float, name: str) -> Message:
    deletion = {"timestamp": messages.stamp(time), "type": 0, "id": name}
    return Message(time, TOPIC, SCHEMA, {"deletions": [deletion], "entities": []})


def _entity(time: float, name: str, frame: str, **parts: list[Any]) -> dict[str, Any]:
    kinds = "arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models"
    return {
        "timestamp": messages.stamp(time),
        "frame_id": frame,
        "id": name,
        "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": True,
        "metadata": [],
        **{kind: parts.get(kind, []) for kind in kinds},
    }


def _body(playback: Playback, name: str, time: float) -> dict[str, Any]:
    kind, robot = name.rpartition("-")[0], playback.robot_named(name)
    radius = PERSON if robot is None else playback.radii[robot]
    tall, paint = TALL[kind], messages.colour(BODIES[kind])
    arrow = {
        "pose": messages.pose(0.0, 0.0, z=tall),
        "shaft_length": radius,
        "shaft_diameter": radius / 4,
        "head_length": radius / 2,
        "head_diameter": radius / 2,
        "color": messages.colour(INK),
    }
    label = _words(name, 0.0, 0.0, tall + 0.3)
    return _entity(
        time, name, name, cylinders=[_cylinder(radius, tall, paint)], arrows=[arrow], texts=[label]
    )


def _disc(
    name: str, time: float, kind: str, place: tuple[float, float], radius: float
) -> dict[str, Any]:
    paint = messages.colour(HAZARDS[kind], 0.5)
    return _entity(time, name, FRAME, cylinders=[_cylinder(radius, 0.05, paint, *place)])


def _cylinder(
    radius: float, tall: float, paint: dict[str, float], x: float = 0.0, y: float = 0.0
) -> dict[str, Any]:
    size = messages.point(2 * radius, 2 * radius, tall)
    upright = messages.pose(x, y, z=tall / 2)
    return {"pose": upright, "size": size, "bottom_scale": 1.0, "top_scale": 1.0, "color": paint}


def _lines(segments: Any, code: str) -> dict[str, Any]:
    ends = [messages.point(*end) for x1, y1, x2, y2 in segments for end in ((x1, y1), (x2, y2))]
    return {
        "type": 2,
        "pose": HERE,
        "thickness": 2.0,
        "scale_invariant": True,
        "points": ends,
        "color": messages.colour(code),
        "colors": [],
        "indices": [],
    }


def _words(text: str, x: float, y: float, z: float = 0.0) -> dict[str, Any]:
    return {
        "pose": messages.pose(x, y, z=z),
        "billboard": True,
        "font_size": 12.0,
        "scale_invariant": True,
        "color": messages.colour(INK),
        "text": text,
    }
