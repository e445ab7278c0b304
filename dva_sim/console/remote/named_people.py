"""People who decide at a console of a remote DVA: all through the console's own control room."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from dva_sim.agents.control_room.control_room import ControlRoomAgent
from dva_sim.agents.device import do_nothing
from dva_sim.console.asking.refusal import NO_ANSWER, OnResult, Refused
from dva_sim.console.bench import UNATTENDED
from dva_sim.console.events.handing_over import HandingOver
from dva_sim.console.system.known_system import KnownSystem
from dva_sim.console.wire.events import RoomEntry
from dva_sim.protocol.devices import ControlRoomRole

Named = tuple[str, ControlRoomRole]


class NamedPeople:
    """The people at the pages, by what they call themselves; see `NamedRooms`.

    Args:
        system: System to which the console is attached.

    Attributes:
        listener: The console's own control room.
        by_client: The name of each who has joined, and what the address of its page allows.
        users: Names of those who have logged in, by their pages.
        handing_over: Work that people offer to each other.
    """

    def __init__(self, system: KnownSystem) -> None:
        self._system = system
        self.listener = system.agent
        self.by_client: dict[str, Named] = {}
        self.users: dict[str, str] = {}
        self.handing_over = HandingOver()
        self._come = 0

    def join(self, client: str, role: str, name: str, on_result: OnResult) -> None:
        """Let a page's person decide from now on, or be called otherwise.

        Raises:
            Refused: the DVA does not answer.
        """
        if not self._system.answers:
            raise Refused(NO_ANSWER)
        name = self.users.get(client, name)
        self._system.let_decide(do_nothing)
        if name or client not in self.by_client:
            self.by_client[client] = name or self._new_name(role), ControlRoomRole(role)
        on_result(True, f"you are {self.by_client[client][0]}, and may {self._system.role}")

    def _new_name(self, role: str) -> str:
        self._come += 1
        return f"{role}-{self._come}"

    def decide(
        self,
        client: str,
        role: str,
        on_result: OnResult,
        then: Callable[[ControlRoomAgent, OnResult], object],
    ) -> None:
        """Call `then` with the console's control room once the DVA lets it decide."""
        self._system.let_decide(partial(then, self.listener, on_result))

    def leave(self, client: str) -> None:
        """Forget a page's person, and let the DVA rely on nobody here if no other has stayed."""
        self.by_client.pop(client, None)
        bench = self._system.bench
        if bench is not None and not self.by_client:
            bench.appoint(self._system.device.id_tag, UNATTENDED)

    def attend(self, _: Mapping[str, str]) -> None:
        """Note which pages are open: all are one device for the DVA, which alone knows its role."""

    def names(self) -> Mapping[str, str]:
        """Return the name of each person who has joined, by page."""
        return {client: name for client, (name, _) in self.by_client.items()}

    def room_of(self, _: str) -> str:
        """Return the id of the console's own control room: all decide by it."""
        return self.listener.device.id_tag

    def entries(self) -> list[RoomEntry]:
        """Return who decides, within what both the DVA and the page's address allow."""
        most = ControlRoomRole(self._system.role)
        return [
            {"label": name, "role": str(own if most.includes(own) else most), "client": client}
            for client, (name, own) in self.by_client.items()
        ]
