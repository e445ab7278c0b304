"""Roles of control rooms and of any other device, by configuration; no device can claim one.

A role goes with the id of a device: with keys an id is proven, without them anybody can claim
to be anybody, as everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum


class ControlRoomRole(StrEnum):
    """Role of a control room, or of another device; each includes those before it."""

    LOOK = "look"
    DRIVE = "drive"
    DISPATCH = "dispatch"
    SUPERVISE = "supervise"

    def includes(self, other: ControlRoomRole) -> bool:
        """Return True if this role allows what the other one allows."""
        ranks = list(ControlRoomRole)
        return ranks.index(self) >= ranks.index(other)


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
        """From now on a device has this role.

        Raises:
            ValueError: there is no such role.
        """
        self.known[device] = ControlRoomRole(role)

    def dismiss(self, device: str) -> None:
        """From now on a device may look, as anybody."""
        self.known.pop(device, None)
