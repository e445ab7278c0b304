"""Audit of the safety rules from outside: it observes instead of trusting messages.

It takes the facts of a run (`observations`): the permissions that the DVA really gave, when a robot
learnt that one is over, and when an emergency reached it; how bodies move, and the set points of
their motors; every command that a robot accepted, and every manual drive at the robot itself.
`CHECKED` lists the rules. It uses nothing else of a run, so that a recording can be judged like the
run itself.
"""

from __future__ import annotations

import math
import re
from collections import OrderedDict, defaultdict, deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

from dva_sim.agents.observation import CameraFrame
from dva_sim.agents.robot.controller import Mode
from dva_sim.agents.robot.emergency_latch import DRIVE, PERSON
from dva_sim.kernel.recorder import Accepted, ByHand, Recorder
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode_if_valid
from dva_sim.simulation.full.event_ledger import (
    PENDING_SLACK,
    SILENT_AFTER,
    STEP_SLACK,
    EventLedger,
)
from dva_sim.simulation.full.observations import MotorLimits, Page, RobotMotion, SafetyTerms
from dva_sim.simulation.full.physical_world import PHYSICS_TICK
from dva_sim.simulation.full.regional_checks import RegionalRules
from dva_sim.simulation.full.takeovers import Takeovers
from dva_sim.worlds.bodies import G

MOVING = 0.05  # a faster robot counts as moving [m/s]
TURNING = 0.1  # a faster one counts as turning [rad/s]
SLACK = 1.02  # factor by which measured speeds may exceed a limit
OBEYS_WITHIN = 5.0  # time to obey a message, on top of ten messages' processing [s]
ROUNDED = 0.002  # rounding error of ticks [s]
RESTARTED = 10.0  # a robot whose clock has jumped by this much has restarted [s]
LEASE = 30.0  # time without a valid command after which a drive ends [s]
LEASE_SLACK = 2.0  # tolerance: a robot checks the lease once a second, the audit twice [s]
TELLS_WITHIN = 2.0  # a stopped robot reports that to the DVA every second; tolerance included [s]
ENDLESS = 3600.0  # a set point valid for this long counts as unlimited [s]
MAX_COPIES = 8  # maximum copies of a command, and registrations of a robot, that are told apart
MAX_KEPT = 1000  # maximum latest messages to a robot, sessions and events that are kept

CHECKED: Final = {
    "S1": "a robot is asked to move, and moves, by a started drive's newest command that arrived "
    "within the watchdog, behind it a picture within the age limit, by a mission that holds, or by "
    "the hand that has taken it, within the watchdog; "
    "slack: a tick of the motors, and until it can have braked",
    "S2": "no command acts by a session that is over, no robot changes hands while it moves "
    f"({MOVING:g} m/s, {TURNING:g} rad/s), none is driven by hand that somebody holds, nor by "
    "messages that is driven by hand; nobody keeps a robot of whom it hears nothing valid for "
    f"{LEASE:g} s, or the DVA nothing for {SILENT_AFTER:g} s; slack: until it has confirmed the "
    f"end, or its program restarts, {OBEYS_WITHIN:g} s and ten messages, {LEASE_SLACK:g} s of "
    "silence; of each session that is over the robot is told; one that a supervisor takes stands "
    "and knows it before it is given",
    "S3": "after an emergency nothing moves a robot until a person has asked the DVA to release it "
    "from the newest one, and the DVA has told it so, or somebody has at the robot itself; where "
    "the DVA knows nobody who may, until its holder starts it again; nothing from before moves "
    "it then, and the DVA sends none out that tells it that it is stopped; slack: as for S1 and S2",
    "S4": "speed and turn rate, and what the motors are asked for, stay within their limits; "
    f"slack: {SLACK - 1:.0%}, and "
    f"{MOVING:g} m/s backwards",
    "S5": "every command, drive, mission, stop, subscription has a permission that the DVA gave, "
    "and has confirmed to the robot when it asked; nobody gets a sensor's values who may not read "
    f"it; slack of sensors: {OBEYS_WITHIN:g} s and ten messages",
    "S6": "every report becomes an event, every event is in one state and the counts agree; none "
    "waits, or is in one pair of hands, beyond its limit, nor is given more time to wait by a "
    "restart; its severity is no lower than reported; who takes one up sets out and moves in "
    "time; nothing is found but by who was sent; "
    f"slack: {PENDING_SLACK:g} s, and how far one sees an event",
    "S7": "the times of every event are in order, and those at which they were noted; nobody is "
    f"noted as arrived who has not been there; slack: {STEP_SLACK:g} s, and how far one sees an "
    "event",
}
"""Checks of each rule, made at every message and twice a second."""
CHECKED_IN_SHORT: Final = (
    "S1 to S7 checked twice a second; slack a tick of the motors, and until a robot can brake; "
    f"{SLACK - 1:.0%} of speed, {PENDING_SLACK:g} s of deadlines, {OBEYS_WITHIN:g} s to obey"
)

Broken = tuple[str, str]
_ID = re.compile(r"\b[0-9A-F]{2}(?::[0-9A-F]{2}){5}\b")
_ORDERS_ROBOT = re.compile(b"<Order>|<GoTo>|<Patrol>|<Inspect>|<ReturnToBase")
_ORDERS = m.StartTeleOp | m.GoTo | m.Patrol | m.Inspect | m.ReturnToBase


