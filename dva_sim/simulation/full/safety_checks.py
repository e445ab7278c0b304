"""An audit of the safety rules from outside: what it can see itself, it believes nobody.

It listens on the network, so it knows which permissions the DVA really gave, when a robot was told
that one is over, and when an emergency reached it. It sees the bodies move, and it is told of every
command that a robot accepted, whoever sent it. `CHECKED` says which rules it holds that against.
"""

from __future__ import annotations

import re
from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

from dva_sim.agents.observation import CameraFrame
from dva_sim.agents.robot.controller import Mode
from dva_sim.agents.robot.robot import RobotAgent
from dva_sim.core.assignments import Rules
from dva_sim.core.events import ACT_STEPS, SAME_SPOT, STEPS, Event, EventBook, State, apart
from dva_sim.kernel.recorder import Accepted, Recorder
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode
from dva_sim.protocol.errors import ProtocolError
from dva_sim.simulation.scenario import RobotConfig
from dva_sim.worlds.bodies import G

MOVING = 0.05  # above this a robot is going somewhere [m/s]
SLACK = 1.02  # measured speeds may exceed a limit by so much
PENDING_SLACK = 2.0  # the desk looks at deadlines once a second [s]
OBEYS_WITHIN = 5.0  # a robot may wait so long, and ten messages' processing, until it obeys [s]
ROUNDED = 0.002  # of ticks [s]
MOST_KEPT = 1000  # of the newest messages to a robot, of its sessions, and of events
FELT_LATELY = 10.0  # a value of a robot's sensor may have confirmed an event [s]
FOUND: Final = frozenset({"confirmed", "contained", "refuted"})

CHECKED: Final = {
    "S1": "a robot moves by a command that arrived within the watchdog, behind it a picture within "
    "the age limit; slack: until it can have braked",
    "S2": "no command acts by a session that is over, no robot changes hands while it moves "
    f"({MOVING:g} m/s); slack: until it has confirmed the end, {OBEYS_WITHIN:g} s and ten messages",
    "S3": "nothing that came before an emergency moves a robot after it; slack: as for S1 and S2",
    "S4": f"speed and turn rate stay within the motors' limits; slack: {SLACK - 1:.0%}, and "
    f"{MOVING:g} m/s backwards",
    "S5": "every command, drive, mission and subscription has a permission that the DVA gave; "
    "no slack",
    "S6": "every report becomes an event, every event is in one state and the counts agree; none "
    f"waits, or is in one pair of hands, beyond its limit; slack: {PENDING_SLACK:g} s",
    "S7": "the times of every event are in order; no slack",
}
"""What the audit checks of each rule, at every message and twice a second."""
CHECKED_IN_SHORT: Final = (
    f"S1 to S7 checked twice a second; slack {SLACK - 1:.0%} of speed, {PENDING_SLACK:g} s of "
    f"deadlines, {OBEYS_WITHIN:g} s to obey"
)

Broken = tuple[str, str]
_COMMAND = re.compile(  # as everybody here writes them, but any other would do no harm
    rb"<MessageID>(\d+)</MessageID><SourceID>([^<]+)</SourceID>.*<SetTeleOp>", re.DOTALL
)
_OF_EVENTS = b"<EventReport>", b"<OrderProgress>", b"<SensorValue>", b"<RegMsg>"
_ORDERED = b"<Order>", b"<TaskAward>", b"<OrderProgress>"
_ORDERS = m.StartTeleOp | m.GoTo | m.Patrol | m.Inspect | m.ReturnToBase


class Held(NamedTuple):
    """A permission that the DVA gave: to whom, for what."""

    holder: str
    level: str
    sensors: tuple[str, ...]

    def allows(self, level: str) -> bool:
        """Whether it is for `teleoperation`, or for `missions`."""
        return self.level in (level, "both")


class Unanswered(NamedTuple):
    """A message that reached a robot, and is not answered yet; `source` has really sent it."""

    message: m.Message
    at: float
    source: str


class Doing(NamedTuple):
    """What a robot does by the newest order: `level` is as of a permission."""

    source: str
    session: int | None
    level: str


