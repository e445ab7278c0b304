"""Devices as the DVA knows them: types, roles of control rooms, and when they are forgotten."""

from __future__ import annotations

from enum import StrEnum
from typing import Final

ROBOT: Final = "Robot"
GUARD: Final = "Guard"
OPERATOR: Final = "TeleOp"
DETECTOR: Final = "Sensor"
REMOTE: Final = "Remote Control"  # may drive robots, but gets no orders
CONTROL_ROOM: Final = "ControlRoom"  # observes and decides; may drive if its role allows it
PEER: Final = "DVA"  # another DVA, which serves other regions

FORGET_AFTER: Final = 60.0  # silence after which a device is forgotten [s]


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
