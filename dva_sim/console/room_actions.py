"""What control rooms are asked for at pages: each becomes messages of the person's own device."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final

from dva_sim.agents.operator.handheld import Gathered
from dva_sim.agents.operator.steps import give_back, start
from dva_sim.agents.people.person_guard import SEVERITIES
from dva_sim.console.refusal import Refused, Said
from dva_sim.console.rooms import NO_ANSWER, ConsoleRoom, why
from dva_sim.console.seats import Seats
from dva_sim.console.world import ConsoleWorld
from dva_sim.core.registry import ROBOT
from dva_sim.protocol import messages as m
from dva_sim.protocol.reply_codes import OUT_OF_ORDER

Line = dict[str, Any]
Doer = Callable[[str, Line, Said], object]

CERTAIN: Final = 0.9  # of what somebody in a control room reports
ASK_PERIOD: Final = 3.0  # from one question how a mission stands to the next [s]
UNDER_WAY: Final = ("under_way", "waiting", "replanning")
TAKE_AGAIN: Final = 0.5  # while a robot is brought to a standstill [s]
MOST_TRIES: Final = 40


class RoomActions:
    """Does what control rooms are asked for.

    Args:
        world: In which.
        seats: Who sits where.
        robot: Finds the id of a robot that a line names.
        take: Takes a robot for a page's seat.
    """

    def __init__(
        self,
        world: ConsoleWorld,
        seats: Seats,
        robot: Callable[[Any], str],
        take: Doer,
    ) -> None:
        self._world, self._rooms, self._seats = world, world.rooms, seats
        self._robot, self._take = robot, take
        self.doers: Mapping[str, Doer] = {
            "room_join": self._join,
            "event_raise": self._raise,
            "event_acknowledge": self._plain(m.Acknowledge, "acknowledged"),
            "event_assign": self._assign,
            "event_take_off": self._take_off,
            "event_false_alarm": self._with_words(m.FalseAlarm, "a false alarm"),
            "event_escalate": self._with_words(m.Escalate, "escalated"),
            "event_note": self._note,
            "event_proposal": self._proposal,
            "dispatch_mode": self._mode,
            "mission": self._mission,
            "take_over": self._take_over,
        }

    def forget(self, client: str) -> None:
        """A page is gone for good."""
        self._rooms.leave(client)

    # --- who asks ---------------------------------------------------------------------------

    def _join(self, client: str, line: Line, said: Said) -> None:
        name = str(line.get("name", "")).strip()[:64]
        self._rooms.join(client, str(line.get("role", "look")), name, said)

    def _room(
        self, client: str, line: Line, said: Said, then: Callable[[ConsoleRoom], object]
    ) -> None:
        """The control room of a page; it gets one with its first decision."""
        room = self._rooms.by_client.get(client)
        if room is not None and room.registered:
            then(room)
            return

        def joined(ok: bool, text: str, /, **_: Any) -> None:
            room = self._rooms.by_client.get(client)
            if ok and room is not None:
                then(room)
            else:
                said(False, text)

        self._rooms.join(client, str(line.get("role", "look")), "", joined)

    def _ask(
        self,
        client: str,
        line: Line,
        said: Said,
        body: m.Body,
        done: str,
        then: Callable[[m.Reply], Line] | None = None,
    ) -> None:
        self._room(client, line, said, lambda room: room.ask(body, said, done, then))

    # --- events -----------------------------------------------------------------------------

    def _raise(self, client: str, line: Line, said: Said) -> None:
        kind, place = str(line["kind"]), self._place(line)
        severity = SEVERITIES[line["severity"]]
        body = m.EventReport(None, kind, place, severity, CERTAIN, "detected")

        def then(_: m.Reply) -> Line:
            event = self._world.run.dva.desk.book.near(kind, place)
            return {} if event is None else {"event": event.number}

        self._ask(client, line, said, body, f"{kind.replace('_', ' ')} is raised", then)

    def _place(self, line: Line) -> m.Position:
        """Where on earth a place of the site lies.

        Raises:
            Refused: it is none.
        """
        site = self._world.run.stage.site
        x, y = line["x_m"], line["y_m"]
        left, low, right, high = site.extent
        if not (left <= x <= right and low <= y <= high):
            raise Refused("x_m and y_m should be a place on the site")
        return m.Position(*site.frame.to_latlon(x, y))

    def _plain(self, kind: Callable[[int], m.Body], done: str) -> Doer:
        """What needs no words."""

        def do(client: str, line: Line, said: Said) -> None:
            number = line["event"]
            self._ask(client, line, said, kind(number), f"event {number} is {done}")

        return do

    def _with_words(self, kind: Callable[..., m.Body], done: str) -> Doer:
        """What needs a reason, and is not done where somebody else has decided meanwhile."""

        def do(client: str, line: Line, said: Said) -> None:
            number, reason = line["event"], line.get("reason") or None
            body = kind(number, reason, self._seen(line))
            self._ask(client, line, said, body, f"event {number} is {done}")

        return do

    def _seen(self, line: Line) -> int | None:
        """How many decisions the asker knows: what the page says, else what is known here."""
        given = line.get("decisions")
        return given if given is not None else self._rooms.decisions(line["event"])

    def _assign(self, client: str, line: Line, said: Said) -> None:
        number, label = line["event"], str(line["device"])
        body = m.Assign(
            number,
            self._device(label),
            task=line.get("task"),
            reason=line.get("reason") or None,
            decisions=self._seen(line),
        )
        self._ask(client, line, said, body, f"{label} is sent to event {number}")

    def _take_off(self, client: str, line: Line, said: Said) -> None:
        number, label = line["event"], str(line["device"])
        reason = line.get("reason") or None
        body = m.TakeOff(number, self._device(label), reason, self._seen(line))
        self._ask(client, line, said, body, f"{label} is called off event {number}")

    def _device(self, label: str) -> str:
        """The id of a device by its label.

        Raises:
            Refused: there is none.
        """
        entries = self._world.run.dva.desk.registry.entries
        found = (i for i, entry in entries.items() if entry.device.label == label)
        id_tag = next(found, None)
        if id_tag is None:
            raise Refused(f"there is no device {label!r}")
        return id_tag

    def _note(self, client: str, line: Line, said: Said) -> None:
        number = line["event"]
        body = m.AddNote(number, str(line["text"]))
        self._ask(client, line, said, body, f"noted at event {number}")

    def _proposal(self, client: str, line: Line, said: Said) -> None:
        body = m.GetProposal(line["event"])
        self._ask(client, line, said, body, "", self._proposed)

    def _proposed(self, reply: m.Reply) -> Line:
        proposal = reply.content
        if not isinstance(proposal, m.Proposal):
            return {}
        label = next((c.label for c in proposal.candidates if c.device == proposal.device), "")
        return {
            "proposal": {
                "event": proposal.event_id,
                "policy": proposal.policy,
                "reason": proposal.reason,
                "task": proposal.task,
                "label": label,
                "arrival_s": proposal.arrival_in,
                "decide_within_s": proposal.decide_within,
                "candidates": [self._candidate(each) for each in proposal.candidates],
            }
        }

    def _candidate(self, who: m.Candidate) -> Line:
        entry = self._world.run.dva.desk.registry.entries.get(who.device)
        return {
            "label": who.label,
            "robot": entry is not None and entry.device.device_type == ROBOT,
            "can": who.arrival_in is not None,
            "reason": who.reason,
            "arrival_s": who.arrival_in,
        }

    def _mode(self, client: str, line: Line, said: Said) -> None:
        mode = str(line["mode"])
        body = m.SetDispatch(mode, line.get("reason") or None)
        told = "the policy asks first" if mode == "ask_first" else "the policy decides by itself"
        self._ask(client, line, said, body, told)

    # --- robots -----------------------------------------------------------------------------

    def _mission(self, client: str, line: Line, said: Said) -> None:
        """Have a robot go to an event by itself, and look at it."""
        status = self._rooms.listener.events.get(line["event"])
        if status is None:
            raise Refused(f"there is no event {line['event']}")
        robot = self._robot(line["robot"])
        body = m.Inspect(status.event_id, status.kind, status.position)
        self._room(client, line, said, partial(self._send, robot=robot, body=body, said=said))

    def _send(self, room: ConsoleRoom, robot: str, body: m.Inspect, said: Said) -> None:
        device, label = room.device, room.device.label_of(robot)

        def granted(reply: m.Reply) -> None:
            if not isinstance(reply.content, m.Permission):
                said(False, f"{label}: {why(reply)}")
                return
            session = reply.content.session

            def refused(text: str) -> None:
                give_back(device, robot, session)
                said(False, f"{label}: {text}")

            def begun() -> None:
                self._follow(room, robot, session)
                said(True, f"{label} goes to event {body.event_id} by itself")

            start(
                *(device, robot, body, lambda: session),
                wanted=lambda: True,
                begun=begun,
                refused=refused,
                lost=lambda: refused("it does not answer"),
            )

        device.connect(robot)
        wish = m.PermissionRequest(robot, "missions")
        device.ask(device.dva, wish, granted, lambda: said(False, NO_ANSWER))

    @staticmethod
    def _follow(room: ConsoleRoom, robot: str, session: int) -> None:
        """Ask how a mission stands until it is over; then the robot is given back."""
        device = room.device

        def answered(reply: m.Reply) -> None:
            status = reply.content
            if isinstance(status, m.MissionStatus) and status.mission_state in UNDER_WAY:
                device.clock.call_after(ASK_PERIOD, ask)
            else:
                give_back(device, robot, session)

        def ask() -> None:
            device.ask(robot, m.GetMissionStatus(), answered, session=session)

        device.clock.call_after(ASK_PERIOD, ask)

    def _take_over(self, client: str, line: Line, said: Said) -> None:
        """Take a robot from whoever holds it, with what it was sent to, into the own seat."""
        robot, reason = self._robot(line["robot"]), str(line["reason"])
        self._room(client, line, said, partial(self._revoke, client, line, robot, reason, said))

    def _revoke(
        self, client: str, line: Line, robot: str, reason: str, said: Said, room: ConsoleRoom
    ) -> None:
        event = next(
            (n for n, e in self._rooms.listener.events.items() if _works_at(e, robot)), None
        )

        def revoked(reply: m.Reply) -> None:
            if reply.code == m.NOT_PERMITTED:
                said(False, why(reply))
                return
            self._sit_down(client, line, robot, event, reason, said, room)

        room.device.ask(
            room.device.dva, m.Revoke(robot, reason), revoked, lambda: said(False, NO_ANSWER)
        )

    def _sit_down(
        self,
        client: str,
        line: Line,
        robot: str,
        event: int | None,
        reason: str,
        said: Said,
        room: ConsoleRoom,
    ) -> None:
        """The robot is free: the person's seat asks for it, and gets the order it had."""
        number = self._seats.sit(client)
        if number is None:
            said(False, "all seats are taken")
            return
        operator = self._world.person(number).device.id_tag
        tries = iter(range(MOST_TRIES))

        def take() -> None:
            self._take(client, line | {"robots": [room.device.label_of(robot)]}, taken)

        def taken(ok: bool, text: str, /, **_: Any) -> None:
            if ok or next(tries, None) is None:
                said(ok, text)
            else:  # it is still brought to a standstill
                room.device.clock.call_after(TAKE_AGAIN, take)

        def ordered(reply: m.Reply) -> None:
            content = reply.content
            if (
                reply.code == OUT_OF_ORDER
                and isinstance(content, m.EventStatus)
                and content.closed_for is None
                and next(tries, None) is not None
            ):
                assign(content.decisions)  # the policy was quicker
            else:
                take()

        def assign(decisions: int | None) -> None:
            assert event is not None
            body = m.Assign(event, robot, operator, None, reason, decisions)
            room.device.ask(room.device.dva, body, ordered, take)

        if event is None:
            take()
        else:
            self._world.person(number).sit_down()
            assign(self._rooms.decisions(event))


