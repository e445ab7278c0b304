"""The channels of a recording: positions, hazards, drawings for viewers, events and messages.

Robots and people with their estimated positions; smoke, radiant heat, gas and water as grids over
the floor; walls, names of rooms and bodies for a viewer; the story, messages and commands.
"""

from __future__ import annotations

import base64
import heapq
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.agents.observation import CameraFrame
from dva_sim.core.events import Event
from dva_sim.kernel.recorder import Moment, Sent, TrackPoint
from dva_sim.protocol.facts import Fact
from dva_sim.recordings import messages
from dva_sim.recordings.messages import FRAME, ORIGIN_POSE, XML, ChannelMessage, stamped
from dva_sim.simulation.full import Playback
from dva_sim.simulation.full.hazards import RunHazard
from dva_sim.simulation.full.observation_json import as_plain
from dva_sim.worlds.hazards import Hazard, Raster
from dva_sim.worlds.site import Site

POSE = "pose"  # last part of a topic, as the next three
ACTIVITY = "activity"
FIX = "fix"
SEEN = "seen"
ALIVE_S = 1.0  # interval at which standing bodies are recorded, on whole multiples [s]


def poses(playback: Playback) -> Iterator[ChannelMessage]:
    """Yield a pose for each moving agent, and all poses of a moment in one transform."""
    tracks = playback.recorder.tracks.items()
    every = heapq.merge(
        *([(p.time, name, p) for p in sparse(track)] for name, track in tracks),
        key=lambda entry: entry[0],
    )
    for time, group in groupby(every, key=lambda entry: entry[0]):
        yield from placed(time, [(name, point) for _, name, point in group])


def placed(time: float, moved: Sequence[tuple[str, TrackPoint]]) -> Iterator[ChannelMessage]:
    """Yield the poses of the agents that moved at a moment, by name."""
    for name, p in moved:
        yield _pose(name, POSE, p)
    transforms = [
        {
            "timestamp": messages.stamp(p.time),
            "parent_frame_id": FRAME,
            "child_frame_id": name,
            "translation": messages.point(p.x, p.y),
            "rotation": messages.turned(p.heading),
        }
        for name, p in moved
    ]
    yield ChannelMessage(time, "/tf", "foxglove.FrameTransforms", {"transforms": transforms})


def sparse(track: Sequence[TrackPoint]) -> Iterator[TrackPoint]:
    """Yield the points of a track between which everything lies on straight lines.

    While somebody stands still: the first and the last point, and one for each `ALIVE_S`.
    """
    last = len(track) - 1
    for index, here in enumerate(track):
        before = track[max(0, index - 1)]
        after = track[min(last, index + 1)]
        still = before[1:] == here[1:] == after[1:]
        alive = here.time // ALIVE_S != before.time // ALIVE_S
        if not still or alive or index in (0, last):
            yield here


def activities(playback: Playback) -> Iterator[ChannelMessage]:
    """Yield the activity of each agent when it changes."""
    for name, track in playback.recorder.tracks.items():
        for mode, points in groupby(track, key=lambda p: p.mode):
            yield active(next(points).time, name, mode)


def active(time: float, name: str, mode: str) -> ChannelMessage:
    """Return the activity of an agent from now on."""
    return stamped(time, f"/{name}/{ACTIVITY}", "dva_sim.Activity", activity=mode)


def beliefs(playback: Playback) -> Iterator[ChannelMessage]:
    """Yield where operators believe the robots they drive to be."""
    for robot, views in playback.recorder.views.items():
        for view in views:
            yield _pose(playback.labels[robot], SEEN, view)


