"""The dispatcher: asks the policy, and gives the orders that the rules allow.

Robots that go their rounds while nothing happens are sent by the DVA itself (`Patrols`).
"""

from __future__ import annotations

import copy
import math
import operator
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from dva_sim.core.auctions import Auctions
from dva_sim.core.dispatch import MinEta
from dva_sim.core.dispatch.situation import (
    Advice,
    Announcement,
    Assignment,
    Policy,
    Relocation,
    Situation,
)
from dva_sim.core.events import Event, State
from dva_sim.core.orders import Orders
from dva_sim.core.questions import Questions
from dva_sim.core.registry import DeviceEntry, Registry
from dva_sim.core.roles import Roles
from dva_sim.core.sessions import DvaAnswer, Send, Sessions
from dva_sim.core.situation_builder import PolicyView, SituationBuilder, same_place
from dva_sim.core.travel_times import SiteKnowledge, Travel
from dva_sim.kernel.plugins import FAILURES
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import ROBOT, ControlRoomRole
from dva_sim.protocol.facts import Fact

DECISIONS = 4  # maximum decisions in a row, where each makes the next necessary


@dataclass(frozen=True, slots=True)
class Advised:
    """Advice of the policy about an event: whom to send, to do what.

    Attributes:
        device: Id of the guard or robot.
        task: `confirm`, `contain` or `stand_by`.
        arrival_in: Expected arrival of the device [s from now].
    """

    device: str
    task: str
    arrival_in: float