class Held(NamedTuple):
    """Permission that the DVA gave: its holder, level and sensors."""

    holder: str
    level: str
    sensors: tuple[str, ...]

    @property
    def drives(self) -> bool:
        """True if it allows more than reading sensors."""
        return self.level != "sensors"

    def allows(self, level: str) -> bool:
        """Return True if it allows `teleoperation`, or `missions`."""
        return self.level in (level, "both")


class Unanswered(NamedTuple):
    """Message that reached a robot and is not answered yet; `source` is its true sender."""

    message: m.Message
    at: float
    source: str


@dataclass
class StopTold:
    """News of a robot's emergency at the DVA.

    Attributes:
        at: Time at which the robot last said that it is stopped [s].
        tick: Its own clock at the emergency [ms].
        released: Tick of the emergency for which somebody has asked for a release [ms].
    """

    at: float = -math.inf
    tick: int = -1
    released: int | None = None


class Doing(NamedTuple):
    """Activity of a robot by its newest order; `level` is that of a permission."""

    source: str
    session: int | None
    level: str


@dataclass
class Witness:
    """Facts about one robot that are known without asking it; times in [s].

    Attributes:
        obeys_within: Longest time to obey a message.
        sessions: By session: what the DVA gave.
        over: By session: from when on nobody may act by it.
        unanswered: By sender and number: what it has not answered yet.
        done: By sender, session and number: what it has said OK to; it may say so again.
        arrivals: By sender, number and session: when copies of the newest commands arrived.
        stopped: Time at which the newest emergency was obeyed, or should have been.
        ordered: Arrival time of the newest accepted order.
        does: Content of that order, by sender and session; None once it was ended.
        owner: Sender of that order.
        newest: Sender and session, and number, of the newest command that was accepted.
        allowed: Until when that lets it move.
        offset: Offset from its own clock to the time of the run.
        last_mission: Time at which it was last on a permitted mission.
        looked: Time of the last check.
        stood: Time at which it was last seen with no commanded motion.
        stood_before: Value of `stood` before the newest order was accepted.
        heard: Time at which a message of its driver, or of a manual driver, was last obeyed.
        confirmed: Sessions that the DVA has confirmed to it, when it asked.
        question: Number of its newest question to the DVA: only the answer to that counts. 0: it
            has restarted since.
        last_question: The same, over restarts.
        asked: Time at which that request was first sent.
        hand: Person in manual control, until released.
        let_go: Time at which the last one released it.
        latched: True from an emergency on until it is released.
        released_by: Rule of that: `person` or `drive`; None: the DVA has not said.
        emergency: Clock of the robot at the newest emergency, as it says [ms].
        reported_at: Time at which it first said that [s].
        questions: Numbers of its newest requests for a release.
        registrations: Newest ones at each DVA, by number and time stamp.
        reported: Number of its newest status.
        restarts: Number of restarts of its program that messages have shown.
        restarts_shown: Number of them that each kind of message has shown.
    """

    obeys_within: float
    sessions: OrderedDict[int, Held] = field(default_factory=OrderedDict)
    over: dict[int, float] = field(default_factory=dict)
    unanswered: dict[tuple[str, int], Unanswered] = field(default_factory=dict)
    done: OrderedDict[tuple[str, int | None, int], None] = field(default_factory=OrderedDict)
    arrivals: OrderedDict[tuple[str, int, int | None], deque[float]] = field(
        default_factory=OrderedDict
    )
    stopped: float = -1.0
    ordered: float = -1.0
    does: Doing | None = None
    owner: str | None = None
    newest: tuple[tuple[str, int | None], int] = ("", None), 0
    allowed: float = 0.0
    offset: float | None = None
    last_mission: float = 0.0
    looked: float = 0.0
    stood: float = -1.0
    stood_before: float = -1.0
    heard: float = 0.0
    confirmed: set[int] = field(default_factory=set)
    question: int = 0
    last_question: int = 0
    asked: float = 0.0
    hand: str | None = None
    let_go: float = -math.inf
    reported: int = 0
    restarts: int = 0
    restarts_shown: dict[str, int] = field(default_factory=dict)
    latched: bool = False
    released_by: m.ReleasedBy | None = None
    emergency: int | None = None
    reported_at: float = -math.inf
    questions: deque[int] = field(default_factory=lambda: deque(maxlen=MAX_COPIES))
    registrations: dict[str, deque[tuple[int, str]]] = field(
        default_factory=lambda: defaultdict(lambda: deque(maxlen=MAX_COPIES))
    )

    def given(self, session: int, right: Held) -> None:
        """Note that the DVA gives a permission, or says that one holds."""
        self.sessions[session] = right
        if len(self.sessions) > MAX_KEPT:
            forgotten, _ = self.sessions.popitem(last=False)
            self.over.pop(forgotten, None)
            self.confirmed.discard(forgotten)

    def permits(self, source: str, session: int | None, level: str, now: float) -> Broken | None:
        """Return why a device must not act, or None."""
        right = self.sessions.get(session or 0)
        if right is None or right.holder != source or not right.allows(level):
            return "S5", f"obeys {source}, who has no permission for {level}"
        if session not in self.confirmed:
            return "S5", f"obeys {source}, whose permission the DVA has not confirmed"
        if now > self.over.get(session or 0, now):
            return "S2", f"obeys {source}, whose session was over"
        return None

    def holder(self) -> str | None:
        """Return the holder of a confirmed session whose end the robot has not heard."""
        sessions = (s for s in self.sessions if s in self.confirmed and s not in self.over)
        return next((h.holder for h in map(self.sessions.get, sessions) if h and h.drives), None)

    def in_hand(self, now: float) -> bool:
        """Return True while somebody drives it by hand who was heard within the lease."""
        return self.hand is not None and now - self.heard <= LEASE

    def hears(self, now: float) -> None:
        """Note a valid command; a manual driver that was silent for the lease has let go before."""
        if not self.in_hand(now):
            self.hand = None
        self.heard = now

    def registers(self, dva: str, registration: tuple[int, str], now: float) -> None:
        """Note a registration, unless it is repeated; only those at one DVA are in order."""
        registrations = self.registrations[dva]
        if registration not in registrations:
            last = registrations[-1][0] if registrations else 0
            self._follows(f"registration at {dva}", last, registration[0], now)
            registrations.append(registration)

    def reports(self, number: int, now: float) -> None:
        """Note a status; each goes to several devices."""
        if number != self.reported:
            self._follows("status", self.reported, number, now)
            self.reported = number

    def asks(self, number: int, now: float) -> None:
        """Note a request to the DVA for the robot's holder, unless it is sent again."""
        if number != self.question:
            self._follows("question", self.last_question, number, now)
            self.question = self.last_question = number
            self.asked = now

    def _follows(self, sequence: str, last: int, number: int, now: float) -> None:
        """Note the next of some messages; a number that goes back shows that it has restarted.

        Then it knows no session any longer, unless the DVA confirms one when it asks. Over a bad
        link each kind of message may be the first to show that; the others do so later.
        """
        if number > last:
            return
        if self.restarts_shown.get(sequence, 0) == self.restarts:
            self.restarts += 1
            if self.question > number:
                self.question = 0
            for session in self.confirmed:
                _end(self, session, now)
        self.restarts_shown[sequence] = self.restarts

    def note_stand(self, when: float) -> None:
        """Note that no earlier order may move the robot; any manual control ends."""
        self.stopped = max(self.stopped, when)
        self.hand = None

    def note_stop(self, when: float, rule: m.ReleasedBy | None) -> None:
        """Note that an emergency has stopped it, or should have, until it is released.

        Args:
            when: Time [s].
            rule: Rule of releases, where the DVA is not asked.
        """
        self.note_stand(when)
        if not self.latched:
            self.released_by = rule
        self.latched = True

    def reports_emergency(self, message: m.Message, now: float, rule: m.ReleasedBy | None) -> None:
        """Note its report of an emergency: a new tick means that it has obeyed one."""
        body = message.body
        if not isinstance(body, m.RobotEmergency):
            return
        self.questions.append(message.message_id)
        if body.released is None and body.tick != self.emergency:
            self.emergency = body.tick
            self.reported_at = now
            self.note_stop(now, rule)

    def hears_release(self, answer: m.Reply) -> m.ByWhom | None:
        """Take an answer of the DVA; return who has released the robot, if that takes effect."""
        content = answer.content
        if answer.answers not in self.questions:
            return None
        if answer.code in (m.BAD_MESSAGE, m.NOT_SUPPORTED) and self.released_by is None:
            self.released_by = DRIVE
        if not isinstance(content, m.EmergencyRelease) or content.tick != self.emergency:
            return None
        if content.released is None:
            if content.released_by == PERSON or self.released_by is None:
                self.released_by = PERSON if content.released_by == PERSON else DRIVE
            return None
        if self.reported_at < self.stopped - ROUNDED:
            return None  # that was for an earlier emergency
        self.latched = False
        return content.released

    def starts_again(self) -> bool:
        """Take an order that could release it; False if it stays stopped."""
        if self.latched and self.released_by == DRIVE:
            self.latched = False
        return not self.latched

    def has_stood_since(self, when: float) -> bool:
        """Return True if an emergency that came then has been obeyed, though no answer was seen.

        A later one, or a copy, has stopped it; or it stood, and a later order was accepted.
        """
        return self.stopped >= when or (self.stood_before >= when and self.ordered > when)

    def may_be_on_a_mission(self, now: float) -> bool:
        """Return True if it was sent on a mission, not called back, and the session holds."""
        does = self.does
        if does is None or does.level != "missions":
            return False
        return now <= self.over.get(does.session or 0, now)

    def ends(self, level: str, now: float) -> None:
        """End its activity at a level: no earlier command moves it."""
        if level == "teleoperation":
            self.allowed = min(self.allowed, now)
        if self.does is not None and self.does.level == level:
            self.does = None

    def obeyed_before(self, message: m.Message) -> bool:
        """Return True if it has accepted that before and only repeats its OK; note it otherwise."""
        key = message.source, message.session, message.message_id
        if key in self.done:
            return True
        self.done[key] = None
        if len(self.done) > MAX_KEPT:
            self.done.popitem(last=False)
        return False


