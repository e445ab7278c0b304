"""The table of devices: all that the DVA knows, and what the console knows of them beside it."""

from __future__ import annotations

import math
import statistics
from collections.abc import Collection
from itertools import islice
from typing import Any, Final

from dva_sim.agents.device import HEARTBEAT_PERIOD
from dva_sim.agents.robot.robot import RobotAgent
from dva_sim.core.registry import DETECTOR, DeviceEntry
from dva_sim.live.parts import Rate
from dva_sim.simulation.full.run import Run

Line = dict[str, Any]
MOST_ROWS: Final = 200
FAIR, POOR = 2.5 * HEARTBEAT_PERIOD, 4 * HEARTBEAT_PERIOD  # without a word [s]


def link_of(heard_s: float, silent: bool) -> str:
    """How good the connection to a device seems, by how long ago it was heard [s]."""
    if silent:
        return "lost"
    if heard_s > POOR:
        return "poor"
    return "fair" if heard_s > FAIR else "good"


class DeviceRows:
    """Rows about all devices of a run.

    Args:
        run: Which.
    """

    def __init__(self, run: Run) -> None:
        self._run = run
        self._beats: dict[str, Rate] = {}
        self._commands: dict[str, Rate] = {}

    def rows(self, fakes: Collection[str]) -> list[Line]:
        """A row for each, those that are there first; to be asked for once a second.

        Args:
            fakes: Ids of those that were added by hand.
        """
        entries = self._run.dva.desk.registry.entries
        first = islice(sorted(entries, key=lambda i: entries[i].silent), MOST_ROWS)
        self._beats = {i: self._beats.get(i) or Rate() for i in first}
        return [self._row(i, entries[i], i in fakes) for i in self._beats]

    def _row(self, id_tag: str, entry: DeviceEntry, is_fake: bool) -> Line:
        run, now, device = self._run, self._run.clock.now, entry.device
        heard = now - entry.last_heard
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
            **self._as_robot(id_tag, now),
            **self._permission(id_tag, now),
        }

    def _doing(self, id_tag: str, entry: DeviceEntry) -> str | None:
        field = self._run.field
        if id_tag in field.robots:
            return field.robots[id_tag].controller.mode.value
        guard = next((g for g in field.guards if g.device.id_tag == id_tag), None)
        if guard is not None:
            return guard.activity
        return entry.mode if entry.position is not None and entry.kind == "Robot" else None

    def _as_robot(self, id_tag: str, now: float) -> Line:
        """What only the world of a robot can tell; of those outside it is unknown."""
        robot: RobotAgent | None = self._run.field.robots.get(id_tag)
        if robot is None:
            return {"commands_hz": None, "refused": None, "picture_age_s": None}
        rate = self._commands.setdefault(id_tag, Rate()).of(robot.applied, now)
        age = robot.picture_age if rate else None
        return {
            "commands_hz": round(rate, 1),
            "refused": robot.refused,
            "picture_age_s": None if age is None or math.isinf(age) else round(age, 2),
        }

    def _round_trip(self, id_tag: str) -> float | None:
        device = next((d for d in self._run.stage.devices if d.id_tag == id_tag), None)
        trips = device.round_trips if device is not None else []
        return round(statistics.median(trips), 4) if trips else None

    def _permission(self, id_tag: str, now: float) -> Line:
        desk, labels = self._run.dva.desk, self._run.stage.labels
        grant = desk.sessions.permissions.grants.get(id_tag)
        if grant is None:
            return {"holder": None, "holder_label": None, "level": None, "ends_s": None}
        holder = desk.registry.entries.get(grant.holder)
        label = labels.get(grant.holder, "") if holder is None else holder.device.label
        robot, ends = desk.registry.entries.get(id_tag), math.inf
        if holder is not None and robot is not None:
            ends = desk.access.ends(holder.device, robot.device, grant.level, now)
        return {
            "holder": grant.holder,
            "holder_label": label,
            "level": grant.level,
            "ends_s": None if math.isinf(ends) else round(ends - now, 1),
        }