class Dispatcher:
    """Dispatcher, which carries out the policy's advice as far as the rules allow.

    Args:
        policy: Policy that advises.
        travel: Travel times and distances.
        orders: Current orders.
        rng: Random generator passed to policies.
        ground: Knowledge of the site.
        roles: Roles of the control rooms.
        name: Name of the policy.

    Attributes:
        auctions: Auctions under way.
        situations: Builder of the situations that the policy decides on.
        questions: Open questions of the policy to people.
        last_failure: Latest failure of the policy, in words.
    """

    def __init__(
        self,
        policy: Policy,
        travel: Travel,
        orders: Orders,
        rng: np.random.Generator,
        ground: SiteKnowledge,
        roles: Roles,
        name: str = "",
    ) -> None:
        self.policy = policy
        self.orders = orders
        self.roles = roles
        self.name = (name or type(policy).__name__)[:64]
        self.questions = Questions(orders.rules.decide_within)
        self.auctions = Auctions(orders.rules.bid_within)
        self.situations = SituationBuilder(policy, travel, orders, ground, self.auctions)
        self.last_failure = ""
        self._rng = rng
        self._ground = ground
        self._default = MinEta()

    def decide(self, now: float) -> list[Send]:
        """Give the orders that are due now; escalate events for which nobody was found in time."""
        sends: list[Send] = []
        self.auctions.close(self.orders.events, now)
        for _ in range(DECISIONS):
            before = self.orders.counters["preempted"]
            orders = self._decide(now)
            sends += orders
            # A recalled responder leaves its task open; an order to look leaves one to stand by.
            looks = self.orders.rules.containment and any(map(_is_to_look, orders))
            if self.orders.counters["preempted"] == before and not looks:
                break
        sends += self.orders.give_up(now)
        self.auctions.close(self.orders.events, now)
        return sends

    def bid(self, device: str, body: m.TaskBid, now: float) -> DvaAnswer:
        """Take a bid, and decide if it was the last."""
        if not self.auctions.bid(body.event_id, device, body.arrival_in, now):
            text = f"no bid was asked for on event {body.event_id}, or it comes too late"
            return DvaAnswer(m.UNKNOWN_EVENT, text)
        return DvaAnswer(sends=self.decide(now))

    def next_deadline(self) -> float:
        """Return when the next wait for an answer is too long [s]."""
        return min(self.auctions.next_deadline(), self.questions.next_deadline())

    def advised(self, event: Event, now: float) -> Advised | None:
        """Return the policy's advice about an event, or what it has done already; None: nothing."""
        if (question := self.questions.of(event.number)) is not None:
            return Advised(question.device, question.task, max(0.0, question.expected - now))
        view = self.situations.look(now)
        if view is not None and event in view.events:
            rng = copy.deepcopy(self._rng)  # a query must not consume random numbers
            for piece in self._advice(view.situation, rng):
                if isinstance(piece, Assignment) and view.events[piece.task] is event:
                    eta = float(view.situation.eta[piece.task, piece.responder])
                    device = view.team.entries[piece.responder].device.id_tag
                    return Advised(device, _task_of(piece, view), eta)
        return self._sent_by_itself(event, now)

    def _sent_by_itself(self, event: Event, now: float) -> Advised | None:
        handling = event.handling
        device = handling.advised
        if not device or device not in (event.responder, event.actor):
            return None
        task = "confirm" if device == event.responder else "contain"
        return Advised(device, task, handling.arrival_in(device, now) or 0.0)

    def _decide(self, now: float) -> list[Send]:
        view = self.situations.look(now)
        sends = list[Send]()
        if view is not None:
            sends = self._carry_out(self._advice(view.situation, self._rng), view, now)
        for event in self.questions.settle():
            self.orders.events.touch(event)
        return sends

    def _advice(self, situation: Situation, rng: np.random.Generator) -> Sequence[Advice]:
        """Return the policy's advice if it is valid, otherwise the default policy's."""
        try:
            advice = list(self.policy.advise(situation, rng))
            _check_form(advice, situation)
        except FAILURES as error:
            self.orders.counters["policy failed"] += 1
            self.last_failure = f"{type(error).__name__}: {error}"
            return self._default.advise(situation, rng)
        return advice

    def _carry_out(self, advice: Sequence[Advice], view: PolicyView, now: float) -> list[Send]:
        """Carry out advice; send no responder to two places and give no task to two responders."""
        taken: set[int] = set()
        tasks: set[int] = set()
        sends: list[Send] = []
        for piece in advice:
            done: list[Send] | None = None
            if isinstance(piece, Announcement):
                done = self._announce(piece, view, now)
            elif piece.responder in taken:
                pass
            elif isinstance(piece, Relocation):
                done = self._relocate(piece, view, now)
            elif piece.task not in tasks:
                done = self._assign(piece, view, now)
                tasks.update({piece.task} if done is not None else ())
            if done is None:
                self.orders.counters["overruled"] += 1
            else:
                sends += done
                if not isinstance(piece, Announcement):
                    taken.add(piece.responder)
        return sends

    # --- orders that the rules allow; None: they forbid them -----------------------------

    def _assign(self, choice: Assignment, view: PolicyView, now: float) -> list[Send] | None:
        """Return the orders that an assignment means."""
        task = view.situation.tasks[choice.task]
        event = view.events[choice.task]
        entry = view.team.entries[choice.responder]
        former = view.team.engaged[choice.responder]
        eta = float(view.situation.eta[choice.task, choice.responder])
        if task.engaged is not None or not math.isfinite(eta):
            return None
        if former is not None and not self.orders.may_preempt(former, now):
            return None
        if self._waits_for_a_person(choice, view, now):
            return []  # not None: the advice is not overruled, a person may still agree
        pilot = None
        if entry.device.device_type == ROBOT:
            if former is None and not view.team.operators:
                return None
            # Popped, so that no other order of this decision gets the same free hand.
            pilot = former.operator if former else view.team.operators.pop(0).device.id_tag
        sends = self.orders.redirect(former, now) if former else []
        responder = entry.device.id_tag
        self._note(event, choice, view, now)
        self.situations.forget_move(responder)
        if task.stage == "contain":
            return [*sends, self.orders.act(event, responder, now)]
        award = self.auctions.award(event.number, responder)
        return [*sends, self.orders.confirm(event, responder, pilot, now, award)]

    def _waits_for_a_person(self, choice: Assignment, view: PolicyView, now: float) -> bool:
        """Return True if a person is asked first and still has time."""
        if not self.questions.asks or not self.somebody_decides():
            return False
        event = view.events[choice.task]
        device = view.team.entries[choice.responder].device
        eta = float(view.situation.eta[choice.task, choice.responder])
        return self.questions.ask(event, _task_of(choice, view), device.id_tag, eta, now)

    def somebody_decides(self) -> bool:
        """Return True if a device is registered whose people may decide."""
        entries = self.orders.registry.entries
        return any(
            role.includes(ControlRoomRole.DISPATCH)
            and (entry := entries.get(device)) is not None
            and not entry.silent
            for device, role in self.roles.known.items()
        )

    def _note(self, event: Event, choice: Assignment, view: PolicyView, now: float) -> None:
        """Note the policy's decision as a fact, and for comparison with people's decisions."""
        orders = self.orders
        if not orders.trail.keeps:
            return
        device = view.team.entries[choice.responder].device.id_tag
        eta = float(view.situation.eta[choice.task, choice.responder])
        event.handling.advised = device
        event.handling.expected[device] = (now, eta)
        is_question = self.questions.asks and self.somebody_decides()
        why = f"nobody has decided within {self.questions.within:g} s" if is_question else ""
        fact = Fact(
            time=now,
            author=orders.sessions.permissions.own,
            label=self.name,
            action="assign",
            event=event.number,
            device=device,
            task=_task_of(choice, view),
            arrival_in=eta,
            cause=why,
            advised=device,
            advised_in=eta,
            waited=now - event.times["detected"],
        )
        orders.decided(event, fact)

    def _announce(self, offer: Announcement, view: PolicyView, now: float) -> list[Send] | None:
        """Ask every idle responder that could go there for a bid."""
        event = view.events[offer.task]
        on_offer = event.number in self.auctions.running
        if not self.policy.auctions or on_offer or event.state is not State.PENDING:
            return None
        idle = view.team.idle().difference(self.orders.engaged)
        able = np.isfinite(view.situation.eta[offer.task])
        both = zip(view.situation.responders, able, strict=True)
        bidders = [responder.device for responder, can in both if can and responder.device in idle]
        if not bidders:
            return None
        self.orders.counters["auctions"] += 1
        within = self.auctions.announce(event.number, bidders, now)
        body = m.TaskAnnouncement(event.number, event.kind, event.position, event.severity, within)
        return [Send(device, body) for device in bidders]

    def _relocate(self, move: Relocation, view: PolicyView, now: float) -> list[Send] | None:
        """Let an idle guard wait elsewhere, unless it is there already, or on its way there."""
        entry = view.team.entries[move.responder]
        cover = view.situation.cover
        assert cover is not None, "without stations there is no such advice: see _check_form"
        place = self._ground.stations[move.station].position
        if entry.position is not None and same_place(place, entry.position):
            return None
        eta = float(cover.eta[move.responder, move.station])  # infinite unless an idle guard's
        if not math.isfinite(eta) or cover.bound_for[move.responder] == move.station:
            return None
        self.situations.sends_to_wait(entry.device.id_tag, move.station, eta, now)
        self.orders.counters["relocated"] += 1
        return [Send(entry.device.id_tag, m.Relocation(place))]


