"""Builds the situation that a policy decides on: what is known at one moment."""

from __future__ import annotations

import math
import operator
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from dva_sim.core.auctions import Auctions
from dva_sim.core.dispatch.situation import Cover, Policy, Responder, Situation, Task
from dva_sim.core.events import Event, State
from dva_sim.core.orders import Orders
from dva_sim.core.registry import DeviceEntry
from dva_sim.core.travel_times import Floats, SiteKnowledge, Start, Travel
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import GUARD, OPERATOR, ROBOT

CONSIDERED = 1000  # maximum tasks of one decision, those detected longest ago
SAME_PLACE = 3e-5  # positions nearer than this, a few metres, are the same [deg]
LATE, SETTLED = 2.0, 180.0  # a move is given up after this many times its travel time plus [s]
KINDS: dict[str, Literal["guard", "robot"]] = {GUARD: "guard", ROBOT: "robot"}

_place = operator.attrgetter("place")


@dataclass
class KnownTeam:
    """Available responders: the entries behind `Situation.responders`, and free operators."""

    entries: list[DeviceEntry]
    engaged: list[Event | None]
    operators: list[DeviceEntry]

    def idle(self) -> set[str]:
        """Return the ids of idle responders."""
        pairs = zip(self.entries, self.engaged, strict=True)
        return {entry.device.id_tag for entry, event in pairs if event is None}

    def starts(self) -> list[Start]:
        """Return the starting points of the responders."""
        return [
            Start(e.device.id_tag, KINDS[e.device.device_type], e.position, a is not None)
            for e, a in zip(self.entries, self.engaged, strict=True)
            if e.position is not None
        ]


@dataclass
class PolicyView:
    """View of a policy, with the core's objects behind it, at the same indices."""

    situation: Situation
    events: list[Event]
    team: KnownTeam


