"""Recorder of a run: timeline, data for measures, and breaches of safety rules."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.kernel.labels import visible
from dva_sim.kernel.makers import maker


class Moment(NamedTuple):
    """One line of the timeline.

    Attributes:
        time: Time [s].
        who: Agent that the line is about.
        what: Description in words.
        kind: `event`, `order`, `drive`, `mode`, `link` or `safety`.
    """

    time: float
    who: str
    what: str
    kind: str


class TrackPoint(NamedTuple):
    """Position [m], heading [rad] and activity of an agent."""

    time: float
    x: float
    y: float
    heading: float
    mode: str


class Sent(NamedTuple):
    """A message that went onto the network.

    Attributes:
        time: Time [s].
        source: Id of the sender.
        destination: Id of the receiver.
        size: Size with all framing [B].
        payload: XML as bytes, or a camera frame.
    """

    time: float
    source: str
    destination: str
    size: int
    payload: Any


class Issued(NamedTuple):
    """A command in transit.

    Attributes:
        made: Time at which the app made it from the tilt [s].
        sent: Time at which the pattern sent it [s].
        sample_age: Mean age of the tilt samples behind it when it was made [s].
        captured: Mean capture time of the pictures behind it [s].
    """

    made: float
    sent: float
    sample_age: float
    captured: float


make_issued = maker(Issued)


class Accepted(NamedTuple):
    """A command that a robot accepted.

    Attributes:
        robot: Id of the robot.
        source: Sender according to the message.
        session: Session according to the message.
        message_id: Number of the message.
        seen_tick: Tick of the newest picture its sender had seen, by the robot's clock [ms].
        arrived: Arrival time according to the robot [s].
        time: Time of acceptance [s].
    """

    robot: str
    source: str
    session: int | None
    message_id: int
    seen_tick: int | None
    arrived: float
    time: float


make_accepted = maker(Accepted)


class ByHand(NamedTuple):
    """Obeyed action of a person who drives a robot by hand, at the robot itself.

    Attributes:
        robot: Id of the robot.
        who: Name of the person.
        what: `takes`, `drives`, `lets go`, `stops` by the emergency button, `releases` after
            that, or `stands`, which the robot does by itself.
        time: Now [s].
    """

    robot: str
    who: str
    what: str
    time: float


class Applied(NamedTuple):
    """A command that took effect at the robot; times in [s].

    Attributes:
        issued: Time at which the operator's app made it from the tilt.
        sent: Time at which the pattern sent it.
        arrived: Time at which it reached the robot.
        time: Time at which it took effect.
        until: Time at which it expires, unless a newer one replaces it.
        sample_age: Mean age of the tilt samples behind it when it was made.
        captured: Mean capture time of the pictures behind it.
    """

    issued: float
    sent: float
    arrived: float
    time: float
    until: float
    sample_age: float
    captured: float


_make_applied = maker(Applied)


class Shown(NamedTuple):
    """A frame on the operator's screen.

    Attributes:
        captured: Capture time [s].
        time: Display time [s].
        tick: Robot's clock at capture [ms].
    """

    captured: float
    time: float
    tick: int


make_shown = maker(Shown)


class Followed(NamedTuple):
    """Command that an operator wants, and the picture that it is based on; times in [s].

    Attributes:
        captured: Capture time of that picture.
        shown: Display time of that picture.
        time: Time from which it is wanted.
    """

    captured: float
    shown: float
    time: float


_make_followed = maker(Followed)


class DrivenBy(NamedTuple):
    """Driver of a drive, and the driver's equipment, where these differ from the scenario's.

    Attributes:
        person: Number, not a name; empty for a simulated person.
        pattern: Pattern that carried the commands.
        pipeline: Pipeline from tilt to commands.
        sensor_hz: Samples of a real phone per second, as measured.
        link_delay_s: One-way delay of the link, as last set during the drive [s].
        tour_time: Time for the leg of the guided tour that this drive ended, as its page measured
            it [s].
        contacts: Contacts of the robot during the drive; nan: not counted.
    """

    person: str = ""
    pattern: str = ""
    pipeline: str = ""
    sensor_hz: float = math.nan
    link_delay_s: float = math.nan
    tour_time: float = math.nan
    contacts: float = math.nan


SIMULATED = DrivenBy()


@dataclass
class DriveLog:
    """One drive of one robot by one operator.

    Attributes:
        ordered: Time at which the operator got the order [s].
        started: Time at which the robot reported that teleoperation had started [s].
        ended: End of the drive [s].
        outcome: `confirmed`, `refuted`, `gave up`, `refused`, `lost link` or `timeout`.
        refused: Number of commands refused, by reply code, including those without a reply.
        refusal: Reply code that ended the drive, if any.
        disturbed: Time of the scenario's disturbance [s].
        round_trips: Time from each command's request to its reply [s]; empty for published
            commands.
        samples: Number of accelerometer samples in the batches that the phone's filter took.
        values: Number of such batches; 0 for a filter without batches.
        applied: Commands in the order in which they took effect, including those still in
            transit when the drive ended.
        hand_lag: Time constant with which the hand follows what is wanted [s].
        frames: Frames shown, in order.
        intents: Commands that the operator wanted, in order.
        workload: Workload measures of the way of steering, such as `waits`.
        taken_up: Time at which the operator turned to the order [s].
        attended: Start and end of each look at this robot's picture [s].
        looks_since: Start of the present look [s]; None if the operator looks elsewhere.
        turned_to: Number of times the operator turned to this drive from another order.
        waits_from: Time at which the robot reached the place where its operator has to judge [s].
        commands: Commands made from the tilt: time [s], speed [m/s], turn rate [rad/s].
        ways: Routes planned by the operator: time [s], points `(n, 2)` [m].
        by: Driver and equipment, where people take part.
    """

    robot: str
    operator: str
    event: int
    ordered: float
    started: float | None = None
    ended: float | None = None
    outcome: str = "timeout"
    sent: int = 0
    superseded: int = 0
    hand_lag: float = 0.0
    timeouts: int = 0
    alerts: int = 0
    refused: Counter[int] = field(default_factory=Counter)
    refusal: int | None = None
    disturbed: float | None = None
    round_trips: Sequence[float] = ()
    samples: int = 0
    values: int = 0
    applied: list[Applied] = field(default_factory=list)
    frames: list[Shown] = field(default_factory=list)
    intents: list[Followed] = field(default_factory=list)
    workload: dict[str, float] = field(default_factory=dict)
    taken_up: float | None = None
    attended: list[tuple[float, float]] = field(default_factory=list)
    looks_since: float | None = None
    turned_to: int = 0
    waits_from: float | None = None
    commands: list[tuple[float, float, float]] = field(default_factory=list)
    ways: list[tuple[float, NDArray[np.float64]]] = field(default_factory=list)
    by: DrivenBy = SIMULATED

    def followed(self, tick: int, now: float) -> float:
        """Record a wanted command based on the frame of a tick; return its capture time [s].

        Without such a frame it is based on the true state, whose capture time is `now`.
        """
        for frame in reversed(self.frames):
            if frame.tick == tick:
                self.intents.append(_make_followed(frame.captured, frame.time, now))
                return frame.captured
            if frame.tick < tick:
                break
        self.intents.append(Followed(now, now, now))
        return now


@dataclass
class Breach:
    """Breach of a safety rule by an agent.

    Attributes:
        rule: Name of the rule, such as `S1`.
        who: Name of the agent.
        time: Time of the first breach [s].
        what: The first breach in words.
        count: Number of breaches seen.
    """

    rule: str
    who: str
    time: float
    what: str
    count: int = 0


class Recorder:
    """Collector of the data of a run, without any decisions.

    Args:
        keep_traffic: Also keep each message sent, for pictures and recordings.

    Attributes:
        messages: Number of messages sent.
        bytes: Size of all messages sent [B].
        counters: Other counts, by name.
        broken: First breach of each rule by each agent.
        facts: Facts for judging the safety rules, in order; None if not kept.
        on_accepted: Callback for each command that a robot accepts.
        on_hand: Callback for each action on a robot by hand.
    """

    def __init__(self, keep_traffic: bool = False) -> None:
        self.timeline: list[Moment] = []
        self.tracks: dict[str, list[TrackPoint]] = defaultdict(list)
        self.messages = self.bytes = 0
        self.counters: Counter[str] = Counter()
        self.violations: Counter[str] = Counter()
        self.broken: dict[tuple[str, str], Breach] = {}
        self.facts: list[Any] | None = None
        self.drives: list[DriveLog] = []
        self.newest_drive: dict[str, DriveLog] = {}  # by robot
        self.views: dict[str, list[TrackPoint]] = defaultdict(list)
        self.traffic: list[Sent] | None = [] if keep_traffic else None
        self.exposure: dict[str, float] = defaultdict(float)
        self._issued: dict[tuple[str, int], Issued] = {}
        self.on_accepted: Callable[[Accepted], object] = lambda _: None
        self.on_hand: Callable[[ByHand], object] = lambda _: None

    def tell(self, time: float, who: str, what: str, kind: str = "event") -> None:
        """Add a line to the timeline; what others say in it can hide nothing."""
        self.timeline.append(Moment(time, who, visible(what), kind))

    def view(self, time: float, robot: str, x: float, y: float, heading: float) -> None:
        """Record the position that an operator assumes for a robot, if pictures are wanted."""
        if self.traffic is not None:
            self.views[robot].append(TrackPoint(time, x, y, heading, "seen"))

    def message_sent(
        self, time: float, source: str, destination: str, size: int, payload: Any
    ) -> None:
        """Count a message, and keep it if pictures are wanted."""
        self.messages += 1
        self.bytes += size
        if self.traffic is not None:
            self.traffic.append(Sent(time, source, destination, size, payload))

    def command_issued(self, source: str, message_id: int, issued: Issued) -> None:
        """Record a command that leaves the phone."""
        self._issued[source, message_id] = issued

    def command_applied(
        self,
        drive: DriveLog,
        source: str,
        message_id: int,
        arrived: float,
        now: float,
        until: float,
    ) -> None:
        """Record a command that takes effect, and expires at `until` [s]."""
        issued = self._issued.pop((source, message_id), None)
        if issued is None:
            return
        made, sent, sample_age, captured = issued
        drive.applied.append(
            _make_applied(
                issued=made,
                sent=sent,
                arrived=arrived,
                time=now,
                until=until,
                sample_age=sample_age,
                captured=captured,
            )
        )

    def drive_ordered(self, drive: DriveLog) -> None:
        """Record that an operator was ordered to drive."""
        self.drives.append(drive)
        self.newest_drive[drive.robot] = drive

    def drive_begins(self, source: str) -> None:
        """Forget the commands of a phone's earlier drives that were never applied."""
        for key in [key for key in self._issued if key[0] == source]:
            del self._issued[key]

    def violated(self, rule: str, time: float, who: str, what: str) -> None:
        """Record a broken safety rule: always counted, reported once per rule and agent."""
        if not self.violations[rule]:
            self.tell(time, who, f"{rule} broken: {what}", "safety")
        self.violations[rule] += 1
        first = self.broken.setdefault((rule, who), Breach(rule, who, time, what))
        first.count += 1
