"""Decisions of people at an attached console: messages of its own control room.

The DVA decides if that is allowed: it alone knows the role of each control room.
"""

from __future__ import annotations

from functools import partial
from typing import Any

from dva_sim.console.asking.dispatcher import does
from dva_sim.console.asking.refusal import NO_ANSWER, OnResult, Refused, unanswered
from dva_sim.console.attached.people import AttachedPeople
from dva_sim.console.attached.system import AttachedSystem
from dva_sim.console.events.decisions import DECISIONS, answer_of, decision_of, report_of
from dva_sim.console.events.missions import inspection_of, send_on_mission
from dva_sim.console.events.takeover import Takeover
from dva_sim.console.wire.actions import Asked
from dva_sim.console.wire.arguments import MissionAsked, ReportAsked, RoomName, TakeoverAsked
from dva_sim.protocol import messages as m


class AttachedDecisions:
    """Does what pages ask for about events.

    Args:
        system: System to which the console is attached.
        people: People at the pages.
    """

    def __init__(self, system: AttachedSystem, people: AttachedPeople) -> None:
        self._system, self._people = system, people

    @does("room_join")
    def _join(self, client: str, line: RoomName, on_result: OnResult) -> None:
        """All who decide here share the console's own control room, each by an own name."""
        if not self._system.answers:
            raise Refused(NO_ANSWER)
        name = line["name"].strip()
        name = self._people.join(client, str(line.get("role", "look")), name)
        on_result(True, f"you are {name}, and may {self._system.role}")

    @does("event_raise")
    def _raise(self, _: str, line: ReportAsked, on_result: OnResult) -> None:
        place = self._system.place_of(line["x_m"], line["y_m"])
        self._ask(*report_of(line, place), on_result)

    @does(*DECISIONS)
    def decide(self, _: str, line: Asked, on_result: OnResult) -> None:
        """Decide on an event."""
        self._ask(*decision_of(line, self._device, self._seen), on_result)

    # --- robots ------------------------------------------------------------------------------

    @does("mission")
    def _mission(self, _: str, line: MissionAsked, on_result: OnResult) -> None:
        """Have a robot go to an event by itself, and look at it."""
        status = self._system.agent.events.get(line["event"])
        if status is None:
            raise Refused(f"there is no event {line['event']}")
        self._send(self._robot(line["robot"]), status, on_result)

    def _send(self, robot: str, status: m.EventStatus, on_result: OnResult) -> None:
        label = self._system.label_of(robot)
        send_on_mission(self._system.device, robot, label, inspection_of(status), on_result)

    @does("take_over")
    def _take_over(self, _: str, line: TakeoverAsked, on_result: OnResult) -> None:
        """Take a robot from its driver; it drives itself to where it was sent."""
        robot, agent = self._robot(line["robot"]), self._system.agent
        label = self._system.label_of(robot)
        sent = (e for e in agent.events.values() if e.closed_for is None and e.responder == robot)
        event = next(sent, None)

        def take(on_result: OnResult) -> None:
            if event is None:
                on_result(True, f"{label} is nobody's now, and stands")
            else:
                self._send(robot, event, on_result)

        Takeover(
            agent=agent,
            robot=robot,
            reason=line["reason"],
            event=event,
            seat=None,
            take=take,
            on_result=on_result,
        ).begin()

    def _robot(self, number: Any) -> str:
        """The id of a robot that pages know by a number.

        Raises:
            Refused: the DVA has listed none.
        """
        found = self._system.id_of(number)
        if found is None or found not in self._system.robots():
            raise Refused(f"the DVA has listed no robot {number!r}")
        return found

    def _ask(self, body: m.Body, done: str, on_result: OnResult) -> None:
        robots = self._system.robots

        def answered(reply: m.Reply) -> None:
            ok = reply.code == m.OK
            words = reply.text or m.CODE_NAMES.get(reply.code, str(reply.code))
            more = answer_of(reply, lambda device: device in robots()) if ok else {}
            on_result(ok, done if ok else words, **more)

        self._system.agent.ask(body, answered, partial(unanswered, on_result))

    def _seen(self, event: int) -> int | None:
        """Return how many decisions on an event are known here."""
        status = self._system.agent.events.get(event)
        return None if status is None else status.decisions

    def _device(self, label: str) -> str:
        """The id of a device by its label.

        Raises:
            Refused: the DVA has listed none of that label.
        """
        known = self._system.state.devices.items()
        found = next((i for i, entry in known if entry.device.label == label), None)
        if found is None:
            raise Refused(f"there is no device {label!r}")
        return found