@dataclass
class Witness:
    """What is known of one robot without asking it; times in [s].

    Attributes:
        obeys_within: How long it may take to obey a message.
        sessions: By session: what the DVA gave.
        over: By session: from when on nobody may act by it.
        unanswered: By sender and number: what it has not answered yet.
        done: By sender, session and number: what it has said OK to; it may say so again.
        arrivals: By sender and number: when the newest commands arrived.
        stopped: When the newest emergency was obeyed, or should have been.
        ordered: When the newest order that was accepted had arrived.
        does: What that was, by sender and session; nothing once that was ended.
        owner: Who gave it.
        newest: Sender, session and number of the newest command that was accepted.
        allowed: Until when that lets it move.
        offset: What is to be added to its own clock to have the time.
        last_mission: When it was last on a mission that it may be on.
        looked: When it was last looked at.
    """

    obeys_within: float
    sessions: OrderedDict[int, Held] = field(default_factory=OrderedDict)
    over: dict[int, float] = field(default_factory=dict)
    unanswered: dict[tuple[str, int], Unanswered] = field(default_factory=dict)
    done: OrderedDict[tuple[str, int | None, int], None] = field(default_factory=OrderedDict)
    arrivals: OrderedDict[tuple[str, int], float] = field(default_factory=OrderedDict)
    stopped: float = -1.0
    ordered: float = -1.0
    does: Doing | None = None
    owner: str | None = None
    newest: tuple[str, int | None, int] = "", None, 0
    allowed: float = 0.0
    offset: float | None = None
    last_mission: float = 0.0
    looked: float = 0.0

    def given(self, session: int, held: Held) -> None:
        """The DVA gives a permission, or says that one holds."""
        self.sessions[session] = held
        if len(self.sessions) > MOST_KEPT:
            forgotten, _ = self.sessions.popitem(last=False)
            self.over.pop(forgotten, None)

    def permits(self, source: str, session: int | None, level: str, now: float) -> Broken | None:
        """Why a device must not act, or None."""
        held = self.sessions.get(session or 0)
        if held is None or held.holder != source or not held.allows(level):
            return "S5", f"obeys {source}, who has no permission for {level}"
        if now > self.over.get(session or 0, now):
            return "S2", f"obeys {source}, whose session was over"
        return None

    def may_be_on_a_mission(self, now: float) -> bool:
        """Whether it was sent on one, nobody has called it back, and the session holds."""
        does = self.does
        if does is None or does.level != "missions":
            return False
        return now <= self.over.get(does.session or 0, now)

    def ends(self, level: str, now: float) -> None:
        """What it does at a level is over: no command that came before moves it."""
        if level == "teleoperation":
            self.allowed = min(self.allowed, now)
        if self.does is not None and self.does.level == level:
            self.does = None

    def obeyed_before(self, message: m.Message) -> bool:
        """Whether it has said OK to that already, and only repeats it; noted from now on."""
        key = message.source, message.session, message.message_id
        if key in self.done:
            return True
        self.done[key] = None
        if len(self.done) > MOST_KEPT:
            self.done.popitem(last=False)
        return False