class SafetyAudit:
    """Audit that checks the facts of a run against the rules, and records breaches.

    It is an `Observer`.

    Args:
        recorder: Recorder of broken rules.
        terms: Limits that the run is held to.
        motion_of: Function that returns the motion of a robot now, by its id.
        place_of: True position of a device, by its id; None if it has none.
    """

    def __init__(
        self,
        recorder: Recorder,
        terms: SafetyTerms,
        motion_of: Callable[[str], RobotMotion],
        place_of: Callable[[str], m.Position | None],
    ) -> None:
        self._recorder = recorder
        self._motors = terms.motors
        self._labels = terms.labels
        self._watchdog = terms.watchdog
        self._max_age = terms.max_age
        self._release = terms.release
        self._asked_release: dict[tuple[str, str], float] = {}  # by robot and device: when last
        self._hears_dva = False
        self._told_stopped: dict[tuple[str, str], StopTold] = {}  # by DVA and robot
        self._orders_sent: deque[int] = deque(maxlen=MAX_KEPT)  # hashes; each may be sent again
        self._dvas = frozenset(terms.dvas)
        self._obeys_within = OBEYS_WITHIN + 10 * terms.processing
        self._motion_of = motion_of
        self._deaf = set[str]()
        self._ledgers: dict[str, EventLedger] = {}
        for dva in terms.dvas:
            what = terms.rules, dva, place_of, terms.at_event, self._name_of
            self._ledgers[dva] = EventLedger(*what, self._ledgers.values())
        self._witnesses: dict[str, Witness] = {}
        self._takeovers = {dva: Takeovers() for dva in terms.dvas}
        at = terms.region_at
        self._regional = None if at is None else RegionalRules(terms, at)

    def _name_of(self, device: str) -> str:
        return self._labels.get(device, device)

    def deafened(self, now: float, robot: str, deaf: bool) -> None:
        """Implement `Observer`: a robot that hangs is idle, hears nothing and loses its queue."""
        (self._deaf.add if deaf else self._deaf.discard)(robot)
        witness = self.witness(robot)
        witness.does = None
        witness.unanswered.clear()

    def slowed(self, now: float, processing: float) -> None:
        """Implement `Observer`."""
        self._obeys_within = OBEYS_WITHIN + 10 * processing
        for witness in self._witnesses.values():
            witness.obeys_within = max(witness.obeys_within, self._obeys_within)

    def witness(self, robot: str) -> Witness:
        """Return the facts about a robot."""
        witness = self._witnesses.get(robot)
        if witness is None:
            witness = self._witnesses[robot] = Witness(self._obeys_within)
        return witness

    # --- what is seen on the network -------------------------------------------------------

    def delivered(self, now: float, source: str, to: str, payload: Any) -> None:
        """Implement `Observer`."""
        if self._regional is not None and isinstance(payload, bytes):
            self._regional.delivered(now, source, to, payload)
        if to in self._motors:
            if to not in self._deaf:
                self._reaches_robot(now, source, to, payload)
        elif to in self._dvas and isinstance(payload, bytes):
            message = decode_if_valid(payload)
            self._hears_dva = True
            self._ledgers[to].hears(source, message, now)
            if message is not None and message.source == source:
                self._takeovers[to].hears(source, message)
                self._dva_hears_of_stops(to, message, now)

    def knows_places(self, known: bool) -> None:
        """Note whether places are known; without them, any finding is taken as made there."""
        for ledger in self._ledgers.values():
            ledger.knows_places = known

    def heard(self, now: float, device: str) -> None:
        """Note that a DVA has heard a device."""
        for ledger in self._ledgers.values():
            ledger.is_heard(device, now)

    def kept_nothing_for(self, seconds: float) -> None:
        """Implement `EventLedger.kept_nothing_for`; what robots said is forgotten, too."""
        for ledger in self._ledgers.values():
            ledger.kept_nothing_for(seconds)
        if seconds > 0.0:
            for told in self._told_stopped.values():
                told.at = -math.inf

    def _reaches_robot(self, now: float, source: str, robot: str, data: bytes) -> None:
        witness = self.witness(robot)
        message = decode_if_valid(data)
        if message is None or isinstance(message.body, m.Heartbeat):
            return
        if isinstance(message.body, m.Reply):
            if source in self._dvas:
                self._report([*self._released(robot, witness, message.body)], now, source)
            if source in self._dvas and message.body.answers == witness.question:
                breaches = [*_confirms_as_given(witness, message.body.content)]
                self._report(breaches, now, source)
                self._confirms(witness, message.body.content, now)
            return
        key = message.source, message.message_id
        if isinstance(message.body, m.SetTeleOp):
            # Whoever has restarted numbers from 1 again, and has other sessions.
            copies = deque[float](maxlen=MAX_COPIES)
            witness.arrivals.setdefault((*key, message.session), copies).append(now)
            if len(witness.arrivals) > MAX_KEPT:
                witness.arrivals.popitem(last=False)
            return
        witness.unanswered.setdefault(key, Unanswered(message, now, source))
        if source in self._dvas and isinstance(message.body, m.PermissionGrant):
            grant = message.body
            witness.given(grant.session, Held(grant.holder, grant.level, grant.sensors))

    def _dva_hears_of_stops(self, dva: str, message: m.Message, now: float) -> None:
        source = message.source
        body = message.body
        if isinstance(body, m.RobotEmergency) and source in self._motors:
            told = self._told_stopped.setdefault((dva, source), StopTold())
            told.at = -math.inf if body.tick == told.released else now
            told.tick = body.tick
        elif isinstance(body, m.ReleaseEmergency) and body.device in self._motors:
            told = self._told_stopped.setdefault((dva, body.device), StopTold())
            told.at = -math.inf
            told.released = told.tick
            self._asked_release[body.device, source] = now
            if len(self._asked_release) > MAX_KEPT:
                del self._asked_release[next(iter(self._asked_release))]

    def _sends_stopped(self, dva: str, to: str, data: bytes, now: float) -> Iterator[Broken]:
        """Yield an order for a robot that has just told the DVA that an emergency holds it."""
        is_new = hash(data) not in self._orders_sent
        self._orders_sent.append(hash(data))
        order = decode_if_valid(data) if is_new else None
        if order is None:
            return
        robot = order.body.device if isinstance(order.body, m.Order) else to
        told = self._told_stopped.get((dva, robot or ""))
        if told is not None and now - told.at < TELLS_WITHIN:
            yield "S3", f"sends out {robot}, which has told it that an emergency holds it"

    def _released(self, robot: str, witness: Witness, answer: m.Reply) -> Iterator[Broken]:
        """Yield a release that nobody asked for since the emergency."""
        released = witness.hears_release(answer)
        if released is None:
            return
        requested_at = self._asked_release.get((robot, released.device), -math.inf)
        if self._hears_dva and requested_at < witness.reported_at:
            yield "S3", f"releases {robot} for {released.device}, who has not asked for that"

    def sent(self, now: float, source: str, to: str, payload: Any) -> None:
        """Implement `Observer`."""
        if self._regional is not None and isinstance(payload, bytes):
            self._report([*self._regional.sent(now, source, to, payload)], now, source)
        if source in self._dvas:
            if isinstance(payload, bytes) and _ORDERS_ROBOT.search(payload) is not None:
                self._report([*self._sends_stopped(source, to, payload, now)], now, source)
            ledger = self._ledgers[source]
            if isinstance(payload, bytes) and ledger.waits_for(payload):
                ledger.says(decode_if_valid(payload))
            if (
                self._takeovers[source].waits
                and isinstance(payload, bytes)
                and b"<reply>" in payload
            ):
                answer = decode_if_valid(payload)
                if answer is not None and isinstance(answer.body, m.Reply):
                    self._takeovers[source].says(answer.destination, answer.body, now)
            return
        if source not in self._motors:
            return
        witness = self.witness(source)
        if not isinstance(payload, bytes):
            witness.offset = offset_of(payload) or witness.offset
            return
        if b"<RegMsg>" in payload and (message := decode_if_valid(payload)) is not None:
            witness.registers(to, (message.message_id, message.timestamp), now)
        if b"<GetGrant" in payload and (question := decode_if_valid(payload)) is not None:
            witness.asks(question.message_id, now)
        if b"<RobotEmergency>" in payload and (report := decode_if_valid(payload)) is not None:
            witness.reports_emergency(report, now, self._release)
        if b"<RobotStatus>" in payload:
            _learn_from_status(witness, decode_if_valid(payload), now)
        if b"<SensorValue>" in payload and (value := decode_if_valid(payload)) is not None:
            self._report([*_shown_to(witness, to, value.body, now)], now, source)
        if not witness.unanswered:
            return
        reply = decode_if_valid(payload) if b"<reply>" in payload else None
        if reply is None or not isinstance(reply.body, m.Reply):
            return
        request = witness.unanswered.pop((reply.destination, reply.body.answers), None)
        if request is not None:
            motion = self._motion_of(source)
            limits = self._motors[source]
            breaches = self._answered(witness, motion, limits, request, reply.body.code, now)
            self._report(breaches, now, source)

    @staticmethod
    def _confirms(witness: Witness, content: m.Content | None, now: float) -> None:
        """Note the DVA's answer on who may act on a robot: nobody else may drive it.

        What it has been told to be over since it asked stays over.
        """
        if not isinstance(content, m.Permission):
            return
        if witness.over.get(content.session, -math.inf) > witness.asked:
            return
        right = Held(content.device, content.level, content.sensors)
        witness.given(content.session, right)
        witness.over.pop(content.session, None)
        witness.confirmed.add(content.session)
        if right.drives:
            for session, earlier in witness.sessions.items():
                if session != content.session and earlier.drives:
                    _end(witness, session, now + witness.obeys_within)

    def _answered(
        self,
        witness: Witness,
        motion: RobotMotion,
        limits: MotorLimits,
        request: Unanswered,
        code: int,
        now: float,
    ) -> Iterator[Broken]:
        """Note that a robot has answered a request, and so has obeyed it or not."""
        message = request.message
        body = request.message.body
        match body:
            case m.Emergency():  # it acts whenever it comes, though its bytes never change
                witness.note_stop(now, self._release)
            case m.PermissionRevocation() if request.source in self._dvas:
                if len(self._dvas) == 1 or code != m.NOT_PERMITTED:  # a robot obeys one DVA
                    _end(witness, body.session, now)
        if code != m.OK:
            return
        if witness.obeyed_before(message):
            if isinstance(body, _ORDERS) and witness.does is None and motion.mode == _mode_of(body):
                yield "S1", f"does once more what {message.source} has asked for once"
            return
        if isinstance(body, m.StopTeleOp | m.CancelMission):
            level = "teleoperation" if isinstance(body, m.StopTeleOp) else "missions"
            broken = witness.permits(message.source, message.session, level, now)
            if broken is not None:
                yield broken
            witness.ends(level, now)
        elif isinstance(body, m.DevSub):
            right = witness.sessions.get(message.session or 0)
            mine = (
                right is not None
                and message.session in witness.confirmed
                and right.holder == message.source
                and body.sensor in right.sensors
            )
            if not mine or now > witness.over.get(message.session or 0, now):
                yield "S5", f"lets {message.source} read {body.sensor}"
        if isinstance(body, _ORDERS):
            yield from self._ordered(witness, motion, limits, request, now)

    def _ordered(
        self,
        witness: Witness,
        motion: RobotMotion,
        limits: MotorLimits,
        request: Unanswered,
        now: float,
    ) -> Iterator[Broken]:
        """Note that a robot has begun to carry out an order."""
        message = request.message
        level = "teleoperation" if isinstance(message.body, m.StartTeleOp) else "missions"
        broken = witness.permits(message.source, message.session, level, now)
        if broken is not None:
            yield broken
        if request.at < witness.stopped:
            if motion.mode != Mode.IDLE:  # else it repeats what it once said
                yield "S3", "obeys an order from before the emergency"
            return
        if witness.latched and (level == "missions" or not witness.starts_again()):
            yield "S3", f"obeys {message.source} before anybody has released it"
        if witness.in_hand(now) and motion.mode != Mode.IDLE:
            yield "S2", f"obeys {message.source} while it is driven by hand"
        another = witness.owner not in (None, message.source)
        if another and _goes(motion) and not _pushed(motion, limits, now):
            yield "S2", f"changed its driver to {message.source} while moving at {_pace(motion)}"
        witness.owner = message.source
        witness.ordered = request.at
        witness.hears(now)
        witness.stood_before = witness.stood
        does = Doing(message.source, message.session, level)
        if does != witness.does:  # a repeated start by the same driver continues the drive
            witness.ends("teleoperation", now)
        witness.does = does

    # --- what robots accept ----------------------------------------------------------------

    def accepted(self, command: Accepted) -> None:
        """Note that a robot has accepted a command to drive, from whomever."""
        witness = self.witness(command.robot)
        breaches: list[Broken] = []
        broken = witness.permits(command.source, command.session, "teleoperation", command.time)
        if broken is not None:
            breaches.append(broken)
        source = command.source
        session = command.session
        number = command.message_id
        if witness.stopped > witness.ordered and witness.stopped > -0.5:
            breaches.append(("S3", "obeys a command after an emergency, before a new order"))
        elif witness.in_hand(command.time):
            breaches.append(("S2", f"obeys {source} while it is driven by hand"))
        elif witness.does != (source, session, "teleoperation"):
            breaches.append(("S1", f"obeys a command of {source}, who has not started, or stopped"))
        speaker, newest = witness.newest
        if speaker == (source, session) and number <= newest:
            breaches.append(("S1", "obeys a command again, or after a newer one"))
        witness.newest = (source, session), number
        witness.hears(command.time)
        copies = witness.arrivals.pop((source, number, session), (command.arrived,))
        # Where newer commands replace waiting ones, a copy replaces the first arrival.
        known_by = (when for when in copies if when <= command.arrived + ROUNDED)
        arrived = max(known_by, default=copies[0])
        witness.allowed = arrived + self._watchdog
        if command.seen_tick is not None and witness.offset is None:
            breaches.append(("S1", "obeys a command behind a picture that it has sent nobody"))
        elif command.seen_tick is not None and witness.offset is not None:
            pictured = command.seen_tick / 1000 + witness.offset
            oldest = pictured + self._max_age
            witness.allowed = witness.allowed if witness.allowed < oldest else oldest
            if pictured > command.time + ROUNDED:
                breaches.append(("S1", "obeys a command behind a picture that was not taken yet"))
        if breaches:
            self._report(breaches, command.time, command.robot)

    def by_hand(self, done: ByHand) -> None:
        """Note manual control at the robot itself, which no message reports."""
        witness = self.witness(done.robot)
        now = done.time
        breaches = list[Broken]()
        if done.what == "takes":
            motion = self._motion_of(done.robot)
            limits = self._motors[done.robot]
            breaches = [*_taken_by_hand(witness, motion, limits, now)]
            if not witness.starts_again():
                breaches.append(("S3", "is taken by hand before anybody has released it"))
            witness.hand = witness.owner = done.who
            witness.ordered = witness.heard = now
            witness.ends("teleoperation", now)
            witness.does = None
        elif done.what == "lets go":
            witness.hand = None
            witness.allowed = min(witness.allowed, now)
            witness.let_go = now
        elif done.what == "stops":
            witness.note_stop(now, self._release)
        elif done.what == "stands":
            witness.note_stand(now)
        elif done.what == "releases":
            witness.latched = False
        else:
            if witness.stopped > witness.ordered:
                breaches.append(("S3", "obeys a hand after an emergency, before it is taken again"))
            elif witness.hand != done.who:
                breaches.append(("S1", "obeys a hand that has not taken it, or has let it go"))
            witness.allowed = now + self._watchdog
            witness.heard = now
        self._report(breaches, now, done.robot)

    # --- twice a second, or more often -----------------------------------------------------

    def moves(self, now: float, motions: Mapping[str, RobotMotion]) -> None:
        """Implement `Observer`."""
        for robot, motion in motions.items():
            witness = self.witness(robot)
            limits = self._motors[robot]
            self._overdue(witness, motion, now)
            breaches = [*broken_by_wish(witness, motion, now)]
            breaches += broken_by_moving(witness, motion, limits, now)
            breaches += self._overstays(witness, motion, now)
            self._report(breaches, now, robot)
            witness.looked = now
            if motion.asked_until <= now:
                witness.stood = now

    def shows(self, now: float, page: Page) -> None:
        """Implement `Observer`."""
        self._report([*self._ledgers[page.dva].check(now, page)], now, page.dva)
        self._report([*self._hands_over(page, now)], now, page.dva)
        if self._regional is not None:
            self._report([*self._regional.shows(now, page)], now, page.dva)

    def _hands_over(self, page: Page, now: float) -> Iterator[Broken]:
        """Yield robots that are handed over while they move or before they know of it."""
        for right, session in self._takeovers[page.dva].given(page.rights, now, page.works):
            witness = self.witness(right.robot)
            motion = self._motion_of(right.robot)
            to = f"hands {right.robot} over to {right.holder}"
            pushed = _pushed(motion, self._motors[right.robot], now)
            if session in witness.sessions and session not in witness.over:
                yield "S2", f"{to}, and it has not said that the last session is over"
            elif _goes(motion) and not pushed and not self._is_in_hand(right.robot, motion, now):
                yield "S2", f"{to} while it moves at {_pace(motion)}"

    def _is_in_hand(self, robot: str, motion: RobotMotion, now: float) -> bool:
        """Return True during manual control, and while the robot stops after it."""
        witness = self.witness(robot)
        stopping = _stopping(motion, self._motors[robot])
        return witness.in_hand(now) or now <= witness.let_go + stopping

    def _overstays(self, witness: Witness, motion: RobotMotion, now: float) -> Iterator[Broken]:
        """Yield a drive that goes on without a valid command for longer than the lease."""
        does = witness.does
        silent = now - witness.heard
        if does is None or does.level != "teleoperation" or silent <= LEASE + LEASE_SLACK:
            return
        witness.does = None  # whatever it obeys now needs a new order
        if motion.mode == Mode.TELEOPERATION and motion.powered:
            driver = self._name_of(does.source)
            yield (
                "S2",
                f"is still driven by {driver}, who has sent nothing valid for {silent:.0f} s",
            )

    def _overdue(self, witness: Witness, motion: RobotMotion, now: float) -> None:
        """Treat a request that a robot has not answered in time as obeyed by then."""
        if not motion.powered:
            witness.unanswered.clear()  # without power it has heard none of them
        if not witness.unanswered:
            return
        late = [k for k, v in witness.unanswered.items() if now > v.at + witness.obeys_within]
        for key in late:
            message, at, source = witness.unanswered.pop(key)
            body = message.body
            by = at + witness.obeys_within
            if isinstance(body, m.Emergency):
                if not witness.has_stood_since(at):
                    witness.note_stop(by, self._release)
            elif source not in self._dvas:
                pass
            elif isinstance(body, m.PermissionRevocation):
                _end(witness, body.session, by)

    def _report(self, breaches: Iterator[Broken] | list[Broken], now: float, device: str) -> None:
        for rule, what in breaches:
            named = _ID.sub(lambda match: self._name_of(match[0]), what)
            self._recorder.violated(rule, now, self._name_of(device), named)


