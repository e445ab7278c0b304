"""Guards: people who walk to an event, look at it, and deal with it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from dva_sim.agents.device import STATUS, Device, do_nothing
from dva_sim.agents.duty import Errand, GuardDuty
from dva_sim.agents.operator.person import Trait
from dva_sim.agents.steering import Route
from dva_sim.config import Config
from dva_sim.protocol import messages as m
from dva_sim.worlds.planning import Planner

STATUS_PERIOD, FIRST_STATUS = 2.0, 0.5  # of where a guard is [s]
STEP = 0.5  # how often a walking guard's place is looked at [s]
SLOWEST, FASTEST = 0.6, 2.2  # [m/s]
NEAR_ENOUGH = 2.0  # from where a guard sees what there is, if nothing stands between [m]
HERE = 1.0  # who is so near a place stands at it [m]
STAND_OFF = 10.0
"""Who stands by waits so far from the place [m]: no hazard is dangerous beyond 7 m, one step may
lead a metre too far, and a place is reported a metre or two wrong."""
STAND_BY_FOR = 900.0  # who stands by gives up if the DVA says nothing for so long [s]
MOST = 1e6  # no bid is longer [s]
CONFIRMED, REFUTED, CONTAINED = "confirmed", "refuted", "contained"

Point = tuple[float, float]


class GuardProfile(Config):
    """How guards are drawn.

    Attributes:
        walking_mean_mps: Mean walking speed of a person.
        walking_sd_mps: Its standard deviation between persons.
        mobilisation_s: From the order to the first step.
        confirm_look_s: From arrival to being sure.
        contain_s: From arrival until the danger is over: a young fire put out, a valve or a
            door shut. Assumed; no measurement stands behind it.

    References:
        Walking speed 1.34 m/s (SD 0.26): U. Weidmann, Transporttechnik der Fussgaenger,
        ETH Zuerich, 1993. Turnout within 80 s in 90 % of all cases: NFPA 1710.
    """

    description: str = ""
    walking_mean_mps: Annotated[float, Field(gt=0)] = 1.34
    walking_sd_mps: Annotated[float, Field(ge=0)] = 0.26
    mobilisation_s: Trait = Trait(median=45.0, spread=0.45)
    confirm_look_s: Trait = Trait(median=3.0, spread=0.3)
    contain_s: Trait = Trait(median=120.0, spread=0.5)


@dataclass(frozen=True)
class Walker:
    """One guard.

    Attributes:
        speed: Walking [m/s].
        mobilisation: From an order to the first step [s].
        look: From arrival to being sure [s].
        contain: From arrival until the danger is over [s].
        usual_mobilisation: What the guard itself expects of getting ready [s]: as long as
            guards usually need. How long it takes this time shows when it is over.
    """

    speed: float
    mobilisation: float
    look: float
    contain: float = 60.0
    usual_mobilisation: float = 45.0

    @classmethod
    def draw(cls, profile: GuardProfile, rng: np.random.Generator) -> Walker:
        """One guard of a profile."""
        speed = rng.normal(profile.walking_mean_mps, profile.walking_sd_mps)
        return cls(
            speed=float(np.clip(speed, SLOWEST, FASTEST)),
            mobilisation=profile.mobilisation_s.draw(rng),
            look=profile.confirm_look_s.draw(rng),
            contain=profile.contain_s.draw(rng),
            usual_mobilisation=profile.mobilisation_s.median,
        )


class GuardAgent:
    """A guard on duty: walks, looks, works and tells; what it is on is decided by `GuardDuty`.

    Args:
        device: Identity and ways to talk.
        walker: How this guard walks and works.
        planner: The guard knows the building.
        position: Where the guard stands first [m].
        is_there: Whether something of a kind really is near a place [m].
        contain: Told of what kind is dealt with near a place [m].
    """

    def __init__(
        self,
        device: Device,
        walker: Walker,
        planner: Planner,
        position: Point,
        is_there: Callable[[str, float, float], bool],
        contain: Callable[[str, float, float], object] = do_nothing,
    ) -> None:
        self.device, self._walker, self._planner = device, walker, planner
        self.x, self.y = self._post = position
        self.heading = 0.0
        self.activity = "waiting"
        self._is_there, self._contain = is_there, contain
        self._duty = GuardDuty(device.dva, walker.mobilisation, self._stands_at)
        device.serve(self._on_request)

    def start(self) -> None:
        """Begin to tell where one is."""
        clock = self.device.clock
        clock.every(STATUS_PERIOD, self._publish_status, start=clock.now + FIRST_STATUS)

    def _publish_status(self) -> None:
        position = m.Position(*self.device.frame.to_latlon(self.x, self.y))
        self.device.publish(STATUS, m.PersonStatus(self.activity, position))

    # --- what the DVA says -------------------------------------------------------------

    def _on_request(self, message: m.Message) -> m.Reply:
        answer = self._duty.handle(message, self.device.clock.now)
        if answer.changed:
            self._take_up(self._duty.errand)
        if answer.bid_on is not None:
            self.device.clock.call_after(0.0, self._bid, answer.bid_on)
        return m.Reply(message.message_id, answer.code, answer.text)

    def _take_up(self, errand: Errand | None) -> None:
        """Begin another errand; the steps of an older one come to nothing by themselves."""
        if errand is None:
            self.activity = "waiting"
            self.device.tell("is told that the order is over", "order")
            return
        if errand.order is not None:
            self.device.tell(_in_words(errand.order), "order")
        if self._duty.ready_at > self.device.clock.now:
            self.activity = "getting ready"
        self.device.clock.call_at(self._duty.ready_at, self._depart, errand)

    def _bid(self, announced: m.TaskAnnouncement) -> None:
        """Offer to go, by what only this guard knows: its pace, and where it stands now."""
        if self._duty.order is not None:
            return
        way = self._planner.distance((self.x, self.y), self._xy(announced.position))
        under_way = self._duty.errand is not None and self._duty.ready_at <= self.device.clock.now
        ready = 0.0 if under_way else self._walker.usual_mobilisation
        arrival = ready + way / self._walker.speed
        if arrival <= MOST:
            self.device.ask(self.device.dva, m.TaskBid(announced.event_id, arrival))

    # --- the way -----------------------------------------------------------------------

    def _depart(self, errand: Errand) -> None:
        if errand is not self._duty.errand:
            return
        goal, is_far_enough = self._goal(errand)
        points = self._planner.path((self.x, self.y), goal)
        if points is None:
            self.device.tell("finds no way there", "event")
            self._finish("failed")
            return
        self.activity = "walking"
        if errand.order is not None:
            self.device.progress(errand.order.event_id, "departed")
        self._walk(errand, Route(points), is_far_enough, 0.0)

    def _goal(self, errand: Errand) -> tuple[Point, Callable[[Point], bool]]:
        """Where the way leads to, and from where on it need not be gone to its end."""
        place = self._xy(errand.place)
        if errand.order is None:
            return place, lambda at: False
        if errand.order.task != "stand_by":
            return place, lambda at: self._sees(at, place)
        if math.dist((self.x, self.y), place) < STAND_OFF:
            return self._post, lambda at: math.dist(at, place) >= STAND_OFF  # too near: back off
        return place, lambda at: math.dist(at, place) <= STAND_OFF

    def _stands_at(self, place: m.Position) -> bool:
        return math.dist((self.x, self.y), self._xy(place)) < HERE

    def _sees(self, at: Point, place: Point) -> bool:
        """Whether a place is near, and nothing stands between."""
        near = math.hypot(place[0] - at[0], place[1] - at[1]) <= NEAR_ENOUGH
        return near and self._planner.line_of_sight(at, place)

    def _walk(
        self, errand: Errand, route: Route, is_far_enough: Callable[[Point], bool], along: float
    ) -> None:
        """One step."""
        if errand is not self._duty.errand:
            return
        x, y = route.point_at(along)
        if (x, y) != (self.x, self.y):
            self.heading = math.atan2(y - self.y, x - self.x)
        self.x, self.y = x, y
        if along >= route.length or is_far_enough((x, y)):
            self._arrive(errand)
        else:
            further = min(along + self._walker.speed * STEP, route.length)
            self.device.clock.call_after(STEP, self._walk, errand, route, is_far_enough, further)

    # --- what is done there ------------------------------------------------------------

    def _arrive(self, errand: Errand) -> None:
        order, clock = errand.order, self.device.clock
        if order is None:
            self._post = self.x, self.y
            self._finish()
        elif order.task == "stand_by":
            self.activity = "standing by"
            clock.call_after(STAND_BY_FOR, self._give_up, errand)
        else:
            self.device.progress(order.event_id, "arrived")
            if order.task == "contain" and self._is_there(order.kind, *self._xy(order.position)):
                self._begin_to_contain(errand)
            else:
                self.activity = "looking"
                clock.call_after(self._walker.look, self._looked, errand)

    def _give_up(self, errand: Errand) -> None:
        """Nobody needs who has stood by for so long."""
        if errand is self._duty.errand:
            self._finish("failed")

    def _looked(self, errand: Errand) -> None:
        order = errand.order
        if errand is not self._duty.errand or order is None:
            return
        if not self._is_there(order.kind, *self._xy(order.position)):
            self._report(order, REFUTED)
        elif order.task == "confirm":
            self._report(order, CONFIRMED)
        else:
            self._begin_to_contain(errand)

    def _begin_to_contain(self, errand: Errand) -> None:
        self.activity = "containing"
        self.device.clock.call_after(self._walker.contain, self._contained, errand)

    def _contained(self, errand: Errand) -> None:
        order = errand.order
        if errand is self._duty.errand and order is not None:
            self._contain(order.kind, *self._xy(order.position))
            self._report(order, CONTAINED)

    def _report(self, order: m.Order, finding: str) -> None:
        body = m.EventReport(order.event_id, order.kind, order.position, 0.5, 0.99, finding)
        self.device.ask(self.device.dva, body)
        self.device.tell(f"{finding} event {order.event_id}", "event")
        self._finish("done", at_event=True)

    def _finish(self, state: str | None = None, at_event: bool = False) -> None:
        order = self._duty.order
        if order is not None and state is not None:
            self.device.progress(order.event_id, state)
        self._duty.is_over(at_event)
        self.activity = "waiting"

    def _xy(self, place: m.Position) -> Point:
        return self.device.frame.to_xy(place.latitude, place.longitude)


def _in_words(order: m.Order) -> str:
    purpose = {"contain": " to contain it", "stand_by": " to stand by"}.get(order.task, "")
    return f"is sent to event {order.event_id}{purpose}"
