"""A recorded system at a moment: its devices, as a console would have heard them by then."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Callable, Mapping
from contextlib import suppress
from operator import attrgetter
from typing import Final, TypeVar

from dva_sim.console.bench import Status
from dva_sim.console.system.served_regions import regions_of
from dva_sim.console.system.system_state import DeviceState
from dva_sim.console.views.published_rows import SILENT_AFTER
from dva_sim.console.wire.rows import RegionShown
from dva_sim.kernel.rates import RATE_OVER
from dva_sim.kernel.recorder import Sent
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode
from dva_sim.protocol.devices import ROBOT
from dva_sim.protocol.errors import ProtocolError
from dva_sim.simulation.full import Playback

HOLDER_LAPSES: Final = 3.5  # a robot that is held says so each second; who asks hears it [s]
_KINDS: Final = {
    b"HBMsg": m.Heartbeat,
    b"RegMsg": m.Registration,
    b"RobotStatus": m.RobotStatus,
    b"PersonStatus": m.PersonStatus,
    b"RobotHolder": m.RobotHolder,
    b"RobotEmergency": m.RobotEmergency,
    b"PeerStatus": m.PeerStatus,
}
_TIME: Final = attrgetter("time")
_KIND: Final = re.compile(rb"<(" + b"|".join(_KINDS) + rb")>")
Body = TypeVar("Body")


class RecordedSystem:
    """Devices of a recording.

    Args:
        playback: The recording.
        look: Function that returns the status of a device at a moment [s], from recorded tracks.
    """

    def __init__(self, playback: Playback, look: Callable[[str, float], Status | None]) -> None:
        self._look = look
        self._labels: Mapping[str, str] = playback.labels
        self._regions = regions_of(playback.scenario)
        self._said: dict[tuple[str, type], list[Sent]] = {}  # by sender and kind
        self._heard: dict[str, list[float]] = {}  # times at which a DVA was sent something
        for sent in playback.recorder.traffic or ():
            if isinstance(sent.payload, bytes):
                self._take(sent)

    def _take(self, sent: Sent) -> None:
        if sent.destination in self._regions.labels:
            self._heard.setdefault(sent.source, []).append(sent.time)
        if (kind := _KIND.search(sent.payload)) is not None:
            said = self._said.setdefault((sent.source, _KINDS[kind[1]]), [])
            if not said or said[-1].payload != sent.payload:  # else a copy for somebody else
                said.append(sent)

    def devices(self, now: float) -> list[DeviceState]:
        """Return the devices that had asked a DVA for their registration by a moment [s]."""
        ids = [who for who, kind in self._said if kind is m.Registration]
        states = (self.device(who, now) for who in ids if who not in self._regions.labels)
        return [state for state in states if state.dva]

    def device(self, who: str, now: float) -> DeviceState:
        """Return a device at a moment [s]; its DVA is empty until it asks for a registration."""
        about, _, dva = self._newest(who, m.Registration, now) or (
            m.Registration(who, ROBOT, ""),
            *(now, ""),
        )
        heard = self._heard.get(who, [])
        heard_by_then = bisect_right(heard, now)
        status: tuple[Status, float, str] | None = self._newest(
            who, m.RobotStatus, now
        ) or self._newest(who, m.PersonStatus, now)
        holder = self._newest(who, m.RobotHolder, now)
        emergency = self._newest(who, m.RobotEmergency, now)
        state = DeviceState(
            m.Device(who, self._labels.get(who, about.label), about.device_type, about.address),
            listed=now,
            dva=dva,
            heard=heard[heard_by_then - 1] if heard_by_then else None,
            published=status and status[0],
            look=lambda: self._look(who, now),
            holder=holder[:2] if holder and now - holder[1] <= HOLDER_LAPSES else None,
            emergency=emergency and emergency[:2],
        )
        for second in range(int(RATE_OVER) + 1):
            then = now - RATE_OVER + second
            state.beats = bisect_right(self._said.get((who, m.Heartbeat), []), then, key=_TIME)
            state.rate.of(state.beats, then)
        return state

    def is_lost(self, device_state: DeviceState, now: float) -> bool:
        """Return True if a device had been silent for so long that no DVA listed it any more."""
        return device_state.heard is not None and now - device_state.heard > SILENT_AFTER

    def regions(self, now: float) -> list[RegionShown]:
        """Return who served each region at a moment [s]; none if no DVA had a listener then."""
        self._regions.heard.clear()
        for dva in self._regions.labels:
            if (status := self._newest(dva, m.PeerStatus, now)) is not None:
                self._regions.heard[dva] = status[1], status[0]
        rows = self._regions.rows(now)
        return rows if any(row["state"] != "dead" for row in rows) else []

    def _newest(self, who: str, kind: type[Body], now: float) -> tuple[Body, float, str] | None:
        """Return the newest message of a kind up to a moment, with its time, and to whom it went.

        None: there is none, or it cannot be read.
        """
        said = self._said.get((who, kind), [])
        end = bisect_right(said, now, key=_TIME)
        with suppress(ProtocolError):
            if end and isinstance(body := decode(said[end - 1].payload).body, kind):
                return body, said[end - 1].time, said[end - 1].destination
        return None
