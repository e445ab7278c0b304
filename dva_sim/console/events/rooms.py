"""The control rooms of a console: a device for each person who decides, and one that listens.

Decisions of people become messages of their devices, and what pages show of events comes by the
DVA's own: another make of control room, or of DVA, can take either place.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final, Unpack

from dva_sim.agents.control_room.control_room import ControlRoomAgent
from dva_sim.agents.device import AgentDevice
from dva_sim.console.asking.refusal import OnResult, unanswered
from dva_sim.console.events.handing_over import HandingOver
from dva_sim.console.system.site_control_room import SiteControlRoom
from dva_sim.console.wire.events import RoomEntry
from dva_sim.console.wire.limits import LONG
from dva_sim.console.wire.seats import Answered
from dva_sim.kernel.labels import with_id
from dva_sim.protocol.devices import FORGET_AFTER, ControlRoomRole
from dva_sim.simulation.full.run import Run

LISTENER: Final = 1000  # number of the device that listens for the pages; those at the DVAs of
# other regions are just below, and a scenario's far below
MAX_ROOMS: Final = 250
RESTS: Final = FORGET_AFTER + 60.0  # from the end of one until its id is given out again [s]
JOINED_WITHIN: Final = 30.0  # a person is told by then whether the DVA knows the device [s]
LOOK: Final = 0.05  # from one look whether it does to the next [s]


@dataclass
class ConsoleRoom:
    """A person's share in the control of a run.

    Attributes:
        number: Number from which its id is made.
        agent: Agent at the DVA.
        role: Role that the person's address allows.
        registered: True once the DVA has registered it.
        unanswered: Requests of its person without a reply.
    """

    number: int
    agent: ControlRoomAgent
    role: str
    registered: bool = False
    unanswered: set[OnResult] = field(default_factory=set)

    def until_answered(self, on_result: OnResult) -> OnResult:
        """Keep an answer in mind: a room that is left stays until its person has it."""

        def answer(ok: bool, text: str, /, **more: Unpack[Answered]) -> None:
            self.unanswered.discard(on_result)
            on_result(ok, text, **more)

        self.unanswered.add(on_result)
        return answer

    def is_called(self, name: str) -> bool:
        """Return True if that is the name which its person gave."""
        return self.device.label in (name, with_id(name, self.device.id_tag))

    @property
    def device(self) -> AgentDevice:
        """Its identity, and ways to talk."""
        return self.agent.device


class ConsoleRooms:
    """All control rooms of a console.

    Args:
        run: The run.
        appoint: Gives a control room a role; see `Bench`.

    Attributes:
        listener: Control room that receives the DVA's news of events for the pages; its
            reader starts it.
        by_client: The rooms by their pages.
        users: Names of those who have logged in, by their pages.
        handing_over: Work that people offer to each other.
    """

    def __init__(self, run: Run, appoint: Callable[[str, ControlRoomRole], object]) -> None:
        self._run = run
        self._appoint = appoint
        self.by_client: dict[str, ConsoleRoom] = {}
        self.users: dict[str, str] = {}
        self.handing_over = HandingOver()
        self._used: set[int] = set()
        self.listener = SiteControlRoom(*map(self._listening, range(len(run.dvas))))

    def _listening(self, order: int) -> AgentDevice:
        """Return the device of the listener at one of the DVAs; at the first it knows all."""
        device = self._device(LISTENER - order, "console")
        if order:
            device.dvas = (list(self._run.dvas)[order],)
            device.dva = device.dvas[0]
            device.call(f"console at {self._run.stage.labels[device.dva]}")
        return device

    def _device(self, number: int, label: str) -> AgentDevice:
        device = self._run.stage.device("control-room", number)
        device.call(label)
        return device

    # --- who decides ------------------------------------------------------------------------

    def decide(
        self,
        client: str,
        role: str,
        on_result: OnResult,
        then: Callable[[ControlRoomAgent, OnResult], object],
        name: str = "",
    ) -> None:
        """Call `then` with the control room of a page; it gets one with its first decision."""

        def joined(ok: bool, text: str, /, **_: Unpack[Answered]) -> None:
            room = self.by_client.get(client)
            if ok and room is not None:
                then(room.agent, room.until_answered(on_result))
            else:
                on_result(False, text)

        self.join(client, role, name, joined)

    def join(self, client: str, role: str, name: str, on_result: OnResult) -> None:
        """Give a page's person a device of its role, or another name."""
        name = self.users.get(client, name)
        room = self.by_client.get(client)
        if room is not None and (not name or room.is_called(name)):
            on_result(True, f"you are {room.device.label}")
            return
        if room is not None:  # what it has sent goes on
            self._end(self.by_client.pop(client), room.device.clock.now + LONG)
        room = self._new(role, name)
        if room is None:
            on_result(False, "too many control rooms have come and gone: try again in two minutes")
            return
        self.by_client[client] = room

        clock = room.device.clock
        ends = clock.now + JOINED_WITHIN

        def looks_again() -> bool:
            status = room.agent.dispatch
            if status is not None and status.role is not None:
                room.registered = True
                on_result(True, f"you are {room.device.label}, and may {status.role}")
            elif clock.now >= ends:
                unanswered(on_result)
            return not room.registered and clock.now < ends

        room.agent.start()
        clock.every(LOOK, looks_again)

    def _new(self, role: str, name: str) -> ConsoleRoom | None:
        number = next((n for n in range(1, MAX_ROOMS + 1) if n not in self._used), None)
        if number is None:
            return None
        self._used.add(number)
        agent = ControlRoomAgent(self._device(LISTENER + number, name or f"{role}-{number}"))
        agent.device.dva = self.listener.device.dva  # which answers, where another may be dead
        self._appoint(agent.device.id_tag, ControlRoomRole(role))
        return ConsoleRoom(number, agent, role)

    def attend(self, pages: Mapping[str, str]) -> None:
        """Let the DVA count on exactly those whose pages are open.

        Args:
            pages: Role of each open page, by client. The console's own rooms have the highest, so
                that DVAs know of people who have decided nothing yet.
        """
        roles = {ControlRoomRole(role) for role in pages.values() if role}
        highest = max(roles, key=list(ControlRoomRole).index, default=ControlRoomRole.LOOK)
        for listening in self.listener.rooms:
            self._appoint(listening.device.id_tag, highest)
        for client, room in self.by_client.items():
            if client not in pages:
                room.device.withdrawn = True
            elif room.device.withdrawn:
                room.device.resume()

    def leave(self, client: str) -> None:
        """Let a page go for good: what it asked for is answered yet, what it sent is open."""
        room = self.by_client.pop(client, None)
        if room is not None:
            room.agent.orders.clear()
            self._end(room, room.device.clock.now + LONG)

    def _end(self, room: ConsoleRoom, latest: float) -> None:
        """Let a device leave that nobody waits for, or only in vain, and that has no order."""
        clock = room.device.clock
        is_awaited = bool(room.unanswered) and clock.now < latest
        if is_awaited or room.agent.orders:
            clock.call_after(LOOK, self._end, room, latest)
            return
        room.device.leave()
        clock.call_after(RESTS, self._forget, room)

    def _forget(self, room: ConsoleRoom) -> None:
        for peer in (*room.device.dvas, *self._run.field.robots):
            room.device.forget(peer)
        self._run.stage.dismiss(room.device)
        self._appoint(room.device.id_tag, ControlRoomRole.LOOK)
        self._used.discard(room.number)

    # --- what pages are told ----------------------------------------------------------------

    def names(self) -> Mapping[str, str]:
        """Return the name of each person who decides, by page."""
        return {client: room.device.label for client, room in self.by_client.items()}

    def room_of(self, client: str) -> str | None:
        """Return the id of the control room by which a page's person decides."""
        room = self.by_client.get(client)
        return None if room is None else room.device.id_tag

    def entries(self) -> list[RoomEntry]:
        """Return who decides."""
        return [
            {"label": room.device.label, "role": room.role, "client": client}
            for client, room in self.by_client.items()
            if room.registered
        ]
