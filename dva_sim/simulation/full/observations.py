"""Facts that the safety rules are judged by: messages, commands, motion, and the DVA's book.

A virtual run reports them as they happen, a live run and a recording line by line; the audit takes
all of them alike. Of a decision nothing is asked: a robot that answers an emergency with OK has
sent a message, and its body shows whether it has stopped.
"""

from __future__ import annotations

import math
from collections import OrderedDict, defaultdict
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol

from dva_sim.agents.robot.command_queue import mean_of
from dva_sim.agents.robot.emergency_latch import DRIVE
from dva_sim.agents.robot.robot import RobotAgent
from dva_sim.core.assignments import Rules
from dva_sim.core.events import Event, EventTable, State
from dva_sim.core.regions.regional_dva import RegionalDva
from dva_sim.kernel.recorder import Accepted, ByHand, Sent
from dva_sim.protocol.messages import Position, ReleasedBy
from dva_sim.simulation.full.control_room import at_event_m
from dva_sim.simulation.full.dva_server import DvaAgent
from dva_sim.simulation.full.stage import DVA, dvas_of, id_of, label_of, region_finder, release_of
from dva_sim.simulation.scenario import Scenario, robot_profiles
from dva_sim.worlds.bodies import GRIP


class MotorLimits(NamedTuple):
    """Limits of a robot's motors: [m/s], [rad/s], [m/s^2], and their time constant [s]."""

    max_speed: float
    max_turn_rate: float
    max_deceleration: float
    time_constant: float


@dataclass
class SafetyTerms:
    """Limits that the safety rules hold a run to.

    Attributes:
        watchdog: Time for which a command may be in force after its arrival [s].
        max_age: And after the picture behind it was taken [s].
        rules: Deadlines of the DVA.
        at_event: From how far somebody may see what was reported somewhere [m].
        processing: Mean time that a message takes a robot's computer [s].
        motors: Limits of the robots by id.
        labels: Names by id, for what is said of somebody.
        dvas: Ids of the DVAs.
        release: Rule by which robots are released after an emergency; None: as the DVA says.
        region_at: Function that returns the region of a place; None: there is one DVA.
    """

    watchdog: float
    max_age: float
    rules: Rules
    at_event: float
    processing: float = 0.0
    motors: dict[str, MotorLimits] = field(default_factory=dict)
    labels: dict[str, str] = field(default_factory=dict)
    dvas: tuple[str, ...] = (DVA,)
    release: ReleasedBy | None = DRIVE
    region_at: Callable[[Position], str] | None = None

    def about_robots(self) -> dict[str, Any]:
        """Return the limits that stand in the profiles of the robots, and not in the scenario."""
        motors = {robot: list(limits) for robot, limits in self.motors.items()}
        release = {} if self.release == DRIVE else {"release": self.release}
        return {"processing_s": self.processing, "motors": motors, **release}


def terms_of(
    scenario: Scenario, robots: Mapping[str, Any] | None = None, attended: bool = False
) -> SafetyTerms:
    """Return the limits for a run of a scenario.

    Args:
        scenario: The scenario.
        robots: From `about_robots`; None: the profiles of the robots are read.
        attended: As in `Stage`, where nothing comes from `robots`.

    Raises:
        ConfigError: a profile of a robot that cannot be read.
    """
    rules = replace(scenario.dispatch.rules(), operator_span=scenario.operator.span)
    limits = scenario.robot.watchdog_s, scenario.robot.max_age_s
    labels = dvas_of(scenario)
    terms = SafetyTerms(*limits, rules, at_event_m(scenario), labels=labels, dvas=tuple(labels))
    terms.release = release_of(scenario, attended)
    if scenario.dva.regions:
        terms.region_at = region_finder(scenario)
    for kind in ("robot", "guard", "operator"):
        count = getattr(scenario, kind).count
        terms.labels |= {id_of(kind, n): label_of(kind, n) for n in range(1, count + 1)}
    if robots is not None:
        terms.processing = float(robots["processing_s"])
        terms.release = robots.get("release", DRIVE)
        terms.motors = {robot: MotorLimits(*of) for robot, of in robots["motors"].items()}
        return terms
    profiles = robot_profiles(scenario)
    terms.processing = max((mean_of(profile.processing_s) for profile in profiles), default=0.0)
    for number, profile in enumerate(profiles, 1):
        terms.motors[id_of("robot", number)] = MotorLimits(
            profile.max_speed_mps,
            profile.max_turn_rate_rad_s,
            profile.max_deceleration_mps2,
            profile.motor_time_constant_s,
        )
    return terms