class SafetyAudit:
    """Holds what happens against the rules, and tells the recorder what breaks one.

    Args:
        recorder: Told what broke which rule.
        limits: Of the robots, as the scenario states them.
        robots: The robots by id; they may come later.
        book: The DVA's events.
        rules: Of the DVA.
        processing: Of a message at a robot, mean [s].
        dva: Its id.
        place_of: Where a device really is, by its id; None: it has no place.
        at_event: From how far somebody may see what was reported somewhere [m].
        tick: Of the motors [s].
    """

    def __init__(
        self,
        recorder: Recorder,
        *,
        limits: RobotConfig,
        robots: Mapping[str, RobotAgent],
        book: EventBook,
        rules: Rules,
        processing: float,
        dva: str,
        place_of: Callable[[str], m.Position | None],
        at_event: float,
        tick: float,
    ) -> None:
        self._recorder, self._limits, self._robots = recorder, limits, robots
        self._dva, self._obeys_within = dva, OBEYS_WITHIN + 10 * processing
        self._ledger, self._tick = EventLedger(book, rules, dva, place_of, at_event), tick
        self._witnesses: dict[str, Witness] = {}
        recorder.on_accepted = self.accepted

    def expect(self, processing: float) -> None:
        """From now on a message takes a robot's computer so long on average [s]."""
        self._obeys_within = OBEYS_WITHIN + 10 * processing
        for witness in self._witnesses.values():
            witness.obeys_within = max(witness.obeys_within, self._obeys_within)

    def witness(self, robot: str) -> Witness:
        """What is known of a robot."""
        known = self._witnesses.get(robot)
        if known is None:
            known = self._witnesses[robot] = Witness(self._obeys_within)
        return known

    # --- what is seen on the network -------------------------------------------------------

    def delivered(self, now: float, source: str, to: str, data: Any) -> None:
        """A message, or a picture, has reached somebody; `source` is who really sent it."""
        if isinstance(data, CameraFrame):
            if source in self._robots and (witness := self.witness(source)).offset is None:
                witness.offset = data.captured - data.observation.tick / 1000
        elif to in self._robots:
            self._reaches_robot(now, source, to, data)
        elif to == self._dva and any(what in data for what in _OF_EVENTS):
            self._ledger.hears(source, _read(data), now)

    def _reaches_robot(self, now: float, source: str, robot: str, data: bytes) -> None:
        witness = self.witness(robot)
        command = _COMMAND.search(data)
        if command is not None:
            witness.arrivals.setdefault((command[2].decode(), int(command[1])), now)
            if len(witness.arrivals) > MOST_KEPT:
                witness.arrivals.popitem(last=False)
            return
        message = _read(data)
        if message is None:
            return
        witness.unanswered.setdefault(
            (message.source, message.message_id), Unanswered(message, now, source)
        )
        if source == self._dva and isinstance(message.body, m.PermissionGrant):
            grant = message.body
            witness.given(grant.session, Held(grant.holder, grant.level, grant.sensors))

    def sent(self, now: float, source: str, to: str, data: Any) -> None:
        """A message has been sent."""
        if not isinstance(data, bytes):
            return
        if self._ledger.waits_for(source, data):
            self._report(self._ledger.told(source, _read(data)), now, "dva")
        if source == self._dva and to in self._robots and b"<Permission>" in data:
            self._says_who_holds(to, _read(data))
        witness = self._witnesses.get(source)
        if witness is None:
            return
        if witness.offset is None and b"<RobotStatus>" in data:
            status = _read(data)
            if status is not None and isinstance(status.body, m.RobotStatus):
                witness.offset = now - status.body.tick / 1000
        if not witness.unanswered:
            return
        reply = _read(data) if b"<reply>" in data else None
        if reply is None or not isinstance(reply.body, m.Reply):
            return
        asked = witness.unanswered.pop((reply.destination, reply.body.answers), None)
        if asked is not None:
            found = self._answered(witness, self._robots[source], asked, reply.body.code, now)
            self._report(found, now, self._robots[source].device.label)

    def _says_who_holds(self, robot: str, reply: m.Message | None) -> None:
        """The DVA has answered a robot that asked who holds it: that permission is good."""
        content = reply.body.content if reply and isinstance(reply.body, m.Reply) else None
        if isinstance(content, m.Permission):
            witness = self.witness(robot)
            witness.given(content.session, Held(content.device, content.level, content.sensors))
            witness.over.pop(content.session, None)

    def _answered(
        self, witness: Witness, robot: RobotAgent, asked: Unanswered, code: int, now: float
    ) -> Iterator[Broken]:
        """A robot has answered a request, and so has obeyed it or not."""
        message, body = asked.message, asked.message.body
        match body:
            case m.Emergency():
                witness.stopped = max(witness.stopped, now)
            case m.PermissionRevocation() if asked.source == self._dva:
                _end(witness, body.session, now)
            case m.PermissionGrant() if asked.source == self._dva and code == m.OK:
                self._replaced(witness, body, now)
        if code != m.OK or witness.obeyed_before(message):
            return
        if isinstance(body, m.StopTeleOp):
            witness.ends("teleoperation", now)
        elif isinstance(body, m.CancelMission):
            witness.ends("missions", now)
        elif isinstance(body, m.DevSub):
            held = witness.sessions.get(message.session or 0)
            mine = (
                held is not None and held.holder == message.source and body.sensor in held.sensors
            )
            if not mine or now > witness.over.get(message.session or 0, now):
                yield "S5", f"lets {message.source} read {body.sensor}"
        if isinstance(body, _ORDERS):
            yield from self._ordered(witness, robot, asked, now)

    def _ordered(
        self, witness: Witness, robot: RobotAgent, asked: Unanswered, now: float
    ) -> Iterator[Broken]:
        """A robot has begun to do what somebody asked for."""
        message = asked.message
        level = "teleoperation" if isinstance(message.body, m.StartTeleOp) else "missions"
        broken = witness.permits(message.source, message.session, level, now)
        if broken is not None:
            yield broken
        if asked.at < witness.stopped:
            if robot.controller.mode is not Mode.IDLE:  # else it repeats what it once said
                yield "S3", "obeys an order from before the emergency"
            return
        another = witness.owner not in (None, message.source)
        if another and abs(robot.body.speed) > MOVING and not _pushed(robot, now):
            yield "S2", f"goes over to {message.source} at {robot.body.speed:.2f} m/s"
        witness.owner, witness.ordered = message.source, asked.at
        witness.ends("teleoperation", now)
        witness.does = Doing(message.source, message.session, level)

    @staticmethod
    def _replaced(witness: Witness, grant: m.PermissionGrant, now: float) -> None:
        """A robot has a new holder: every other session to act on it is over."""
        if grant.level == "sensors":
            return
        for session, held in witness.sessions.items():
            if session < grant.session and held.level != "sensors":
                _end(witness, session, now)

    # --- what robots accept ----------------------------------------------------------------

    def accepted(self, command: Accepted) -> None:
        """A robot has accepted a command to drive, from whomever."""
        witness, limits = self.witness(command.robot), self._limits
        found: list[Broken] = []
        broken = witness.permits(command.source, command.session, "teleoperation", command.time)
        if broken is not None:
            found.append(broken)
        source, session, number = command.source, command.session, command.message_id
        if witness.stopped > max(witness.ordered, -0.5):
            found.append(("S3", "obeys a command after an emergency, before a new order"))
        elif witness.does != (source, session, "teleoperation"):
            found.append(("S1", f"obeys a command of {source}, who has not started, or stopped"))
        if witness.newest[:2] == (source, session) and number <= witness.newest[2]:
            found.append(("S1", "obeys a command again, or after a newer one"))
        witness.newest = source, session, number
        arrived = witness.arrivals.pop((source, number), command.arrived)
        witness.allowed = arrived + limits.watchdog_s
        if command.seen_tick is not None and witness.offset is None:
            found.append(("S1", "obeys a command behind a picture that it has sent nobody"))
        elif command.seen_tick is not None and witness.offset is not None:
            pictured = command.seen_tick / 1000 + witness.offset
            witness.allowed = min(witness.allowed, pictured + limits.max_age_s)
            if pictured > command.time + ROUNDED:
                found.append(("S1", "obeys a command behind a picture that was not taken yet"))
        self._report(found, command.time, self._robots[command.robot].device.label)

    # --- twice a second --------------------------------------------------------------------

    def check(self, now: float) -> None:
        """Hold what is seen now against the rules."""
        for id_tag, robot in self._robots.items():
            witness = self.witness(id_tag)
            self._overdue(witness, robot, now)
            found = [*broken_by_wish(witness, robot, now, self._tick)]
            found += broken_by_moving(witness, robot, now)
            self._report(found, now, robot.device.label)
            witness.looked = now
        self._report(self._ledger.check(now), now, "dva")

    def _overdue(self, witness: Witness, robot: RobotAgent, now: float) -> None:
        """What a robot has not answered in time counts as obeyed by then."""
        if not witness.unanswered:
            return
        late = [k for k, v in witness.unanswered.items() if now > v.at + witness.obeys_within]
        for key in late:
            message, at, source = witness.unanswered.pop(key)
            body, by = message.body, at + witness.obeys_within
            if not robot.body.powered:
                pass  # it has not heard it
            elif isinstance(body, m.Emergency):
                witness.stopped = max(witness.stopped, by)
            elif source != self._dva:
                pass
            elif isinstance(body, m.PermissionRevocation):
                _end(witness, body.session, by)
            elif isinstance(body, m.PermissionGrant):
                self._replaced(witness, body, by)

    def _report(self, found: Iterator[Broken] | list[Broken], now: float, who: str) -> None:
        for rule, what in found:
            self._recorder.violated(rule, now, who, what)


