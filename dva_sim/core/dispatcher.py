"""The dispatcher: shows the policy what is known, and gives the orders that the rules allow."""

from __future__ import annotations

import math
import operator
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from dva_sim.core.auctions import Auctions
from dva_sim.core.dispatch import MinEta
from dva_sim.core.dispatch.situation import (
    Advice,
    Announcement,
    Assignment,
    Cover,
    Policy,
    Relocation,
    Responder,
    Situation,
    Task,
)
from dva_sim.core.events import Event, State
from dva_sim.core.ground import Floats, Ground, Start, Travel
from dva_sim.core.orders import Orders
from dva_sim.core.registry import GUARD, OPERATOR, ROBOT, Entry
from dva_sim.core.send import Send
from dva_sim.protocol import messages as m

CONSIDERED = 1000  # tasks that one decision looks at, those detected longest ago
SAME_PLACE = 3e-5  # a few metres [deg]
DECISIONS = 4  # in a row, where one makes the next necessary
LATE, SETTLED = 2.0, 180.0  # within twice its time and so long [s] who was sent to wait is there
KINDS: dict[str, Literal["guard", "robot"]] = {GUARD: "guard", ROBOT: "robot"}


@dataclass
class _Team:
    """Who can go: the entries behind `Situation.responders`, and the free operators."""

    entries: list[Entry]
    engaged: list[Event | None]
    operators: list[Entry]

    def idle(self) -> set[str]:
        """Ids of those who do nothing."""
        pairs = zip(self.entries, self.engaged, strict=True)
        return {entry.device.id_tag for entry, event in pairs if event is None}

    def starts(self) -> list[Start]:
        """From where they would set out."""
        return [
            Start(e.device.id_tag, KINDS[e.device.device_type], e.position, a is not None)
            for e, a in zip(self.entries, self.engaged, strict=True)
            if e.position is not None
        ]


