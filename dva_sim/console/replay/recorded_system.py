"""A recorded system at a moment: devices and events, as a console would have heard of them."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterable, Mapping
from contextlib import suppress
from operator import attrgetter
from typing import Final, NoReturn, TypeVar

from dva_sim.agents.control_room.control_room import ControlRoomAgent
from dva_sim.agents.device import AgentDevice
from dva_sim.console.bench import Status
from dva_sim.console.replay.recorded_bench import ROUNDED, RecordedBench
from dva_sim.console.system.known_system import SOMEWHERE
from dva_sim.console.system.served_regions import regions_of
from dva_sim.console.system.system_state import DeviceState
from dva_sim.console.views.published_rows import SILENT_AFTER
from dva_sim.console.wire.rows import RegionShown
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.rates import RATE_OVER
from dva_sim.kernel.recorder import Recorder, Sent
from dva_sim.network.virtual_network import VirtualNetwork
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode, decode_if_valid
from dva_sim.protocol.devices import CONTROL_ROOM, ROBOT
from dva_sim.protocol.errors import ProtocolError
from dva_sim.recordings.event_moments import News
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
_TOLD: Final = re.compile(rb"<(EventStatus|EventList|AuditRecord)>")
Body = TypeVar("Body")


class RecordedRoom(ControlRoomAgent):
    """A control room in the time of a recording, which its clock leads through.

    Args:
        news: Messages about events, with their times.
    """

    def __init__(self, news: Iterable[News]) -> None:
        clock = Clock()
        super().__init__(
            AgentDevice(
                id_tag="",  # it sends nothing, and nobody knows it
                label="",
                device_type=CONTROL_ROOM,
                address="",
                dva="",
                network=VirtualNetwork(clock, _unlinked),
                recorder=Recorder(),
                frame=SOMEWHERE,
                timeout=0.0,
                attempts=0,
            )
        )
        for time, body in news:
            clock.call_at(time, self._take, body)


class RecordedSystem:
    """Devices and events of a recording.

    Args:
        playback: The recording.
        bench: Its bodies, drives, and the book of the DVA.
    """

    def __init__(self, playback: Playback, bench: RecordedBench) -> None:
        self._look = bench.status
        self._labels: Mapping[str, str] = playback.labels
        self._regions = regions_of(playback.scenario)
        self._said: dict[tuple[str, type], list[Sent]] = {}  # by sender and kind
        self._heard: dict[str, list[float]] = {}  # times at which a DVA was sent something
        traffic = [s for s in playback.recorder.traffic or () if isinstance(s.payload, bytes)]
        for sent in traffic:
            self._take(sent)
        told = [s for s in traffic if s.source in self._regions.labels and _TOLD.search(s.payload)]
        heard = [
            (time, getattr(message.body, "content", message.body))  # that of a reply, or itself
            for time, data in dict.fromkeys((s.time, s.payload) for s in told)  # once for all rooms
            if (message := decode_if_valid(data)) is not None
        ]
        self._news = heard or [*bench.news()]
        self._room = RecordedRoom(self._news)

    def _take(self, sent: Sent) -> None:
        if sent.destination in self._regions.labels:
            self._heard.setdefault(sent.source, []).append(sent.time)
        if (kind := _KIND.search(sent.payload)) is not None:
            said = self._said.setdefault((sent.source, _KINDS[kind[1]]), [])
            if not said or said[-1].payload != sent.payload:  # else a copy for somebody else
                said.append(sent)

    def room(self, now: float) -> RecordedRoom:
        """Return a control room that has heard what was told of events by a moment [s]."""
        if now < self._room.device.clock.now - 2 * ROUNDED:
            self._room = RecordedRoom(self._news)
        self._room.device.clock.run(now + ROUNDED)
        return self._room

    def devices(self, now: float) -> list[DeviceState]:
        """Return the devices that had asked a DVA for their registration by a moment [s]."""
        return [
            state
            for who, kind in self._said
            if kind is m.Registration and who not in self._regions.labels
            if (state := self.device(who, now)).dva
        ]

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


def _unlinked(node: str, peer: str) -> NoReturn:
    raise LookupError("a recording has no links")