def _works_at(event: m.EventStatus, robot: str) -> bool:
    return event.closed_for is None and event.responder == robot


class AlarmActions:
    """Does what people ask for about alarms.

    Args:
        world: In which.
        rooms: Whose devices tell the DVA that an event was seen.
    """

    def __init__(self, world: ConsoleWorld, rooms: RoomActions) -> None:
        self._world, self._desk, self._rooms = world, world.alarms, rooms
        self.doers: Mapping[str, Doer] = {
            "alarm_acknowledge": self._acknowledge,
            "alarm_shelve": self._shelve,
            "alarm_unshelve": self._unshelve,
        }

    def _acknowledge(self, client: str, line: Line, said: Said) -> None:
        """What an open event is behind is acknowledged at the DVA, all else here."""
        keys = self._desk.members(line["alarm"])
        events = self._desk.by_event(keys)
        for key in keys:
            if key not in events:
                self._desk.acknowledge(key, self._world.author(client))
        if not events:
            said(True, "seen")
            return
        answers = Gathered(len(events), said)
        for number in events.values():
            self._rooms.doers["event_acknowledge"](client, line | {"event": number}, answers)

    def _shelve(self, client: str, line: Line, said: Said) -> None:
        keys = self._desk.members(line["alarm"])
        self._desk.shelve(keys, line["for_s"], self._world.author(client))
        said(True, f"shelved for {line['for_s'] / 60:.0f} minutes")

    def _unshelve(self, client: str, line: Line, said: Said) -> None:
        self._desk.unshelve(self._desk.members(line["alarm"]))
        said(True, "back in the list")
