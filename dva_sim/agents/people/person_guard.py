"""A person as a guard: a guard's device whose decisions a real person makes.

It takes the DVA's orders by the protocol of all guards, and reports the person's entries. Its body
stands at the position that the person enters. If nobody plays it, orders are declined after a
while.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from dva_sim.agents.device import MAX_BID, STATUS, AgentDevice, do_nothing
from dva_sim.agents.people.evacuation import AirAt, Exposure, OnFoot, clean_air
from dva_sim.agents.people.guard import (
    CONFIRMED,
    CONTAINED,
    FIRST_STATUS,
    REFUTED,
    STATUS_PERIOD,
    Point,
)
from dva_sim.agents.people.guard_protocol import Errand, GuardProtocol
from dva_sim.agents.people.profiles import Walker
from dva_sim.agents.people.walking import Walking
from dva_sim.kernel.errors import ConfigError
from dva_sim.protocol import messages as m
from dva_sim.protocol.event_kinds import SEVERITIES
from dva_sim.worlds.planning import Planner

DECLINED_AFTER: Final = 30.0  # design: time until an order without a player is declined [s]
SET_OUT: Final = 2.0  # design: distance walked since the order that counts as departed [m]
FINDINGS: Final = (CONFIRMED, REFUTED, CONTAINED)
SAYINGS: Final = ("departed", "arrived", *FINDINGS, "help")

OnResult = Callable[[bool, str], object]


class PersonGuard(OnFoot):
    """A guard that a person can play.

    Args:
        device: Identity and connections of the guard.
        walker: Profile with the pace that the DVA expects.
        planner: Planner of the site.
        walking: Walking model; its first position is the guard's post.
        put: Function that moves the body to a position [m].
        contain: Callback with the kind and place of a contained event [m].
        air: Conditions at a place [m] and time [s].

    Attributes:
        attended: True if a person plays it.
        answered: True once the person has accepted the order.
        alert: Message for the person.
        wanted: Event to which the person goes of their own accord: its order is accepted at once;
            0: there is none.
    """

    def __init__(
        self,
        device: AgentDevice,
        walker: Walker,
        planner: Planner,
        walking: Walking,
        *,
        put: Callable[[float, float], object],
        contain: Callable[[str, float, float], object] = do_nothing,
        air: AirAt = clean_air,
    ) -> None:
        super().__init__(walking, Exposure(device.clock, walking, air))
        self.device = device
        self._walker = walker
        self._planner = planner
        device.meanwhile = "an order in hand goes on"
        self._put = put
        self._contain = contain
        self.attended = self.answered = self._needs_help = False
        self.alert = ""
        self.wanted = 0
        self._stage = ""  # last reported stage of the order
        self._order_at: Point = walking.place
        self._protocol = GuardProtocol(device.dva, 0.0, self._is_at)
        device.on_dva = self._protocol.obey
        device.is_engaged = lambda: self._protocol.order is not None
        self.exposure.start(self._felt)
        device.serve(self._on_request)

    def start(self) -> None:
        """Begin to tell where one is."""
        clock = self.device.clock
        clock.every(STATUS_PERIOD, self._publish_status, start=clock.now + FIRST_STATUS)

    @property
    def order(self) -> m.Order | None:
        """Order of the DVA, until it is settled."""
        return self._protocol.order

    @property
    def activity(self) -> str:
        """Activity of the person, in words."""
        if self._needs_help:
            return "needs help"
        if not self.attended:
            return "nobody there"
        if self.order is None:
            return "waiting"
        if not self.answered:
            return "reads an order"
        return {"departed": "walking", "arrived": "looking"}.get(self._stage, "getting ready")

    def goal(self) -> tuple[Point, float, list[list[float]]] | None:
        """Return the order's place [m], and the path there: its length and points [m]."""
        if self.order is None:
            return None
        place = self._xy(self.order.position)
        path = self._planner.path(self.walking.place, place)
        points = [] if path is None else [[round(x, 2), round(y, 2)] for x, y in path.tolist()]
        return place, self._planner.distance(self.walking.place, place), points

    # --- actions of the person --------------------------------------------------------------

    def join(self) -> None:
        """Let a person play this guard from now on."""
        self.attended = True
        self.alert = ""

    def leave(self) -> None:
        """End the person's play: an open order is given back."""
        if self.order is not None:
            self._give_back("failed" if self.answered else "declined", "leaves")
        self.attended = self._needs_help = False

    def answer(self, accepts: bool, reason: str, on_result: OnResult) -> None:
        """Accept the order, or decline it."""
        order = self.order
        if order is None:
            on_result(False, "You have no order.")
        elif accepts:
            self.answered = True
            self.device.progress(order.event_id, "accepted")
            on_result(True, f"event {order.event_id} is yours")
        else:
            self._give_back("failed" if self.answered else "declined", reason or "no reason given")
            on_result(True, f"event {order.event_id} is given back")

    def say(self, what: str, on_result: OnResult) -> None:
        """Report progress, one of `SAYINGS`."""
        order = self.order
        if what == "help":
            self._needs_help = not self._needs_help  # a second report withdraws the first
            now = "need help" if self._needs_help else "need no help any more"
            self.device.tell(now.replace("need", "needs", 1), "safety")
            self._publish_status()
            on_result(True, f"the DVA knows that you {now}")
        elif order is None:
            on_result(False, "You have no order.")
        elif what in FINDINGS:
            self._find(order, what, on_result)
        else:
            self._needs_help = False
            self._reach(order, what)
            on_result(True, f"{what} has been reported")

    def stand_at(self, x: float, y: float, on_result: OnResult) -> None:
        """Say where one is [m]."""
        try:
            self._put(x, y)
        except ConfigError as error:
            on_result(False, error.problem)
            return
        self._publish_status()
        errand = self._protocol.errand
        if errand is not None and errand.order is None and self._is_at(errand.place):
            self._protocol.is_over()
        far = math.dist(self._order_at, (x, y)) > SET_OUT
        if self.order is not None and self.answered and far:
            self._reach(self.order, "departed")
        on_result(True, "")

    def report(self, kind: str, x: float, y: float, severity: str, on_result: OnResult) -> None:
        """Report an event at a place [m]."""
        position = m.Position(*self.device.frame.to_latlon(x, y))
        body = m.EventReport(None, kind, position, SEVERITIES[severity], 0.9, "detected")
        self._ask(body, f"{kind.replace('_', ' ')} is reported", on_result)
        self.device.tell(f"reports {kind.replace('_', ' ')}", "event")

    def _find(self, order: m.Order, finding: str, on_result: OnResult) -> None:
        place = self._xy(order.position)
        off = math.dist(self.walking.place, place)
        most = self._walker.habits.work.keeps_off_m
        if finding == CONTAINED and off > most:
            on_result(False, f"it is {off:.0f} m away: go within {most:g} m to contain it")
            return
        self._reach(order, "arrived")
        if finding == CONTAINED:
            self._contain(order.kind, *place)
        body = m.EventReport(order.event_id, order.kind, order.position, 0.5, 0.99, finding)
        self._tell(body, f"event {order.event_id} is {finding}", on_result)
        self.device.tell(f"{finding} event {order.event_id}", "event")
        if finding == CONFIRMED and order.task == "contain":
            return  # it still has to be contained
        self.device.progress(order.event_id, "done")
        self._end(at_event=True)

    def _reach(self, order: m.Order, stage: str) -> None:
        """Report each stage to the DVA once, in order; arrival implies acceptance."""
        if not self.answered:
            self.answered = True
            self.device.progress(order.event_id, "accepted")
        if not self._stage:
            self._stage = "departed"
            self.device.progress(order.event_id, "departed")
        if stage == "arrived" and self._stage == "departed":
            self._stage = "arrived"
            self.device.progress(order.event_id, "arrived")

    def _tell(self, body: m.EventReport, done: str, on_result: OnResult) -> None:
        """Report a finding; one that the DVA does not keep yet is reported again by itself."""

        def answered(reply: m.Reply) -> None:
            later = "; the DVA cannot store that yet, so it is sent again"
            is_heard = reply.code in (m.OK, m.BUSY)
            text = done + (later if reply.code == m.BUSY else "")
            on_result(is_heard, text if is_heard else reply.reason)

        def unheard() -> None:
            on_result(False, "the DVA does not answer; it is sent again until it does")

        self.device.report_finding(body, answered, unheard)

    def _ask(self, body: m.Body, done: str, on_result: OnResult) -> None:
        def answered(reply: m.Reply) -> None:
            ok = reply.code == m.OK
            on_result(ok, done if ok else reply.reason)

        unreachable = lambda: on_result(False, "the DVA does not answer")  # noqa: E731
        self.device.ask(self.device.dva, body, answered, unreachable)

    # --- messages of the DVA ----------------------------------------------------------------

    def _on_request(self, message: m.Message) -> m.Reply:
        had = self.order
        now = self.device.clock.now
        answer = self._protocol.handle(message, now)
        if answer.changed:
            self._changed(had, self._protocol.errand)
        if answer.bid_on is not None and self.attended:
            self.device.clock.call_after(0.0, self._bid, answer.bid_on)
        return m.Reply(message.message_id, answer.code, answer.text)

    def _changed(self, had: m.Order | None, errand: Errand | None) -> None:
        """Change to another errand, or to none."""
        self.answered = False
        self._stage = ""
        self._order_at = self.walking.place
        if errand is None:
            self.alert = f"event {had.event_id} is settled, or another's" if had else ""
        elif errand.order is None:
            x, y = self._xy(errand.place)
            self.alert = f"the DVA asks you to wait at x {x:.0f} m, y {y:.0f} m"
        else:
            self.alert = ""
            self.device.tell(f"is asked to go to event {errand.order.event_id}", "order")
            self.device.clock.call_after(DECLINED_AFTER, self._decline_alone, errand.order)
            if errand.order.event_id == self.wanted:
                self.device.clock.call_after(0.0, self.answer, True, "", do_nothing)
            self.wanted = 0

    def _decline_alone(self, order: m.Order) -> None:
        """Decline the order, since nobody plays the guard."""
        if self.order is order and not self.attended:
            self._give_back("declined", "nobody sits here")

    def _bid(self, announced: m.TaskAnnouncement) -> None:
        distance = self._planner.distance(self.walking.place, self._xy(announced.position))
        arrival = self._walker.usual_mobilisation + distance / self._walker.speed
        if self.order is None and arrival <= MAX_BID:
            self.device.ask(self.device.dva, m.TaskBid(announced.event_id, arrival))

    def _give_back(self, state: str, why: str) -> None:
        order = self.order
        assert order is not None
        self.device.progress(order.event_id, state)
        self.device.tell(f"gives event {order.event_id} back: {why}", "order")
        self._end()

    def _end(self, at_event: bool = False) -> None:
        self._protocol.is_over(at_event)
        self.answered = False
        self._stage = ""
        self._needs_help = False

    def _felt(self) -> None:
        """Breathe this air for half a second more: leaving it is up to the person."""
        if self.exposure.is_too_much and self.attended:
            self.alert = "the air where you stand is dangerous: leave"

    def _publish_status(self) -> None:
        position = m.Position(*self.device.frame.to_latlon(*self.walking.place))
        self.device.publish(STATUS, m.PersonStatus(self.activity, position))

    def _is_at(self, place: m.Position) -> bool:
        here = self._walker.habits.work.is_there_m
        return math.dist(self.walking.place, self._xy(place)) < here

    def _xy(self, place: m.Position) -> Point:
        return self.device.frame.to_xy(place.latitude, place.longitude)