class RobotMotion(NamedTuple):
    """Motion of a robot and set point of its motors, as seen from outside.

    Attributes:
        mode: Its mode, by its own word; all else is measured.
        speed: Measured along its heading [m/s].
        turn_rate: Measured [rad/s].
        asked_speed: Latest set point of the motors [m/s].
        asked_turn_rate: Latest set point of the motors [rad/s].
        asked_until: Until when that is in force [s]; 0: they were asked to stand.
        touched: Time of the latest contact with anything [s]; -inf: never.
        grip: Friction coefficient of the floor under it.
        powered: True while it has power.
    """

    mode: str
    speed: float
    turn_rate: float
    asked_speed: float = 0.0
    asked_turn_rate: float = 0.0
    asked_until: float = 0.0
    touched: float = float("-inf")
    grip: float = GRIP
    powered: bool = True


STATIONARY = RobotMotion("Idle", 0.0, 0.0)


def motion_of(robot: RobotAgent) -> RobotMotion:
    """Return the motion of a robot now."""
    body = robot.body
    speed, turn_rate, until = body.asked
    return RobotMotion(
        mode=robot.controller.mode.value,
        speed=body.speed,
        turn_rate=body.turn_rate,
        asked_speed=speed,
        asked_turn_rate=turn_rate,
        asked_until=until,
        touched=body.last_touch,
        grip=body.grip,
        powered=body.powered,
    )


class Right(NamedTuple):
    """A permission to act on a robot, as the DVA's book shows it."""

    robot: str
    holder: str
    session: int


class Page(NamedTuple):
    """Current table of the DVA.

    Attributes:
        events: The events.
        rights: Permissions to act on robots.
        works: False while the DVA is silenced: then it decides nothing.
        dva: Id of the DVA.
        copies: DVAs for which it looks at events, and their numbers there, by its own number.
        served: Epochs of the regions that it serves.
    """

    events: EventTable
    rights: Sequence[Right]
    works: bool
    dva: str = DVA
    copies: Mapping[int, tuple[str, int]] = MappingProxyType({})
    served: Mapping[str, int] = MappingProxyType({})


def page_of(dva: DvaAgent) -> Page:
    """Return the present page of a DVA's book."""
    grants = dva.core.sessions.permissions.grants.values()
    rights = [Right(grant.robot, grant.holder, grant.session) for grant in grants]
    page = Page(dva.core.events, rights, not dva.device.silent, dva.device.id_tag)
    core = dva.core
    if not isinstance(core, RegionalDva):
        return page
    return page._replace(copies=core.help.copies, served=dict(core.division.served()))


class Listener(Protocol):
    """Interface of listeners to messages, in order of time [s]."""

    def sent(self, now: float, source: str, to: str, payload: Any) -> None:
        """Take a message or picture that a node has sent; `to` may be empty."""

    def delivered(self, now: float, source: str, to: str, payload: Any) -> None:
        """Take a message that has reached a node; `source` is its true sender."""


