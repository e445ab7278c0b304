"""Roles of clients: each may do what those before it may."""

from __future__ import annotations

from enum import IntEnum


class Role(IntEnum):
    """The permissions of a client, in ascending order.

    Every role may press the emergency stop, which can do no more than stop robots. A phone drives
    its own robot, or belongs to a guard. Drivers may change the link and the run as well,
    dispatchers may decide on events, and supervisors may take robots from their holders.
    """

    NOBODY = 0
    LOOK = 1
    PHONE = 2
    DRIVE = 3
    DISPATCH = 4
    SUPERVISE = 5

    @property
    def acts(self) -> bool:
        """True if it may do more than look and press the emergency stop."""
        return self >= Role.PHONE