@dataclass
class Dispatcher:
    """Asks the policy, keeps what the rules allow.

    Attributes:
        policy: Advises.
        travel: How far it is from whom to where.
        orders: Gives the orders.
        rng: Luck of policies that use it.
        ground: What is known of the place.
        last_failure: What the policy did wrong last, in words.
    """

    policy: Policy
    travel: Travel
    orders: Orders
    rng: np.random.Generator
    ground: Ground = field(default_factory=Ground)
    auctions: Auctions = field(init=False)
    last_failure: str = ""
    _bound_for: dict[str, tuple[int, float]] = field(default_factory=dict)  # station, until

    def __post_init__(self) -> None:
        self.auctions = Auctions(self.orders.rules.bid_within)
        self._default = MinEta()

    # --- a decision --------------------------------------------------------------------

    def decide(self, now: float) -> list[Send]:
        """Give the orders that are due now; what finds nobody in time is given up."""
        sends: list[Send] = []
        self.auctions.close(self.orders.book, now)
        for _ in range(DECISIONS):
            before = self.orders.counters["preempted"]
            given = self._decide(now)
            sends += given
            # Who was called away leaves a task open; an order to look leaves one to stand by.
            looks = self.orders.rules.containment and any(map(_is_to_look, given))
            if self.orders.counters["preempted"] == before and not looks:
                break
        sends += self.orders.give_up(now)
        self.auctions.close(self.orders.book, now)
        return sends

    def _decide(self, now: float) -> list[Send]:
        if not self.orders.book.open and not self.policy.relocates:
            return []
        events = self._tasks()
        if not events and not self.policy.relocates:
            return []
        team = self._team(now)
        if not team.entries:
            return []
        self.auctions.forget_useless(team.idle())
        situation = self._situation(events, team, now)
        return self._carry_out(self._advice(situation), situation, events, team, now)

    def _advice(self, situation: Situation) -> Sequence[Advice]:
        """The policy's, if it makes sense; else the default's."""
        try:
            advice = list(self.policy.advise(situation, self.rng))
            _check_form(advice, situation)
        except Exception as error:
            self.orders.counters["policy failed"] += 1
            self.last_failure = f"{type(error).__name__}: {error}"
            return self._default.advise(situation, self.rng)
        return advice

    def _carry_out(
        self,
        advice: Sequence[Advice],
        situation: Situation,
        events: list[Event],
        team: _Team,
        now: float,
    ) -> list[Send]:
        taken: set[int] = set()
        given: set[int] = set()
        sends: list[Send] = []
        for piece in advice:
            done: list[Send] | None = None
            if isinstance(piece, Announcement):
                done = self._announce(situation, events[piece.task], team, piece.task, now)
            elif piece.responder in taken:
                pass
            elif isinstance(piece, Relocation):
                done = self._relocate(piece, situation, team, now)
            elif piece.task not in given:
                done = self._assign(piece, situation, events, team, now)
                given.update({piece.task} if done is not None else ())
            if done is None:
                self.orders.counters["overruled"] += 1
            else:
                sends += done
                if not isinstance(piece, Announcement):
                    taken.add(piece.responder)
        return sends

    def not_moved(self, guard: str) -> None:
        """A guard did not take a relocation, or has forgotten it."""
        self._bound_for.pop(guard, None)

    # --- what the rules allow ----------------------------------------------------------

    def _assign(
        self,
        choice: Assignment,
        situation: Situation,
        events: list[Event],
        team: _Team,
        now: float,
    ) -> list[Send] | None:
        """The orders that an assignment means; None if the rules do not allow it."""
        task, event = situation.tasks[choice.task], events[choice.task]
        entry, former = team.entries[choice.responder], team.engaged[choice.responder]
        if task.engaged is not None or not math.isfinite(
            situation.eta[choice.task, choice.responder]
        ):
            return None
        if former is not None and not self.orders.may_preempt(former, now):
            return None
        is_robot = entry.device.device_type == ROBOT
        if is_robot and former is None and not team.operators:
            return None
        pilot = None
        if is_robot:
            pilot = former.operator if former else team.operators.pop(0).device.id_tag
        sends = self.orders.redirect(former, now) if former else []
        self._bound_for.pop(entry.device.id_tag, None)
        if task.stage == "contain":
            return [*sends, self.orders.act(event, entry.device.id_tag, now)]
        award = self.auctions.award(event.number, entry.device.id_tag)
        return [*sends, self.orders.confirm(event, entry.device.id_tag, pilot, now, award)]

    def _announce(
        self, situation: Situation, event: Event, team: _Team, task: int, now: float
    ) -> list[Send] | None:
        """Ask every idle responder that could go there for a bid."""
        on_offer = event.number in self.auctions.running
        if not self.policy.auctions or on_offer or event.state is not State.PENDING:
            return None
        idle = team.idle() - self.orders.engaged.keys()
        able = zip(situation.responders, np.isfinite(situation.eta[task]), strict=True)
        asked = [who.device for who, can in able if can and who.device in idle]
        if not asked:
            return None
        self.orders.counters["auctions"] += 1
        within = self.auctions.announce(event.number, asked, now)
        body = m.TaskAnnouncement(event.number, event.kind, event.position, event.severity, within)
        return [Send(device, body) for device in asked]

    def _relocate(
        self, move: Relocation, situation: Situation, team: _Team, now: float
    ) -> list[Send] | None:
        """Let an idle guard wait elsewhere, unless it is there already, or on its way there."""
        entry, cover = team.entries[move.responder], situation.cover
        if not self.policy.relocates or cover is None or team.engaged[move.responder] is not None:
            return None
        guard, place = entry.device.id_tag, self.ground.stations[move.station].position
        if entry.position is not None and _same_place(place, entry.position):
            return None
        eta = float(cover.eta[move.responder, move.station])
        if not math.isfinite(eta) or cover.bound_for[move.responder] == move.station:
            return None
        self._bound_for[guard] = move.station, now + LATE * eta + SETTLED
        self.orders.counters["relocated"] += 1
        return [Send(guard, m.Relocation(place))]

    # --- what is known -----------------------------------------------------------------

    def _tasks(self) -> list[Event]:
        """Events that somebody could do something about, detected longest ago first."""
        book, rules = self.orders.book, self.orders.rules
        if not (rules.containment or self.policy.preempts):
            found = list(book.waiting.values())
        else:
            found = [e for e in book.open.values() if self._is_task(e)]
        found.sort(key=operator.attrgetter("number"))
        return found[:CONSIDERED]

    def _is_task(self, event: Event) -> bool:
        if event.waits_for is not None:
            return not self._finder_is_there(event)
        if event.needs_containment and event.actor is None:
            return True
        return self.policy.preempts and self._is_under_way(event)

    def _finder_is_there(self, event: Event) -> bool:
        """Whether a guard has just confirmed it and is about to be free to deal with it."""
        finder = event.responder
        if event.state is not State.CONFIRMED or event.operator is not None or finder is None:
            return False
        return self.orders.engaged.get(finder) is event

    def _is_under_way(self, event: Event) -> bool:
        """Whether its responder has heard of it and is not there yet."""
        if event.state is not State.ASSIGNED or not event.taken_up or event.responder is None:
            return False
        return self.orders.registry.entries[event.responder].position is not None

    def _team(self, now: float) -> _Team:
        registry = self.orders.registry
        entries = self._free(registry.located(GUARD), now)
        robots = self._free(registry.located(ROBOT), now)
        operators = self._free(registry.of_type(OPERATOR), now) if robots else []
        if operators:
            entries += robots
        engaged: list[Event | None] = [None] * len(entries)
        if self.policy.preempts:
            for event in filter(self._is_under_way, self.orders.book.open.values()):
                entries.append(self.orders.registry.entries[event.responder or ""])
                engaged.append(event)
        return _Team(entries, engaged, operators)

    def _free(self, entries: Iterable[Entry], now: float) -> list[Entry]:
        """Those who may be given an order, in order of registration."""
        held, engaged = self.orders.sessions.permissions.grants, self.orders.engaged
        free = [
            e
            for e in entries
            if not e.silent and e.free_from <= now
            if e.device.id_tag not in engaged and e.device.id_tag not in held
        ]
        return sorted(free, key=_place)

    def _situation(self, events: list[Event], team: _Team, now: float) -> Situation:
        rows = {id(e): row for row, e in enumerate(events)}
        columns = {id(e): c for c, e in enumerate(team.engaged) if e is not None}
        tasks = tuple(self._task(e, columns.get(id(e))) for e in events)
        responders = tuple(
            Responder(e.device.id_tag, KINDS[e.device.device_type], rows.get(id(a)) if a else None)
            for e, a in zip(team.entries, team.engaged, strict=True)
        )
        distance, eta = self._ways(events, tasks, team)
        names = [r.device for r in responders]
        preference = self.ground.preference
        ranks = [preference(e.position, names) for e in events] if preference and events else []
        bids = self.auctions.bids(events, names, now) if self.policy.auctions else np.empty((0, 0))
        return Situation(
            now,
            tasks,
            responders,
            _sealed(distance),
            _sealed(eta),
            _sealed(np.array(ranks, dtype=np.float64) if ranks else np.empty((0, 0))),
            _sealed(bids),
            len(team.operators),
            self._cover(team, now) if self.policy.relocates else None,
        )

    def _task(self, event: Event, engaged: int | None) -> Task:
        # While somebody is under way to look, what is left to give is standing by.
        confirm = event.state is State.PENDING or engaged is not None
        return Task(
            event.number,
            event.kind,
            "confirm" if confirm else "contain",
            confirm or event.state is State.CONFIRMED,
            event.severity,
            event.confidence,
            event.times["detected"],
            event.waiting_since,
            engaged,
            self.auctions.stage(event.number),
        )

    def _ways(
        self, events: list[Event], tasks: Sequence[Task], team: _Team
    ) -> tuple[Floats, Floats]:
        starts = team.starts()
        goals = [e.position for e in events]
        distance, eta = (ways.copy() for ways in self.travel(starts, goals))
        robots = np.array([s.kind == "robot" for s in starts])
        for row, (event, task) in enumerate(zip(events, tasks, strict=True)):
            if task.stage == "contain":
                distance[row, robots] = eta[row, robots] = np.inf
            if event.failed:
                _leave_out_who_failed(event, starts, distance[row], eta[row])
        return distance, eta

    def _cover(self, team: _Team, now: float) -> Cover | None:
        """Where idle guards could wait, and where they are on their way to already."""
        ground = self.ground
        if not ground.stations:
            return None
        starts = [replace(start, under_way=True) for start in team.starts()]  # there is no hurry
        eta = self.travel(starts, [s.position for s in ground.stations])[1].T.copy()
        bound_for: list[int | None] = []
        for row, (start, engaged) in enumerate(zip(starts, team.engaged, strict=True)):
            bound, until = self._bound_for.get(start.device, (None, math.inf))
            there = bound is not None and _same_place(
                ground.stations[bound].position, start.position
            )
            if there or now > until:
                del self._bound_for[start.device]
                bound = None
            if start.kind != "guard" or engaged is not None:
                eta[row] = np.inf
            bound_for.append(bound)
        names = tuple(s.name for s in ground.stations)
        reach, demand = _sealed(ground.reach), _sealed(ground.demand)
        return Cover(names, _sealed(eta), reach, demand, tuple(bound_for))


