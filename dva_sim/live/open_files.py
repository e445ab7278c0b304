"""Limit of devices per process: each needs some of the files that the process may open."""

from __future__ import annotations

import resource
from typing import Final, NamedTuple

from dva_sim.core.registry import MAX_DEVICES
from dva_sim.kernel.errors import DvaSimError

PER_DEVICE: Final = 16  # at the DVA
OWN_FILES: Final = 200  # files of the program itself


class DeviceRoom(NamedTuple):
    """Devices that fit, and the files that may be open."""

    devices: int
    files: int

    def __str__(self) -> str:
        return f"has room for {self.devices:,} devices, with {self.files:,} open files"


def room_here() -> DeviceRoom:
    """Return how many devices fit, with as many open files as the system allows."""
    usable = _usable()
    return DeviceRoom(max(1, min(MAX_DEVICES, (usable - OWN_FILES) // PER_DEVICE)), usable)


def check_room_for(devices: int) -> None:
    """Refuse to begin where devices would be turned away one by one.

    Raises:
        DvaSimError: how many files may be open, and how many it takes.
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
