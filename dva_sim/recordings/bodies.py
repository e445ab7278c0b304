"""Robots and people in a recording: where they are, what they do, where they are taken to be."""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import Any

from dva_sim.recorder import TrackPoint
from dva_sim.recordings import messages
from dva_sim.recordings.messages import FRAME, Message
from dva_sim.simulation import Playback

POSE, ACTIVITY, FIX, SEEN = "pose", "activity", "fix", "seen"  # last parts of topics
ALIVE_S = 1.0  # who stands still is told of so often, on whole multiples [s]


def poses(playback: Playback) -> Iterator[Message]:
    """Where everybody is: a pose for each who moves, and all of a moment in one transform."""
    tracks = playback.recorder.tracks.items()
    every = heapq.merge(
        *([(p.time, name, p) for p in sparse(track)] for name, track in tracks),
        key=lambda entry: entry[0],
    )
    for time, group in groupby(every, key=lambda entry: entry[0]):
        moved = [(name, point) for _, name, point in group]
        for name, p in moved:
            yield _pose(name, POSE, p)
        transforms = [_transform(name, p) for name, p in moved]
        yield Message(time, "/tf", "foxglove.FrameTransforms", {"transforms": transforms})


def sparse(track: Sequence[TrackPoint]) -> Iterator[TrackPoint]:
    """The points of a track between which everything lies on straight lines.

    Of somebody who stands still, the first and the last point, and one for each `ALIVE_S`.
    """
    last = len(track) - 1
    for index, here in enumerate(track):
        before, after = track[max(0, index - 1)], track[min(last, index + 1)]
        still = before[1:] == here[1:] == after[1:]
        alive = here.time // ALIVE_S != before.time // ALIVE_S
        if not still or alive or index in (0, last):
            yield here


def activities(playback: Playback) -> Iterator[Message]:
    """What everybody does, told when it changes."""
    for name, track in playback.recorder.tracks.items():
        for mode, points in groupby(track, key=lambda p: p.mode):
            time = next(points).time
            content = {"timestamp": messages.stamp(time), "activity": mode}
            yield Message(time, f"/{name}/{ACTIVITY}", "dva_sim.Activity", content)


def beliefs(playback: Playback) -> Iterator[Message]:
    """Where operators take the robots to be that they drive."""
    for robot, views in playback.recorder.views.items():
        for seen in views:
            yield _pose(playback.labels[robot], SEEN, seen)


def fixes(playback: Playback) -> Iterator[Message]:
    """Where the robots are on earth, once a second."""
    for robot in playback.radii:
        name = playback.labels[robot]
        for _, points in groupby(playback.recorder.tracks[name], key=lambda p: p.time // 1.0):
            p = next(points)
            latitude, longitude = playback.site.frame.to_latlon(p.x, p.y)
            content = {
                "timestamp": messages.stamp(p.time),
                "frame_id": name,
                "latitude": round(latitude, 9),
                "longitude": round(longitude, 9),
                "altitude": 0.0,
                "position_covariance": [0.0] * 9,
                "position_covariance_type": 0,
            }
            yield Message(p.time, f"/{name}/{FIX}", "foxglove.LocationFix", content)


def _pose(name: str, what: str, p: TrackPoint) -> Message:
    content = {
        "timestamp": messages.stamp(p.time),
        "frame_id": FRAME,
        "pose": messages.pose(p.x, p.y, p.heading),
    }
    return Message(p.time, f"/{name}/{what}", "foxglove.PoseInFrame", content)


def _transform(name: str, p: TrackPoint) -> dict[str, Any]:
    return {
        "timestamp": messages.stamp(p.time),
        "parent_frame_id": FRAME,
        "child_frame_id": name,
        "translation": messages.point(p.x, p.y),
        "rotation": messages.turned(p.heading),
    }
