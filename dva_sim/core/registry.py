"""Registered devices: when each was last heard, and its present activity."""

from __future__ import annotations

import math
from collections import OrderedDict, defaultdict, deque
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, field, replace
from itertools import chain, islice, takewhile
from typing import Final, NamedTuple

from dva_sim.kernel.labels import distinct, look_of, with_id
from dva_sim.protocol.devices import (
    CONTROL_ROOM,
    DETECTOR,
    FORGET_AFTER,
    GUARD,
    OPERATOR,
    PEER,
    REMOTE,
    ROBOT,
)
from dva_sim.protocol.messages import Device, DeviceList, Position, Registration
from dva_sim.protocol.wire_size import LIST_BYTES, xml_size

SAME_AS = {"Teleoperation": OPERATOR}  # other names of a type
DRIVERS = frozenset({OPERATOR, REMOTE, CONTROL_ROOM, *SAME_AS})
LISTED = (ROBOT, OPERATOR, REMOTE, GUARD, CONTROL_ROOM)  # types in the device list, in this order
DEVICE_BYTES = 175  # maximum size of a listed device without its label [B]
MAX_LISTED = 64  # maximum devices in one list
MAX_DEVICES = 20_000
DAY = 86_400.0  # [s]


@dataclass(slots=True)
class DeviceEntry:
    """One registered device.

    Attributes:
        device: Device as in the device list.
        last_heard: Time of its last message of any kind [s].
        position: Last known position.
        mode: Last known mode of a robot.
        silent: True if it has been silent for longer than the time-out.
        registrations: MessageID and timestamp of its last ones.
        free_from: Time until which it gets no order, because it declined one [s].
        place: Index in the order of registration, from 0.
        there_until: Time until which it counts as being at its address, as it was heard from there
            [s].
    """

    device: Device
    last_heard: float
    position: Position | None = None
    mode: str = "Idle"
    silent: bool = False
    registrations: deque[tuple[int, str]] = field(default_factory=lambda: deque(maxlen=8))
    free_from: float = 0.0
    place: int = 0
    there_until: float = -math.inf

    @property
    def kind(self) -> str:
        """Its type, by the name that the DVA uses."""
        return SAME_AS.get(self.device.device_type, self.device.device_type)

    def is_new_life(self, message_id: int, timestamp: str) -> bool:
        """Return True if a registration shows that the device has restarted: MessageIDs go back.

        A copy of an earlier registration, sent again or come late, does not say so. Between DVAs,
        whose clocks outlast them, nor does one that was sent before the newest: over a backbone it
        may have been repeated for minutes.
        """
        if not self.registrations or (message_id, timestamp) in self.registrations:
            return False
        newest, sent = self.registrations[-1]
        is_late = self.kind == PEER and _is_before(timestamp, sent)
        return message_id <= newest and not is_late


def _is_before(one: str, other: str) -> bool:
    """Return True if one time of day is before another, by less than half a day."""
    first, second = (int(t[:2]) * 3600 + int(t[3:5]) * 60 + float(t[6:]) for t in (one, other))
    return 0.0 < (second - first) % DAY < DAY / 2