@dataclass
class SituationBuilder:
    """Builder of situations: available responders, tasks, and travel times between them.

    Attributes:
        policy: Policy, which declares what it needs to see.
        travel: Travel times and distances.
        orders: Current orders.
        ground: Knowledge of the site.
        auctions: Auctions under way.
    """

    policy: Policy
    travel: Travel
    orders: Orders
    ground: SiteKnowledge
    auctions: Auctions
    _bound_for: dict[str, tuple[int, float]] = field(default_factory=dict)  # station, until

    def look(self, now: float) -> PolicyView | None:
        """Return the decision to make; None if there is none, or nobody to send."""
        if not self.orders.events.open and not self.policy.relocates:
            return None
        events = self._tasks()
        if not events and not self.policy.relocates:
            return None
        team = self._team(now)
        if not team.entries:
            return None
        self.auctions.forget_useless(team.idle())
        return PolicyView(self._situation(events, team, now), events, team)

    def idle(self, now: float) -> set[str]:
        """Return ids of guards and robots that could be sent somewhere now."""
        return self._team(now).idle()

    # --- moves to waiting places --------------------------------------------------------

    def sends_to_wait(self, guard: str, station: int, eta: float, now: float) -> None:
        """Note that a guard is on its way to a station; a very late one is given up."""
        self._bound_for[guard] = station, now + LATE * eta + SETTLED

    def forget_move(self, guard: str) -> None:
        """Forget a move: the guard goes elsewhere, did not take it, or has forgotten it."""
        self._bound_for.pop(guard, None)

    # --- tasks and responders -----------------------------------------------------------

    def _tasks(self) -> list[Event]:
        """Return the events that need a responder, detected longest ago first."""
        events = self.orders.events
        rules = self.orders.rules
        if not (rules.containment or self.policy.preempts):
            tasks = list(events.waiting.values())
        else:
            tasks = [e for e in events.open.values() if self._is_task(e)]
        tasks.sort(key=operator.attrgetter("number"))
        return tasks[:CONSIDERED]

    def _is_task(self, event: Event) -> bool:
        if event.waits_for is not None:
            return not self._finder_is_there(event)
        if event.needs_containment and event.actor is None:
            return True
        return self.policy.preempts and self._is_under_way(event)

    def _finder_is_there(self, event: Event) -> bool:
        """Return True if a guard has just confirmed it and will soon be free to deal with it."""
        finder = event.responder
        if event.state is not State.CONFIRMED or event.operator is not None or finder is None:
            return False
        return self.orders.engaged.is_at(finder, event)

    def _is_under_way(self, event: Event) -> bool:
        """Return True if its responder has received the order and has not arrived."""
        if event.state is not State.ASSIGNED or not event.taken_up or event.responder is None:
            return False
        return self.orders.registry.entries[event.responder].position is not None

    def _team(self, now: float) -> KnownTeam:
        registry = self.orders.registry
        entries = self._free(registry.located(GUARD), now)
        robots = self._free(registry.located(ROBOT), now)
        operators = self._hands(registry.of_type(OPERATOR), now) if robots else []
        # A robot cannot be sent without an operator who has a hand free.
        if operators:
            entries += robots
        engaged: list[Event | None] = [None] * len(entries)
        if self.policy.preempts:
            for event in filter(self._is_under_way, self.orders.events.open.values()):
                entries.append(self.orders.registry.entries[event.responder or ""])
                engaged.append(event)
        return KnownTeam(entries, engaged, operators)

    def _free(self, entries: Iterable[DeviceEntry], now: float) -> list[DeviceEntry]:
        """Return the devices that may be given an order, in order of registration."""
        is_held = self.orders.sessions.is_held
        engaged = self.orders.engaged
        is_stopped = self.orders.emergencies.holds
        free = [
            e
            for e in entries
            if not e.silent and e.free_from <= now
            if e.device.id_tag not in engaged and not is_held(e.device.id_tag)
            if not is_stopped(e.device.id_tag)
        ]
        return sorted(free, key=_place)

    def operators(self, now: float) -> list[DeviceEntry]:
        """Return operators who may be given a robot now, as `_hands` has them."""
        return self._hands(self.orders.registry.of_type(OPERATOR), now)

    def _hands(self, operators: Iterable[DeviceEntry], now: float) -> list[DeviceEntry]:
        """Return operators once for each robot they could still take; the least busy first."""
        span = self.orders.rules.operator_span
        count = self.orders.engaged.count
        hands = [
            (in_hand, e.place, e)
            for e in operators
            if not e.silent and e.free_from <= now
            for in_hand in range(count(e.device.id_tag), span)
        ]
        return [entry for _, _, entry in sorted(hands, key=operator.itemgetter(0, 1))]

    def _situation(self, events: list[Event], team: KnownTeam, now: float) -> Situation:
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
            now=now,
            tasks=tasks,
            responders=responders,
            distance=_sealed(distance),
            eta=_sealed(eta),
            preference=_sealed(np.array(ranks, dtype=np.float64) if ranks else np.empty((0, 0))),
            bids=_sealed(bids),
            operators=len(team.operators),
            cover=self._cover(team, now) if self.policy.relocates else None,
        )

    def _task(self, event: Event, engaged: int | None) -> Task:
        # While somebody is under way to look, what is left to give is standing by.
        confirm = event.state is State.PENDING or engaged is not None
        return Task(
            event=event.number,
            kind=event.kind,
            stage="confirm" if confirm else "contain",
            due=confirm or event.state is State.CONFIRMED,
            severity=event.severity,
            confidence=event.confidence,
            detected=event.times["detected"],
            waiting_since=event.waiting_since,
            engaged=engaged,
            auction=self.auctions.stage(event.number),
        )

    def _ways(
        self, events: list[Event], tasks: Sequence[Task], team: KnownTeam
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
            if event.handling.taken_off:
                off = np.array([s.device in event.handling.taken_off for s in starts], dtype=bool)
                distance[row, off] = eta[row, off] = np.inf
        return distance, eta

    def _cover(self, team: KnownTeam, now: float) -> Cover | None:
        """Return where idle guards could wait, and where some are going already."""
        ground = self.ground
        if not ground.stations:
            return None
        starts = [
            replace(start, under_way=True) for start in team.starts()
        ]  # a move to wait needs no mobilisation
        eta = self.travel(starts, [s.position for s in ground.stations])[1].T.copy()
        idle_guard = [
            start.kind == "guard" and engaged is None
            for start, engaged in zip(starts, team.engaged, strict=True)
        ]
        eta[~np.array(idle_guard)] = np.inf
        bound_for = tuple(self._station_ahead(start, now) for start in starts)
        names = tuple(s.name for s in ground.stations)
        reach = _sealed(ground.reach)
        demand = _sealed(ground.demand)
        return Cover(names, _sealed(eta), reach, demand, bound_for)

    def _station_ahead(self, start: Start, now: float) -> int | None:
        """Return the station that a guard is going to; None once it is there, or much too late."""
        station, until = self._bound_for.get(start.device, (None, math.inf))
        if station is None:
            return None
        if now <= until and not same_place(self.ground.stations[station].position, start.position):
            return station
        self.forget_move(start.device)
        return None


def same_place(a: m.Position, b: m.Position) -> bool:
    """Return True if two places are within a few metres."""
    return abs(a.latitude - b.latitude) + abs(a.longitude - b.longitude) < SAME_PLACE


def _sealed(array: Floats) -> Floats:
    """Return a read-only copy of an array for a policy."""
    view = array.view()
    view.flags.writeable = False
    return view


def _leave_out_who_failed(
    event: Event, starts: Sequence[Start], distance: Floats, eta: Floats
) -> None:
    """Leave out responders that gave an event back, unless nobody else can go."""
    failed = np.array([s.device in event.failed for s in starts], dtype=bool)
    if np.isfinite(distance[~failed]).any():
        distance[failed] = eta[failed] = np.inf
