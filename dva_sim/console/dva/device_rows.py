"""The table of devices: what a console hears of each, and of its own run what the bench knows."""

from __future__ import annotations

import math
import statistics
from collections.abc import Collection, Mapping

from dva_sim.agents.device import HEARTBEAT_PERIOD
from dva_sim.agents.robot.robot import RobotAgent
from dva_sim.console.dva.run_bench import RunBench
from dva_sim.console.robots.shown_mode import EMERGENCY, shown_mode
from dva_sim.console.system.system_state import DeviceState
from dva_sim.console.views.published_rows import (
    emergency_of,
    holder_named,
    sensors_of,
)
from dva_sim.console.wire.rows import DeviceRow
from dva_sim.kernel.rates import Rate
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import DETECTOR, ROBOT
from dva_sim.simulation.full.device_table import BookedDevice
from dva_sim.simulation.full.run import Run

FAIR, POOR = 2.5 * HEARTBEAT_PERIOD, 4 * HEARTBEAT_PERIOD  # without a word [s]


def link_of(heard_s: float, silent: bool) -> str:
    """Return the quality of a device's connection, by how long ago it was heard [s]."""
    if silent:
        return "lost"
    if heard_s > POOR:
        return "poor"
    return "fair" if heard_s > FAIR else "good"


def device_row(
    device: m.Device,
    *,
    doing: str | None,
    heard_s: float | None,
    silent: bool,
    beats_hz: float,
    holder: str | None,
    holder_label: str | None,
    dva: str | None,
    is_fake: bool = False,
) -> DeviceRow:
    """Return what any console can show of a device; all else is unknown."""
    speaks = heard_s is not None and not is_fake and device.device_type != DETECTOR
    return {
        "id": device.id_tag,
        "label": device.label,
        "type": device.device_type,
        "address": device.address,
        "doing": doing,
        "heard_s": _rounded(heard_s, 1),
        "silent": silent,
        "beats_hz": round(beats_hz, 2),
        "dva": dva,
        "link": link_of(heard_s or 0.0, silent) if speaks else None,
        "fake": is_fake,
        "round_trip_s": None,
        "commands_hz": None,
        "refused": None,
        "picture_age_s": None,
        "holder": holder,
        "holder_label": holder_label,
        "level": None,
        "ends_s": None,
    }


def listed_device_row(
    device_state: DeviceState,
    now: float,
    labels: Mapping[str, str],
    *,
    is_lost: bool,
    is_fake: bool,
    may_revoke: bool,
) -> DeviceRow:
    """Return a device, as the DVA lists it and as it is heard here."""
    is_stopped = emergency_of(device_state, now, {}) is not None
    device = device_state.device
    status = device_state.status
    doing = status.mode if isinstance(status, m.RobotStatus) else None
    doing = EMERGENCY if is_stopped else doing
    holder = device_state.holder[0] if device_state.holder is not None else None
    row = device_row(
        device,
        doing=status.activity if isinstance(status, m.PersonStatus) else doing,
        heard_s=None if device_state.heard is None else now - device_state.heard,
        silent=is_lost,
        beats_hz=device_state.rate.of(device_state.beats, now),
        holder=None if holder is None else holder.holder,
        holder_label=holder_named(holder, labels) or "",
        dva=labels.get(device_state.dva),
        is_fake=is_fake,
    )
    row["holder_known"] = holder is not None or device.device_type != ROBOT
    row["revocable"] = may_revoke
    row["camera"] = device_state.camera
    row["sensors"] = sensors_of(device_state)
    return row


class DeviceRows:
    """Rows about all devices of a run.

    Args:
        run: The run.
        bench: Its bench.
    """

    def __init__(self, run: Run, bench: RunBench) -> None:
        self._run = run
        self._bench = bench
        self._commands: dict[str, Rate] = {}

    def rows(self, fakes: Collection[str]) -> list[DeviceRow]:
        """Return a row for each, those that are there first; to be asked for once a second.

        Args:
            fakes: Ids of those that were added by hand.
        """
        obeyed = {device.id_tag: device.dva for device in self._run.stage.devices}
        rows = {  # of a device that has left a DVA, only from the book of the next
            booked.device.id_tag: self._row(booked, fakes, dva)
            for dva, table in self._bench.devices.items()
            for booked in table.rows()
            if obeyed.get(booked.device.id_tag, dva) in (dva, booked.device.id_tag)
        }
        return list(rows.values())

    def _row(self, booked: BookedDevice, fakes: Collection[str], dva: str) -> DeviceRow:
        id_tag = booked.device.id_tag
        robot = self._run.field.robots.get(id_tag)
        grant = booked.grant
        rate = self._rate_of(robot, self._run.clock.now)
        row = device_row(
            booked.device,
            doing=self._doing(booked),
            heard_s=booked.heard_s,
            silent=booked.silent,
            beats_hz=booked.beats_hz,
            holder=None if grant is None else grant.holder,
            holder_label=None if grant is None else booked.holder_label,
            dva=None if id_tag in self._run.dvas else self._run.stage.labels[dva],
            is_fake=id_tag in fakes,
        )
        row["round_trip_s"] = self._round_trip(id_tag)
        row["commands_hz"] = _rounded(rate, 1)
        if robot is not None:
            row["refused"] = robot.refused
            row["picture_age_s"] = _rounded(robot.picture_age, 2) if rate else None
        row["level"] = None if grant is None else grant.level
        row["ends_s"] = _rounded(booked.ends_in, 1)
        return row

    def _doing(self, booked: BookedDevice) -> str | None:
        field = self._run.field
        id_tag = booked.device.id_tag
        if id_tag in field.robots:
            return shown_mode(field.robots[id_tag].controller)
        guard = next((g for g in field.guards if g.device.id_tag == id_tag), None)
        if guard is not None:
            return guard.activity
        return EMERGENCY if booked.is_stopped else booked.mode

    def _rate_of(self, robot: RobotAgent | None, now: float) -> float | None:
        """Return commands in a second; of a robot outside it is unknown."""
        if robot is None:
            return None
        return self._commands.setdefault(robot.device.id_tag, Rate()).of(robot.applied, now)

    def _round_trip(self, id_tag: str) -> float | None:
        device = next((d for d in self._run.stage.devices if d.id_tag == id_tag), None)
        trips = device.round_trips if device is not None else []
        return round(statistics.median(trips), 4) if trips else None


def _rounded(number: float | None, digits: int) -> float | None:
    return None if number is None or math.isinf(number) else round(number, digits)