def offset_of(picture: Any) -> float | None:
    """Return the offset of the run's clock from that of the robot that took a picture [s]."""
    if isinstance(picture, CameraFrame):
        return picture.captured - picture.observation.tick / 1000
    tick = picture.get("tick_ms")  # as a recording has it
    return None if tick is None else float(picture["captured_s"]) - float(tick) / 1000


def _learn_from_status(witness: Witness, status: m.Message | None, now: float) -> None:
    """Note the status's number, and the clock offset if it is unknown or the robot restarted."""
    if status is None or not isinstance(status.body, m.RobotStatus):
        return
    witness.reports(status.message_id, now)
    offset = now - status.body.tick / 1000
    if witness.offset is None or abs(offset - witness.offset) > RESTARTED:
        witness.offset = offset


def _confirms_as_given(witness: Witness, content: m.Content | None) -> Iterator[Broken]:
    """Yield a permission that the DVA confirms to a robot in another form than it gave it."""
    if not isinstance(content, m.Permission):
        return
    right = Held(content.device, content.level, content.sensors)
    grant = witness.sessions.get(content.session, right)
    if grant != right:
        yield "S5", f"gives {grant.level} to {grant.holder}, and confirms {right.level}"


def _shown_to(witness: Witness, reader: str, value: m.Body, now: float) -> Iterator[Broken]:
    """Yield a broken rule if a device gets a value of a sensor that it may not read."""
    if not isinstance(value, m.SensorValue):
        return
    for session in witness.confirmed:
        right = witness.sessions.get(session)
        over = witness.over.get(session, now)
        may = right is not None and right.holder == reader and value.sensor in right.sensors
        if may and now <= over + witness.obeys_within:
            return
    yield "S5", f"shows {value.sensor} to {reader}, who may not read it"


