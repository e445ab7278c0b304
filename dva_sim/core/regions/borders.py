"""Borders: devices that have crossed into another region are handed over to the DVA there.

A device changes its DVA only while it is free: no border ends a drive, a mission or an order.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from dva_sim.core.orders import Orders
from dva_sim.core.regions.division import Division
from dva_sim.core.regions.help import MutualHelp
from dva_sim.core.registry import DeviceEntry
from dva_sim.core.sessions import Send
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import DETECTOR, GUARD, PEER, ROBOT

CROSSED_AFTER_M: Final = 2.0  # design: depth beyond a border at which it is crossed [m]
FOR: Final = 10.0  # design: and for so long: who walks along it stays where he was [s]
ASK_AGAIN: Final = 10.0  # design: pause after a hand-over that was not taken [s]
BACK: Final = 60.0  # design: pause after a guard was sent back, and is not there [s]


@dataclass
class Borders:
    """Handover of free devices to the DVA in whose region they are.

    Attributes:
        division: Division of the site, with the service of each region.
        orders: Current orders.
        help: Tells who was lent: such a device comes back.
        returning: Devices that go to the DVA of a region that was given back, by that region.
    """

    division: Division
    orders: Orders
    help: MutualHelp
    returning: dict[str, str] = field(default_factory=dict)
    _since: dict[str, float] = field(default_factory=dict)
    _homes: dict[str, m.Position] = field(default_factory=dict)
    _asked: dict[str, float] = field(default_factory=dict)

    def cross(self, now: float) -> list[Send]:
        """Return the hand-overs that are due, and send guards back who were lent."""
        sends: list[Send] = []
        for entry in self._movable():
            device = entry.device.id_tag
            if entry.position is None or self._is_inside(entry.position):
                self._since.pop(device, None)
                self.help.lent.discard(device)
                if entry.position is not None:
                    self._homes[device] = entry.position
            elif device in self.help.lent:
                sends += self._back(entry, now) if self._is_free(entry) else []
            elif self._is_free(entry):
                since = self._since.setdefault(device, now)
                sends += self._hand_over(entry, now) if now - since >= FOR else []
        if not any(self.division.served()):
            sends += self._all_others(now)
        for device, region in self.returning.items():
            guest = self.orders.registry.entries.get(device)
            dva = self.division.claims[region].dva
            sends += self._send(guest, dva, now) if guest and self._is_free(guest) else []
        return sends

    def forget(self, device: str) -> None:
        """Forget a device that is not registered here any longer."""
        for table in (self._since, self._homes, self._asked, self.returning):
            table.pop(device, None)
        self.help.lent.discard(device)

    def _movable(self) -> list[DeviceEntry]:
        registry = self.orders.registry
        return [e for kind in (ROBOT, GUARD) for e in registry.of_type(kind)]

    def _is_inside(self, place: m.Position) -> bool:
        """Return True for a place that this DVA serves, or just beyond its border."""
        regions = (region for region, _ in self.division.served())
        is_near = any(self.division.outside(region, place) <= CROSSED_AFTER_M for region in regions)
        return is_near or self.division.dva_at(place) == self.division.own

    def _is_free(self, entry: DeviceEntry) -> bool:
        device = entry.device.id_tag
        sessions = self.orders.sessions
        is_held = device in sessions.permissions.grants or device in sessions.reserved
        idle = entry.kind != ROBOT or entry.mode == "Idle"
        return idle and not is_held and device not in self.orders.engaged

    def _hand_over(self, entry: DeviceEntry, now: float) -> list[Send]:
        """Ask a device to register with the DVA of its region, if that DVA is reachable."""
        assert entry.position is not None
        return self._send(entry, self.division.dva_at(entry.position), now)

    def _send(self, entry: DeviceEntry, dva: str, now: float) -> list[Send]:
        device = entry.device.id_tag
        registry = self.orders.registry
        if not self.division.is_there(dva, registry) or dva == self.division.own:
            return []
        if now - self._asked.get(device, -ASK_AGAIN) < ASK_AGAIN:
            return []
        self._asked[device] = now
        return [Send(device, m.HandOver(dva, registry.entries[dva].device.address))]

    def _back(self, entry: DeviceEntry, now: float) -> list[Send]:
        """Send a guard who was lent back to where he was; a robot waits for an order there."""
        device = entry.device.id_tag
        home = self._homes.get(device)
        if entry.kind != GUARD or home is None or now - self._asked.get(device, -BACK) < BACK:
            return []
        self._asked[device] = now
        return [Send(device, m.Relocation(home))]

    def _all_others(self, now: float) -> Iterator[Send]:
        """Yield hand-overs of all devices, since this DVA serves no region any longer."""
        dva = self.division.claims[self.division.home].dva
        for entry in list(self.orders.registry.entries.values()):
            if entry.kind not in (PEER, DETECTOR, ROBOT, GUARD) and not entry.silent:
                yield from self._send(entry, dva, now) if self._is_free(entry) else ()
