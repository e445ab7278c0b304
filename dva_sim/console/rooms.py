"""The control rooms of a console: a device for each person who decides, and one that listens.

What people decide becomes messages of their devices, and what pages show of events comes by the
DVA's own: another make of control room, or of DVA, can take either place.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final

from dva_sim.agents.device import AgentDevice
from dva_sim.console.refusal import Said
from dva_sim.core.registry import FORGET_AFTER
from dva_sim.protocol import messages as m
from dva_sim.simulation.full.run import Run

Line = dict[str, Any]
Appoint = Callable[[str, str], object]

EVENTS, AUDIT = "event|", "audit|"  # topics of the DVA
LISTENER: Final = 1  # number of the device that listens for the pages
MOST_ROOMS: Final = 250
RESTS: Final = FORGET_AFTER + 60.0  # from the end of one until its id is given out again [s]
ASK_AGAIN: Final = 10.0  # what is published may be lost: the list is asked for so often [s]
KEPT_CLOSED: Final = 50  # events that are over and remembered
NO_ANSWER: Final = "the DVA does not answer"


@dataclass
class ConsoleRoom:
    """A person's share in the control of a run.

    Attributes:
        number: By which its id is made.
        device: At the DVA.
        role: What the person's address allows.
        registered: Whether the DVA knows it.
    """

    number: int
    device: AgentDevice
    role: str
    registered: bool = False

    def ask(
        self, body: m.Body, said: Said, done: str, then: Callable[[m.Reply], Line] | None = None
    ) -> None:
        """Ask the DVA, and tell how that went.

        Args:
            body: What is asked.
            said: Told what became of it.
            done: In words, if it is done.
            then: Makes more of a reply that says so.
        """

        def answered(reply: m.Reply) -> None:
            ok = reply.code == m.OK
            more = then(reply) if ok and then is not None else {}
            said(ok, done if ok else why(reply), **more)

        self.device.ask(self.device.dva, body, answered, lambda: said(False, NO_ANSWER))


def why(reply: m.Reply) -> str:
    """Why a reply refuses, in words."""
    return reply.text or m.CODE_NAMES.get(reply.code, str(reply.code))


@dataclass
class Known:
    """What the DVA has said of an event, and when that arrived [s]."""

    status: m.EventStatus
    at: float


@dataclass
class EventBoard:
    """What the DVA tells of events and of how orders are given.

    Attributes:
        events: By number.
        dispatch: How orders are given, and when that arrived [s]; None: it has not said.
    """

    events: dict[int, Known] = field(default_factory=dict)
    dispatch: tuple[m.DispatchStatus, float] | None = None

    def hear(self, content: object, now: float) -> None:
        """The DVA says something."""
        if isinstance(content, m.EventList):
            for status in content.events:
                self.hear(status, now)
        elif isinstance(content, m.EventStatus):
            self.events[content.event_id] = Known(content, now)
            self._forget()
        elif isinstance(content, m.DispatchStatus):
            self.dispatch = content, now

    def _forget(self) -> None:
        closed = [n for n, known in self.events.items() if known.status.closed_for is not None]
        for number in closed[:-KEPT_CLOSED]:
            del self.events[number]

    def decisions(self, number: int) -> int | None:
        """How many decisions on an event there have been, as far as one knows here."""
        known = self.events.get(number)
        return None if known is None else known.status.decisions

    def about(self, number: int) -> Line:
        """What a page is told of an event beside what everybody sees."""
        known = self.events.get(number)
        if known is None:
            return {"decisions": None, "acknowledged": None, "decided": None, "note": None}
        status, at = known.status, known.at
        last = status.last_decision
        return {
            "decisions": status.decisions,
            "acknowledged": _by(status.acknowledged, at),
            "decided": None
            if last is None
            else {
                "label": last.label,
                "action": last.action,
                "at_ms": _ms(at - last.ago),
                "reason": last.reason or "",
            },
            "note": status.note,
        }

    def dispatch_line(self) -> Line | None:
        """How orders are given."""
        if self.dispatch is None:
            return None
        status, at = self.dispatch
        return {
            "mode": status.dispatch_mode,
            "decide_within_s": status.decide_within,
            "switched": _by(status.switched, at),
        }


def _ms(seconds: float) -> int:
    return round(1000 * seconds)


def _by(whom: m.ByWhom | None, at: float) -> Line | None:
    return None if whom is None else {"label": whom.label, "at_ms": _ms(at - whom.ago)}


class ConsoleRooms:
    """All control rooms of a console.

    Args:
        run: In which.
        appoint: Tells the DVA of a role, by the id of a device: no device states its own.

    Attributes:
        board: What the DVA has told.
        by_client: The rooms by their pages.
        joined: Told the id and the label of each that is new.
    """

    def __init__(self, run: Run, appoint: Appoint) -> None:
        self._run, self._appoint = run, appoint
        self.board = EventBoard()
        self.by_client: dict[str, ConsoleRoom] = {}
        self.joined: Callable[[str, str], object] = lambda *_: None
        self._used = {LISTENER}
        self._device = run.stage.device("room", LISTENER)
        self._name(self._device, "console")
        self._device.register(self._listen)

    def _name(self, device: AgentDevice, label: str) -> None:
        device.label = device.labels[device.id_tag] = label

    # --- what the DVA says ------------------------------------------------------------------

    def _listen(self) -> None:
        device = self._device
        device.network.subscribe(device.id_tag, device.dva, EVENTS, self._published)
        device.clock.every(ASK_AGAIN, self._ask_for_all, start=device.clock.now)

    def _published(self, data: bytes) -> None:
        message = self._device.read(data, self._device.dva)
        if message is not None:
            self.board.hear(message.body, self._device.clock.now)

    def _ask_for_all(self) -> None:
        self._device.ask(self._device.dva, m.GetDispatch(), self._answered)
        self._ask_above(None)

    def _ask_above(self, number: int | None) -> None:
        """Ask for the events above a number, and then for those above the last of them."""

        def answered(reply: m.Reply) -> None:
            self._answered(reply)
            content = reply.content
            if isinstance(content, m.EventList) and content.events:
                last = content.events[-1].event_id
                if number is None or last > number:
                    self._ask_above(last)

        self._device.ask(self._device.dva, m.GetEventList(number), answered)

    def _answered(self, reply: m.Reply) -> None:
        self.board.hear(reply.content, self._device.clock.now)

    # --- who decides ------------------------------------------------------------------------

    def join(self, client: str, role: str, name: str, said: Said) -> None:
        """A page's person gets a device of its role, or its device gets another name."""
        room = self.by_client.get(client)
        if room is not None and (not name or room.device.label == name):
            said(True, f"you are {room.device.label}")
            return
        if room is not None:
            self.leave(client)
        room = self._new(role, name)
        if room is None:
            said(False, "too many control rooms have come and gone: try again in two minutes")
            return
        self.by_client[client] = room

        def answered(reply: m.Reply) -> None:
            room.registered = ok = reply.code == m.OK
            if not ok:
                self._drop(client, room)
            said(ok, f"you are {room.device.label}" if ok else why(reply))

        def unreachable() -> None:
            self._drop(client, room)
            said(False, NO_ANSWER)

        room.device.register_once(answered, unreachable)

    def _new(self, role: str, name: str) -> ConsoleRoom | None:
        number = next((n for n in range(1, MOST_ROOMS + 1) if n not in self._used), None)
        if number is None:
            return None
        self._used.add(number)
        device = self._run.stage.device("room", number)
        self._name(device, name or f"{role}-{number - LISTENER}")
        self._appoint(device.id_tag, role)
        self.joined(device.id_tag, device.label)
        return ConsoleRoom(number, device, role)

    def _drop(self, client: str, room: ConsoleRoom) -> None:
        if self.by_client.get(client) is room:
            self.leave(client)

    def leave(self, client: str) -> None:
        """A page is gone for good, and its person decides no more."""
        room = self.by_client.pop(client, None)
        if room is not None:
            room.device.leave()
            room.device.clock.call_after(RESTS, self._forget, room)

    def _forget(self, room: ConsoleRoom) -> None:
        for peer in (room.device.dva, *self._run.field.robots):
            room.device.forget(peer)
        self._run.stage.devices.remove(room.device)
        room.device.labels.pop(room.device.id_tag, None)
        self._used.discard(room.number)

    def label(self, client: str) -> str:
        """What the person of a page is called; nothing if it has no control room."""
        room = self.by_client.get(client)
        return "" if room is None else room.device.label

    def line(self, now_ms: int) -> Line:
        """What pages are told: how orders are given, and who decides."""
        rooms = [
            {"label": room.device.label, "role": room.role, "client": client}
            for client, room in self.by_client.items()
            if room.registered
        ]
        dispatch = self.board.dispatch_line()
        return {"k": "control", "t": now_ms, "dispatch": dispatch, "rooms": rooms}