def _is_to_look(send: Send) -> bool:
    body = send.body
    return isinstance(body, m.TaskAward) or (isinstance(body, m.Order) and body.task == "confirm")


def _check_form(advice: Iterable[Advice], situation: Situation) -> None:
    """Refuse what is not advice, or names what is not there."""
    tasks, responders = len(situation.tasks), len(situation.responders)
    stations = len(situation.cover.stations) if situation.cover else 0
    for piece in advice:
        if not isinstance(piece, Advice):
            raise TypeError(f"{piece!r} is no advice")
        if not isinstance(piece, Relocation):
            _check_place("task", piece.task, tasks)
        if not isinstance(piece, Announcement):
            _check_place("responder", piece.responder, responders)
        if isinstance(piece, Relocation):
            _check_place("station", piece.station, stations)


def _check_place(what: str, place: object, count: int) -> None:
    if isinstance(place, bool) or not 0 <= operator.index(place) < count:  # type: ignore[arg-type]
        raise IndexError(f"there is no {what} {place!r}; there are {count}")


def _sealed(array: Floats) -> Floats:
    """The same array, which a policy cannot change."""
    view = array.view()
    view.flags.writeable = False
    return view


_place = operator.attrgetter("place")


def _same_place(a: m.Position, b: m.Position) -> bool:
    """Within a few metres."""
    return abs(a.latitude - b.latitude) + abs(a.longitude - b.longitude) < SAME_PLACE


def _leave_out_who_failed(
    event: Event, starts: Sequence[Start], distance: NDArray[np.float64], eta: NDArray[np.float64]
) -> None:
    """A responder that gave an event back goes again only if nobody else can."""
    failed = np.array([s.device in event.failed for s in starts], dtype=bool)
    if np.isfinite(distance[~failed]).any():
        distance[failed] = eta[failed] = np.inf
