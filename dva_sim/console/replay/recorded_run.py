"""Recorded run at any moment, in the lines of a running world.

Values that a recording lacks, such as the charge of a battery, are not guessed: they are null.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable, Mapping
from typing import Any

from dva_sim.agents.control_room.history import EventHistory
from dva_sim.agents.robot.controller import Mode
from dva_sim.cameras.lines import FrameLine
from dva_sim.console.dva.device_rows import device_row
from dva_sim.console.replay.moments import (
    RecordedTracks,
    captured_at,
    commands_hz,
    set_point,
)
from dva_sim.console.replay.robot_lines import RobotLines, about
from dva_sim.console.robots.shown_mode import EMERGENCY
from dva_sim.console.system.things import UNKNOWN_PERSON, Things, camera_shown
from dva_sim.console.views.event_rows import event_row
from dva_sim.console.views.feed import moment_shown
from dva_sim.console.views.fields import HazardFeed
from dva_sim.console.views.scene import scene_of
from dva_sim.console.wire.events import EventsLine, HazardsLine, StorySoFarLine
from dva_sim.console.wire.rows import (
    DeviceRow,
    DevicesLine,
    DoingShown,
    PlacesLine,
    RobotRow,
    RobotWindowLine,
)
from dva_sim.console.wire.scenes import Happened, LinkShown, SceneLine, ThingBody
from dva_sim.kernel.errors import DvaSimError
from dva_sim.kernel.recorder import DriveLog, Sent
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode
from dva_sim.protocol.errors import ProtocolError
from dva_sim.protocol.facts import Fact
from dva_sim.recordings.event_moments import ROUNDED, statuses_at
from dva_sim.recordings.reading import Opened, RecordedHazard
from dva_sim.simulation.full.stage import dvas_of
from dva_sim.simulation.scenario import plan_of, robot_profiles

BEATING = 10.0  # over which heartbeats are counted [s]


class RecordedDevices:
    """Devices registered at the DVAs, and the times at which each was heard.

    Args:
        traffic: All messages of a run, by time.
        dvas: Labels of the DVAs, by id.
    """

    def __init__(self, traffic: Iterable[Sent], dvas: Mapping[str, str]) -> None:
        self._dvas = dvas
        self._registered: dict[str, list[tuple[float, str, m.Registration]]] = {}  # time, DVA
        self._heard: dict[str, list[float]] = {}
        self._beats: dict[str, list[float]] = {}
        for sent in traffic:
            if sent.destination in dvas and isinstance(sent.payload, bytes):
                self._take(sent)

    def _take(self, sent: Sent) -> None:
        who = sent.source
        data = sent.payload
        self._heard.setdefault(who, []).append(sent.time)
        if b"<HBMsg>" in data:
            self._beats.setdefault(who, []).append(sent.time)
        elif b"<RegMsg>" in data:
            try:
                body = decode(data).body
            except ProtocolError:
                return
            moves = self._registered.setdefault(who, [])
            is_news = not moves or moves[-1][1] != sent.destination  # else it is a renewal
            if isinstance(body, m.Registration) and is_news:
                moves.append((sent.time, sent.destination, body))

    def rows(
        self, now: float, robots: Mapping[str, RobotRow], doing: Mapping[str, str]
    ) -> list[DeviceRow]:
        """Return a row for each that had registered by then; what nobody recorded is open.

        Args:
            now: The moment [s].
            robots: State of robots, by id.
            doing: Activities of the people and robots on site, by label.
        """
        past = {who: [r for r in each if r[0] <= now] for who, each in self._registered.items()}
        return [
            self._row(who, *each[-1][1:], now, robots.get(who), doing)
            for who, each in past.items()
            if each
        ]

    def _row(
        self,
        who: str,
        dva: str,
        about: m.Registration,
        now: float,
        robot: RobotRow | None,
        doing: Mapping[str, str],
    ) -> DeviceRow:
        heard = self._heard[who]
        beats = self._beats.get(who, [])
        last = heard[bisect_right(heard, now) - 1]
        recent = bisect_right(beats, now) - bisect_right(beats, now - BEATING)
        row = device_row(
            m.Device(who, about.label, about.device_type, about.address),
            doing=doing.get(about.label),
            heard_s=now - last,
            silent=False,
            beats_hz=recent / BEATING,
            holder=None if robot is None else robot["holder"],
            holder_label=None if robot is None else robot["holder_label"],
            dva=None if who in self._dvas else self._dvas[dva],
        )
        row["link"] = None
        row["revocable"] = False
        row["commands_hz"] = None if robot is None else robot["commands_hz"]
        return row


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
        tracks: Tracks of everybody.
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
        self.tracks = RecordedTracks(playback.recorder.tracks, playback.duration)
        self._moments = [moment.time for moment in playback.recorder.timeline]
        self._drives: dict[str, list[DriveLog]] = {}
        for drive in playback.recorder.drives:
            self._drives.setdefault(drive.robot, []).append(drive)
        self._facts = playback.facts or _facts_heard(playback.recorder.traffic or ())
        self._windows: dict[str, RobotLines] = {}
        self._devices: RecordedDevices | None = None
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
        rows = [
            [
                self.numbers[label],
                *(round(100 * at.x), round(100 * at.y)),
                round(1000 * math.remainder(at.heading, 2.0 * math.pi)),
                round(1000 * speed),
            ]
            for label, at, speed in self.tracks.places(now)
        ]
        return {"k": "pos", "t": _ms(now), "p": rows}

    def robots(self, now: float) -> list[RobotRow]:
        """Return a row for each robot."""
        doing = {label: at.mode for label, at, _ in self.tracks.places(now)}
        return [
            self._robot(id_tag, doing.get(self.playback.labels[id_tag], ""), now)
            for id_tag in self.playback.radii
        ]

    def _robot(self, id_tag: str, mode: str, now: float) -> RobotRow:
        drive = self._drive_of(id_tag, now)
        speed, turn_rate = set_point(drive, now) if mode == Mode.TELEOPERATION else (0.0, 0.0)
        holder = None if drive is None else drive.operator
        emergency = self._lines_of(id_tag).emergency(now)
        return {
            "i": self.numbers[id_tag],
            "mode": EMERGENCY if emergency is not None else mode or "Idle",
            "emergency": emergency,
            "pattern": self.playback.scenario.pattern,
            "battery": None,
            "holder": holder,
            "holder_label": holder and self.playback.labels.get(holder, holder),
            "session_age_s": None if drive is None else round(now - drive.ordered, 1),
            "watchdog_left_s": None,
            "stop_reason": "",
            "set_speed_mps": round(speed, 3),
            "set_turn_rate_radps": round(turn_rate, 3),
            "queue": 0,
            "lost": 0,
            "commands_hz": 0.0 if drive is None else commands_hz(drive, now),
            "refused": 0,
            "timeouts": 0,
        }

    def window(self, id_tag: str, now: float) -> RobotWindowLine:
        """Return the contents of a robot's windows."""
        label = self.playback.labels[id_tag]
        here = {name: (at, speed) for name, at, speed in self.tracks.places(now)}
        before = {name: at for name, at, _ in self.tracks.places(now - TURNING)}
        at, speed = here.get(label, (None, 0.0))
        turned = 0.0
        if at is not None and label in before:
            turned = math.remainder(at.heading - before[label].heading, 2.0 * math.pi) / TURNING
        row = self._robot(id_tag, "" if at is None else at.mode, now)
        return self._lines_of(id_tag).line(row, speed, turned, now)

    def _lines_of(self, id_tag: str) -> RobotLines:
        if id_tag not in self._windows:
            playback = self.playback
            self._windows[id_tag] = RobotLines(
                self._drives.get(id_tag, []),
                playback.recorder.traffic or (),
                id_tag,
                playback.labels,
            )
        return self._windows[id_tag]

    def _drive_of(self, robot: str, now: float) -> DriveLog | None:
        """Return the drive that goes on, if one does."""
        for drive in reversed(self._drives.get(robot, [])):
            if drive.ordered <= now:
                over = drive.ended is not None and drive.ended <= now
                return None if over else drive
        return None

    def people(self, now: float) -> list[DoingShown]:
        """Return the activities of people on foot."""
        radii = {self.playback.labels[robot] for robot in self.playback.radii}
        return [
            {"i": self.numbers[label], "doing": at.mode}
            for label, at, _ in self.tracks.places(now)
            if label not in radii
        ]

    def devices(self, now: float) -> DevicesLine:
        """Return the table of devices."""
        if self._devices is None:
            traffic = self.playback.recorder.traffic or ()
            self._devices = RecordedDevices(traffic, dvas_of(self.playback.scenario))
        ids = {thing["i"]: thing["id"] for thing in self.things.all}
        robots = {ids[row["i"]]: row for row in self.robots(now)}
        doing = {label: at.mode for label, at, _ in self.tracks.places(now)}
        rows = self._devices.rows(now, robots, doing)
        return {"k": "devices", "t": _ms(now), "devices": rows}

    def hazards(self, now: float) -> HazardsLine:
        """Return where hazards are, and their effect on air and floor."""
        return self._hazards.line(_ms(now))

    def events(self, now: float) -> EventsLine:
        """Return the states of the events."""
        playback = self.playback
        site = playback.site
        lines = [
            event_row(status, received_at=now, labels=playback.labels, site=site, frame=site.frame)
            for status in statuses_at(playback.events, self._facts, now)
        ]
        return {"k": "events", "t": _ms(now), "events": lines}

    def histories(self, now: float) -> dict[int, EventHistory]:
        """Return the histories of events, as a control room would have heard them by then."""
        history_by_event: dict[int, EventHistory] = {}
        for event in self.playback.events:
            facts = [fact for fact in self._facts if fact.event == event.number]
            moments = {*event.times.values(), *(fact.time for fact in facts)}
            for moment in sorted(time for time in moments if time <= now + ROUNDED):
                history = history_by_event.setdefault(event.number, EventHistory())
                for status in statuses_at([event], facts, moment):
                    history.hear_status(status, moment)
                for fact in facts:
                    if fact.time == moment:
                        history.hear_record(fact.record(), moment)
        return history_by_event

    def story(self, now: float) -> StorySoFarLine:
        """Return the story up to a moment."""
        end = bisect_right(self._moments, now + ROUNDED)
        moments = self.playback.recorder.timeline[max(0, end - STORY_KEPT) : end]
        return {
            "k": "story_so_far",
            "t": _ms(now),
            "lines": [moment_shown(moment) for moment in moments],
        }

    # --- pictures --------------------------------------------------------------------------

    def frame(self, robot: str, number: int, now: float) -> FrameLine | None:
        """Return what a robot's operator saw at a moment, or if nobody drove, what its camera saw.

        The picture is drawn from where everybody was when it was taken.
        """
        drive = self._drive_of(robot, now)
        captured = now if drive is None else captured_at(drive, now)
        if captured is None:
            return None
        label = self.playback.labels[robot]
        there = list(self.tracks.places(captured))
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


def _facts_heard(traffic: Iterable[Sent]) -> list[Fact]:
    """Return the decisions that the DVA told the first control room that heard of any."""
    records = [
        (sent, body)
        for sent in traffic
        if isinstance(sent.payload, bytes)
        and b"<AuditRecord>" in sent.payload
        and isinstance(body := decode(sent.payload).body, m.AuditRecord)
    ]
    room = records[0][0].destination if records else ""
    heard = (Fact.of_record(body, sent.time) for sent, body in records if sent.destination == room)
    return [*dict.fromkeys(heard)]  # one that it subscribed to twice came twice


def _ms(time: float) -> int:
    return round(1000 * time)
