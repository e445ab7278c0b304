"""Control room of a console that hears the DVAs of all regions of a site."""

from __future__ import annotations

from typing_extensions import override

from dva_sim.agents.control_room.control_room import ControlRoomAgent
from dva_sim.agents.device import AgentDevice
from dva_sim.protocol import messages as m


class SiteControlRoom(ControlRoomAgent):
    """A control room with a device at each DVA, as a device is registered with one DVA only.

    What all of them tell is one list of events, and one of devices.

    Args:
        device: Its device at the DVA of the first region; it turns to another DVA when that dies.
        *others: Its devices at the other DVAs, one each.

    Attributes:
        rooms: Its control room at each DVA, this one first.
    """

    def __init__(self, device: AgentDevice, *others: AgentDevice) -> None:
        super().__init__(device)
        self.rooms = [self, *map(ControlRoomAgent, others)]
        for room in self.rooms[1:]:
            room.on_event = self._note
            # Where this one has turned to the DVA of that room, it hears the record itself.
            room.on_record = lambda record, dva=room.device.dva: self._take(  # type: ignore[misc]
                record if dva != self.device.dva else None
            )

    @override
    def start(self) -> None:
        super().start()
        for room in self.rooms[1:]:
            room.start()

    @override
    def _take(self, body: object) -> None:
        super()._take(body)
        if isinstance(body, m.DeviceList):
            for room in self.rooms[1:]:
                self.devices |= room.devices

    def about(self, event: int, agent: ControlRoomAgent) -> ControlRoomAgent:
        """Return the control room at the other DVA that has told last of an event, or `agent`."""
        newest = self.events.get(event, self)
        return next((room for room in self.rooms[1:] if room.events.get(event) is newest), agent)

    def at(self, dva: str | None, agent: ControlRoomAgent) -> ControlRoomAgent:
        """Return the control room at another DVA, or `agent`."""
        return next((room for room in self.rooms[1:] if room.device.dva == dva), agent)
