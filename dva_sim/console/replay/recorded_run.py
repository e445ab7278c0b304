"""Recorded run at any moment, in the lines of a running world.

Values that a recording lacks, such as the charge of a battery, are not guessed: they are null.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from typing import Any

from dva_sim.cameras.lines import FrameLine
from dva_sim.console.dva.device_rows import listed_device_row
from dva_sim.console.replay.recorded_bench import ROUNDED, RecordedBench, captured_at
from dva_sim.console.replay.recorded_system import RecordedSystem
from dva_sim.console.replay.robot_lines import about, robot_window
from dva_sim.console.system.things import UNKNOWN_PERSON, Things, camera_shown
from dva_sim.console.views.event_rows import event_rows
from dva_sim.console.views.feed import moment_shown
from dva_sim.console.views.fields import HazardFeed
from dva_sim.console.views.published_rows import place_shown, robot_row
from dva_sim.console.views.scene import scene_of
from dva_sim.console.wire.events import EventsLine, HazardsLine, StorySoFarLine
from dva_sim.console.wire.rows import (
    DevicesLine,
    PlacesLine,
    RobotRow,
    RobotWindowLine,
)
from dva_sim.console.wire.scenes import Happened, LinkShown, SceneLine, ThingBody
from dva_sim.kernel.errors import DvaSimError
from dva_sim.recordings.reading import Opened, RecordedHazard
from dva_sim.simulation.scenario import plan_of, robot_profiles

TURNING = 0.25  # over which a turn rate is measured [s]
STORY_KEPT = 200  # lines of the story up to a moment
MAX_MARKS = 400  # moments to jump to
MARKED = ("event", "drive", "safety", "order")  # kinds of moments that are worth a jump


class RecordedRun:
    """A recording, by moments of its time [s].

    Args:
        opened: The recording.
        name: Name on the page.

    Attributes:
        playback: Content of the recording.
        things: Everybody.
        numbers: By which lines call them, by id and by label.
        duration: Length [s].
        audit: The rows of the console's audit log, if it had one.
        bench: Its bodies, drives, and the book of the DVA.
        system: Devices, DVAs and events, by their messages.
    """

    def __init__(self, opened: Opened, name: str) -> None:
        self.playback = playback = opened.playback
        self.name = name
        self.is_whole = opened.is_whole
        self.audit = opened.audit
        self.duration = playback.duration
        self.things = Things()
        self.numbers = self.things.numbers
        self._number_all()
        self._moments = [moment.time for moment in playback.recorder.timeline]
        self.bench = RecordedBench(playback, self.numbers)
        self.system = RecordedSystem(playback, self.bench)
        self._hazards = HazardFeed(
            playback.site,
            incidents=playback.incidents,
            surroundings=playback.surroundings,
            contained=playback.contained,
        )

    def _number_all(self) -> None:
        playback = self.playback
        limits = self._limits()
        camera = camera_shown(playback.scenario.camera)
        for number, (id_tag, radius) in enumerate(playback.radii.items()):
            speed, turn_rate = limits[number] if number < len(limits) else (0.5, math.pi / 6)
            body: ThingBody = {
                **about(radius),
                "max_speed_mps": speed,
                "max_turn_rate_radps": turn_rate,
                "camera": camera,
            }
            self.things.add(id_tag, playback.labels[id_tag], "robot", body)
        ids = {label: id_tag for id_tag, label in playback.labels.items()}
        for label in playback.recorder.tracks:
            if label not in self.numbers:
                kind = label.rpartition("-")[0]
                drawn_as = kind if kind in ("guard", "bystander") else "guard"
                self.things.add(ids.get(label, label), label, drawn_as, UNKNOWN_PERSON)
        for id_tag, label in playback.labels.items():
            if label not in self.numbers:
                kind = label.partition("-")[0]
                self.things.add(id_tag, label, kind if kind in ("dva", "operator") else "device")

    def _limits(self) -> list[tuple[float, float]]:
        """Return the robots' limits, if their profiles can still be found; loads no code for it."""
        try:
            profiles = robot_profiles(self.playback.scenario)
        except DvaSimError:
            return []
        return [(one.max_speed_mps, one.max_turn_rate_rad_s) for one in profiles]

    @property
    def is_drawn(self) -> bool:
        """True if cameras can be drawn: not if a hazard's class is the user's own."""
        own = (isinstance(i.hazard, RecordedHazard) for i in self.playback.incidents)
        return bool(self.playback.radii) and not any(own)

    # --- what does not change --------------------------------------------------------------

    def scene(self) -> SceneLine:
        """Return the first line."""
        playback = self.playback
        link = playback.scenario.link
        how: LinkShown = {
            "kind": "modelled",
            "delay_s": link.delay_s,
            "jitter_s": link.jitter_s,
            "loss": link.loss,
            "rate_bps": link.rate_bps,
            "processing_s": 0.0,
            "trace": link.trace_up or link.trace_down or link.delay_log,
        }
        line = scene_of(
            playback.scenario,
            site=playback.site,
            incidents=playback.incidents,
            things=self.things.all,
            link=how,
            regions=plan_of(playback.scenario.dva.regions, playback.site),
            name=self.name,
            seed=playback.seed,
        )
        line["replay"] = {
            "name": self.name,
            "duration_ms": round(1000 * self.duration),
            "whole": self.is_whole,
            "marks": self._marks(),
            "audit": bool(self.audit),
        }
        return line

    def _marks(self) -> list[Happened]:
        """Return moments to jump to, in order; of too many, evenly chosen ones."""
        timeline = self.playback.recorder.timeline
        marks = [moment for moment in timeline if moment.kind in MARKED]
        step = max(1, math.ceil(len(marks) / MAX_MARKS))
        return [moment_shown(moment) for moment in marks[::step]]

    # --- a moment --------------------------------------------------------------------------

    def positions(self, now: float) -> PlacesLine:
        """Return the positions of everybody."""
        return {
            "k": "pos",
            "t": _ms(now),
            "p": [
                place_shown(self.numbers[label], (at.x, at.y), at.heading, speed)
                for label, at, speed in self.bench.places(now)
            ],
        }

    def robots(self, now: float) -> list[RobotRow]:
        """Return a row for each robot."""
        return [self._robot(id_tag, now) for id_tag in self.playback.radii]

    def _robot(self, id_tag: str, now: float) -> RobotRow:
        """Return a robot as it said itself, with what is recorded of its drive."""
        state = self.system.device(id_tag, now)
        row = robot_row(state, self.numbers[id_tag], now, self.playback.labels)
        row["pattern"] = self.playback.scenario.pattern
        row["silent"] = self.system.is_lost(state, now)
        self.bench.complete(id_tag, row, now)
        return row

    def window(self, id_tag: str, now: float) -> RobotWindowLine:
        """Return the contents of a robot's windows."""
        label = self.playback.labels[id_tag]
        here = self.bench.place(label, now)
        before = self.bench.place(label, now - TURNING)
        turned = here[0].heading - before[0].heading if here and before else 0.0
        return robot_window(
            self._robot(id_tag, now),
            self.bench.drives.get(id_tag, ()),
            speed=here[1] if here else 0.0,
            turn_rate=math.remainder(turned, 2.0 * math.pi) / TURNING,
            now=now,
        )

    def devices(self, now: float) -> DevicesLine:
        """Return the table of devices."""
        system = self.system
        rows = [
            listed_device_row(
                state,
                now,
                self.playback.labels,
                is_lost=system.is_lost(state, now),
                is_fake=False,
                may_revoke=False,
            )
            for state in system.devices(now)
        ]
        return {"k": "devices", "t": _ms(now), "devices": rows}

    def hazards(self, now: float) -> HazardsLine:
        """Return where hazards are, and their effect on air and floor."""
        return self._hazards.line(_ms(now))

    def events(self, now: float) -> EventsLine:
        """Return the states of the events."""
        site = self.playback.site
        return {
            "k": "events",
            "t": _ms(now),
            "events": event_rows(self.system.room(now), self.playback.labels, site, site.frame),
        }

    def story(self, now: float) -> StorySoFarLine:
        """Return the story up to a moment."""
        end = bisect_right(self._moments, now + ROUNDED)
        moments = self.playback.recorder.timeline[max(0, end - STORY_KEPT) : end]
        return {"k": "story_so_far", "t": _ms(now), "lines": [*map(moment_shown, moments)]}

    # --- pictures --------------------------------------------------------------------------

    def frame(self, robot: str, number: int, now: float) -> FrameLine | None:
        """Return what a robot's operator saw at a moment, or if nobody drove, what its camera saw.

        The picture is drawn from where everybody was when it was taken.
        """
        drive = self.bench.drive(robot, now)
        captured = now if drive is None else captured_at(drive, now)
        if captured is None:
            return None
        label = self.playback.labels[robot]
        there = list(self.bench.places(captured))
        own = next((at for name, at, _ in there if name == label), None)
        if own is None:
            return None
        kinds = {thing["i"]: thing["kind"] for thing in self.things.all}
        figures: list[list[Any]] = [
            [
                *(kinds[self.numbers[name]], self.numbers[name]),
                *(round(at.x, 3), round(at.y, 3), round(at.heading, 3), at.mode),
            ]
            for name, at, _ in there
            if name != label
        ]
        return {
            "k": "frame",
            "t": _ms(now),
            "robot": self.numbers[robot],
            "number": number,
            "captured_ms": _ms(captured),
            "pose": [round(own.x, 3), round(own.y, 3), round(own.heading, 4)],
            "figures": figures,
        }


def _ms(time: float) -> int:
    return round(1000 * time)
