"""People who decide at an attached console: all through the console's own control room."""

from __future__ import annotations

from dva_sim.console.audit.audited import name_of_page
from dva_sim.console.wire.events import RoomEntry
from dva_sim.protocol.devices import ControlRoomRole

Named = tuple[str, ControlRoomRole]


class AttachedPeople:
    """The people at the pages, by what they call themselves.

    Attributes:
        by_client: The name of each who has joined, and what the address of its page allows.
    """

    def __init__(self) -> None:
        self.by_client: dict[str, Named] = {}
        self._come = 0

    def join(self, client: str, role: str, name: str) -> str:
        """Somebody decides from now on, or is called otherwise; the name."""
        known = self.by_client.get(client)
        if not name and known is not None:
            return known[0]
        if not name:
            self._come += 1
            name = f"{role}-{self._come}"
        self.by_client[client] = name, ControlRoomRole(role)
        return name

    def leave(self, client: str) -> None:
        """A page is gone for good."""
        self.by_client.pop(client, None)

    def author(self, client: str) -> str:
        """Return the name of a page's person."""
        known = self.by_client.get(client)
        return name_of_page(client) if known is None else known[0]

    def lines(self, allowed: str) -> list[RoomEntry]:
        """Return who decides, within what both the DVA and the page's address allow."""
        most = ControlRoomRole(allowed)
        return [
            {"label": name, "role": str(own if most.includes(own) else most), "client": client}
            for client, (name, own) in self.by_client.items()
        ]
