"""An audit of the safety rules from outside: what it can see itself, it believes nobody.

It listens on the network, so it knows which permissions the DVA really gave, when a robot was told
that one is over, and when an emergency reached it. It sees the bodies move, and it is told of every
command that a robot accepted, whoever sent it, and of every hand that drove one at the robot
itself. `CHECKED` says which rules it holds that against.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

from dva_sim.agents.observation import CameraFrame
from dva_sim.agents.robot.controller import Mode
from dva_sim.agents.robot.robot import RobotAgent
from dva_sim.core.assignments import Rules
from dva_sim.core.events import EventBook
from dva_sim.kernel.recorder import Accepted, ByHand, Recorder
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode
from dva_sim.protocol.errors import ProtocolError
from dva_sim.simulation.full.event_ledger import PENDING_SLACK, EventLedger
from dva_sim.simulation.scenario import RobotConfig
from dva_sim.worlds.bodies import G

MOVING = 0.05  # above this a robot is going somewhere [m/s]
SLACK = 1.02  # measured speeds may exceed a limit by so much
OBEYS_WITHIN = 5.0  # a robot may wait so long, and ten messages' processing, until it obeys [s]
ROUNDED = 0.002  # of ticks [s]
MOST_KEPT = 1000  # of the newest messages to a robot, of its sessions, and of events

CHECKED: Final = {
    "S1": "a robot is asked to move, and moves, by a started drive's newest command that arrived "
    "within the watchdog, behind it a picture within the age limit, by a mission that holds, or by "
    "the hand that has taken it, within the watchdog; "
    "slack: a tick of the motors, and until it can have braked",
    "S2": "no command acts by a session that is over, no robot changes hands while it moves "
    f"({MOVING:g} m/s), none is driven by hand that somebody holds, nor by messages that is driven "
    "by hand; slack: until it has confirmed the end, {OBEYS_WITHIN:g} s and ten messages",
    "S3": "nothing that came before an emergency moves a robot after it; slack: as for S1 and S2",
    "S4": f"speed and turn rate stay within the motors' limits; slack: {SLACK - 1:.0%}, and "
    f"{MOVING:g} m/s backwards",
    "S5": "every command, drive, mission and subscription has a permission that the DVA gave; "
    "no slack",
    "S6": "every report becomes an event, every event is in one state and the counts agree; none "
    "waits, or is in one pair of hands, beyond its limit; nothing is found but by who was sent; "
    f"slack: {PENDING_SLACK:g} s, and how far one sees an event",
    "S7": "the times of every event are in order; no slack",
}
"""What the audit checks of each rule, at every message and twice a second."""
CHECKED_IN_SHORT: Final = (
    "S1 to S7 checked twice a second; slack a tick of the motors, and until a robot can brake; "
    f"{SLACK - 1:.0%} of speed, {PENDING_SLACK:g} s of deadlines, {OBEYS_WITHIN:g} s to obey"
)

Broken = tuple[str, str]
_ORDERS = m.StartTeleOp | m.GoTo | m.Patrol | m.Inspect | m.ReturnToBase


class Held(NamedTuple):
    """A permission that the DVA gave: to whom, for what."""

    holder: str
    level: str
    sensors: tuple[str, ...]

    @property
    def drives(self) -> bool:
        """Whether it is for more than reading sensors."""
        return self.level != "sensors"

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
        newest: Sender and session, and number, of the newest command that was accepted.
        allowed: Until when that lets it move.
        offset: What is to be added to its own clock to have the time.
        last_mission: When it was last on a mission that it may be on.
        looked: When it was last looked at.
        told: Sessions that it has agreed to.
        hand: Who has taken it by hand, and has not let it go since.
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
    newest: tuple[tuple[str, int | None], int] = ("", None), 0
    allowed: float = 0.0
    offset: float | None = None
    last_mission: float = 0.0
    looked: float = 0.0
    told: set[int] = field(default_factory=set)
    hand: str | None = None

    def given(self, session: int, held: Held) -> None:
        """The DVA gives a permission, or says that one holds."""
        self.sessions[session] = held
        if len(self.sessions) > MOST_KEPT:
            forgotten, _ = self.sessions.popitem(last=False)
            self.over.pop(forgotten, None)
            self.told.discard(forgotten)

    def permits(self, source: str, session: int | None, level: str, now: float) -> Broken | None:
        """Why a device must not act, or None."""
        held = self.sessions.get(session or 0)
        if held is None or held.holder != source or not held.allows(level):
            return "S5", f"obeys {source}, who has no permission for {level}"
        if now > self.over.get(session or 0, now):
            return "S2", f"obeys {source}, whose session was over"
        return None

    def holder(self) -> str | None:
        """Who holds it by a session that it has agreed to, and whose end it has not heard."""
        held = (s for s in self.sessions if s in self.told and s not in self.over)
        return next((h.holder for h in map(self.sessions.get, held) if h and h.drives), None)

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

    Attributes:
        deaf: Robots whose computer was made to hang: what reaches them now, they do not hear.
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
        self._recorder, self._robots = recorder, robots
        self._watchdog, self._max_age = limits.watchdog_s, limits.max_age_s
        self._dva, self._obeys_within = dva, OBEYS_WITHIN + 10 * processing
        self._ledger, self._tick = EventLedger(book, rules, dva, place_of, at_event), tick
        self._witnesses: dict[str, Witness] = {}
        self.deaf: set[str] = set()
        recorder.on_accepted, recorder.on_hand = self.accepted, self.by_hand

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
        elif to in self._robots and to not in self.deaf:
            self._reaches_robot(now, source, to, data)
        elif to == self._dva:
            self._ledger.hears(source, _read(data), now)

    def _reaches_robot(self, now: float, source: str, robot: str, data: bytes) -> None:
        witness, message = self.witness(robot), _read(data)
        if message is None:
            return
        key = message.source, message.message_id
        if isinstance(message.body, m.SetTeleOp):
            witness.arrivals.setdefault(key, now)
            if len(witness.arrivals) > MOST_KEPT:
                witness.arrivals.popitem(last=False)
            return
        witness.unanswered.setdefault(key, Unanswered(message, now, source))
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
            witness.told.add(content.session)

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
                witness.told.add(body.session)
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
        if witness.hand is not None and robot.controller.mode is not Mode.IDLE:
            yield "S2", f"obeys {message.source} while it is driven by hand"
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
            if session < grant.session and held.drives:
                _end(witness, session, now)

    # --- what robots accept ----------------------------------------------------------------

    def accepted(self, command: Accepted) -> None:
        """A robot has accepted a command to drive, from whomever."""
        witness = self.witness(command.robot)
        found: list[Broken] = []
        broken = witness.permits(command.source, command.session, "teleoperation", command.time)
        if broken is not None:
            found.append(broken)
        source, session, number = command.source, command.session, command.message_id
        if witness.stopped > witness.ordered and witness.stopped > -0.5:
            found.append(("S3", "obeys a command after an emergency, before a new order"))
        elif witness.hand is not None:
            found.append(("S2", f"obeys {source} while it is driven by hand"))
        elif witness.does != (source, session, "teleoperation"):
            found.append(("S1", f"obeys a command of {source}, who has not started, or stopped"))
        speaker, known = witness.newest
        if speaker == (source, session) and number <= known:
            found.append(("S1", "obeys a command again, or after a newer one"))
        witness.newest = (source, session), number
        arrived = witness.arrivals.pop((source, number), command.arrived)
        witness.allowed = arrived + self._watchdog
        if command.seen_tick is not None and witness.offset is None:
            found.append(("S1", "obeys a command behind a picture that it has sent nobody"))
        elif command.seen_tick is not None and witness.offset is not None:
            pictured = command.seen_tick / 1000 + witness.offset
            oldest = pictured + self._max_age
            witness.allowed = witness.allowed if witness.allowed < oldest else oldest
            if pictured > command.time + ROUNDED:
                found.append(("S1", "obeys a command behind a picture that was not taken yet"))
        if found:
            self._report(found, command.time, self._robots[command.robot].device.label)

    def by_hand(self, done: ByHand) -> None:
        """Somebody drives a robot at the robot itself: no message tells of that."""
        witness, robot, now = self.witness(done.robot), self._robots[done.robot], done.time
        found: list[Broken] = []
        if done.what == "takes":
            found = [*_taken_by_hand(witness, robot, now)]
            witness.hand = witness.owner = done.who
            witness.ordered = now
            witness.ends("teleoperation", now)
            witness.does = None
        elif done.what == "lets go":
            witness.hand, witness.allowed = None, min(witness.allowed, now)
        elif done.what == "stops":
            witness.stopped = max(witness.stopped, now)
        else:
            if witness.stopped > witness.ordered:
                found.append(("S3", "obeys a hand after an emergency, before it is taken anew"))
            elif witness.hand != done.who:
                found.append(("S1", "obeys a hand that has not taken it, or has let it go"))
            witness.allowed = now + self._watchdog
        self._report(found, now, robot.device.label)

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


def broken_by_moving(witness: Witness, robot: RobotAgent, now: float) -> list[Broken]:
    """Rules that the motion of a robot breaks now; what was pushed breaks none."""
    spec, speed, turn_rate = robot.body.spec, robot.body.speed, robot.body.turn_rate
    found: list[Broken] = []
    if abs(speed) > MOVING:
        allowed, stopping = max(witness.allowed, witness.last_mission), _stopping(robot)
        if now > allowed + stopping:
            late = f"{now - allowed:.1f} s after it had to stop"
            found.append(("S1", f"moves at {speed:.2f} m/s, {late}"))
        if witness.stopped > witness.ordered and now > witness.stopped + stopping:
            late = f"{now - witness.stopped:.1f} s after an emergency"
            found.append(("S3", f"moves at {speed:.2f} m/s, {late}"))
    # Comparisons that a nan fails, too; nobody drives backwards.
    forward = -MOVING <= speed <= spec.max_speed * SLACK
    if not (forward and abs(turn_rate) <= spec.max_turn_rate * SLACK):
        found.append(("S4", f"moves at {speed:.2f} m/s and {turn_rate:.2f} rad/s"))
    return [] if found and _pushed(robot, now) else found


def _taken_by_hand(witness: Witness, robot: RobotAgent, now: float) -> Iterator[Broken]:
    """Whether a robot may be taken by hand now: only one that stands, and that nobody holds."""
    holder = witness.holder()
    if holder is not None:
        yield "S2", f"goes into a hand while {holder} holds it"
    if abs(robot.body.speed) > MOVING and not _pushed(robot, now):
        yield "S2", f"goes into a hand at {robot.body.speed:.2f} m/s"


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
    """What whoever gets it reads, too: the same bytes are read once."""
    try:
        return decode(data)
    except ProtocolError:
        return None
