"""Responders that are times only: to get ready, to get there, to look, to act, to come back.

Current work is dropped when a newer order comes; callbacks that were meant for the old one
find that their ticket is no longer the newest, and do nothing.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from typing import Any, Protocol

from dva_sim.kernel.clock import Clock
from dva_sim.protocol import messages as m
from dva_sim.simulation.timed.exposure import approach, leaving, on_scene
from dva_sim.simulation.timed.incidents import Incident
from dva_sim.simulation.timed.scenario import Group
from dva_sim.simulation.timed.travel import Place, Terrain


class ShiftWorld(Protocol):
    """Interface of the world for a unit."""

    clock: Clock
    terrain: Terrain

    def after(self, delay: float, action: Any, *args: Any) -> None:
        """Do something later [s]."""

    def say(self, source: str, body: m.Body) -> None:
        """Send a message to the DVA."""

    def says_arrived(self, unit: Unit, job: Job) -> None:
        """Tell the DVA that a unit is where it was sent."""

    def publish_place(self, unit: Unit, activity: str) -> None:
        """Publish where a unit is."""

    def incident_at(self, event: int) -> Incident:
        """Return the true incident of an event of the DVA."""

    def mobilisation(self, unit: Unit, incident: Incident) -> float:
        """Return the time that this unit takes to get ready for this incident [s]."""

    def trip(self, unit: Unit, start: Place, goal: Place) -> float:
        """Time to get somewhere [s]; infinite if no path exists."""

    def look(self, unit: Unit, incident: Incident) -> float:
        """Return the time from arrival to certainty [s]."""

    def act(self, unit: Unit, incident: Incident) -> float:
        """Return how long it takes to contain it [s]."""

    def needs_people(self, incident: Incident) -> bool:
        """Return True if a person will be called to contain it."""

    def spent(self, unit: Unit, phase: str, since: float) -> None:
        """Note that a unit has spent the time since `since` in a phase."""

    def freed(self, unit: Unit, job: Job) -> None:
        """Note that a job is over, or broken off."""

    def exposed(self, unit: Unit, stage: str, seconds: float) -> None:
        """Note the time of a guard within a danger radius."""

    def moving(self, unit: Unit, moves: bool) -> None:
        """Note that a unit begins or ceases to move, which is reported to the DVA."""


@dataclass(slots=True)
class Job:
    """Job of a unit.

    Attributes:
        order: The DVA's.
        voice: Device that answers for it: the guard's, or the operator's.
        begun: Start time [s].
        phase: `ready`, `travel`, `look`, `act`, `stand by` or `return`.
        inside: True within the danger radius, false on stand-by.
    """

    order: m.Order
    incident: Incident
    voice: str
    begun: float
    phase: str = "ready"
    inside: bool = True


@dataclass(slots=True)
class Leg:
    """A way under way: from where to where, since when [s], how long [m] and until when [s]."""

    start: Place
    goal: Place
    since: float
    length: float
    until: float


DONE = "done"
ROUNDING = 2e-6  # rounding error of the clock [s]


class Unit:
    """A guard, or a robot with its driver.

    Args:
        number: Among all units, from 0.
        name: Name for people.
        device: Its id.
        group: Properties of the unit.
        base: Waiting place.
        speed: [m/s]

    Attributes:
        place: Current place, or place of departure.
        job: Current job.
        leg: Its way, while it moves.
        equipped: True if it would set out at once, being out already.
        since: Start of the present phase of its job [s].
        distance: Distance moved [m].
        jobs: Number of orders settled, by task.
    """

    def __init__(
        self,
        world: ShiftWorld,
        number: int,
        name: str,
        device: str,
        group: Group,
        base: Place,
        speed: float,
    ) -> None:
        self.world = world
        self.number = number
        self.name = name
        self.device = device
        self.group = group
        self.base = base
        self.place = base
        self.speed = speed
        self.kind = group.kind
        self.job: Job | None = None
        self.leg: Leg | None = None
        self.equipped = False
        self.distance = 0.0
        self.jobs: Counter[str] = Counter()
        self._ticket = 0
        self.since = 0.0
        self._ready_at = 0.0
        self._near: Incident | None = None
        self._offers: dict[int, m.TaskAnnouncement] = {}

    # --- what the DVA says ---------------------------------------------------------------

    def take(self, body: m.Body) -> bool:
        """Hear the DVA; False declines."""
        if isinstance(body, m.Order):
            return self.order(body, self.device)
        if isinstance(body, m.OrderProgress):
            return self._stand_down(body)
        if isinstance(body, m.Relocation):
            return self._wait_at(self.world.terrain.known_at(body.position))
        if isinstance(body, m.TaskAnnouncement):
            return self._bid(body)
        if isinstance(body, m.TaskAward):
            return self._awarded(body)
        return False

    def order(self, order: m.Order, voice: str) -> bool:
        """Begin an order, or continue it; a job for another event is dropped."""
        world = self.world
        job = self.job
        now = self.world.clock.now
        if job is not None and job.order.event_id == order.event_id:
            job.voice = voice
            if job.order.task != "stand_by" or order.task != "contain":
                return True  # said again
            job.order = order
            if job.phase == "stand by":
                self._enter(job)
            return True
        ready_at = self._drop()
        incident = world.incident_at(order.event_id)
        at_hand = self.equipped or incident is self._near
        if incident is not self._near:
            self._leave()
        self._near = None
        self.job = job = Job(order, incident, voice, now, inside=order.task != "stand_by")
        self.since = now
        if at_hand:
            delay = 0.0
        elif ready_at is not None:
            delay = ready_at - now
        else:
            delay = world.mobilisation(self, incident)
        self._ready_at = now + delay
        self._then(delay, self._depart, job)
        return True

    def _stand_down(self, body: m.OrderProgress) -> bool:
        """End an order that is over by the DVA's word."""
        job = self.job
        if job is not None and job.order.event_id == body.event_id:
            self._drop()
            self._rest()
        return True

    def _wait_at(self, place: Place) -> bool:
        """Go to another place and wait there for orders."""
        if self.job is not None:
            return False
        self._stop()
        self._walk_idle(place)
        return True

    def _bid(self, offer: m.TaskAnnouncement) -> bool:
        """Bid with the expected time of arrival; False without a bid."""
        if self.job is not None:
            return False
        if len(self._offers) > 64:
            self._offers.pop(next(iter(self._offers)))
        self._offers[offer.event_id] = offer
        arrival = self.expected(self.world.terrain.known_at(offer.position))
        if math.isinf(arrival):
            return False
        self.world.say(self.device, m.TaskBid(offer.event_id, arrival))
        return True

    def _awarded(self, body: m.TaskAward) -> bool:
        offer = self._offers.pop(body.event_id, None)
        if offer is None or self.job is not None:
            return False
        if self.kind == "robot":
            return True  # its operator is told
        order = m.Order(offer.event_id, offer.kind, offer.position, None)
        return self.order(order, self.device)

    def expected(self, goal: Place) -> float:
        """Time to get somewhere, as far as one can know [s]."""
        ready = 0.0 if self.equipped else self.group.mobilisation.mean
        return ready + self.world.trip(self, self.here(), goal)

    # --- under way -----------------------------------------------------------------------

    def _depart(self, job: Job) -> None:
        self._turn_to(job, "travel")
        self.equipped = True
        start = self.here()
        goal = job.incident.place
        self._stop()
        length = self.world.terrain.length(start, goal)
        seconds = self.world.trip(self, start, goal)
        if math.isinf(length):
            self._finish(job, "failed")
            return
        now = self.world.clock.now
        if seconds > 0.0:  # else the arrival says it all
            self.world.say(job.voice, m.OrderProgress(job.order.event_id, "departed"))
        if not job.inside and length > 0.0:
            outside = max(0.0, length - job.incident.danger_radius(now + seconds))
            seconds = seconds * outside / length
            length = outside
        self.leg = Leg(start, goal, now, length, now + seconds)
        self.world.moving(self, True)
        self._then(seconds, self._arrive, job)

    def _arrive(self, job: Job) -> None:
        leg = self.leg
        incident = job.incident
        assert leg is not None
        self._stop()
        if not job.inside and leg.length > 0.0:
            self.place = self.world.terrain.along(leg.start, incident.place, leg.length)
        else:
            self.place = incident.place
        self.world.says_arrived(self, job)
        if job.order.task == "confirm":
            self._turn_to(job, "look")
            self._then(self.world.look(self, incident), self._found, job)
        elif job.order.task == "contain":
            self._enter(job) if not job.inside else self._act(job)
        else:
            self._turn_to(job, "stand by")

    def _enter(self, job: Job) -> None:
        """Enter the danger from its edge, which may have moved outwards meanwhile."""
        self._turn_to(job, "travel")
        goal = job.incident.place
        now = self.world.clock.now
        apart = self.world.terrain.length(self.place, goal) > 0.0  # else ways play no part
        length = job.incident.danger_radius(now) if apart else 0.0
        job.inside = True
        seconds = length / self.speed
        self.leg = Leg(self.place, goal, now, length, now + seconds)
        self._then(seconds, self._inside, job)

    def _inside(self, job: Job) -> None:
        self._stop()
        self.place = job.incident.place
        self._act(job)

    # --- on the scene ----------------------------------------------------------------------

    def _act(self, job: Job) -> None:
        self._turn_to(job, "act")
        self._then(self.world.act(self, job.incident), self._contained, job)

    def _found(self, job: Job) -> None:
        finding = "confirmed" if job.incident.true else "refuted"
        self._report(job, finding, 0.99 if self.kind == "guard" else 0.95)

    def _contained(self, job: Job) -> None:
        self._report(job, "contained", 0.99)

    def _report(self, job: Job, finding: str, confidence: float) -> None:
        order = job.order
        severity = job.incident.severity
        place = job.incident.place.position
        body = m.EventReport(order.event_id, order.kind, place, severity, confidence, finding)
        self._turn_to(job, "return")
        self.world.say(job.voice, body)
        if finding == "contained" or not job.incident.true:
            job.incident.over = min(job.incident.over, self.world.clock.now)
        self._near = job.incident
        self._come_back(job)

    def _leave(self) -> None:
        """Leave the danger radius, unless the unit has been called back."""
        near = self._near
        self._near = None
        if near is not None and self.kind == "guard":
            self.world.exposed(self, "leave", leaving(near, self.world.clock.now, self.speed))

    def _come_back(self, job: Job) -> None:
        """Finish the job now, or at base if units return; units needed here finish now."""
        needed = self.kind == "guard" and self.world.needs_people(job.incident)
        length = self.world.terrain.length(self.place, self.base)
        if self.group.after != "return" or needed or math.isinf(length):
            self._finish(job, DONE)
            return
        self._leave()
        now = self.world.clock.now
        seconds = length / self.speed
        self.leg = Leg(self.place, self.base, now, length, now + seconds)
        self._then(seconds, self._back, job)

    def _back(self, job: Job) -> None:
        self._stop()
        self.place = self.base
        self.equipped = False
        self._finish(job, DONE)

    def _finish(self, job: Job, state: str) -> None:
        """Finish an order that is settled, or given back."""
        world = self.world
        if world.clock.now > self.since:
            world.spent(self, job.phase, self.since)
        world.freed(self, job)
        self.job = None
        self._ticket += 1
        self.jobs[job.order.task] += state == DONE
        world.publish_place(self, "waiting")
        world.say(job.voice, m.OrderProgress(job.order.event_id, state))
        if self.group.after == "stay" and not world.needs_people(job.incident):
            self.equipped = False
            self._leave()
        elif self.place is not self.base:
            world.after(0.0, self._rest_after, self._ticket)

    def _rest_after(self, ticket: int) -> None:
        if ticket == self._ticket and self.job is None:
            self._rest()

    # --- waiting ---------------------------------------------------------------------------

    def _rest(self) -> None:
        """Wait here, or walk back to base, free for new orders."""
        self._leave()
        if self.group.after == "stay" or self.here() is self.base:
            self.equipped = False
            self.world.publish_place(self, "waiting")
        else:
            self._walk_idle(self.base)

    def _walk_idle(self, goal: Place) -> None:
        start = self.here()
        length = self.world.terrain.length(start, goal)
        if math.isinf(length):
            return
        now = self.world.clock.now
        self.place = start
        self.leg = Leg(start, goal, now, length, now + length / self.speed)
        self.world.moving(self, True)
        self._then(length / self.speed, self._settle, None)

    def _settle(self, _: None) -> None:
        leg = self.leg
        assert leg is not None
        self._stop()
        self.place = leg.goal
        self.equipped = False
        self.world.publish_place(self, "waiting")

    # --- the small print -------------------------------------------------------------------

    def here(self) -> Place:
        """Return its position now."""
        leg = self.leg
        if leg is None:
            return self.place
        return self.world.terrain.along(leg.start, leg.goal, self._gone(leg))

    def _gone(self, leg: Leg) -> float:
        whole = leg.until - leg.since
        share = (self.world.clock.now - leg.since) / whole if whole > 0.0 else 1.0
        return leg.length * min(1.0, share)

    def _stop(self) -> None:
        """End the present leg, wherever it has led to."""
        leg = self.leg
        if leg is None:
            return
        now = self.world.clock.now
        gone = self._gone(leg)
        job = self.job
        if now < leg.until - ROUNDING:
            self.place = self.world.terrain.along(leg.start, leg.goal, gone)
        self.distance += gone
        self.leg = None
        self.world.moving(self, False)
        if job is not None and job.inside and self.kind == "guard" and job.phase == "travel":
            pace = leg.length / (leg.until - leg.since) if leg.until > leg.since else 0.0
            inside = approach(job.incident, leg.since, leg.length, pace, now)
            self.world.exposed(self, "approach", inside)

    def _drop(self) -> float | None:
        """Break off the current job; return when the unit would have been ready to set out [s]."""
        job = self.job
        self._ticket += 1
        if job is None:
            if self.leg is not None:
                self._stop()
                self.world.publish_place(self, "waiting")
            return None
        self._stop()
        ready_at = self._ready_at if job.phase == "ready" else None
        if job.phase in ("look", "act"):
            self._near = job.incident
        self._turn_to(job, "dropped")
        self.world.freed(self, job)
        self.job = None
        self.world.publish_place(self, "waiting")
        return ready_at

    def _turn_to(self, job: Job, phase: str) -> None:
        """Turn to another phase of the same job."""
        world = self.world
        now = self.world.clock.now
        if now > self.since:
            world.spent(self, job.phase, self.since)
            if self.kind == "guard" and job.phase in ("look", "act"):
                seconds = on_scene(job.incident, self.since, now)
                world.exposed(self, job.phase, seconds)
        job.phase = phase
        self.since = now

    def _then(self, delay: float, action: Any, job: Job | None) -> None:
        """Run an action after a delay, unless the unit begins another one first."""
        self._ticket += 1
        if delay <= 0.0:
            action(job)
        else:
            self.world.after(delay, self._due, self._ticket, action, job)

    def _due(self, ticket: int, action: Any, job: Job | None) -> None:
        if ticket == self._ticket:
            action(job)