def _mode_of(order: m.Body) -> Mode:
    return Mode.TELEOPERATION if isinstance(order, m.StartTeleOp) else Mode.MISSION


def broken_by_wish(witness: Witness, motion: RobotMotion, now: float) -> Iterator[Broken]:
    """Yield the rules broken by a set point: valid too long, or after an emergency.

    Motors without power obey none, and messages sent meanwhile have not been received.
    """
    until = motion.asked_until
    is_sent = motion.mode == Mode.MISSION and witness.may_be_on_a_mission(now)
    if is_sent:
        witness.last_mission = now
    if not motion.powered:
        return
    if witness.stopped > witness.ordered and until > now > witness.stopped + PHYSICS_TICK:
        yield (
            "S3",
            f"is still commanded to move {now - witness.stopped:.1f} s after an emergency stop",
        )
    elif not is_sent and until > max(witness.allowed + PHYSICS_TICK + ROUNDED, witness.looked):
        late = until - max(witness.allowed, witness.last_mission)
        longer = f"for {late:.2f} s longer than allowed" if late < ENDLESS else "with no time limit"
        yield "S1", f"is commanded to move {longer}"


def broken_by_moving(
    witness: Witness, motion: RobotMotion, limits: MotorLimits, now: float
) -> list[Broken]:
    """Return the rules broken by a robot's motion now; the motion of a pushed robot breaks none."""
    speed = motion.speed
    turn_rate = motion.turn_rate
    breaches: list[Broken] = []
    if _goes(motion):
        allowed = max(witness.allowed, witness.last_mission)
        stopping = _stopping(motion, limits)
        if now > allowed + stopping:
            late = f"{now - allowed:.1f} s after it had to stop"
            breaches.append(("S1", f"moves at {_pace(motion)}, {late}"))
        if witness.stopped > witness.ordered and now > witness.stopped + stopping:
            late = f"{now - witness.stopped:.1f} s after an emergency"
            breaches.append(("S3", f"moves at {_pace(motion)}, {late}"))
    if not _is_within(speed, turn_rate, limits):
        breaches.append(("S4", f"moves at {_pace(motion)}"))
    if breaches and _pushed(motion, limits, now):
        breaches.clear()
    if not _is_within(motion.asked_speed, motion.asked_turn_rate, limits):
        command = f"{motion.asked_speed:.2f} m/s and {motion.asked_turn_rate:.2f} rad/s"
        breaches.append(("S4", f"its motors were commanded to {command}"))
    return breaches