class Observer(Listener, Protocol):
    """Interface of observers of all facts, in order of time [s]."""

    def accepted(self, command: Accepted) -> None:
        """Take a command to drive that a robot has accepted."""

    def by_hand(self, done: ByHand) -> None:
        """Take an action of manual control at the robot itself, which no message reports."""

    def moves(self, now: float, motions: Mapping[str, RobotMotion]) -> None:
        """Take the motion of robots, by id."""

    def shows(self, now: float, page: Page) -> None:
        """Take the present page of the DVA's book."""

    def deafened(self, now: float, robot: str, deaf: bool) -> None:
        """Take the news that a robot's computer hangs, or hears again."""

    def slowed(self, now: float, processing: float) -> None:
        """Take a new mean time that a message takes a robot's computer [s]."""


MAX_SENT = 50_000  # maximum messages whose sender is remembered


class Senders:
    """True senders of messages over sockets, where only the message names one.

    Args:
        is_ours: Predicate for devices whose every message is noted.
        most: Maximum number of remembered messages; None: all.
    """

    def __init__(self, is_ours: Callable[[str], bool], most: int | None = MAX_SENT) -> None:
        self._is_ours = is_ours
        self._most = most
        self._sent: OrderedDict[tuple[str, int], None] = OrderedDict()

    def note(self, source: str, payload: bytes) -> None:
        """Note a message that a device of ours sends."""
        self._sent[source, hash(payload)] = None
        if self._most is not None and len(self._sent) > self._most:
            self._sent.popitem(last=False)

    def sender(self, claimed: str, payload: bytes) -> str:
        """Return the claimed sender; empty if it is one of ours that has not sent the message."""
        forged = self._is_ours(claimed) and (claimed, hash(payload)) not in self._sent
        return "" if forged else claimed


# --- facts that are kept -----------------------------------------------------------------


class Arrived(NamedTuple):
    """A message has reached a robot or the DVA.

    Attributes:
        time: Arrival time [s].
        source: Its true sender; empty if it claims to be of a device that has not sent it.
        to: Its receiver.
        payload: Its bytes.
    """

    time: float
    source: str
    to: str
    payload: bytes


class Heard(NamedTuple):
    """Devices whose heartbeat or status has reached the DVA since the last such fact."""

    time: float
    devices: tuple[str, ...]


class MotionNews(NamedTuple):
    """Motion of the robots whose motion has changed, by id."""

    time: float
    motions: dict[str, RobotMotion]


class PlaceNews(NamedTuple):
    """Places of robots and guards that have moved, by id."""

    time: float
    places: dict[str, Position]


class BookNews(NamedTuple):
    """Changes of the DVA's book since the last look at it.

    Attributes:
        time: Time [s].
        events: Events that have changed, as `event_facts` has them.
        gone: Numbers of events that are in it no longer.
        total: Number of all events so far.
        counts: Number of events in each state; None: as before.
        rights: Permissions to act on robots; None: as before.
        works: False while the DVA is silenced.
        dva: Id of the DVA.
        copies: As in `Page`.
        served: As in `Page`.
    """

    time: float
    events: list[dict[str, Any]]
    gone: list[int]
    total: int
    counts: dict[str, int] | None
    rights: list[Right] | None
    works: bool
    dva: str = DVA
    copies: Mapping[int, tuple[str, int]] = MappingProxyType({})
    served: Mapping[str, int] = MappingProxyType({})


class Deafened(NamedTuple):
    """A robot's computer hangs and hears nothing, or hears again."""

    time: float
    robot: str
    deaf: bool


class Slowed(NamedTuple):
    """Mean processing time of a message by a robot's computer from now on [s]."""

    time: float
    processing: float


class FactGap(NamedTuple):
    """Facts that could not be kept.

    Attributes:
        time: From when on facts are kept again [s]; infinite: no more come.
        missing: Number of facts.
        since: Time of the first of them [s].
        rules: Rules that depend on them; empty: all.
    """

    time: float
    missing: int
    since: float
    rules: tuple[str, ...] = ()


