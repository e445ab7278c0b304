"""A moment of a recording: where everybody was, and what a drive had come to."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence

from dva_sim.kernel.recorder import DriveLog, TrackPoint

GONE = 1.0  # whoever was not seen for so long has left the site [s]


class RecordedTracks:
    """Tracks of everybody.

    Args:
        tracks: By label, in order of time.
        duration: Length of the recording [s].
    """

    def __init__(self, tracks: Mapping[str, Sequence[TrackPoint]], duration: float) -> None:
        self._tracks = tracks
        self._duration = duration
        self._times = {label: [p.time for p in track] for label, track in tracks.items()}

    def places(self, now: float) -> Iterator[tuple[str, TrackPoint, float]]:
        """Yield everybody who is on the site: label, place, and speed [m/s]."""
        for label in self._tracks:
            if (place := self.place(label, now)) is not None:
                yield label, *place

    def place(self, label: str, now: float) -> tuple[TrackPoint, float] | None:
        """Return the place and speed [m/s] of somebody; None if they are not on the site."""
        track = self._tracks.get(label, ())
        index = bisect_right(self._times.get(label, ()), now)
        if index == 0:
            return None
        before, after = track[index - 1], track[min(index, len(track) - 1)]
        if after is before:
            has_left = now - before.time > GONE and before.time < self._duration - GONE
            return None if has_left else (before, 0.0)
        return _between(before, after, now)


def _between(before: TrackPoint, after: TrackPoint, now: float) -> tuple[TrackPoint, float]:
    """Interpolate between two points of a track: position, and speed [m/s]."""
    period = after.time - before.time
    share = 0.0 if period <= 0.0 else (now - before.time) / period
    x = before.x + share * (after.x - before.x)
    y = before.y + share * (after.y - before.y)
    turn = math.remainder(after.heading - before.heading, 2.0 * math.pi)
    speed = math.dist((before.x, before.y), (after.x, after.y)) / period if period > 0.0 else 0.0
    return TrackPoint(now, x, y, before.heading + share * turn, before.mode), speed


def set_point(drive: DriveLog | None, now: float) -> tuple[float, float]:
    """Return the newest command of a drive as made: speed [m/s] and turn rate [rad/s]."""
    commands: Sequence[tuple[float, float, float]] = () if drive is None else drive.commands
    index = bisect_right(commands, now, key=lambda command: command[0])
    return commands[index - 1][1:] if index else (0.0, 0.0)


def commands_hz(drive: DriveLog, now: float) -> float:
    """Return commands in the last second [1/s]."""
    first, last = (
        bisect_right(drive.commands, when, key=lambda command: command[0])
        for when in (now - 1.0, now)
    )
    return float(last - first)


def captured_at(drive: DriveLog, now: float) -> float | None:
    """Return when the operator's picture was taken [s]; None before the first."""
    index = bisect_right(drive.frames, now, key=lambda frame: frame.time)
    return drive.frames[index - 1].captured if index else None
