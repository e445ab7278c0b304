"""The list of devices that the DVA shows to who asks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice

from dva_sim.core.registry import CONTROL_ROOM, GUARD, OPERATOR, REMOTE, ROBOT, Registry
from dva_sim.core.wire_size import LIST_BYTES, xml_size
from dva_sim.protocol import messages as m

DEVICE_BYTES = 175  # of one device without its label, at most [B]
MOST_LISTED = 64
SHOWN = (ROBOT, OPERATOR, REMOTE, GUARD, CONTROL_ROOM)


@dataclass
class DeviceLister:
    """Lists devices one can do something with, robots first, as many as fit into a message."""

    registry: Registry
    _made: tuple[int, m.DeviceList] = field(default=(-1, m.DeviceList(())))

    def listed(self) -> m.DeviceList:
        """The list; replaced when somebody has come or gone."""
        if self._made[0] != self.registry.version:
            self._made = self.registry.version, m.DeviceList(tuple(self._as_many_as_fit()))
        return self._made[1]

    def _as_many_as_fit(self) -> Iterator[m.Device]:
        room = LIST_BYTES
        for device in islice(self._all(), MOST_LISTED):
            room -= DEVICE_BYTES + xml_size(device.label)
            if room < 0:
                return
            yield device

    def _all(self) -> Iterator[m.Device]:
        for device_type in SHOWN:
            for entry in self.registry.of_type(device_type):
                yield entry.device
