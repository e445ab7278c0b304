"""Clairvoyant optimum, planned with knowledge of the future: a reference for small cases."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from typing_extensions import override

from dva_sim.core.dispatch.greedy import Free, waiting
from dva_sim.core.dispatch.situation import Advice, Assignment, Floats, Policy, Situation
from dva_sim.kernel.errors import ConfigError

_SAME_TIME_S = 1e-6  # times nearer than this are the same [s]
_INF = float("inf")
_Step = tuple[int, int, float]  # event, unit, when it is sent [s]


@dataclass(frozen=True)
class Instance:
    """A day as it will be: events, and units that go out from their base and return to it.

    Attributes:
        release: Time at which each event becomes known [s], ascending, shape `(events,)`.
        arrival: Time from being sent from the base to being there [s], shape `(events, units)`;
            infinite where a unit cannot go.
        busy: Time from being sent to being back and free again [s], same shape.
    """

    release: Floats
    arrival: Floats
    busy: Floats

    def __post_init__(self) -> None:
        if self.arrival.shape != self.busy.shape or len(self.arrival) != len(self.release):
            raise ValueError("release, arrival and busy differ in how many events they hold")
        if (np.diff(self.release) < 0).any():
            raise ValueError("events should be in order of release")


@dataclass(frozen=True)
class OraclePlan:
    """Sequence of assignments of the clairvoyant plan.

    Attributes:
        tours: Events of each unit in its order, counted from 0.
        start: Departure time for each event [s]; infinite if nobody can go.
        release: Release times of the instance.
        total: Sum of response times [s], of those events that somebody can go to.
    """

    tours: tuple[tuple[int, ...], ...]
    start: tuple[float, ...]
    release: tuple[float, ...]
    total: float


def solve(instance: Instance) -> OraclePlan:
    """Return the plan with the least sum of response times, exactly.

    A plan is an order of events for each unit, in which it is sent as soon as the event is
    known and it is free; it may wait for an event to come while another one is open. Branch and
    bound over who is sent next where, in order of time. A branch ends where its bound is no
    better than what is known. And it ends where another order of the same events was as cheap,
    not later, and left no unit free later, as nothing that follows could be better.

    Meant for up to about 8 events and 3 units.
    """
    return _Search(instance).plan()


class _Search:
    def __init__(self, instance: Instance) -> None:
        self.release = instance.release
        self.arrival = instance.arrival
        self.busy = instance.busy
        self.best = _INF
        self.steps: tuple[_Step, ...] = ()
        self.seen: dict[tuple[int, ...], list[tuple[float, ...]]] = {}

    def plan(self) -> OraclePlan:
        units = self.arrival.shape[1]
        possible = tuple(np.flatnonzero(np.isfinite(self.arrival).any(axis=1)).tolist())
        self._extend(possible, (float(self.release.min(initial=0.0)),) * units, 0.0, ())
        tours: list[list[int]] = [[] for _ in range(units)]
        start = [_INF] * len(self.release)
        for event, unit, when in self.steps:
            tours[unit].append(event)
            start[event] = when
        return OraclePlan(
            tuple(map(tuple, tours)), tuple(start), tuple(self.release.tolist()), self.best
        )

    def _extend(
        self,
        left: tuple[int, ...],
        free: tuple[float, ...],
        cost: float,
        steps: tuple[_Step, ...],
    ) -> None:
        if not left:
            if cost < self.best:
                self.best = cost
                self.steps = steps
            return
        last = steps[-1][2] if steps else -_INF
        if self._dominated(left, (cost, last, *free)):
            return
        if cost + self._bound(left, free, last) >= self.best - _SAME_TIME_S:
            return
        for response, event, unit, start in self._branches(left, free, last):
            back = start + float(self.busy[event, unit])
            later = (*free[:unit], back, *free[unit + 1 :])
            remaining = tuple(e for e in left if e != event)
            self._extend(remaining, later, cost + response, (*steps, (event, unit, start)))

    def _branches(
        self, left: tuple[int, ...], free: tuple[float, ...], last: float
    ) -> list[tuple[float, int, int, float]]:
        """Return response time, event, unit and start of every unit that could be sent next."""
        branches = []
        for event in left:
            release = float(self.release[event])
            arrival = self.arrival[event].tolist()
            for unit, since in enumerate(free):
                start = max(release, since)
                # Only in order of time: every other order of the same departures is the same plan.
                if start >= last and arrival[unit] < _INF:
                    branches.append((start + arrival[unit] - release, event, unit, start))
        return sorted(branches)

    def _bound(self, left: tuple[int, ...], free: tuple[float, ...], last: float) -> float:
        """Return a bound: no way to serve the rest has a smaller sum of response times.

        The p-th event of a unit's tour cannot be served before the unit has done p others, which
        takes no less than the p quickest of all that are left. The best assignment of events
        to places on tours, each place once, is then a bound.
        """
        from scipy.optimize import linear_sum_assignment

        rows = list(left)
        before = np.zeros((len(rows), len(free)))  # (places, units)
        np.cumsum(np.sort(self.busy[rows], axis=0)[:-1], axis=0, out=before[1:])
        release = self.release[rows, None, None]
        response = np.maximum(0.0, np.maximum(before + np.array(free), last) - release)
        response = (response + self.arrival[rows, None, :]).reshape(len(rows), -1)
        return float(response[linear_sum_assignment(response)].sum())

    def _dominated(self, left: tuple[int, ...], state: tuple[float, ...]) -> bool:
        """Return True if the same events were served at no more cost, with no unit free later."""
        states = self.seen.setdefault(left, [])
        if any(all(a <= b for a, b in zip(old, state, strict=True)) for old in states):
            return True
        states.append(state)
        return False


class OraclePolicy(Policy):
    """Follows a plan event by event: a reference that knows the future, not a way to work.

    A unit is held back while something that its plan serves earlier is open or has yet to come.
    So it keeps to the order of the plan even where the times turn out a little different.

    Args:
        plan: Plan from `solve`; event number 1 is its first event.
        devices: Ids of the units, in the plan's order.
    """

    def __init__(self, plan: OraclePlan | None = None, devices: Sequence[str] = ()) -> None:
        if plan is None:
            raise ConfigError(
                "it needs a plan made with knowledge of the future, so it cannot be named in a "
                "configuration; should be one of the others"
            )
        if len(devices) != len(plan.tours):
            raise ConfigError(f"the plan is for {len(plan.tours)} units; given {len(devices)}")
        self.plan = plan
        self.devices = tuple(devices)

    @override
    def advise(self, situation: Situation, rng: np.random.Generator) -> Sequence[Advice]:
        tasks = {situation.tasks[index].event - 1: index for index in waiting(situation)}
        places = {responder.device: index for index, responder in enumerate(situation.responders)}
        free = Free(situation)
        chosen = []
        for device, tour in zip(self.devices, self.plan.tours, strict=True):
            event = self._next(tour, tasks, situation.now)
            if event is None or device not in places:
                continue
            task = tasks[event]
            unit = places[device]
            if unit in free.able(situation.eta[task]):
                free.take(unit)
                chosen.append(Assignment(task, unit))
        return chosen

    def _next(self, tour: Sequence[int], tasks: dict[int, int], now: float) -> int | None:
        """Return the first open event of a tour, unless an earlier one has yet to come."""
        for event in tour:
            if event in tasks:
                return event
            if self.plan.release[event] > now + _SAME_TIME_S:
                return None
        return None
