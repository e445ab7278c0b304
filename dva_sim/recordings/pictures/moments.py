"""A recorded run at any moment: agents, hazards and camera pictures."""

from __future__ import annotations

import math
from bisect import bisect_right
from typing import NamedTuple

from dva_sim.agents.people.bystander import INCAPACITATED
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.recorder import DriveLog, TrackPoint
from dva_sim.kernel.suggestions import unknown
from dva_sim.recordings.pictures.colours import ROBOT
from dva_sim.simulation.full import Playback
from dva_sim.simulation.full.hazards import RunHazard
from dva_sim.worlds.camera import Camera, Figure, SmokeView
from dva_sim.worlds.camera.picture import Picture
from dva_sim.worlds.geo import Pose

GONE = 1.0  # time after the end of a track from which a person counts as gone [s]
PERSON = 0.25  # radius of a person on foot, seen from above [m]
FRESH_FOR_S = 3.0  # age above which a picture is not shown any more [s]


def kind_of(label: str) -> str:
    """Return the kind of agent of a label: `robot-1` is a robot."""
    return label.rpartition("-")[0]


class Glance(NamedTuple):
    """Contents of an operator's screen.

    Attributes:
        robot: The robot that took the picture, by its label.
        captured: Capture time [s].
    """

    operator: str
    robot: str
    captured: float


class Moments:
    """A run that can be asked about any time.

    Args:
        recording: The run.
    """

    def __init__(self, recording: Playback) -> None:
        self.recording = recording
        self.tracks = recording.recorder.tracks
        self._times = {name: [p.time for p in track] for name, track in self.tracks.items()}
        real = sorted((i for i in recording.incidents if not i.false_alarm), key=lambda i: i.kind)
        self.looks = {incident.hazard.title: incident.hazard for incident in real}
        self.shown = {what for hazard in self.looks.values() for what in hazard.shows}
        self._cameras: dict[tuple[int, int], Camera] = {}

    # --- who is where ------------------------------------------------------------------

    def names(self, *kinds: str) -> list[str]:
        """Return all agents of some kinds that left a track."""
        return [name for kind in kinds for name in self.tracks if kind_of(name) == kind]

    def within(self, time: float) -> float:
        """Return the moment [s] to show at `time`: after the end of a run, its last one."""
        return min(time, self.recording.duration)

    def is_there(self, name: str, time: float) -> bool:
        """Return True if an agent is on the site at `time` [s]: its track ends when it leaves."""
        return time <= self._times[name][-1] + GONE

    def past(self, name: str, time: float) -> list[TrackPoint]:
        """Return the track of an agent up to `time` [s]."""
        track = self.tracks[name]
        index = bisect_right(self._times[name], time)
        return [*track[: max(1, index)], self.at(name, time)]

    def at(self, name: str, time: float) -> TrackPoint:
        """Return the position of an agent at `time` [s], interpolated between two samples."""
        track = self.tracks[name]
        index = bisect_right(self._times[name], time)
        before = track[max(0, index - 1)]
        after = track[min(index, len(track) - 1)]
        gap = after.time - before.time
        share = (time - before.time) / gap if gap > 0 else 0.0
        turn = (after.heading - before.heading + math.pi) % (2 * math.pi) - math.pi
        return TrackPoint(
            time,
            before.x + share * (after.x - before.x),
            before.y + share * (after.y - before.y),
            before.heading + share * turn,
            before.mode,
        )

    def going_on(self, time: float) -> list[RunHazard]:
        """Return the hazards that are active at `time` [s]."""
        contained = self.recording.contained
        return [
            incident
            for number, incident in enumerate(self.recording.incidents)
            if incident.is_there(time) and time < contained.get(number, math.inf)
        ]

    # --- what cameras see --------------------------------------------------------------

    def radius(self, name: str) -> float:
        """Return the radius of an agent, seen from above [m]."""
        robot = self.recording.robot_named(name)
        return PERSON if robot is None else self.recording.radii[robot]

    def glance(self, time: float) -> Glance | None:
        """Return the newest picture on a driving operator's screen, or None."""
        labels = self.recording.labels
        for drive in self.recording.recorder.drives:
            captured = _shown(drive, time)
            if captured is not None:
                return Glance(labels[drive.operator], labels[drive.robot], captured)
        return None

    def eye(self, robot: str, time: float, width: int = 320, height: int = 240) -> Picture:
        """Return the picture of a robot's camera at `time` [s].

        Raises:
            ConfigError: no such robot.
        """
        if robot not in self.names(ROBOT):
            raise ConfigError(unknown("robot", robot, self.names(ROBOT)))
        size = width, height
        if size not in self._cameras:
            angle = math.radians(self.recording.scenario.camera.field_of_view_deg)
            self._cameras[size] = Camera(self.recording.site, width, height, angle)
        here = self.at(robot, time)
        raster = self.recording.surroundings.raster
        smoke = None
        if "smoke" in self.shown:
            smoke = SmokeView(raster("smoke", time), raster("layer", time))
        others = (name for name in self.tracks if name != robot)
        return self._cameras[size].picture(
            Pose(here.x, here.y, here.heading),
            [self._figure(name, time) for name in others if self.is_there(name, time)],
            [incident.hazard for incident in self.going_on(time)],
            smoke,
            raster("water", time) if "water" in self.shown else None,
            time,
        )

    def _figure(self, name: str, time: float) -> Figure:
        here = self.at(name, time)
        number = name.rpartition("-")[2]
        return Figure(
            kind_of(name),
            here.x,
            here.y,
            here.heading,
            number=int(number) if number.isdigit() else 1,
            lying=here.mode == INCAPACITATED,
        )


def _shown(drive: DriveLog, time: float) -> float | None:
    """Return the time stamp of the picture on the driver's screen, or None."""
    if drive.started is None or not drive.started <= time < (drive.ended or math.inf):
        return None
    frames = [frame for frame in drive.frames if frame.time <= time]
    return frames[-1].captured if frames and time - frames[-1].time < FRESH_FOR_S else None