def broken_by_wish(
    witness: Witness, robot: RobotAgent, now: float, tick: float
) -> Iterator[Broken]:
    """Whether the motors were asked to move for longer than they may be; to a tick."""
    until = robot.body.asked_until
    if robot.controller.mode is Mode.MISSION and witness.may_be_on_a_mission(now):
        witness.last_mission = now
    elif until > max(witness.allowed + tick + ROUNDED, witness.looked):
        late = until - max(witness.allowed, witness.last_mission)
        yield "S1", f"is asked to move for {late:.2f} s longer than it may"


def broken_by_moving(witness: Witness, robot: RobotAgent, now: float) -> Iterator[Broken]:
    """Rules that the motion of a robot breaks now."""
    spec, speed, turn_rate = robot.body.spec, robot.body.speed, robot.body.turn_rate
    pushed, stopping = _pushed(robot, now), _stopping(robot)
    if abs(speed) > MOVING and not pushed:
        allowed = max(witness.allowed, witness.last_mission)
        if now > allowed + stopping:
            yield "S1", f"moves at {speed:.2f} m/s, {now - allowed:.1f} s after it had to stop"
        if witness.stopped > witness.ordered and now > witness.stopped + stopping:
            since = now - witness.stopped
            yield "S3", f"moves at {speed:.2f} m/s, {since:.1f} s after an emergency"
    # Comparisons that a nan fails, too; nobody drives backwards.
    forward = -MOVING <= speed <= spec.max_speed * SLACK
    within = forward and abs(turn_rate) <= spec.max_turn_rate * SLACK
    if not within and not pushed:
        yield "S4", f"moves at {speed:.2f} m/s and {turn_rate:.2f} rad/s"