def _goes(motion: RobotMotion) -> bool:
    """Return True if it drives or turns."""
    return abs(motion.speed) > MOVING or abs(motion.turn_rate) > TURNING


def _pace(motion: RobotMotion) -> str:
    return f"{motion.speed:.2f} m/s and {motion.turn_rate:.2f} rad/s"


def _is_within(speed: float, turn_rate: float, limits: MotorLimits) -> bool:
    """Return True within the limits, without driving backwards; NaN is outside."""
    forward = -MOVING <= speed <= limits.max_speed * SLACK
    return forward and abs(turn_rate) <= limits.max_turn_rate * SLACK


def _taken_by_hand(
    witness: Witness, motion: RobotMotion, limits: MotorLimits, now: float
) -> Iterator[Broken]:
    """Yield why a robot may not be taken by hand now: it moves, or somebody holds it."""
    holder = witness.holder()
    if holder is not None:
        yield "S2", f"was taken by hand while {holder} held it"
    if _goes(motion) and not _pushed(motion, limits, now):
        yield "S2", f"was taken by hand while moving at {_pace(motion)}"


def _stopping(motion: RobotMotion, limits: MotorLimits) -> float:
    """Return how long a robot takes to stop from full speed [s]."""
    braking = min(limits.max_deceleration, motion.grip * G)
    return limits.max_speed / braking + 4 * limits.time_constant


def _pushed(motion: RobotMotion, limits: MotorLimits, now: float) -> bool:
    """Return True while the brakes of a pushed robot have not stopped it yet.

    A robot pushed backwards during a drive is stopped by its motors, with half the deceleration.
    """
    times = 2 if motion.speed < -MOVING else 1
    return motion.touched + times * _stopping(motion, limits) >= now


def _end(witness: Witness, session: int, when: float) -> None:
    witness.over[session] = min(when, witness.over.get(session, when))
