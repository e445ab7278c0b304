"""Guards: people who walk to an event, confirm and contain it, and withdraw from danger.

A guard **withdraws** as soon as what is around it is untenable, what is right ahead of it deadly,
or its dose is `HURT`: whatever it was on, it tells `failed`, and goes to its post or the nearest
exit by a way that is not untenable, looking ahead as bystanders do. But who was sent to look, and
has the place in sight, has seen enough: it confirms first. Until the guard is there it takes no
orders; with such a dose it never takes one again. One who is incapacitated stays where it is, and
its device answers that it lies down.

**Containment** works from a distance: a fire with a hand-held extinguisher, a leak or a
burst pipe by its valve, which is taken to be no nearer than the air allows to go.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from itertools import takewhile

from dva_sim.agents.device import MAX_BID, STATUS, AgentDevice, do_nothing
from dva_sim.agents.observation import SEEN_THROUGH, no_smoke
from dva_sim.agents.people.evacuation import AirAt, Exposure, OnFoot, WayOut, clean_air
from dva_sim.agents.people.guard_protocol import Errand, GuardProtocol
from dva_sim.agents.people.profiles import Walker
from dva_sim.agents.people.walking import Walking
from dva_sim.protocol import messages as m
from dva_sim.worlds.hazards import KINDS
from dva_sim.worlds.planning import Planner

STATUS_PERIOD = 2.0  # design: interval of reports of a guard's position [s]
FIRST_STATUS = 0.5  # design: time until the first report [s]
CONFIRMED = "confirmed"
REFUTED = "refuted"
CONTAINED = "contained"

Point = tuple[float, float]


class GuardAgent(OnFoot):
    """A guard on duty: walks, looks, works and tells; what it is on is decided by `GuardProtocol`.

    Args:
        device: Identity and connections of the guard.
        walker: Walking and working properties.
        planner: The guard knows the building.
        walking: Walking model; its first position is the guard's post.
        is_there: Predicate: True if a hazard of a kind really is near a place [m].
        contain: Callback with the kind and place of a contained event [m].
        air: Conditions at a place [m] and time [s].
        refuges: Exits, which are safe regardless of the air there [m].
        smoke: Optical depth of the smoke between two places now.
    """

    def __init__(
        self,
        device: AgentDevice,
        walker: Walker,
        planner: Planner,
        walking: Walking,
        *,
        is_there: Callable[[str, float, float], bool],
        contain: Callable[[str, float, float], object] = do_nothing,
        air: AirAt = clean_air,
        refuges: Sequence[Point] = (),
        smoke: Callable[[Point, Point], float] = no_smoke,
    ) -> None:
        super().__init__(walking, Exposure(device.clock, walking, air))
        self.device = device
        self._walker = walker
        self._planner = planner
        self._habits = walker.habits.work
        device.meanwhile = "an order in hand goes on"
        self._post = walking.place
        self._refuges = refuges
        self._way_out = WayOut(device.clock, planner, walking, self.exposure, self._safe_places)
        self.activity = "waiting"
        self._is_there = is_there
        self._contain = contain
        self._smoke = smoke
        self._protocol = GuardProtocol(device.dva, walker.mobilisation, self._is_at)
        device.on_dva = self._protocol.obey
        device.is_engaged = lambda: self._protocol.order is not None
        self.exposure.start(self._felt)
        device.serve(self._on_request)

    def start(self) -> None:
        """Begin to tell where one is."""
        clock = self.device.clock
        clock.every(STATUS_PERIOD, self._publish_status, start=clock.now + FIRST_STATUS)

    def _publish_status(self) -> None:
        position = m.Position(*self.device.frame.to_latlon(*self.walking.place))
        self.device.publish(STATUS, m.PersonStatus(self.activity, position))

    # --- messages of the DVA ----------------------------------------------------------

    def _on_request(self, message: m.Message) -> m.Reply:
        answer = self._protocol.handle(message, self.device.clock.now)
        if answer.changed:
            self._take_up(self._protocol.errand)
        if answer.bid_on is not None:
            self.device.clock.call_after(0.0, self._bid, answer.bid_on)
        return m.Reply(message.message_id, answer.code, answer.text)

    def _take_up(self, errand: Errand | None) -> None:
        """Begin another errand; pending steps of an older one have no effect."""
        if errand is None:
            self.walking.stop()
            self.activity = "waiting"
            self.device.tell("is told that the order is over", "order")
            return
        if errand.order is not None:
            purpose = {"contain": " to contain it", "stand_by": " to stand by"}.get(
                errand.order.task, ""
            )
            self.device.tell(f"is sent to event {errand.order.event_id}{purpose}", "order")
        if self._protocol.ready_at > self.device.clock.now:
            self.activity = "getting ready"
        self.device.clock.call_at(self._protocol.ready_at, self._depart, errand)

    def _bid(self, announced: m.TaskAnnouncement) -> None:
        """Bid for a task, with this guard's own pace and position."""
        if self._protocol.order is not None:
            return
        distance = self._planner.distance(self.walking.place, self._xy(announced.position))
        under_way = (
            self._protocol.errand is not None and self._protocol.ready_at <= self.device.clock.now
        )
        ready = 0.0 if under_way else self._walker.usual_mobilisation
        arrival = ready + distance / self._walker.speed
        if arrival <= MAX_BID:
            self.device.ask(self.device.dva, m.TaskBid(announced.event_id, arrival))

    # --- walking -----------------------------------------------------------------------

    def _depart(self, errand: Errand) -> None:
        if errand is not self._protocol.errand:
            return
        goal, is_far_enough = self._goal(errand)
        arrived = partial(self._arrive, errand)
        blocked = self._cannot_pass
        self.activity = "walking"
        if not self.walking.go(goal, arrived, blocked, is_far_enough):
            self.device.tell("finds no way there", "event")
            self._finish("failed")
        elif errand.order is not None:
            self.device.progress(errand.order.event_id, "departed")

    def _cannot_pass(self) -> None:
        self.device.tell("cannot get past what is in the way, and gives up", "event")
        self._finish("failed")

    def _goal(self, errand: Errand) -> tuple[Point, Callable[[Point], bool]]:
        """Return the destination of a path, and a test whether a point on it is near enough."""
        place = self._xy(errand.place)
        if errand.order is None:
            return place, lambda at: False
        if errand.order.task != "stand_by":
            return place, partial(self._is_near_enough, errand.order, place)
        off = self._habits.stands_off_m
        if math.dist(self.walking.place, place) < off:
            return self._post, lambda at: math.dist(at, place) >= off  # too near: back off
        return place, lambda at: math.dist(at, place) <= off

    def _is_at(self, place: m.Position) -> bool:
        return math.dist(self.walking.place, self._xy(place)) < self._habits.is_there_m

    def _is_near_enough(self, order: m.Order, place: Point, at: Point) -> bool:
        """Return True if the order can be carried out from here."""
        has_valve = order.task == "contain" and not _is_extinguished(order.kind)
        ahead = self.walking.places_ahead(1.0, self._habits.keeps_off_m) if has_valve else []
        return any(map(self.exposure.is_bad, ahead)) or self._is_in_reach(order, place, at)

    def _is_in_reach(self, order: m.Order, place: Point, at: Point) -> bool:
        own = self._habits
        within = own.extinguishes_from_m if _is_extinguished(order.kind) else own.sees_from_m
        return self._sees(order.kind, at, place, within)

    def _sees(self, kind: str, at: Point, place: Point, within: float) -> bool:
        """Return True if a place is near enough [m], with neither wall nor thick smoke between.

        As for cameras, thick smoke itself counts as a sign of the fire.
        """
        if math.dist(at, place) > within or not self._planner.line_of_sight(at, place):
            return False
        return KINDS[kind].shines or self._smoke(at, place) < SEEN_THROUGH

    # --- work at the event ------------------------------------------------------------

    def _arrive(self, errand: Errand) -> None:
        order = errand.order
        clock = self.device.clock
        if order is None:
            self._post = self.walking.place
            self._finish()
        elif order.task == "stand_by":
            self.activity = "standing by"
            clock.call_after(self._habits.stands_by_s, self._give_up, errand)
        else:
            self.device.progress(order.event_id, "arrived")
            if order.task == "contain" and self._is_there(order.kind, *self._xy(order.position)):
                self._begin_to_contain(errand)
            else:
                self.activity = "looking"
                clock.call_after(self._walker.look, self._looked, errand)

    def _give_up(self, errand: Errand) -> None:
        """End standing by, after this guard has not been needed for a while."""
        if errand is self._protocol.errand:
            self._finish("failed")

    def _looked(self, errand: Errand) -> None:
        order = errand.order
        if errand is not self._protocol.errand or order is None:
            return
        if not self._is_there(order.kind, *self._xy(order.position)):
            self._report(order, REFUTED)
        elif order.task == "confirm":
            self._report(order, CONFIRMED)
        else:
            self._begin_to_contain(errand)

    def _begin_to_contain(self, errand: Errand) -> None:
        walker = self._walker
        order = errand.order
        extinguished = order is not None and _is_extinguished(order.kind)
        takes = walker.extinguish if extinguished else walker.contain
        self.activity = "containing"
        self.device.clock.call_after(takes, self._contained, errand)

    def _contained(self, errand: Errand) -> None:
        order = errand.order
        if errand is self._protocol.errand and order is not None:
            self._contain(order.kind, *self._xy(order.position))
            self._report(order, CONTAINED)

    def _report(self, order: m.Order, finding: str) -> None:
        body = m.EventReport(order.event_id, order.kind, order.position, 0.5, 0.99, finding)
        self.device.report_finding(body)
        self.device.tell(f"{finding} event {order.event_id}", "event")
        self._finish("done", at_event=True)

    def _finish(self, state: str | None = None, at_event: bool = False) -> None:
        order = self._protocol.order
        if order is not None and state is not None:
            self.device.progress(order.event_id, state)
        self._protocol.is_over(at_event)
        self.activity = "waiting"

    # --- withdrawal ------------------------------------------------------------------

    def _felt(self) -> None:
        """Breathe this air for half a second more."""
        if self.dose.incapacitated:
            self.exposure.end()
            self._give_back("lies down")
            self._way_out.end()
            self.activity = "incapacitated"
            self.device.tell("is incapacitated", "safety")
        elif not self._protocol.unfit and (self.exposure.is_too_much or self._is_deadly_ahead()):
            self._give_back("withdraws from danger")
            self.activity = "withdrawing"
            self.device.tell("withdraws", "safety")
            self._way_out.leave(self._is_safe)
        elif self.activity == "withdrawing":
            self._way_out.look_ahead()

    def _is_deadly_ahead(self) -> bool:
        """Return True if an errand leads into deadly conditions before it is near enough."""
        if self.activity != "walking":
            return False
        far = self._habits.looks_ahead_m
        ahead = takewhile(self._goes_on_from, self.walking.places_ahead(0.5, far))
        return any(map(self.exposure.is_deadly, ahead))

    def _goes_on_from(self, at: Point) -> bool:
        """Return True if a place [m] is not near enough yet to the goal."""
        order = self._protocol.order
        return order is None or not self._is_in_reach(order, self._xy(order.position), at)

    def _give_back(self, unfit: str) -> None:
        """Abandon the present errand, for a reason."""
        order = self._protocol.order
        self._protocol.unfit = unfit
        if order is None:
            self._finish()
        elif order.task == "confirm" and self._has_seen(order):
            self._report(order, CONFIRMED)
        else:
            self._finish("failed")

    def _has_seen(self, order: m.Order) -> bool:
        at = self.walking.place
        place = self._xy(order.position)
        within = self._habits.in_sight_m
        return self._sees(order.kind, at, place, within) and self._is_there(order.kind, *place)

    def _safe_places(self) -> list[Point]:
        """Return where to withdraw to: its post, unless that is bad, and the exits."""
        post = [] if self.exposure.is_bad(self._post) else [self._post]
        return [*post, *(place for place in self._refuges if place != self._post)]

    def _is_safe(self) -> None:
        """Recover at a refuge, unless hurt; at an exit step out."""
        here = self.walking.place
        near = self._habits.is_there_m
        if any(math.dist(here, place) < near for place in self._refuges):
            self.exposure.step_out()
        self._protocol.unfit = "is hurt" if self.exposure.is_hurt else ""
        self.activity = "hurt" if self.exposure.is_hurt else "waiting"

    def _xy(self, place: m.Position) -> Point:
        return self.device.frame.to_xy(place.latitude, place.longitude)


def _is_extinguished(kind: str) -> bool:
    """Return True for an event that an extinguisher ends, rather than a valve."""
    return KINDS[kind].contained_by == "extinguisher"
