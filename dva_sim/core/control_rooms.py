"""Requests and decisions about events: allowed by role, carried out once, and recorded.

Control rooms send them, and so may any other device, such as a phone: what each may is a matter of
its role alone. People decide; the rules hold all the same: an event is in one state, has one
responder and loses no time of its own, and nobody acts on a robot without its permission. The
policy only advises.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

from dva_sim.core.candidates import proposal
from dva_sim.core.dispatcher import Advised, Dispatcher
from dva_sim.core.event_status import by_whom, event_list, status_of
from dva_sim.core.events import LOOKING, Cause, Choice, Event, State
from dva_sim.core.handovers import Handovers
from dva_sim.core.permissions import Access
from dva_sim.core.registry import DRIVERS, DeviceEntry
from dva_sim.core.roles import Roles
from dva_sim.core.sessions import DvaAnswer, Send
from dva_sim.core.travel_times import Start
from dva_sim.protocol import messages as m
from dva_sim.protocol.control_room import ControlRoomBody
from dva_sim.protocol.devices import CONTROL_ROOM, GUARD, ROBOT, ControlRoomRole
from dva_sim.protocol.facts import Fact

R = ControlRoomRole
NEEDS: Final[dict[type, tuple[ControlRoomRole, str]]] = {
    m.GetEventList: (R.LOOK, "look"),
    m.GetDispatch: (R.LOOK, "look"),
    m.GetProposal: (R.LOOK, "look"),
    m.GetRequestLog: (R.DRIVE, "read_requests"),
    m.Acknowledge: (R.DISPATCH, "acknowledge"),
    m.Assign: (R.DISPATCH, "assign"),
    m.TakeOff: (R.DISPATCH, "take_off"),
    m.FalseAlarm: (R.DISPATCH, "false_alarm"),
    m.Escalate: (R.DISPATCH, "escalate"),
    m.AddNote: (R.DISPATCH, "note"),
    m.ReleaseEmergency: (R.DISPATCH, "release_emergency"),
    m.SetDispatch: (R.SUPERVISE, "set_dispatch"),
    m.Revoke: (R.SUPERVISE, "revoke"),
}
"""Role that each message needs, and its effect in the words of a `Fact`."""
_ASKS = (
    m.GetEventList | m.GetDispatch | m.GetProposal | m.GetRequestLog
)  # questions, which change nothing
LISTED_CLOSED = 50  # latest closed events in a list
Decision = m.Acknowledge | m.Assign | m.TakeOff | m.FalseAlarm | m.Escalate | m.AddNote


class _Refused(Exception):
    """Nothing is done: a code of a reply, and why."""

    def __init__(self, code: int, text: str) -> None:
        super().__init__(text)
        self.code = code


class ControlRooms:
    """Answers control rooms.

    Args:
        dispatcher: Dispatcher with the policy and all orders.
        handovers: Handovers of robots.
        roles: Roles of the control rooms.
        access: Rules of access to robots.
    """

    def __init__(
        self, dispatcher: Dispatcher, handovers: Handovers, roles: Roles, access: Access
    ) -> None:
        self._dispatcher = dispatcher
        self._handovers = handovers
        self._roles = roles
        self._access = access
        self._orders = dispatcher.orders
        self._events = dispatcher.orders.events
        self._doers: dict[type, Callable[[Any, Event, m.Device, float], list[Send] | str]] = {
            m.Acknowledge: self._acknowledge,
            m.Assign: self._assign,
            m.TakeOff: self._take_off,
            m.FalseAlarm: self._close,
            m.Escalate: self._close,
            m.AddNote: self._add_note,
        }

    # --- what comes in -----------------------------------------------------------------

    def answer(self, body: ControlRoomBody, sender: m.Device, now: float) -> DvaAnswer:
        """Answer a question or a decision of a device."""
        need, action = NEEDS.get(type(body), (R.SUPERVISE, ""))
        if not action:
            name = type(body).__name__
            return DvaAnswer(m.NOT_SUPPORTED, f"{name} is what the DVA says")
        if (refusal := self.may(sender, need, action)) is not None:
            return self._refuse(body, sender, action, m.NOT_PERMITTED, refusal, now)
        match body:
            case m.GetEventList():
                return DvaAnswer(content=self._list(body.event_id or 0, now))
            case m.GetDispatch():
                return DvaAnswer(content=self.status(now, sender))
            case m.GetRequestLog():
                return DvaAnswer()  # the node that carries the messages fills in its log
            case m.SetDispatch():
                return self._set_dispatch(body, sender, now)
            case m.Revoke():
                return self._revoke(body, sender, now)
            case m.ReleaseEmergency():
                return self._release_emergency(body, sender, now)
        return self._about_event(body, sender, action, now)

    def may(self, sender: m.Device, need: ControlRoomRole, action: str) -> str | None:
        """Return why a device may not do something, or None."""
        role = self._roles.of(sender.id_tag)
        if role.includes(need):
            return None
        done = action.replace("_", " ")
        return f"{sender.label} has the role {role}; to {done} needs {need}"

    def status(self, now: float, asker: m.Device | None = None) -> m.DispatchStatus:
        """Return the dispatch mode, and the role of the asker."""
        questions = self._dispatcher.questions
        role = None if asker is None else self._roles.of(asker.id_tag).value
        mode = "ask_first" if questions.asks else "automatic"
        return m.DispatchStatus(mode, questions.within, by_whom(questions.switched, now), role)

    def event_status(self, event: Event, now: float) -> m.EventStatus:
        """Return the present state of an event."""
        return status_of(event, self._dispatcher.questions.of(event.number), now)

    def _list(self, above: int, now: float) -> m.EventList:
        every = (*list(self._events.closed.values())[-LISTED_CLOSED:], *self._events.open.values())
        rest = sorted((e for e in every if e.number > above), key=lambda event: event.number)
        return event_list(rest, self._dispatcher.questions, now)

    # --- about one event ---------------------------------------------------------------

    def _about_event(self, body: Any, sender: m.Device, action: str, now: float) -> DvaAnswer:
        event = self._events.get(body.event_id)
        if event is None:
            text = f"no event {body.event_id}"
            return self._refuse(body, sender, action, m.UNKNOWN_EVENT, text, now)
        if isinstance(body, m.GetProposal):
            return DvaAnswer(content=proposal(self._dispatcher, event, now))
        advised = self._dispatcher.advised(event, now) if action in _ON_HANDS else None
        try:
            self._check(body, event, sender, action, now)
            done = self._doers[type(body)](body, event, sender, now)
        except _Refused as refused:
            answer = self._refuse(
                body=body,
                sender=sender,
                action=action,
                code=refused.code,
                text=str(refused),
                now=now,
                advised=advised,
            )
            return replace(answer, content=self.event_status(event, now))
        if isinstance(done, str):  # nothing had to be done
            return DvaAnswer(m.OK, done, self.event_status(event, now))
        self._decided(body, event, sender, action, advised, now)
        sends = [*done, *self._dispatcher.decide(now)]
        return DvaAnswer(m.OK, "", self.event_status(event, now), tuple(sends))

    def _check(
        self, body: Decision, event: Event, sender: m.Device, action: str, now: float
    ) -> None:
        """Refuse a decision that comes too late: after another one, or when the event is closed."""
        handling = event.handling
        decisions = getattr(body, "decisions", None)
        about = getattr(body, "device", None)
        label = self._orders.label_of(about) if about else ""
        if action not in _ON_HANDS or handling.is_already(sender.id_tag, action, label):
            return  # a repeated decision is answered like the first: its reply may have been lost
        last = "nobody" if handling.last is None else handling.last.described(now)
        if not event.open:
            raise _Refused(m.OUT_OF_ORDER, f"event {event.number} is {event.state}; last: {last}")
        if decisions is not None and decisions != handling.decisions:
            raise _Refused(m.OUT_OF_ORDER, f"event {event.number} was decided on since: {last}")

    def _acknowledge(
        self, body: m.Acknowledge, event: Event, sender: m.Device, now: float
    ) -> list[Send] | str:
        acknowledgement = event.handling.acknowledged
        if acknowledgement is None:
            event.handling.acknowledged = Choice(sender.id_tag, sender.label, "acknowledge", now)
            return []
        if acknowledgement.author == sender.id_tag:
            return "acknowledged already"
        raise _Refused(
            m.OUT_OF_ORDER,
            f"acknowledged by {acknowledgement.label}, {now - acknowledgement.time:.1f} s ago",
        )

    def _add_note(
        self, body: m.AddNote, event: Event, sender: m.Device, now: float
    ) -> list[Send] | str:
        event.handling.note = body.text
        return []

    def _close(
        self, body: m.FalseAlarm | m.Escalate, event: Event, sender: m.Device, now: float
    ) -> list[Send] | str:
        is_false = isinstance(body, m.FalseAlarm)
        if not event.open:
            return f"it is {'over' if is_false else 'escalated'} already"
        cause = Cause.DISMISSED if is_false else Cause.ESCALATED
        return self._orders.transition(event, cause, now)

    def _take_off(
        self, body: m.TakeOff, event: Event, sender: m.Device, now: float
    ) -> list[Send] | str:
        looks = event.state in LOOKING
        sent = {event.actor, event.responder if looks else None}
        if body.device not in sent:
            if body.device in event.handling.taken_off:
                return "it is not sent there any longer"
            label = self._orders.label_of(body.device)
            raise _Refused(m.WRONG_MODE, f"{label} is not sent to event {event.number}")
        event.handling.taken_off.add(body.device)
        return self._orders.recall(event, body.device, now)

    # --- sending -----------------------------------------------------------------------

    def _assign(
        self, body: m.Assign, event: Event, sender: m.Device, now: float
    ) -> list[Send] | str:
        task = body.task or "confirm"
        entry = self._responder(body.device)
        device = entry.device
        if self._is_sent(body, event, task):
            return "is sent there already"
        if task == "confirm":
            self._may_look(body, event)
        else:
            self._may_act(body, event, device, task)
        if self._orders.emergencies.holds(device.id_tag):
            raise _Refused(m.BUSY, f"{device.label} is stopped by an emergency: release it first")
        is_passed_on = self._passes_on(body, event)
        engaged = self._orders.engaged.all(device.id_tag)
        if engaged and not is_passed_on:
            text = f"{device.label} is at event {engaged[0].number}: take it off there first"
            raise _Refused(m.BUSY, text)
        driver = None
        if device.device_type == ROBOT:
            driver = self._driver(body, device, sender, now)
            holder = self._handovers.holder(device.id_tag, driver, now)
            if holder is not None and not (is_passed_on and holder.holder == event.operator):
                text = f"{device.label} is held by {holder.label}: take it over first"
                raise _Refused(m.BUSY, text)
        return self._send(body, event, entry, driver, now)

    def _responder(self, device: str) -> DeviceEntry:
        entry = self._orders.registry.entries.get(device)
        if entry is None or entry.silent or entry.device.device_type not in (GUARD, ROBOT):
            raise _Refused(m.UNKNOWN_DEVICE, f"no such guard or robot: {device}")
        return entry

    @staticmethod
    def _is_sent(body: m.Assign, event: Event, task: str) -> bool:
        if task == "confirm":
            looks = event.state in LOOKING and event.responder == body.device
            return looks and body.operator in (None, event.operator)
        stand_by = event.state is not State.CONFIRMED
        return event.actor == body.device and stand_by == (task == "stand_by")

    @staticmethod
    def _passes_on(body: m.Assign, event: Event) -> bool:
        """Return True if the robot that looks there stays, and only its operator changes."""
        looks = (body.task or "confirm") == "confirm" and event.state in LOOKING
        return looks and event.responder == body.device

    def _may_look(self, body: m.Assign, event: Event) -> None:
        """Refuse to replace a responder on the scene, or one under way unknown to the sender."""
        label = self._orders.label_of(event.responder or "")
        if event.state is State.CONFIRMED:
            raise _Refused(m.WRONG_MODE, f"event {event.number} is confirmed: somebody has looked")
        if event.state is State.ON_SCENE and not self._passes_on(body, event):
            raise _Refused(m.BUSY, f"{label} is there already: take it off first")
        if event.state in LOOKING and body.decisions is None:
            raise _Refused(m.BUSY, f"{label} is on the way; to send another, include Decisions")

    def _may_act(self, body: m.Assign, event: Event, device: m.Device, task: str) -> None:
        if not event.needs_containment:
            raise _Refused(m.NOT_SUPPORTED, "events here are only looked at, not contained")
        if device.device_type == ROBOT:
            raise _Refused(m.NOT_SUPPORTED, "a robot can only look")
        if (task == "contain") != (event.state is State.CONFIRMED):
            allowed = "stand_by until it is" if task == "contain" else "contain, as it is confirmed"
            raise _Refused(m.WRONG_MODE, f"event {event.number} is {event.state}: {allowed}")
        if event.state is State.PENDING:
            raise _Refused(m.WRONG_MODE, "nobody looks there yet: send somebody to first")
        if event.actor is not None and body.decisions is None:
            label = self._orders.label_of(event.actor)
            raise _Refused(m.BUSY, f"{label} has it; state Decisions to send another instead")

    def _driver(self, body: m.Assign, robot: m.Device, sender: m.Device, now: float) -> str:
        """Choose the driver of a robot: the one the sender names, or the least busy one."""
        if body.operator is None:
            hands = self._dispatcher.situations.operators(now)
            if not hands:
                raise _Refused(m.BUSY, f"no operator is free to drive {robot.label}")
            return hands[0].device.id_tag
        return self._named_driver(body.operator, robot, sender, now).id_tag

    def _named_driver(self, named: str, robot: m.Device, sender: m.Device, now: float) -> m.Device:
        entry = self._orders.registry.entries.get(named)
        if entry is None or entry.silent or entry.device.device_type not in DRIVERS:
            raise _Refused(m.UNKNOWN_DEVICE, f"no operator {named}")
        device = entry.device
        is_room = device.device_type == CONTROL_ROOM
        if is_room and device.id_tag != sender.id_tag:
            raise _Refused(m.NOT_PERMITTED, f"only {device.label} decides what it drives")
        # A room may also let the robot go by itself, and as many as it likes.
        levels = ("teleoperation", "missions") if is_room else ("teleoperation",)
        if not any(self._access.allows(device, robot, level, now) for level in levels):
            raise _Refused(m.NOT_PERMITTED, f"{device.label} may not drive {robot.label}")
        in_hand = self._orders.engaged.count(named)
        if not is_room and in_hand >= self._orders.rules.operator_span:
            raise _Refused(m.BUSY, f"{device.label} has {in_hand} in hand already")
        return device

    def _send(
        self, body: m.Assign, event: Event, entry: DeviceEntry, driver: str | None, now: float
    ) -> list[Send]:
        """Recall the responder that is under way, if there is one, and give the order."""
        orders = self._orders
        device = entry.device.id_tag
        looks = (body.task or "confirm") == "confirm"
        before = event.responder if looks and event.state in LOOKING else None
        before = before if looks else event.actor
        sends = orders.recall(event, before, now, replaced=True) if before else []
        event.handling.taken_off.discard(device)
        self._dispatcher.situations.forget_move(device)
        self._dispatcher.auctions.running.pop(event.number, None)
        if (eta := self._way(entry, event)) is not None:
            event.handling.expected[device] = now, eta
        # A person decided: it must not look later as if the policy had sent the device.
        event.handling.advised = ""
        order = orders.confirm(event, device, driver, now) if looks else None
        return [*sends, order or orders.act(event, device, now)]

    def _way(self, entry: DeviceEntry, event: Event) -> float | None:
        """Return when a device is expected to arrive [s from now]."""
        if entry.position is None:
            return None
        kind = "guard" if entry.device.device_type == GUARD else "robot"
        start = Start(entry.device.id_tag, kind, entry.position)
        eta = float(self._dispatcher.situations.travel([start], [event.position])[1][0, 0])
        return eta if eta < float("inf") else None

    # --- about all events, or none -----------------------------------------------------

    def _set_dispatch(self, body: m.SetDispatch, sender: m.Device, now: float) -> DvaAnswer:
        questions = self._dispatcher.questions
        asks = body.dispatch_mode == "ask_first"
        if questions.asks == asks:
            return DvaAnswer(m.OK, "it is so already", self.status(now, sender))
        questions.asks = asks
        reason = body.reason or ""
        questions.switched = Choice(sender.id_tag, sender.label, "set_dispatch", now, reason)
        self._note(sender, "set_dispatch", now, mode=body.dispatch_mode, cause=reason)
        sends = self._dispatcher.decide(now)
        return DvaAnswer(m.OK, "", self.status(now, sender), tuple(sends))

    def _revoke(self, body: m.Revoke, sender: m.Device, now: float) -> DvaAnswer:
        entry = self._orders.registry.entries.get(body.device)
        sessions = self._orders.sessions
        if entry is None or entry.device.device_type != ROBOT:
            text = f"no robot {body.device}"
            return self._refuse(body, sender, "revoke", m.UNKNOWN_DEVICE, text, now)
        grant = sessions.permissions.grants.get(body.device)
        if grant is None or grant.holder == sessions.permissions.own:
            return DvaAnswer(m.OK, "nobody holds it")
        holder = self._orders.label_of(grant.holder)
        sends = self._orders.taken_away(body.device, now)
        sessions.revoke(grant)
        words = f"{holder} held it"
        self._note(
            sender, "revoke", now, device=body.device, cause=body.reason or "", outcome=words
        )
        return DvaAnswer(m.OK, words, None, (*sends, *self._dispatcher.decide(now)))

    def _release_emergency(
        self, body: m.ReleaseEmergency, sender: m.Device, now: float
    ) -> DvaAnswer:
        """Release a robot; it asks the DVA itself before it takes orders again."""
        action = "release_emergency"
        robot = self._orders.registry.entries.get(body.device)
        if robot is None or robot.device.device_type != ROBOT:
            text = f"no robot {body.device}"
            return self._refuse(body, sender, action, m.UNKNOWN_DEVICE, text, now)
        emergencies = self._orders.emergencies
        if (release := emergencies.who_released(body.device)) is not None:
            return DvaAnswer(m.OK, f"released by {release.label}, {now - release.time:.1f} s ago")
        if not emergencies.holds(body.device):
            text = f"no emergency of {robot.device.label} is known"
            return self._refuse(body, sender, action, m.WRONG_MODE, text, now)
        reason = body.reason or ""
        choice = Choice(
            author=sender.id_tag,
            label=sender.label,
            action=action,
            time=now,
            reason=reason,
            device=robot.device.label,
        )
        emergencies.release(body.device, choice)
        self._note(sender, action, now, device=body.device, cause=reason)
        notice = Send(body.device, m.ReleaseEmergency(body.device))
        return DvaAnswer(m.OK, "", None, (notice, *self._dispatcher.decide(now)))

    # --- what is kept of it ------------------------------------------------------------

    def raised(self, event: Event, sender: m.Device, now: float) -> None:
        """Note that a control room has reported an event."""
        self._note(sender, "raise", now, event=event.number, text=event.kind)

    def asked_for_robot(
        self, sender: m.Device, body: m.PermissionRequest, answer: DvaAnswer, now: float
    ) -> None:
        """Note that a control room has asked for a robot, or taken it from its holder."""
        forced = body.takeover in ("ask", "force")
        action = "take_over" if forced else "take"
        cause = f"{body.level}, {body.takeover}" if forced else body.level
        self._note(
            sender,
            action,
            now,
            device=body.device,
            cause=cause,
            code=answer.code,
            outcome=answer.text,
        )

    def gave_back(self, sender: m.Device, robot: str, now: float) -> None:
        """Note that a control room needs a robot no longer."""
        self._note(sender, "give_back", now, device=robot)

    def _decided(
        self,
        body: Any,
        event: Event,
        sender: m.Device,
        action: str,
        advised: Advised | None,
        now: float,
    ) -> None:
        fact = self._fact(body, sender, action, advised, now)
        device = fact.device
        if device is not None and action == "assign":
            fact = replace(fact, arrival_in=event.handling.arrival_in(device, now))
        fact = replace(fact, waited=now - event.times["detected"])
        if action == "assign" and device == event.responder:
            fact = replace(fact, operator=event.operator)
        if action in _ON_HANDS:
            self._orders.decided(event, fact)
        else:
            self._events.touch(event)
            self._orders.trail.note(fact)

    def _refuse(
        self,
        body: Any,
        sender: m.Device,
        action: str,
        code: int,
        text: str,
        now: float,
        advised: Advised | None = None,
    ) -> DvaAnswer:
        fact = self._fact(body, sender, action, advised, now)
        if not isinstance(body, _ASKS):
            self._orders.trail.note(replace(fact, code=code, outcome=text))
        return DvaAnswer(code, text)

    def _fact(
        self, body: Any, sender: m.Device, action: str, advised: Advised | None, now: float
    ) -> Fact:
        task = (body.task or "confirm") if isinstance(body, m.Assign) else None
        return Fact(
            time=now,
            author=sender.id_tag,
            label=sender.label,
            role=self._roles.of(sender.id_tag).value,
            action=action,
            event=getattr(body, "event_id", None),
            device=getattr(body, "device", None),
            operator=getattr(body, "operator", None),
            task=task,
            mode=getattr(body, "dispatch_mode", None),
            text=getattr(body, "text", None),
            cause=getattr(body, "reason", None) or "",
            advised=advised.device if advised else None,
            advised_in=advised.arrival_in if advised else None,
        )

    def _note(self, sender: m.Device, action: str, now: float, **more: Any) -> None:
        role = None
        if sender.device_type == CONTROL_ROOM:
            role = self._roles.of(sender.id_tag).value
        self._orders.trail.note(
            Fact(
                time=now,
                author=sender.id_tag,
                label=sender.label,
                role=role,
                action=action,
                **more,
            )
        )


_ON_HANDS = frozenset({"assign", "take_off", "false_alarm", "escalate"})
"""Messages that decide who handles an event; only one such decision is open at a time."""
