"""Limit of devices per process, due to the limit of open files."""

from __future__ import annotations

import resource
from typing import Final, NamedTuple

from dva_sim.core.registry import MAX_DEVICES
from dva_sim.kernel.errors import DvaSimError

PER_DEVICE: Final = 16  # open files that a device needs at the DVA
OWN_FILES: Final = 200  # files of the program itself


class DeviceRoom(NamedTuple):
    """Number of devices that fit, and limit of open files."""

    devices: int
    files: int

    def __str__(self) -> str:
        return f"has room for {self.devices:,} devices, with {self.files:,} open files"


def room_here() -> DeviceRoom:
    """Return the number of devices that fit, after raising the limit of open files."""
    usable = _usable()
    return DeviceRoom(max(1, min(MAX_DEVICES, (usable - OWN_FILES) // PER_DEVICE)), usable)


def check_room_for(devices: int) -> None:
    """Refuse to start if some devices could not connect.

    Raises:
        DvaSimError: too few files may be open; the message has both numbers.
    """
    usable = _usable()
    needed = OWN_FILES + devices * PER_DEVICE
    if usable < needed:
        raise DvaSimError(
            f"a process may open {usable} files here, and {devices} devices take {needed}; "
            f"allow more first: ulimit -n {max(1024, needed)}"
        )


def _usable() -> int:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    return soft if hard == resource.RLIM_INFINITY else hard
