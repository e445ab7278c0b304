"""The table of devices at a moment of a recording, from what they said to the DVA up to then."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Mapping

from dva_sim.console.wire.rows import DeviceRow, RobotRow
from dva_sim.kernel.recorder import Sent
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode
from dva_sim.protocol.errors import ProtocolError

BEATING = 10.0  # over which heartbeats are counted [s]


class RecordedDevices:
    """All who registered at the DVA, and when each was heard.

    Args:
        traffic: All messages of a run, by time.
        dva: Id of the DVA.
    """

    def __init__(self, traffic: Iterable[Sent], dva: str) -> None:
        self._registered: dict[str, tuple[float, m.Registration]] = {}
        self._heard: dict[str, list[float]] = {}
        self._beats: dict[str, list[float]] = {}
        for sent in traffic:
            if sent.destination == dva and isinstance(sent.payload, bytes):
                self._take(sent)

    def _take(self, sent: Sent) -> None:
        who, data = sent.source, sent.payload
        self._heard.setdefault(who, []).append(sent.time)
        if b"<HBMsg>" in data:
            self._beats.setdefault(who, []).append(sent.time)
        elif b"<RegMsg>" in data and who not in self._registered:
            try:
                body = decode(data).body
            except ProtocolError:
                return
            if isinstance(body, m.Registration):
                self._registered[who] = sent.time, body

    def rows(
        self, now: float, robots: Mapping[str, RobotRow], doing: Mapping[str, str]
    ) -> list[DeviceRow]:
        """A row for each that had registered by then; what nobody recorded is open.

        Args:
            now: The moment [s].
            robots: State of robots, by id.
            doing: Activities of the people and robots on site, by label.
        """
        return [
            self._row(who, about, now, robots.get(who), doing)
            for who, (when, about) in self._registered.items()
            if when <= now
        ]

    def _row(
        self,
        who: str,
        about: m.Registration,
        now: float,
        robot: RobotRow | None,
        doing: Mapping[str, str],
    ) -> DeviceRow:
        heard, beats = self._heard[who], self._beats.get(who, [])
        last = heard[bisect_right(heard, now) - 1]
        recent = bisect_right(beats, now) - bisect_right(beats, now - BEATING)
        return {
            "id": who,
            "label": about.label,
            "type": about.device_type,
            "address": about.address,
            "doing": doing.get(about.label),
            "heard_s": round(now - last, 1),
            "silent": False,
            "beats_hz": round(recent / BEATING, 2),
            "fake": False,
            "revocable": False,
            "link": None,
            "holder": None if robot is None else robot["holder"],
            "holder_label": None if robot is None else robot["holder_label"],
            "commands_hz": None if robot is None else robot["commands_hz"],
            "round_trip_s": None,
            "refused": None,
            "picture_age_s": None,
            "level": None,
            "ends_s": None,
        }