Fact = Sent | Arrived | Heard | Accepted | ByHand | MotionNews | PlaceNews | BookNews
Fact |= Deafened | Slowed | FactGap
Put = Callable[[Any], object]
_QUIET = b"<HBMsg>", b"<RobotStatus>"  # messages that only show that a device is present


class FactLog:
    """Observer that keeps facts for a recording, and judges nothing.

    Args:
        put: Callback for facts, in order.
        robots: Ids of the robots whose facts are kept.
        dvas: Ids of the DVAs.
        look: Function that returns the motion of a robot now, by its id.
        page: Function that returns the current page of a DVA's book, by its id; None: the DVA is
            elsewhere.
        keeps_sent: Keep sent messages, too; else the caller does that.
    """

    def __init__(
        self,
        put: Put,
        robots: Container[str],
        look: Callable[[str], RobotMotion],
        page: Callable[[str], Page] | None = None,
        *,
        dvas: Container[str] = (DVA,),
        keeps_sent: bool = True,
    ) -> None:
        self._put = put
        self._robots = robots
        self._dvas = dvas
        self._look = look
        self._page = page
        self._keeps_sent = keeps_sent
        self._motions: dict[str, RobotMotion] = {}
        self._places: dict[str, Position] = {}
        self._heard: dict[str, None] = {}
        self._events: defaultdict[str, _EventTableDiff] = defaultdict(_EventTableDiff)

    @property
    def sees_dva(self) -> bool:
        """True if the DVA's book is seen here."""
        return self._page is not None

    @property
    def sees_robots(self) -> bool:
        """True if the motion of any robot has been seen here."""
        return bool(self._motions)

    def heard(self, source: str) -> None:
        """Note that the DVA has received any message of a device."""
        self._heard[source] = None

    def sent(self, now: float, source: str, to: str, payload: Any) -> None:
        """Note a message: an answer with the robot's motion, an order with the book."""
        if isinstance(payload, bytes):
            if source in self._robots and b"<reply>" in payload:
                self._note_motions(now, {source: self._look(source)})
            elif source in self._dvas and self._page is not None and b"<Order>" in payload:
                self._put(self._events[source].news(now, self._page(source)))
        if self._keeps_sent:
            self._put(Sent(now, source, to, 0, payload))

    def delivered(self, now: float, source: str, to: str, payload: Any) -> None:
        """Implement `Observer`."""
        if not isinstance(payload, bytes) or not (to in self._dvas or to in self._robots):
            return
        if not any(quiet in payload for quiet in _QUIET):
            self._put(Arrived(now, source, to, payload))
        elif to in self._dvas:
            self.heard(source)

    def accepted(self, command: Accepted) -> None:
        """Implement `Observer`."""
        self._put(command)

    def by_hand(self, done: ByHand) -> None:
        """Implement `Observer`."""
        self._note_motions(done.time, {done.robot: self._look(done.robot)})
        self._put(done)

    def moves(self, now: float, motions: Mapping[str, RobotMotion]) -> None:
        """Implement `Observer`: the check itself is a fact, too."""
        self._note_motions(now, motions, at_all=True)

    def _note_motions(
        self, now: float, motions: Mapping[str, RobotMotion], at_all: bool = False
    ) -> None:
        motions_noted = self._motions
        new = {robot: each for robot, each in motions.items() if motions_noted.get(robot) != each}
        motions_noted |= new
        if new or at_all:
            self._put(MotionNews(now, new))

    def places(self, now: float, places: Mapping[str, Position]) -> None:
        """Take the places of robots and guards, by id."""
        new = {device: at for device, at in places.items() if self._places.get(device) != at}
        self._places |= new
        if new:
            self._put(PlaceNews(now, new))

    def shows(self, now: float, page: Page) -> None:
        """Implement `Observer`."""
        if self._heard:
            self._put(Heard(now, tuple(self._heard)))
            self._heard.clear()
        self._put(self._events[page.dva].news(now, page))

    def deafened(self, now: float, robot: str, deaf: bool) -> None:
        """Implement `Observer`."""
        self._put(Deafened(now, robot, deaf))

    def slowed(self, now: float, processing: float) -> None:
        """Implement `Observer`."""
        self._put(Slowed(now, processing))


