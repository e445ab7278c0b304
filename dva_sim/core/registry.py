"""Who is registered, when each was last heard, and what each is doing."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from dva_sim.protocol.messages import Device, Position, Registration

ROBOT, GUARD, OPERATOR, DETECTOR = "Robot", "Guard", "TeleOp", "Sensor"
MAX_DEVICES = 20_000


@dataclass
class Entry:
    """One registered device.

    Attributes:
        device: As it stands on the device list.
        last_heard: Time of its last message of any kind [s].
        position: Where it was last known to be.
        mode: Last known mode of a robot.
        order: Event that it is working on.
        silent: Whether it has been quiet for longer than the time-out.
        registrations: MessageID and timestamp of its last ones.
        free_from: Until then it is given no order, because it declined one [s].
    """

    device: Device
    last_heard: float
    position: Position | None = None
    mode: str = "Idle"
    order: int | None = None
    silent: bool = False
    registrations: deque[tuple[int, str]] = field(default_factory=lambda: deque(maxlen=8))
    free_from: float = 0.0

    def is_new_life(self, message_id: int, timestamp: str) -> bool:
        """Whether a registration says that the device has started anew: MessageIDs go back.

        A copy of an earlier registration, sent again or come late, does not say so.
        """
        if not self.registrations or (message_id, timestamp) in self.registrations:
            return False
        return message_id <= self.registrations[-1][0]


@dataclass
class Registry:
    """All devices by id.

    Attributes:
        silent_after: How long a device may be quiet before it counts as gone [s].
        most: How many devices there may be.
    """

    silent_after: float = 10.0
    most: int = MAX_DEVICES
    entries: dict[str, Entry] = field(default_factory=dict)

    def register(self, id_tag: str, request: Registration, now: float) -> Entry | None:
        """Enter a device, or renew its entry; None if the registry is full."""
        device = Device(id_tag, request.label, request.device_type, request.address)
        known = self.entries.get(id_tag)
        if known is not None:
            known.device = device
            self.heard(id_tag, now)
            return known
        if len(self.entries) >= self.most:
            return None
        entry = self.entries[id_tag] = Entry(device, now)
        return entry

    def heard(self, id_tag: str, now: float) -> Entry | None:
        """Note a sign of life; None if the device is not registered."""
        entry = self.entries.get(id_tag)
        if entry is not None:
            entry.last_heard, entry.silent = now, False
        return entry

    def fallen_silent(self, now: float) -> list[Entry]:
        """Devices that have been quiet for longer than the time-out since the last call."""
        limit = now - self.silent_after
        gone = [e for e in self.entries.values() if not e.silent and e.last_heard < limit]
        for entry in gone:
            entry.silent = True
        return gone

    def of_type(self, device_type: str) -> list[Entry]:
        """Registered devices of a type that are not silent, in order of registration."""
        return [
            e for e in self.entries.values() if e.device.device_type == device_type and not e.silent
        ]