def _stopping(robot: RobotAgent) -> float:
    """How long it takes a robot to stand from full speed [s]."""
    spec = robot.body.spec
    braking = min(spec.max_deceleration, robot.body.grip * G)
    return spec.max_speed / braking + 4 * spec.motor_time_constant


def _pushed(robot: RobotAgent, now: float) -> bool:
    """What another robot has pushed moves on, until its own brakes have stopped it."""
    return robot.body.last_touch + _stopping(robot) >= now


def _end(witness: Witness, session: int, when: float) -> None:
    witness.over[session] = min(when, witness.over.get(session, when))


def _read(data: bytes) -> m.Message | None:
    try:
        return decode(data)
    except ProtocolError:
        return None


class Seen(NamedTuple):
    """How an event stood when it was last looked at; times in [s].

    Attributes:
        found: What somebody has found, or done, there.
        hands: Who has it in hand, and for what; empty: nobody.
        since: From when on those do.
        waits: Since when it has waited for somebody who takes it up.
    """

    found: frozenset[str]
    hands: tuple[str | None, ...]
    since: float
    waits: float


@dataclass
class Word:
    """What was said about one event on the network.

    Attributes:
        ordered: Who was sent there, and what goes there for them: a robot, or they themselves.
        taken: Who has taken that up.
        loose: Who has it no longer, by its own word or the DVA's, or has started anew.
        busy: Whether somebody has taken it up since it was last looked at.
        anew: Whether somebody loose was sent there since then.
        found: What those at the place have found, or done.
    """

    ordered: dict[str, str] = field(default_factory=dict)
    taken: set[str] = field(default_factory=set)
    loose: set[str] = field(default_factory=set)
    busy: bool = False
    anew: bool = False
    found: set[str] = field(default_factory=set)