def _task_of(choice: Assignment, view: PolicyView) -> str:
    """Return the task, in the words of an order."""
    task = view.situation.tasks[choice.task]
    if task.stage == "confirm":
        return "confirm"
    return "contain" if view.events[choice.task].state is State.CONFIRMED else "stand_by"


def _is_to_look(send: Send) -> bool:
    body = send.body
    return isinstance(body, m.TaskAward) or (isinstance(body, m.Order) and body.task == "confirm")


def _check_form(advice: Iterable[Advice], situation: Situation) -> None:
    """Reject values that are not advice, or refer to a missing task, responder or station."""
    tasks = len(situation.tasks)
    responders = len(situation.responders)
    stations = len(situation.cover.stations) if situation.cover else 0
    for piece in advice:
        if not isinstance(piece, Advice):
            raise TypeError(f"{piece!r} is not a valid Advice")
        if not isinstance(piece, Relocation):
            _check_place("task", piece.task, tasks)
        if not isinstance(piece, Announcement):
            _check_place("responder", piece.responder, responders)
        if isinstance(piece, Relocation):
            _check_place("station", piece.station, stations)


def _check_place(what: str, index: object, count: int) -> None:
    # True and False would pass as the indices 1 and 0.
    if isinstance(index, bool) or not 0 <= operator.index(index) < count:  # type: ignore[arg-type]
        raise IndexError(f"there is no {what} {index!r}; there are {count}")


REST = 10.0  # time for which a robot stands idle before it sets out [s]


@dataclass
class Patrols:
    """Sends idle robots round their beats.

    The DVA holds such a robot itself. Its hold yields: any requester gets the robot, and
    the higher session ends the patrol. A robot that comes to stand on its round, for whatever
    reason, is sent home, where it is charged; and when it has rested, on its round again.

    Attributes:
        beats: The places of each robot's round, by its label.
    """

    beats: Mapping[str, tuple[m.Position, ...]] = field(default_factory=dict)
    _idle_since: dict[str, float] = field(default_factory=dict)
    _on_round: set[str] = field(default_factory=set)

    def set_out(self, orders: Orders, now: float) -> list[Send]:
        """Return the messages to robots that have rested long enough."""
        sends: list[Send] = []
        sessions = orders.sessions
        robots = orders.registry.of_type(ROBOT) if self.beats else ()
        for entry in (robot for robot in robots if robot.device.label in self.beats):
            robot = entry.device.id_tag
            busy = robot in orders.engaged or sessions.is_held(robot)
            if entry.mode != "Idle" or busy or orders.emergencies.holds(robot):
                self._idle_since.pop(robot, None)
            elif now - self._idle_since.setdefault(robot, now) >= REST:
                self._idle_since[robot] = now
                session, send = sessions.hold(robot)
                if send is not None:
                    sends.append(send)
                elif robot in self._on_round:
                    self._on_round.remove(robot)
                    sends.append(Send(robot, m.ReturnToBase(), session))
                else:
                    sends.append(self._round(entry, session))
        return sends

    def held(self, send: Send, registry: Registry, sessions: Sessions) -> list[Send]:
        """Note that a robot knows its holder; if that is the DVA, return the order to set out."""
        entry = registry.entries.get(send.to)
        body = send.body
        dva = sessions.permissions.own
        if entry is None or not isinstance(body, m.PermissionGrant) or body.holder != dva:
            return []
        if body.level == "sensors":
            return []
        return [self._round(entry, body.session)]

    def forget(self, robot: str) -> None:
        """Forget a robot."""
        self._idle_since.pop(robot, None)
        self._on_round.discard(robot)

    def _round(self, entry: DeviceEntry, session: int) -> Send:
        """Return the order to go round after round, until somebody else takes the robot."""
        self._on_round.add(entry.device.id_tag)
        return Send(entry.device.id_tag, m.Patrol(self.beats[entry.device.label], 0), session)
