"""Roles of control rooms and of any other device, by configuration; no device can claim one.

A role goes with the id of a device: with keys an id is proven, without them anybody can claim
to be anybody, as everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from dva_sim.protocol.devices import ControlRoomRole


@dataclass
class Roles:
    """Role of each device: by configuration, or by the process that runs the DVA.

    Attributes:
        known: Role by id of the device; others may look.
    """

    known: dict[str, ControlRoomRole] = field(default_factory=dict)

    def of(self, device: str) -> ControlRoomRole:
        """Return the role of a device, by its id."""
        return self.known.get(device, ControlRoomRole.LOOK)

    def appoint(self, device: str, role: ControlRoomRole | str) -> None:
        """Appoint a device to a role from now on.

        Raises:
            ValueError: there is no such role.
        """
        self.known[device] = ControlRoomRole(role)
