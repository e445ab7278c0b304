"""The table of devices: all that the DVA knows, and what the console knows of them beside it."""

from __future__ import annotations

import math
import statistics
from collections.abc import Collection
from itertools import islice
from typing import Final

from dva_sim.agents.device import HEARTBEAT_PERIOD
from dva_sim.agents.robot.robot import RobotAgent
from dva_sim.console.robots.shown_mode import EMERGENCY, shown_mode
from dva_sim.console.wire.rows import DeviceRow
from dva_sim.core.registry import DeviceEntry
from dva_sim.core.sessions import Grant
from dva_sim.live.parts import Rate
from dva_sim.protocol.devices import DETECTOR
from dva_sim.simulation.full.run import Run

MOST_ROWS: Final = 200
FAIR, POOR = 2.5 * HEARTBEAT_PERIOD, 4 * HEARTBEAT_PERIOD  # without a word [s]


def link_of(heard_s: float, silent: bool) -> str:
    """Return the quality of a device's connection, by how long ago it was heard [s]."""
    if silent:
        return "lost"
    if heard_s > POOR:
        return "poor"
    return "fair" if heard_s > FAIR else "good"


class DeviceRows:
    """Rows about all devices of a run."""

    def __init__(self, run: Run) -> None:
        self._run = run
        self._beats: dict[str, Rate] = {}
        self._commands: dict[str, Rate] = {}

    def rows(self, fakes: Collection[str]) -> list[DeviceRow]:
        """A row for each, those that are there first; to be asked for once a second.

        Args:
            fakes: Ids of those that were added by hand.
        """
        entries = self._run.dva.core.registry.entries
        first = islice(sorted(entries, key=lambda i: entries[i].silent), MOST_ROWS)
        self._beats = {i: self._beats.get(i) or Rate() for i in first}
        return [self._row(i, entries[i], i in fakes) for i in self._beats]

    def _row(self, id_tag: str, entry: DeviceEntry, is_fake: bool) -> DeviceRow:
        run = self._run
        now = self._run.clock.now
        device = entry.device
        heard = now - entry.last_heard
        robot = run.field.robots.get(id_tag)
        grant = run.dva.core.sessions.permissions.grants.get(id_tag)
        rate = self._rate_of(robot, now)
        speaks = not is_fake and device.device_type != DETECTOR
        return {
            "id": id_tag,
            "label": device.label,
            "type": device.device_type,
            "address": device.address,
            "doing": self._doing(id_tag, entry),
            "heard_s": round(heard, 1),
            "silent": entry.silent,
            "beats_hz": round(self._beats[id_tag].of(run.dva.beats[id_tag], now), 2),
            "link": link_of(heard, entry.silent) if speaks else None,
            "fake": is_fake,
            "round_trip_s": self._round_trip(id_tag),
            "commands_hz": rate if rate is None else round(rate, 1),
            "refused": None if robot is None else robot.refused,
            "picture_age_s": _finite(robot.picture_age, 2) if robot and rate else None,
            "holder": None if grant is None else grant.holder,
            "holder_label": None if grant is None else self._label_of(grant.holder),
            "level": None if grant is None else grant.level,
            "ends_s": None if grant is None else _finite(self._end_of(grant, now) - now, 1),
        }

    def _doing(self, id_tag: str, entry: DeviceEntry) -> str | None:
        field = self._run.field
        if id_tag in field.robots:
            return shown_mode(field.robots[id_tag].controller)
        guard = next((g for g in field.guards if g.device.id_tag == id_tag), None)
        if guard is not None:
            return guard.activity
        if self._run.dva.core.emergencies.holds(id_tag):
            return EMERGENCY
        return entry.mode if entry.position is not None and entry.kind == "Robot" else None

    def _rate_of(self, robot: RobotAgent | None, now: float) -> float | None:
        """Commands in a second; of a robot outside it is unknown."""
        if robot is None:
            return None
        return self._commands.setdefault(robot.device.id_tag, Rate()).of(robot.applied, now)

    def _round_trip(self, id_tag: str) -> float | None:
        device = next((d for d in self._run.stage.devices if d.id_tag == id_tag), None)
        trips = device.round_trips if device is not None else []
        return round(statistics.median(trips), 4) if trips else None

    def _label_of(self, holder: str) -> str:
        entry = self._run.dva.core.registry.entries.get(holder)
        return self._run.stage.labels.get(holder, "") if entry is None else entry.device.label

    def _end_of(self, grant: Grant, now: float) -> float:
        """Return when a permission ends [s]; infinity: never."""
        core = self._run.dva.core
        holder, robot = (core.registry.entries.get(one) for one in (grant.holder, grant.robot))
        if holder is None or robot is None:
            return math.inf
        return core.access.ends(holder.device, robot.device, grant.level, now)


def _finite(seconds: float | None, digits: int) -> float | None:
    return None if seconds is None or math.isinf(seconds) else round(seconds, digits)
