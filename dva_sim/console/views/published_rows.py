"""Rows about robots of which only messages are known; what is unknown is null."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from dva_sim.agents.robot.controller import Mode
from dva_sim.console.events.robot_conditions import UNHEARD
from dva_sim.console.robots.shown_mode import EMERGENCY, EMERGENCY_LAPSES, emergency_shown
from dva_sim.console.system.system_state import DeviceState
from dva_sim.console.wire.rows import EmergencyShown, RobotRow
from dva_sim.protocol import messages as m
from dva_sim.worlds.geo import GeoFrame

SILENT_AFTER: Final = 10.0  # without a place on the list: the DVA's own time-out [s]


def positions(
    devices: Mapping[str, DeviceState], numbers: dict[str, int], frame: GeoFrame
) -> list[list[int]]:
    """Return the positions of everybody who has reported one."""
    rows = []
    for id_tag, entry in devices.items():
        status = entry.status
        if status is None:
            continue
        place = frame.to_xy(status.position.latitude, status.position.longitude)
        motion = 0.0, 0.0
        if isinstance(status, m.RobotStatus):
            motion = status.heading, status.speed
        rows.append(place_shown(numbers[id_tag], place, *motion))
    return rows


def place_shown(number: int, place: tuple[float, float], heading: float, speed: float) -> list[int]:
    """Return the position of somebody; see `PlacesLine`.

    Args:
        number: Number by which pages know them.
        place: Position on the map [m].
        heading: [rad]
        speed: [m/s]
    """
    turn = math.remainder(heading, 2.0 * math.pi)
    x, y = place
    return [number, round(100 * x), round(100 * y), round(1000 * turn), round(1000 * speed)]


def mode_of(device_state: DeviceState) -> str:
    """Return the mode of a robot; empty if it is unknown."""
    status = device_state.status
    return status.mode if isinstance(status, m.RobotStatus) else ""


def emergency_of(
    device_state: DeviceState, now: float, labels: Mapping[str, str]
) -> EmergencyShown | None:
    """Describe the emergency that a robot reports; it does so each second while it is stopped."""
    emergency, heard = device_state.emergency or (None, now)
    is_silent = device_state.heard is None or now - device_state.heard > EMERGENCY_LAPSES
    if emergency is None or (now - heard > EMERGENCY_LAPSES and not is_silent):
        return None
    return emergency_shown(emergency, heard, labels)


def robot_row(
    device_state: DeviceState,
    number: int,
    now: float,
    labels: Mapping[str, str],
    stopper: tuple[str, str] | None = None,
) -> RobotRow:
    """Return a robot, as it says itself.

    Args:
        device_state: Its state.
        number: Number by which pages know it.
        now: [s]
        labels: Labels of devices, by id.
        stopper: Device and name of the person who last stopped it from a page.
    """
    stoppers = {**labels, stopper[0]: stopper[1]} if stopper is not None else labels
    mode = mode_of(device_state)
    holder = device_state.holder
    holding, since = holder if holder is not None else (None, now)
    held = holding is not None and holding.holder is not None
    is_driven = mode == Mode.TELEOPERATION.value
    is_unheard = device_state.heard is not None and now - device_state.heard > SILENT_AFTER
    emergency = emergency_of(device_state, now, stoppers)
    return {
        "i": number,
        "mode": (mode or "unknown") if emergency is None else EMERGENCY,
        "emergency": emergency,
        "stop_reason": UNHEARD if is_driven and is_unheard else "",
        "pattern": None,
        "battery": None,
        "holder": holding.holder if holding is not None else None,
        "holder_label": holder_named(holding, labels),
        "session_age_s": round(holding.held_for + now - since, 1) if holding and held else None,
        "watchdog_left_s": None,
        "set_speed_mps": None,
        "set_turn_rate_radps": None,
        "queue": None,
        "lost": None,
        "commands_hz": None,
        "refused": None,
        "timeouts": None,
        "camera": device_state.camera,
        "sensors": readings_of(device_state, now),
    }


def sensors_of(device_state: DeviceState) -> list[str]:
    """Describe what a device can measure."""
    return [f"{sensor.name} [{sensor.unit}]" for sensor in device_state.sensors]


def readings_of(device_state: DeviceState, now: float) -> list[str]:
    """Describe the values of its sensors; a value that is no longer reported is unknown."""
    return [
        f"{sensor.name} {_reading(sensor, device_state, now)}" for sensor in device_state.sensors
    ]


def _reading(sensor: m.Sensor, device_state: DeviceState, now: float) -> str:
    value, heard = device_state.values.get(sensor.name, (None, 0.0))
    if value is None or now - heard > SILENT_AFTER:
        return "unknown"
    if len(value.values) > 1:
        return f"nearest {min(value.values):.3g} {value.unit}"
    unit = "" if value.unit == "1" else f" {value.unit}"
    return f"{value.values[0]:.3g}{unit}"


def holder_named(holding: m.RobotHolder | None, labels: Mapping[str, str]) -> str | None:
    """Return the label of a robot's holder: the robot's word for it, or the list's."""
    if holding is None or holding.holder is None:
        return None
    return holding.label or labels.get(holding.holder)