def fixes(playback: Playback) -> Iterator[ChannelMessage]:
    """Yield the robots' geographic positions, once a second."""
    for robot in playback.radii:
        name = playback.labels[robot]
        for _, points in groupby(playback.recorder.tracks[name], key=lambda p: p.time // 1.0):
            p = next(points)
            latitude, longitude = playback.site.frame.to_latlon(p.x, p.y)
            yield stamped(
                p.time,
                f"/{name}/{FIX}",
                "foxglove.LocationFix",
                frame_id=name,
                latitude=round(latitude, 9),
                longitude=round(longitude, 9),
                altitude=0.0,
                position_covariance=[0.0] * 9,
                position_covariance_type=0,
            )


def _pose(name: str, what: str, p: TrackPoint) -> ChannelMessage:
    pose = messages.pose(p.x, p.y, p.heading)
    return stamped(p.time, f"/{name}/{what}", "foxglove.PoseInFrame", frame_id=FRAME, pose=pose)


GRIDS = "/fields/"
PERIOD_S = 2.0  # interval between two grids [s]
CELL = 0.5  # side of a cell of a grid [m]
MAX_CELLS = 20_000  # maximum cells of a grid; a larger site has larger ones
DIGITS = 11  # binary digits kept of 23: one part in 4000, and half the file


def grids(playback: Playback) -> Iterator[ChannelMessage]:
    """Yield all fields of the run's hazards, as far as they are not zero."""
    real = sorted((i for i in playback.incidents if not i.false_alarm), key=lambda i: i.kind)
    whats = dict.fromkeys(what for incident in real for what in incident.hazard.shows)
    west, south, east, north = playback.site.extent
    cell = max(CELL, ((east - west) * (north - south) / MAX_CELLS) ** 0.5)
    first = min((incident.start for incident in real), default=math.inf)
    for number in range(int(playback.duration / PERIOD_S) + 1):
        time = number * PERIOD_S
        for what in whats if time > first else ():
            raster = playback.surroundings.raster(what, time, cell)
            if raster.values.max() > 0:
                yield _grid(what, time, cell, raster)


def _grid(what: str, time: float, cell: float, raster: Raster) -> ChannelMessage:
    rows, columns = np.nonzero(raster.values > 0)
    low = int(rows.min())
    left = int(columns.min())
    part = raster.values[low : rows.max() + 1, left : columns.max() + 1]
    west, _, south, _ = raster.extent
    return stamped(
        time,
        f"{GRIDS}{what}",
        "foxglove.Grid",
        frame_id=FRAME,
        pose=messages.pose(west + left * cell, south + low * cell),
        column_count=part.shape[1],
        cell_size={"x": round(cell, 6), "y": round(cell, 6)},
        row_stride=4 * part.shape[1],
        cell_stride=4,
        fields=[{"name": what, "offset": 0, "type": 7}],
        data=base64.b64encode(_shortened(part).tobytes()).decode(),
    )


def _shortened(values: NDArray[np.float64]) -> NDArray[np.float32]:
    """Round to 32-bit numbers whose last digits are zero, which compress far better."""
    bits = np.ascontiguousarray(values, "<f4").view("<u4")
    mask = np.uint32(0xFFFFFFFF << (23 - DIGITS) & 0xFFFFFFFF)
    return (bits & mask).view("<f4")


HAZARDS = "/hazards"
TOPIC = "/scene"
SCHEMA = "foxglove.SceneUpdate"
WALL = "#3a3f47"
INK = "#2b3038"
EXIT = "#2f7d32"
BODIES = {"robot": "#2f7fd0", "guard": "#2f7d32", "bystander": "#8c6d5a"}
TALL = {"robot": 0.5, "guard": 1.75, "bystander": 1.7}  # drawn heights [m]
PERSON = 0.25  # radius of a person [m]
STEP_S = 1.0  # interval between updates of a hazard [s]
MIN_GROWTH = 0.05  # least growth that is drawn again [m]


def bodies(playback: Playback) -> Iterator[ChannelMessage]:
    """Yield all robots and people, each in a frame that moves with it; those who leave vanish."""
    tracks = playback.recorder.tracks
    for name, track in tracks.items():
        robot = playback.robot_named(name)
        radius = PERSON if robot is None else playback.radii[robot]
        yield body(track[0].time, name, radius)
    gone = [(t[-1].time, n) for n, t in tracks.items() if t[-1].time < playback.duration]
    for time, name in sorted(gone):
        yield removal(time, name)


def ground(playback: Playback) -> Iterator[ChannelMessage]:
    """Yield the site, which stands still."""
    yield plan(playback.site)


def plan(site: Site) -> ChannelMessage:
    """Return walls, exits and names of rooms."""
    middles = [(r.name, r.polygon.mean(axis=0)) for r in site.rooms]
    lines = [_lines(site.walls.tolist(), WALL), _lines([e.ends for e in site.exits], EXIT)]
    texts = [_words(name, float(x), float(y)) for name, (x, y) in middles]
    entity = _entity(0.0, "site", FRAME, lines=[line for line in lines if line["points"]])
    return _update(0.0, entity | {"texts": texts})


def hazards(playback: Playback) -> Iterator[ChannelMessage]:
    """Yield real hazards, from their beginning to their end or that of the run."""
    for number, incident, until in _real(playback):
        drawn = -math.inf
        for time in _steps(incident.start, until):
            radius = incident.hazard.radius(time)
            if radius - drawn >= MIN_GROWTH:
                drawn = radius
                yield disc(time, number, incident.hazard)
        if until < playback.duration:
            yield contained(until, number)


def disc(time: float, number: int, hazard: Hazard) -> ChannelMessage:
    """Return a hazard as it is drawn, by its number from 1."""
    return _update(time, _disc(f"hazard-{number}", time, hazard, hazard.radius(time)))


def contained(time: float, number: int) -> ChannelMessage:
    """Return the removal of a hazard."""
    return removal(time, f"hazard-{number}")


def states(playback: Playback) -> Iterator[ChannelMessage]:
    """Yield the state of hazards as numbers, once a second."""
    for number, incident, until in _real(playback):
        for time in _steps(incident.start, until):
            yield state(time, number, incident)


def state(time: float, number: int, incident: RunHazard) -> ChannelMessage:
    """Return the state of a hazard, by its number from 1."""
    x, y = incident.hazard.position
    return stamped(
        time,
        HAZARDS,
        "dva_sim.Hazard",
        number=number,
        kind=incident.kind,
        room=incident.room,
        x_m=round(x, messages.PLACES),
        y_m=round(y, messages.PLACES),
        radius_m=round(incident.hazard.radius(time), 3),
        danger_radius_m=round(incident.hazard.danger_radius(time), 3),
        severity=round(incident.hazard.severity(time), 4),
    )


def _real(playback: Playback) -> Iterator[tuple[int, RunHazard, float]]:
    """Yield real hazards with their number from 1, and when they end [s]."""
    for number, incident in enumerate(playback.incidents):
        if not incident.false_alarm:
            until = playback.contained.get(number, math.inf)
            yield number + 1, incident, min(until, playback.duration)


def _steps(start: float, end: float) -> Iterator[float]:
    count = max(0, math.ceil((end - start) / STEP_S))
    return (start + number * STEP_S for number in range(count))


def _update(time: float, entity: dict[str, Any]) -> ChannelMessage:
    return ChannelMessage(time, TOPIC, SCHEMA, {"deletions": [], "entities": [entity]})


def removal(time: float, name: str) -> ChannelMessage:
    """Return the removal of a drawn body or hazard."""
    deletion = {"timestamp": messages.stamp(time), "type": 0, "id": name}
    return ChannelMessage(time, TOPIC, SCHEMA, {"deletions": [deletion], "entities": []})


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


def body(time: float, name: str, radius: float = PERSON) -> ChannelMessage:
    """Return a body in a frame that moves with it: `robot-1` is drawn as a robot."""
    kind = name.rpartition("-")[0]
    drawn_as = kind if kind in TALL else "robot"
    tall = TALL[drawn_as]
    paint = messages.colour(BODIES[drawn_as])
    arrow = {
        "pose": messages.pose(0.0, 0.0, z=tall),
        "shaft_length": radius,
        "shaft_diameter": radius / 4,
        "head_length": radius / 2,
        "head_diameter": radius / 2,
        "color": messages.colour(INK),
    }
    label = _words(name, 0.0, 0.0, tall + 0.3)
    parts = {"cylinders": [_cylinder(radius, tall, paint)], "arrows": [arrow], "texts": [label]}
    return _update(time, _entity(time, name, name, **parts))


def _disc(name: str, time: float, hazard: Hazard, radius: float) -> dict[str, Any]:
    paint = messages.colour(hazard.colour, 0.5)
    cylinder = _cylinder(radius, 0.05, paint, *hazard.position)
    return _entity(time, name, FRAME, cylinders=[cylinder])


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
        "pose": ORIGIN_POSE,
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


STORY = "/story"
MESSAGES = "/messages"
DECISIONS = "/decisions/"
AUDIT = "/audit"
FACTS = "/facts"
OBSERVED = "/observed/"
# Last parts of topics.
SCREEN = "screen"
COMMANDS = "commands"
CAMERA = "camera"
APPLIED = "applied"
LEVELS = {"safety": 3, "mode": 1, "link": 1}  # levels of Foxglove's log; all else is information


def story_messages(playback: Playback) -> Iterator[ChannelMessage]:
    """Yield the timeline."""
    for moment in playback.recorder.timeline:
        yield log(moment)


def log(moment: Moment) -> ChannelMessage:
    """Return a line of the timeline."""
    return stamped(
        moment.time,
        STORY,
        "foxglove.Log",
        level=LEVELS.get(moment.kind, 2),
        message=moment.what,
        name=moment.who,
        file="",
        line=0,
        kind=moment.kind,
    )


def facts(playback: Playback) -> Iterator[ChannelMessage]:
    """Yield decisions with author and reason, where people take part; else the story tells."""
    for fact in playback.facts if playback.people_decide else ():
        yield fact_message(fact)


def fact_message(fact: Fact) -> ChannelMessage:
    """Return a decision as a message; `fact_of` reads it again."""
    content = {_IN_SECONDS.get(name, name): value for name, value in fact.row().items()}
    del content["time"]
    return stamped(fact.time, FACTS, "dva_sim.Fact", **content)


def fact_of(time: float, content: Mapping[str, Any]) -> Fact:
    """Return the fact that a message of `facts` holds."""
    names = {written: name for name, written in _IN_SECONDS.items()}
    values = {
        names.get(name, name): value for name, value in content.items() if name != "timestamp"
    }
    return Fact(time=time, **values)


_IN_SECONDS = {name: f"{name}_s" for name in ("arrival_in", "advised_in", "waited")}


def network_messages(playback: Playback) -> Iterator[ChannelMessage]:
    """Yield all messages as they went onto the network, among the facts that rules are judged by.

    Of a camera's frame, what it stands for. What happens at the same moment stays in its order.
    """
    names = names_of(playback.labels)
    traffic = iter(playback.recorder.traffic or ())
    for fact in playback.recorder.facts or ():
        if not isinstance(fact, Sent):
            word, time, values = as_plain(fact)
            yield stamped(time, f"{OBSERVED}{word}", f"dva_sim.{type(fact).__name__}", **values)
        elif (sent := next(traffic, None)) is not None:
            yield sent_message(sent, names)
    for sent in traffic:
        yield sent_message(sent, names)


def sent_message(sent: Sent, names: Mapping[str, str]) -> ChannelMessage:
    """Return a message as it went onto the network; a camera frame without its picture."""
    if isinstance(sent.payload, CameraFrame):
        frame = sent.payload
        observation = frame.observation
        hazards = [
            {"kind": h.kind, "x_m": round(h.x, 2), "y_m": round(h.y, 2)}
            for h in observation.hazards
        ]
        return stamped(
            sent.time,
            f"/{names[sent.source]}/{CAMERA}",
            "dva_sim.Frame",
            to=names[sent.destination],
            size_bytes=sent.size,
            captured_s=frame.captured,
            tick_ms=observation.tick,
            x_m=round(observation.x, messages.PLACES),
            y_m=round(observation.y, messages.PLACES),
            heading_rad=round(observation.heading, messages.PLACES),
            visibility_m=round(observation.visibility, 2),
            hazards=hazards,
        )
    topic = f"{MESSAGES}/{names[sent.source]}/{names[sent.destination]}"
    return ChannelMessage(sent.time, topic, XML, sent.payload)


def decided(traces: Mapping[str, Sequence[tuple[float, str]]]) -> Iterator[ChannelMessage]:
    """Yield the traces of the agents that decide, line by line, by name."""
    for name, lines in traces.items():
        for time, line in lines:
            content = {"timestamp": messages.stamp(time), "line": line}
            yield ChannelMessage(time, f"{DECISIONS}{name}", "dva_sim.Decision", content)


def audited(rows: Sequence[tuple[float, Mapping[str, Any]]]) -> Iterator[ChannelMessage]:
    """Yield the rows of an audit log, with their hashes."""
    for time, row in rows:
        content = {"timestamp": messages.stamp(time), "row": json.dumps(row)}
        yield ChannelMessage(time, AUDIT, "dva_sim.Audited", content)


def names_of(labels: Mapping[str, str]) -> dict[str, str]:
    """Return a name for each id that fits into a topic, and that no other id has."""
    names: dict[str, str] = {}
    for device, label in labels.items():
        name = label.replace(" ", "-").replace("/", "-")
        taken = name in names.values()
        names[device] = f"{name}-{device.replace(':', '')}" if taken else name
    return names


def shown(playback: Playback) -> Iterator[ChannelMessage]:
    """Yield the frames that come onto the operators' screens."""
    labels = playback.labels
    names = names_of(playback.labels)
    for number, drive in enumerate(playback.recorder.drives):
        topic = f"/{names[drive.operator]}/{SCREEN}"
        whose = labels[drive.robot]
        for at in drive.frames:
            yield frame_shown(at.time, topic, number, whose, captured=at.captured)


def frame_shown(
    time: float, topic: str, drive: int, robot: str, *, captured: float
) -> ChannelMessage:
    """Return a frame that comes onto an operator's screen."""
    values = {"drive": drive, "robot": robot, "captured_s": captured}
    return stamped(time, topic, "dva_sim.Shown", **values)


def commanded(playback: Playback) -> Iterator[ChannelMessage]:
    """Yield the commands that phones make from the tilt."""
    labels = playback.labels
    names = names_of(playback.labels)
    for number, drive in enumerate(playback.recorder.drives):
        topic = f"/{names[drive.operator]}/{COMMANDS}"
        whose = labels[drive.robot]
        for time, speed, turn_rate in drive.commands:
            # Plus 0.0, since what is rounded to nothing may be -0.0.
            values = round(speed, 5) + 0.0, round(turn_rate, 5) + 0.0
            made = dict(zip(("speed_m_s", "turn_rate_rad_s"), values, strict=True))
            yield stamped(time, topic, "dva_sim.Command", drive=number, robot=whose, **made)


def applied(playback: Playback) -> Iterator[ChannelMessage]:
    """Yield the commands as robots apply them."""
    for drive in playback.recorder.drives:
        for a in drive.applied:
            yield stamped(
                a.time,
                f"/{playback.labels[drive.robot]}/{APPLIED}",
                "dva_sim.Applied",
                made_s=a.issued,
                sent_s=a.sent,
                arrived_s=a.arrived,
                until_s=messages.finite(a.until),
                captured_s=messages.finite(a.captured),
            )


EVENTS = "/events"
LATENCIES = "/latencies"
IMAGE = "image"


def event_message(time: float, event: Event) -> ChannelMessage:
    """Return the state of an event in a live run; recordings hold events as a whole."""
    return stamped(
        time,
        EVENTS,
        "dva_sim.Event",
        number=event.number,
        kind=event.kind,
        state=event.state.value,
        latitude_deg=event.position.latitude,
        longitude_deg=event.position.longitude,
        severity=event.severity,
        responder=event.responder,
        operator=event.operator,
        actor=event.actor,
        times_s=event.times,
    )


def latency(time: float, robot: str, what: str, *, delay: float) -> ChannelMessage:
    """Return the latency of a command or picture; recordings have `applied` and `shown`."""
    values = {"robot": robot, "what": what, "delay_s": round(delay, 6)}
    return stamped(time, LATENCIES, "dva_sim.Latency", **values)


def picture(time: float, name: str, jpeg: bytes) -> ChannelMessage:
    """Return a picture of a robot's camera."""
    data = base64.b64encode(jpeg).decode()
    schema = "foxglove.CompressedImage"
    return stamped(time, f"/{name}/{IMAGE}", schema, frame_id=name, format="jpeg", data=data)
