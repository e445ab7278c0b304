"""Actions of people who play guards; each becomes messages of the guard's device."""

from __future__ import annotations

from functools import partial
from typing import Unpack

from dva_sim.agents.control_room.control_room import ControlRoomAgent
from dva_sim.agents.people.person_guard import PersonGuard
from dva_sim.console.asking.dispatcher import does
from dva_sim.console.asking.refusal import OnResult, Refused, unanswered
from dva_sim.console.events.decisions import on_site, place_of
from dva_sim.console.events.rooms import ConsoleRooms
from dva_sim.console.guards.played_guards import PlayedGuards
from dva_sim.console.wire.actions import Asked
from dva_sim.console.wire.arguments import (
    GuardAnswer,
    GuardAsked,
    GuardWord,
    OfEvent,
    PlaceAsked,
    ReportAsked,
)
from dva_sim.console.wire.seats import Answered
from dva_sim.protocol import messages as m
from dva_sim.worlds.site import Site


class GuardActions:
    """Does what guards' pages ask for.

    Args:
        guards: Guards and their players.
        site: Site of the guards.
        rooms: Control rooms of the console.
    """

    def __init__(self, guards: PlayedGuards, site: Site, rooms: ConsoleRooms) -> None:
        self._guards = guards
        self._site = site
        self._rooms = rooms

    def _guard(self, client: str) -> PersonGuard:
        guard = self._guards.by_client.get(client)
        if guard is None:
            raise Refused("Choose which guard you are first.")
        return guard

    @does("guard_join")
    def _join(self, client: str, line: GuardAsked, on_result: OnResult) -> None:
        label = line["guard"]
        guard = self._guards.named(label)
        if guard is None:
            raise Refused(f"There is no guard {label!r} that a person can play.")
        if self._guards.by_client.get(client) is guard:
            on_result(True, f"you are {label} already")
            return
        if guard.attended:
            raise Refused(f"Somebody else is already {label}.")
        self._guards.leave(client)
        self._guards.join(client, guard)
        on_result(True, f"you are {label}")

    @does("guard_leave")
    def _leave(self, client: str, _: Asked, on_result: OnResult) -> None:
        self._guards.leave(client)
        on_result(True, "nobody plays the guard now")

    @does("guard_answer")
    def _answer(self, client: str, line: GuardAnswer, on_result: OnResult) -> None:
        self._guard(client).answer(line["accept"], line["reason"], on_result)

    @does("guard_go")
    def _go(self, client: str, line: OfEvent, on_result: OnResult) -> None:
        """Have the DVA send the guard who says so, by a control room of the moment."""
        guard = self._guard(client)
        label = guard.device.label
        status = self._rooms.listener.events.get(line["event"])
        if status is None:
            raise Refused(f"there is no event {line['event']}")
        number = status.event_id
        if guard.order is not None and guard.order.event_id == number:
            raise Refused(f"You are sent to event {number} already.")
        task = "contain" if status.event_state == "confirmed" else "confirm"
        reason = f"{label} goes of their own accord"
        body = m.Assign(number, guard.device.id_tag, None, task, reason, status.decisions)

        def over(ok: bool, text: str, /, **more: Unpack[Answered]) -> None:
            self._rooms.leave(client)
            if not ok:
                guard.wanted = 0
            on_result(ok, text, **more)

        def ask(agent: ControlRoomAgent, on_result: OnResult) -> None:
            def answered(reply: m.Reply) -> None:
                ok = reply.code == m.OK
                on_result(ok, f"you go to event {number}" if ok else reply.reason)

            guard.wanted = number
            agent.ask(body, answered, partial(unanswered, on_result))

        self._rooms.decide(client, "dispatch", over, ask, f"{label} alone")

    @does("guard_say")
    def _say(self, client: str, line: GuardWord, on_result: OnResult) -> None:
        self._guard(client).say(line["what"], on_result)

    @does("guard_place")
    def _place(self, client: str, line: PlaceAsked, on_result: OnResult) -> None:
        self._guard(client).stand_at(*on_site(line, self._site), on_result)

    @does("guard_report")
    def _report(self, client: str, line: ReportAsked, on_result: OnResult) -> None:
        point = place_of(line, self._site)
        self._guard(client).report(line["kind"], *point, line["severity"], on_result)
