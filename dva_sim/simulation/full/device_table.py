"""Devices in the book of a run's DVA, which no message reports completely."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import islice
from typing import Final

from dva_sim.core.registry import DeviceEntry
from dva_sim.core.sessions import Grant
from dva_sim.kernel.rates import Rate
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import ROBOT
from dva_sim.simulation.full.dva_server import DvaAgent

MAX_ROWS: Final = 200  # maximum rows of the table


@dataclass(frozen=True, slots=True)
class BookedDevice:
    """Entry of the DVA's book of devices.

    Attributes:
        device: Device as in the list of devices.
        heard_s: Time since its last message [s].
        beats_hz: Heartbeats per second [1/s].
        silent: True if it has been silent for longer than the time-out.
        order: Number of the event that it has an order for.
        mode: Last mode of a robot that has told its status.
        is_stopped: True if an emergency holds it.
        grant: Permission for it, if somebody has one.
        holder_label: Label of the device that holds it; empty if the DVA has forgotten that.
        ends_in: Time until the permission ends [s]; infinite if it does not end by itself.
    """

    device: m.Device
    heard_s: float
    beats_hz: float
    silent: bool
    order: int | None
    mode: str | None
    is_stopped: bool
    grant: Grant | None
    holder_label: str
    ends_in: float


class DeviceTable:
    """Table of a DVA's devices, present ones first.

    Args:
        dva: Function that returns the DVA: another one takes its place after a crash.
    """

    def __init__(self, dva: Callable[[], DvaAgent]) -> None:
        self._dva = dva
        self._beats: dict[str, Rate] = {}

    def rows(self) -> list[BookedDevice]:
        """Return up to `MAX_ROWS` devices, silent ones last; call it once a second."""
        entries = self._dva().core.registry.entries
        first = islice(sorted(entries, key=lambda i: entries[i].silent), MAX_ROWS)
        self._beats = {i: self._beats.get(i) or Rate() for i in first}
        return [self._row(i, entries[i]) for i in self._beats]

    def _row(self, id_tag: str, entry: DeviceEntry) -> BookedDevice:
        dva = self._dva()
        core = dva.core
        now = dva.device.clock.now
        grant = core.sessions.permissions.grants.get(id_tag)
        holder = None if grant is None else core.registry.entries.get(grant.holder)
        ends_in = math.inf
        if grant is not None and holder is not None:
            ends_in = core.access.ends(holder.device, entry.device, grant.level, now) - now
        is_seen = entry.kind == ROBOT and entry.position is not None
        return BookedDevice(
            device=entry.device,
            heard_s=now - entry.last_heard,
            beats_hz=self._beats[id_tag].of(dva.beats[id_tag], now),
            silent=entry.silent,
            order=next((event.number for event in core.orders.engaged.all(id_tag)), None),
            mode=entry.mode if is_seen else None,
            is_stopped=core.emergencies.holds(id_tag),
            grant=grant,
            holder_label="" if holder is None else holder.device.label,
            ends_in=ends_in,
        )
