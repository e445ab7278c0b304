"""A recording as a bench that cannot act: what it holds besides messages, at any moment."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence

from dva_sim.agents.robot.controller import Mode
from dva_sim.console.bench import Status
from dva_sim.console.wire.rows import DoingShown, RobotRow
from dva_sim.kernel.recorder import DriveLog, TrackPoint
from dva_sim.protocol import messages as m
from dva_sim.recordings.event_moments import News, news_of
from dva_sim.recordings.pictures.moments import GONE
from dva_sim.simulation.full import Playback

ROUNDED = 0.0005  # rounding error of times on pages, in milliseconds [s]


class RecordedBench:
    """Bodies, drives, and the DVA's book of events; see `BenchView`.

    Args:
        playback: The recording.
        numbers: Numbers by which lines call everybody, by id and by label.

    Attributes:
        drives: Drives by their robots.
    """

    def __init__(self, playback: Playback, numbers: Mapping[str, int]) -> None:
        self._playback = playback
        self._numbers = numbers
        self._tracks = playback.recorder.tracks
        self._times = {label: [p.time for p in track] for label, track in self._tracks.items()}
        self.drives: dict[str, list[DriveLog]] = {}
        for drive in playback.recorder.drives:
            self.drives.setdefault(drive.robot, []).append(drive)

    def news(self) -> Iterator[News]:
        """Yield the messages about events that a control room would have been sent."""
        # A simulated DVA tells nothing where no control room listens: its book is all there is.
        return news_of(self._playback.events, self._playback.facts)

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
            has_left = now - before.time > GONE and before.time < self._playback.duration - GONE
            return None if has_left else (before, 0.0)
        return _between(before, after, now)

    def status(self, device: str, now: float) -> Status | None:
        """Return the status of a device by its track; None if it has none then."""
        if (place := self.place(self._playback.labels.get(device, ""), now)) is None:
            return None
        at, speed = place
        position = m.Position(*self._playback.site.frame.to_latlon(at.x, at.y))
        if device not in self._playback.radii:
            return m.PersonStatus(at.mode, position)
        return m.RobotStatus(at.mode, position, at.heading, speed, 0.0, 0)

    def people(self, now: float) -> list[DoingShown]:
        """Return the activities of people on foot."""
        return [
            {"i": self._numbers[label], "doing": at.mode}
            for label, at, _ in self.places(now)
            if self._playback.robot_named(label) is None
        ]

    def complete(self, robot: str, row: RobotRow, now: float) -> None:
        """Add to the row of a robot what is recorded of its drive."""
        del row["camera"]  # its pictures are drawn here
        drive = self.drive(robot, now)
        is_driven = row["mode"] == Mode.TELEOPERATION.value
        if drive is not None or not is_driven:  # else somebody drives of whom nothing is recorded
            speed, turn_rate = set_point(drive if is_driven else None, now)
            row["set_speed_mps"], row["set_turn_rate_radps"] = round(speed, 3), round(turn_rate, 3)
            row["commands_hz"] = commands_hz(drive, now) if drive is not None else 0.0

    def drive(self, robot: str, now: float) -> DriveLog | None:
        """Return the drive of a robot that goes on, if one does."""
        for drive in reversed(self.drives.get(robot, [])):
            if drive.ordered <= now:
                over = drive.ended is not None and drive.ended <= now
                return None if over else drive
        return None


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