class EventLedger:
    """A second book of the events, by what is said on the network, beside what the DVA's shows.

    Args:
        book: The DVA's.
        rules: How long an event may wait, or be in one pair of hands.
        dva: Id of the DVA.
        place_of: Where a device really is.
        at_event: Who is so near may have seen what there is [m].
    """

    def __init__(
        self,
        book: EventBook,
        rules: Rules,
        dva: str,
        place_of: Callable[[str], m.Position | None],
        at_event: float,
    ) -> None:
        self._book, self._rules, self._dva = book, rules, dva
        self._place_of, self._at_event = place_of, at_event
        self._asked: dict[tuple[str, int], m.EventReport] = {}
        self._orders: dict[tuple[str, int], int] = {}
        self._words: dict[int, Word] = {}
        self._felt: dict[str, float] = {}
        self._seen: dict[int, Seen] = {}
        self._open: set[int] = set()
        self._now = 0.0

    # --- what is said --------------------------------------------------------------------

    def hears(self, source: str, message: m.Message | None, now: float) -> None:
        """Something about events has reached the DVA; `source` has really sent it."""
        if message is None or message.source != source:
            return
        match message.body:
            case m.SensorValue():
                self._felt[source] = now
            case m.EventReport(event_id=None, finding="detected") as report:
                self._asked[source, message.message_id] = report
                _keep_newest(self._asked)
            case m.EventReport(event_id=int(number), finding=finding):
                self._finds(self._word(number), source, number, finding)
            case m.OrderProgress(event_id=number, state=state):
                if state != "declined":
                    self._takes_up(number, source)
                if state not in ("departed", "arrived"):
                    self._word(number).loose.add(source)
            case m.Registration():
                for word in self._words.values():
                    word.loose.add(source)

    def waits_for(self, source: str, data: bytes) -> bool:
        """Whether what is sent is worth reading: an order, or an answer that is waited for."""
        if source == self._dva:
            return any(what in data for what in _ORDERED) or _answers(self._asked, data)
        return _answers(self._orders, data)

    def told(self, source: str, message: m.Message | None) -> Iterator[Broken]:
        """The DVA sends an order, or somebody answers."""
        if message is None:
            return
        match message.body:
            case m.Order(event_id=number, device=device):
                self._sends(message, number, device or message.destination)
            case m.TaskAward(event_id=number):
                self._sends(message, number, message.destination)
            case m.OrderProgress(event_id=number) if source == self._dva:
                self._word(number).loose.add(message.destination)
            case m.Reply() as reply if source == self._dva:
                yield from self._answered(message.destination, reply)
            case m.Reply(answers=answers, code=code):
                ordered = self._orders.pop((source, answers), None)
                if ordered is not None and code == m.OK:
                    self._takes_up(ordered, source)

    def _word(self, number: int) -> Word:
        word = self._words.setdefault(number, Word())
        _keep_newest(self._words)
        return word

    def _sends(self, message: m.Message, number: int, goes: str) -> None:
        word, to = self._word(number), message.destination
        word.ordered[to], word.anew = goes, word.anew or to in word.loose
        word.taken.discard(to)
        word.loose.discard(to)
        self._orders[to, message.message_id] = number
        _keep_newest(self._orders)

    def _takes_up(self, number: int, device: str) -> None:
        word = self._word(number)
        if device in word.ordered:
            word.busy = True
            word.taken.add(device)

    def _finds(self, word: Word, source: str, number: int, finding: str) -> None:
        """It counts if who was sent there says so; what is confirmed, was looked at there."""
        goes, event = word.ordered.get(source), self._book.get(number)
        if goes is None or event is None:
            return
        self._takes_up(number, source)
        if finding != "confirmed" or self._is_near(goes, event):
            word.found.add(finding)

    def _is_near(self, device: str, event: Event) -> bool:
        place = self._place_of(device)
        return place is not None and apart(place, event.position) <= self._at_event

    def _answered(self, reporter: str, reply: m.Reply) -> Iterator[Broken]:
        """The DVA has taken a report: then there is an event."""
        report = self._asked.pop((reporter, reply.answers), None)
        if report is None or reply.code != m.OK:
            return
        near, kind = max(self._book.merge_distance, SAME_SPOT), report.kind
        known = (*self._book.open.values(), *self._book.closed.values())
        same = (e for e in known if e.kind == kind)
        if not any(apart(e.position, report.position) < near for e in same):
            yield "S6", f"a {report.kind} was reported, and is in no book"

    # --- what the book shows -------------------------------------------------------------

    def check(self, now: float) -> Iterator[Broken]:
        """What is wrong with the book now."""
        book = self._book
        if now < self._now:
            yield "S7", f"time runs back, from {self._now:g} to {now:g} s"
        self._now = now
        if sum(book.counts.values()) != book.total:
            yield "S6", f"{book.total} events, but {sum(book.counts.values())} in some state"
        if min(book.counts.values()) < 0:
            yield "S6", "a count of events is below zero"
        for state in (State.PENDING, State.ASSIGNED, State.ON_SCENE):
            count = sum(e.state is state for e in book.open.values())
            if count != book.counts[state]:
                yield "S6", f"{count} events are {state}, but {book.counts[state]} counted"
        for number in book.open.keys() & book.closed.keys():
            yield "S6", f"event {number} is open and closed"
        for number in self._open - book.open.keys() - book.closed.keys():
            yield "S6", f"event {number} was open, and is in no book"
        self._open = set(book.open)
        every = (*book.open.values(), *book.closed.values())
        seen, self._seen = self._seen, {}
        for event in every:
            yield from self._of_event(event, seen.get(event.number), now)

    def _of_event(self, event: Event, old: Seen | None, now: float) -> Iterator[Broken]:
        new, rules = self._look(event, old, now), self._rules
        self._seen[event.number] = new
        if event.waits_for is not None and now - new.waits > rules.escalate_after + PENDING_SLACK:
            yield "S6", f"event {event.number} is {event.state} after {now - new.waits:.0f} s"
        if new.hands and now - new.since > rules.order_limit + PENDING_SLACK:
            held = now - new.since
            yield "S6", f"event {event.number} is in one pair of hands for {held:.0f} s"
        for finding in new.found - (old.found if old else frozenset()):
            if not self._is_found(event, finding, now):
                yield "S6", f"event {event.number} is {finding}, and nobody there has said so"
        for steps in (STEPS, ACT_STEPS):
            times = [event.times[step] for step in steps if step in event.times]
            if times != sorted(times):
                yield "S7", f"times of event {event.number} are out of order"

    def _look(self, event: Event, old: Seen | None, now: float) -> Seen:
        """Waiting ends when somebody takes it up, and begins anew when it is confirmed."""
        found = FOUND & (event.times.keys() | {event.state.value})
        old = old or Seen(found - FOUND, (), now, now)
        word, hands = self._word(event.number), _in_hand(event)
        taken = bool(word.taken.intersection(hands))
        confirmed = "confirmed" in found - old.found
        waits = now if taken or word.busy or confirmed else old.waits
        since = old.since if hands == old.hands and not word.anew else now
        word.busy = word.anew = False
        return Seen(found, hands, since, waits)

    def _is_found(self, event: Event, finding: str, now: float) -> bool:
        """Whether who was sent there has said so; or a robot nearby may just have felt it."""
        if finding in self._word(event.number).found:
            return True
        lately = [robot for robot, when in self._felt.items() if now - when < FELT_LATELY]
        return finding == "confirmed" and any(self._is_near(r, event) for r in lately)


def _keep_newest(kept: dict[Any, Any]) -> None:
    if len(kept) > MOST_KEPT:
        del kept[next(iter(kept))]


def _answers(asked: dict[Any, Any], data: bytes) -> bool:
    return bool(asked) and b"<reply>" in data


def _in_hand(event: Event) -> tuple[str | None, ...]:
    """Who has an event in hand that is not settled; who stands by has not."""
    if event.state in (State.ASSIGNED, State.ON_SCENE):
        return "look", event.holder, event.responder
    if event.open and event.state is State.CONFIRMED and event.actor is not None:
        return "act", event.actor
    return ()
