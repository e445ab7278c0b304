"""Guards: people who walk to an event and look at it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from dva_sim.agents.device import STATUS, Device
from dva_sim.agents.operator.person import Trait
from dva_sim.agents.steering import Route
from dva_sim.config import Config
from dva_sim.protocol import messages as m
from dva_sim.worlds.planning import Planner

STATUS_PERIOD, FIRST_STATUS = 2.0, 0.5  # of where a guard is [s]
STEP = 0.5  # how often a walking guard's place is looked at [s]
SLOWEST, FASTEST = 0.6, 2.2  # [m/s]
NEAR_ENOUGH = 2.0  # from where a guard sees what there is, if nothing stands between [m]


class GuardProfile(Config):
    """How guards are drawn.

    Attributes:
        walking_mean_mps: Mean walking speed of a person.
        walking_sd_mps: Its standard deviation between persons.
        mobilisation_s: From the order to the first step.
        confirm_look_s: From arrival to being sure.

    References:
        Walking speed 1.34 m/s (SD 0.26): U. Weidmann, Transporttechnik der Fussgaenger,
        ETH Zuerich, 1993. Turnout within 80 s in 90 % of all cases: NFPA 1710.
    """

    description: str = ""
    walking_mean_mps: Annotated[float, Field(gt=0)] = 1.34
    walking_sd_mps: Annotated[float, Field(ge=0)] = 0.26
    mobilisation_s: Trait = Trait(median=45.0, spread=0.45)
    confirm_look_s: Trait = Trait(median=3.0, spread=0.3)


@dataclass(frozen=True)
class Walker:
    """One guard: walking speed [m/s], mobilisation and look [s]."""

    speed: float
    mobilisation: float
    look: float

    @classmethod
    def draw(cls, profile: GuardProfile, rng: np.random.Generator) -> Walker:
        """One guard of a profile."""
        speed = rng.normal(profile.walking_mean_mps, profile.walking_sd_mps)
        return cls(
            speed=float(np.clip(speed, SLOWEST, FASTEST)),
            mobilisation=profile.mobilisation_s.draw(rng),
            look=profile.confirm_look_s.draw(rng),
        )


class GuardAgent:
    """A guard on duty.

    Args:
        device: Identity and ways to talk.
        walker: How this guard walks.
        planner: The guard knows the building.
        position: Where the guard stands first [m].
        is_there: Whether something of a kind really is near a place [m].
    """

    def __init__(
        self,
        device: Device,
        walker: Walker,
        planner: Planner,
        position: tuple[float, float],
        is_there: Callable[[str, float, float], bool],
    ) -> None:
        self.device, self._walker, self._planner = device, walker, planner
        self.x, self.y = position
        self.heading = 0.0
        self.activity = "waiting"
        self._is_there = is_there
        self._order: m.Order | None = None
        device.serve(self._on_order)

    def start(self) -> None:
        """Begin to tell where one is."""
        clock = self.device.clock
        clock.every(STATUS_PERIOD, self._publish_status, start=clock.now + FIRST_STATUS)

    def _publish_status(self) -> None:
        position = m.Position(*self.device.frame.to_latlon(self.x, self.y))
        self.device.publish(STATUS, m.PersonStatus(self.activity, position))

    def _on_order(self, message: m.Message) -> m.Reply:
        order = message.body
        if message.source != self.device.dva:
            return m.Reply(message.message_id, m.NOT_PERMITTED, "only the DVA gives orders")
        if not isinstance(order, m.Order) or order.device is not None:
            return m.Reply(message.message_id, m.NOT_SUPPORTED, "a guard takes orders to walk")
        if self._order is not None:
            return m.Reply(message.message_id, m.BUSY, "on the way already")
        self._order, self.activity = order, "getting ready"
        self.device.tell(f"is sent to event {order.event_id}", "order")
        self.device.clock.call_after(self._walker.mobilisation, self._depart)
        return m.Reply(message.message_id, m.OK, "")

    def _depart(self) -> None:
        assert self._order is not None
        place = self._order.position
        goal = self.device.frame.to_xy(place.latitude, place.longitude)
        points = self._planner.path((self.x, self.y), goal)
        if points is None:
            self.device.tell("finds no way there", "event")
            self._finish("failed")
            return
        self.activity = "walking"
        self.device.progress(self._order.event_id, "departed")
        self._walk(Route(points), goal, 0.0)

    def _walk(self, route: Route, goal: tuple[float, float], along: float) -> None:
        """One step; the guard stops where the place can be seen from near."""
        x, y = route.point_at(along)
        if (x, y) != (self.x, self.y):
            self.heading = math.atan2(y - self.y, x - self.x)
        self.x, self.y = x, y
        near = math.hypot(goal[0] - x, goal[1] - y) <= NEAR_ENOUGH
        if along >= route.length or (near and self._planner.line_of_sight((x, y), goal)):
            self._arrive(goal)
        else:
            further = min(along + self._walker.speed * STEP, route.length)
            self.device.clock.call_after(STEP, self._walk, route, goal, further)

    def _arrive(self, goal: tuple[float, float]) -> None:
        assert self._order is not None
        self.activity = "looking"
        self.device.progress(self._order.event_id, "arrived")
        self.device.clock.call_after(self._walker.look, self._report, goal)

    def _report(self, goal: tuple[float, float]) -> None:
        order = self._order
        assert order is not None
        finding = "confirmed" if self._is_there(order.kind, *goal) else "refuted"
        body = m.EventReport(order.event_id, order.kind, order.position, 0.5, 0.99, finding)
        self.device.ask(self.device.dva, body)
        self.device.tell(f"{finding} event {order.event_id}", "event")
        self._finish("done")

    def _finish(self, state: str) -> None:
        assert self._order is not None
        self.device.progress(self._order.event_id, state)
        self._order, self.activity = None, "waiting"
