"""Roles of clients: each may do what those before it may."""

from __future__ import annotations

from enum import IntEnum


class Role(IntEnum):
    """What a client may do; each may do what those before it may.

    A phone drives its own robot, or is a guard's; whoever may drive changes the link, too. Who
    dispatches sends others, and who supervises takes robots from their holders.
    """

    NOBODY = 0
    LOOK = 1
    PHONE = 2
    DRIVE = 3
    DISPATCH = 4
    SUPERVISE = 5

    @property
    def acts(self) -> bool:
        """Whether it may do anything but look."""
        return self >= Role.PHONE