@dataclass
class Registry:
    """All devices by id.

    Attributes:
        silent_after: Time of silence after which a device counts as gone [s].
        forget_after: Time of silence after which it is forgotten, unless it is involved in
            something open [s].
        most: Maximum number of devices.
        entries: Devices in the order of registration.
        version: Number that grows whenever a device registers, falls silent, returns, is
            forgotten, or changes its label or address.
    """

    silent_after: float = 10.0
    forget_after: float = FORGET_AFTER
    most: int = MAX_DEVICES
    entries: dict[str, DeviceEntry] = field(default_factory=dict)
    version: int = 0
    _of_type: dict[str, dict[str, DeviceEntry]] = field(default_factory=lambda: defaultdict(dict))
    _located: dict[str, dict[str, DeviceEntry]] = field(default_factory=lambda: defaultdict(dict))
    _heard: OrderedDict[str, DeviceEntry] = field(
        default_factory=OrderedDict
    )  # longest quiet first
    _silent: OrderedDict[str, DeviceEntry] = field(default_factory=OrderedDict)  # likewise
    _changed: dict[str, DeviceEntry | None] = field(default_factory=dict)
    _moved: dict[str, DeviceEntry | None] = field(default_factory=dict)
    _listed: tuple[int, DeviceList] = (-1, DeviceList(()))  # version, list
    _places: int = 0
    _looks: dict[str, str] = field(default_factory=dict)  # look of each label as registered, by id
    _alike: dict[str, set[str]] = field(default_factory=dict)  # ids, by look

    @property
    def is_full(self) -> bool:
        """True if no further device fits."""
        return len(self.entries) >= self.most

    def register(self, id_tag: str, request: Registration, now: float) -> DeviceEntry | None:
        """Enter a device, or renew its entry; None if the registry is full.

        If two labels look the same, one is shown with its id, too: the one that is silent, or
        else the one that came later.
        """
        label = self._label_of(id_tag, request.label)
        device = Device(id_tag, label, request.device_type, request.address)
        entry = self.entries.get(id_tag)
        if entry is None:
            if self.is_full:
                return None
            entry = self.add(DeviceEntry(device, now))
            self._look(id_tag, request.label)
            return entry
        self._look(id_tag, request.label)
        if entry.device.address != device.address:
            self.is_there(entry, now)
        elif entry.kind == DETECTOR:  # which publishes nothing: it renews its registration
            self.is_there(entry, now + self.silent_after / 2)
        if entry.device != device:
            entry.device = device
            self._note(id_tag, entry)
        self.heard(id_tag, now)
        return entry

    def is_there(self, entry: DeviceEntry, now: float) -> None:
        """Note that a device is at its address, since it published from there or is new."""
        entry.there_until = max(entry.there_until, now + self.silent_after)

    def is_elsewhere(self, id_tag: str, address: str, now: float) -> bool:
        """Return True while a device is heard at another address than the given one."""
        entry = self.entries.get(id_tag)
        moved = entry is not None and entry.device.address != address
        return moved and entry is not None and now < entry.there_until

    def add(self, entry: DeviceEntry) -> DeviceEntry:
        """Enter a device that was not known."""
        self.is_there(entry, entry.last_heard)
        device = entry.device
        entry.place = self._places
        self._places += 1
        self.entries[device.id_tag] = self._of_type[entry.kind][device.id_tag] = entry
        self._heard[device.id_tag] = entry
        self._look(device.id_tag, device.label)
        self._note(device.id_tag, entry)
        return entry

    def _look(self, id_tag: str, label: str) -> None:
        """Note how a label looks."""
        self._overlook(id_tag)
        self._looks[id_tag] = look_of(label)
        self._alike.setdefault(self._looks[id_tag], set()).add(id_tag)

    def _overlook(self, id_tag: str) -> None:
        look = self._looks.pop(id_tag, None)
        if look is not None:
            self._alike[look].discard(id_tag)
            if not self._alike[look]:
                del self._alike[look]

    def _label_of(self, id_tag: str, label: str) -> str:
        """Return the label under which a device is shown that registers with this one."""
        alike = [self.entries[other] for other in self._alike.get(look_of(label), set()) - {id_tag}]
        for entry in alike:
            if entry.silent and entry.device.label == distinct(label, "", ()):
                renamed = with_id(label, entry.device.id_tag)
                entry.device = replace(entry.device, label=renamed)
                self._note(entry.device.id_tag, entry)
        return distinct(label, id_tag, [entry.device.label for entry in alike])

    def heard(self, id_tag: str, now: float) -> DeviceEntry | None:
        """Note a sign of life; None if the device is not registered."""
        entry = self.entries.get(id_tag)
        if entry is not None:
            if entry.silent:
                entry.silent = False
                del self._silent[id_tag]
                self._note(id_tag, entry)
            entry.last_heard = now
            self._heard[id_tag] = entry
            self._heard.move_to_end(id_tag)
        return entry

    def locate(self, entry: DeviceEntry, position: Position) -> None:
        """Note where a device is."""
        if entry.position is None:
            self._located[entry.kind][entry.device.id_tag] = entry
        entry.position = position

    def fallen_silent(self, now: float) -> list[DeviceEntry]:
        """Return devices that have been quiet for longer than the time-out since the last call."""
        gone = []
        while self.next_silence() <= now:
            id_tag, entry = next(iter(self._heard.items()))
            entry.silent = True
            self._silent[id_tag] = entry
            self._note(id_tag, entry)
            gone.append(entry)
            del self._heard[id_tag]
        return gone

    def forget(self, id_tag: str) -> None:
        """Forget a device as if it had never registered."""
        entry = self.entries.pop(id_tag)
        for entries in (self._of_type, self._located):
            entries[entry.kind].pop(id_tag, None)
        self._heard.pop(id_tag, None)
        self._silent.pop(id_tag, None)
        self._overlook(id_tag)
        self._note(id_tag, None)

    def long_silent(self, now: float) -> Iterator[str]:
        """Return devices that could be forgotten by now, the longest silent first."""
        until = now - self.forget_after
        return (i for i, _ in takewhile(lambda e: e[1].last_heard < until, self._silent.items()))

    @property
    def silent(self) -> Iterable[str]:
        """Silent devices, the longest silent first."""
        return self._silent

    def next_silence(self) -> float:
        """Return when the next device will have been silent for too long [s]."""
        longest = next(iter(self._heard.values()), None)
        if longest is None:
            return math.inf
        return math.nextafter(
            longest.last_heard + self.silent_after, math.inf
        )  # silent: longer than the time-out

    def of_type(self, device_type: str) -> Iterable[DeviceEntry]:
        """Return the registered devices of a type that are not silent, in order of registration."""
        return (e for e in self._of_type[device_type].values() if not e.silent)

    def device_list(self) -> DeviceList:
        """Return the list of devices for other devices, as many as fit into a message."""
        if self._listed[0] != self.version:
            self._listed = self.version, DeviceList(tuple(self._as_many_as_fit()))
        return self._listed[1]

    def _as_many_as_fit(self) -> Iterator[Device]:
        room = LIST_BYTES
        for entry in islice(chain.from_iterable(map(self.of_type, LISTED)), MAX_LISTED):
            room -= DEVICE_BYTES + xml_size(entry.device.label)
            if room < 0:
                return
            yield entry.device

    def located(self, device_type: str) -> Collection[DeviceEntry]:
        """Return the devices of a type with a known position, in any order, even silent ones."""
        return self._located[device_type].values()

    def changes(self) -> dict[str, DeviceEntry | None]:
        """Return the devices that changed since the last call, for the store."""
        changed = self._changed
        self._changed = {}
        return changed

    def moves(self) -> dict[str, DeviceEntry | None]:
        """Return the devices that changed since the last call, for listeners."""
        moved = self._moved
        self._moved = {}
        return moved

    def _note(self, id_tag: str, entry: DeviceEntry | None) -> None:
        self._moved[id_tag] = self._changed[id_tag] = entry
        self.version += 1


RATE: Final = 500.0  # design: mean registrations of a peer; 5000 devices renew as often [1/s]
BURST: Final = 2000  # design: registrations at once, so that a fleet comes back in seconds
MAX_PEERS: Final = 10_000  # maximum peers whose registrations are counted


class RegistrationAllowance(NamedTuple):
    """Number of registrations that a peer may send at a time [s]."""

    number: float
    time: float


class RegistrationLimit:
    """Counts the registrations of each peer; the peers that were quiet longest are forgotten."""

    def __init__(self) -> None:
        self._left: OrderedDict[str, RegistrationAllowance] = OrderedDict()

    def takes(self, peer: str, now: float) -> bool:
        """Return True if a peer may register once more at a time [s]."""
        before = self._left.pop(peer, RegistrationAllowance(BURST, now))
        number = min(BURST, before.number + (now - before.time) * RATE)
        self._left[peer] = RegistrationAllowance(max(number - 1.0, 0.0), now)
        if len(self._left) > MAX_PEERS:
            self._left.popitem(last=False)
        return number >= 1.0