# --- the book, told by what changes -------------------------------------------------------

_OPEN = "open"
_CLOSED = "closed"
_BOTH_KINDS = "both"


def event_facts(event: Event, where: str) -> dict[str, Any]:
    """Return an event as facts have it; `where`: among the open or the closed ones, or `both`."""
    return {
        "number": event.number,
        "kind": event.kind,
        "latitude_deg": event.position.latitude,
        "longitude_deg": event.position.longitude,
        "state": event.state.value,
        "where": where,
        "contain": event.needs_containment,
        **{role: getattr(event, role) for role in _SENT},
        "times_s": dict(event.times),
    }


_SENT = "responder", "operator", "actor"


class _EventTableDiff:
    """Finds the changes of a book by comparing all of it."""

    def __init__(self) -> None:
        self._events: dict[int, tuple[Any, ...]] = {}
        self._counts: dict[str, int] = {}
        self._rights: list[Right] = []

    def news(self, now: float, page: Page) -> BookNews:
        """Return the changes since the last page."""
        events = page.events
        changed = list[dict[str, Any]]()
        every = [(e, _BOTH_KINDS if n in events.closed else _OPEN) for n, e in events.open.items()]
        every += [(e, _CLOSED) for n, e in events.closed.items() if n not in events.open]
        shown_events = self._events
        self._events = {}
        for event, where in every:
            facts: tuple[Any, ...] = where, event.state, event.responder, event.operator
            facts = *facts, event.actor, event.needs_containment, *event.times.items()
            self._events[event.number] = facts
            if shown_events.get(event.number) != facts:
                changed.append(event_facts(event, where))
        gone = [number for number in shown_events if number not in self._events]
        counts = {state.value: count for state, count in events.counts.items()}
        rights = list(page.rights)
        news = BookNews(
            time=now,
            events=changed,
            gone=gone,
            total=events.total,
            counts=counts if counts != self._counts else None,
            rights=rights if rights != self._rights else None,
            works=page.works,
            dva=page.dva,
            copies={number: (asker, at) for number, (asker, at) in page.copies.items()},
            served=dict(page.served),
        )
        self._counts = counts
        self._rights = rights
        return news


class EventTableCopy:
    """A copy of the DVA's book, rebuilt from its changes.

    Facts lack how severe an event is, and since when it waits: nothing compares with these.

    Args:
        merge_distance: Reports of one kind nearer than this are one event [m].
    """

    def __init__(self, merge_distance: float) -> None:
        self.events = EventTable(merge_distance)
        self._rights = list[Right]()

    def page(self, news: BookNews) -> Page:
        """Apply changes, and return the present page."""
        events = self.events
        for number in news.gone:
            events.open.pop(number, None)
            events.closed.pop(number, None)
        for facts in news.events:
            self._put(facts)
        events.total = news.total
        if news.counts is not None:
            events.counts = {State(state): count for state, count in news.counts.items()}
        if news.rights is not None:
            self._rights = news.rights
        return Page(events, self._rights, news.works, news.dva, news.copies, news.served)

    def _put(self, facts: Mapping[str, Any]) -> None:
        number = facts["number"]
        event = Event(
            number,
            facts["kind"],
            Position(facts["latitude_deg"], facts["longitude_deg"]),
            math.nan,
            facts["contain"],
            State(facts["state"]),
            waiting_since=math.nan,
            times=dict(facts["times_s"]),
            **{role: facts[role] for role in _SENT},
        )
        for where, events in ((_OPEN, self.events.open), (_CLOSED, self.events.closed)):
            if facts["where"] in (where, _BOTH_KINDS):
                events[number] = event
            else:
                events.pop(number, None)
