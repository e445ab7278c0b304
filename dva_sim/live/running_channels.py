"""The channels of a recording during a run, from the lines that its parts write."""

from __future__ import annotations

import re
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from typing import Any, Final

from dva_sim.agents.observation import CameraFrame
from dva_sim.core.events import Event, State
from dva_sim.kernel.recorder import Moment, Sent, TrackPoint
from dva_sim.kernel.streams import Streams
from dva_sim.live.judging import SENT_LINE, read_observation
from dva_sim.protocol.facts import Fact
from dva_sim.protocol.messages import Position
from dva_sim.recordings import channels
from dva_sim.recordings.messages import ChannelMessage
from dva_sim.simulation.full.hazards import draw_incidents
from dva_sim.simulation.full.stage import DVA
from dva_sim.simulation.scenario import Scenario, site_of

MAX_SENT: Final = 4000  # maximum commands whose sending time is remembered
HAZARD_S: Final = 1.0  # interval between two messages on hazards, in virtual time [s]
_NUMBER = re.compile(r"<MessageID>(\d{1,10})</MessageID>")

Line = list[Any]


class RunningChannels:
    """Converts lines to messages, one by one; see `RunLines` for the lines.

    Args:
        seed: Random seed.
    """

    def __init__(self, scenario: Scenario, seed: int) -> None:
        self.site = site_of(scenario, seed)
        self._frame_bytes = scenario.camera.frame_bytes
        incidents = draw_incidents(scenario.events, self.site, Streams(seed))
        self._real = {n: i for n, i in enumerate(incidents) if not i.false_alarm}
        self._labels = {DVA: "dva"}
        self._radii = dict[str, float]()
        self._contained = set[int]()
        self._looked_at = -HAZARD_S
        self._bodies = dict[str, TrackPoint]()
        self._modes = dict[str, str]()
        self._sent: OrderedDict[tuple[str, int], float] = OrderedDict()
        self._drives: dict[tuple[str, int], tuple[str, str]] = {}
        self.now = 0.0

    @property
    def robots(self) -> list[str]:
        """Return the names of the robots."""
        return [self._labels[robot] for robot in self._radii if robot in self._labels]

    def standing(self) -> Iterator[ChannelMessage]:
        """Yield the present state for a late viewer: the site, and all agents on it."""
        yield channels.plan(self.site)
        by_name = {self._labels.get(robot, ""): radius for robot, radius in self._radii.items()}
        for name in self._bodies:
            yield channels.body(self.now, name, by_name.get(name, channels.PERSON))
        for number, incident in self._real.items():
            if incident.start <= self.now and number not in self._contained:
                yield channels.disc(self.now, number + 1, incident.hazard)

    def take(self, line: Line) -> Iterator[ChannelMessage]:
        """Return the messages in a line; irrelevant lines have none."""
        word, *values = line
        if word == SENT_LINE:
            yield self._went(*values)
        elif word in READ:
            yield from getattr(self, f"_{word}")(*values) or ()

    # --- lines by their first word -------------------------------------------------------

    def _told(self, when: float, who: str, what: str, kind: str) -> Iterator[ChannelMessage]:
        yield channels.log(Moment(when, who, what, kind))

    def _team(self, labels: dict[str, str], radii: dict[str, float]) -> None:
        self._labels.update(labels)
        self._radii.update(radii)

    def _at(self, when: float, places: Sequence[Line]) -> Iterator[ChannelMessage]:
        self.now = when
        points = {name: TrackPoint(when, *rest) for name, *rest in places}
        moved = [
            (name, point)
            for name, point in points.items()
            if (before := self._bodies.get(name)) is None
            or before[1:] != point[1:]
            or when // channels.ALIVE_S != before.time // channels.ALIVE_S
        ]
        if moved:
            yield from channels.placed(when, moved)
        for name, point in moved:
            if self._modes.get(name) != point.mode:
                self._modes[name] = point.mode
                yield channels.active(when, name, point.mode)
        for name in self._bodies.keys() - points.keys():
            yield channels.removal(when, name)
            del self._bodies[name]
        new = [name for name in points if name not in self._bodies]
        self._bodies.update(moved)
        if new:
            yield from self.standing()
        if when - self._looked_at >= HAZARD_S:
            self._looked_at = when
            for number, incident in self._real.items():
                if incident.start <= when and number not in self._contained:
                    yield channels.disc(when, number + 1, incident.hazard)
                    yield channels.state(when, number + 1, incident)

    def _contains(self, number: int, when: float) -> Iterator[ChannelMessage]:
        self._contained.add(number)
        yield channels.contained(max(when, self.now), number + 1)

    def _event(
        self,
        number: int,
        kind: str,
        at: Sequence[float],
        state: str,
        times: dict[str, float],
        severity: float,
        sent: dict[str, Any],
    ) -> Iterator[ChannelMessage]:
        place = Position(*at)
        event = Event(number, kind, place, severity, state=State(state), times=times, **sent)
        yield channels.event_message(self.now, event)

    def _fact(self, held: dict[str, Any]) -> Iterator[ChannelMessage]:
        yield channels.fact_message(Fact(**held))

    def _went(self, when: float, source: str, destination: str, text: str) -> ChannelMessage:
        if "<SetTeleOp>" in text and (number := _NUMBER.search(text)) is not None:
            self._sent[source, int(number[1])] = when
            if len(self._sent) > MAX_SENT:
                self._sent.popitem(last=False)
        data = text.encode()
        return self._message(Sent(when, source, destination, len(data), data))

    def _frame(
        self, when: float, robot: str, seen: Line, captured: float
    ) -> Iterator[ChannelMessage]:
        frame = CameraFrame(read_observation(seen), captured)
        yield self._message(Sent(when, robot, DVA, self._frame_bytes, frame))

    def _message(self, sent: Sent) -> ChannelMessage:
        for end in (sent.source, sent.destination):
            self._labels.setdefault(end, end)
        return channels.sent_message(sent, channels.names_of(self._labels))

    def _seen(self, when: float, word: str, content: dict[str, Any]) -> Iterator[ChannelMessage]:
        """Yield the transit time of a command that a robot has accepted."""
        if word == "accepted":
            issued = self._sent.pop((content["source"], content["message_id"]), None)
            robot = self._labels.get(content["robot"], content["robot"])
            if issued is not None:
                yield channels.latency(when, robot, "command", delay=when - issued)

    def _drive(self, operator: str, number: int, facts: Line) -> None:
        robot, driver = facts[:2]
        names = {robot: robot, driver: driver} | self._labels
        self._drives[operator, number] = names[robot], names[driver]

    def _drove(
        self, operator: str, number: int, seen: Sequence[Line], made: Sequence[Line]
    ) -> Iterator[ChannelMessage]:
        robot, driver = self._drives.get((operator, number), ("", ""))
        topic = f"/{driver}/{channels.SCREEN}"
        for captured, when in seen if robot else ():
            yield channels.frame_shown(when, topic, number, robot, captured=captured)
            yield channels.latency(when, robot, "picture", delay=when - captured)


# First words of the lines that become messages; each has a method of its name.
READ: Final = "told", "team", "at", "contains", "event", "fact", "frame", "seen", "drive", "drove"
