"""The table of devices: what a console hears of each."""

from __future__ import annotations

import math
from collections.abc import Mapping

from dva_sim.agents.device import HEARTBEAT_PERIOD
from dva_sim.console.robots.shown_mode import EMERGENCY
from dva_sim.console.system.system_state import DeviceState
from dva_sim.console.views.published_rows import emergency_of, holder_named, mode_of, sensors_of
from dva_sim.console.wire.rows import DeviceRow
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import DETECTOR, ROBOT

FAIR, POOR = 2.5 * HEARTBEAT_PERIOD, 4 * HEARTBEAT_PERIOD  # without a word [s]


def link_of(heard_s: float, silent: bool) -> str:
    """Return the quality of a device's connection, by how long ago it was heard [s]."""
    if silent:
        return "lost"
    if heard_s > POOR:
        return "poor"
    return "fair" if heard_s > FAIR else "good"


def listed_device_row(
    device_state: DeviceState,
    now: float,
    labels: Mapping[str, str],
    *,
    is_lost: bool,
    is_fake: bool,
    may_revoke: bool,
) -> DeviceRow:
    """Return a device, as a DVA lists it and as it is heard here; all else is unknown."""
    device = device_state.device
    status = device_state.status
    heard_s = None if device_state.heard is None else now - device_state.heard
    speaks = heard_s is not None and not is_fake and device.device_type != DETECTOR
    doing = status.activity if isinstance(status, m.PersonStatus) else mode_of(device_state)
    is_stopped = emergency_of(device_state, now, {}) is not None
    holder = device_state.holder[0] if device_state.holder is not None else None
    return {
        "id": device.id_tag,
        "label": device.label,
        "type": device.device_type,
        "address": device.address,
        "doing": EMERGENCY if is_stopped else doing or None,
        "heard_s": rounded(heard_s, 1),
        "silent": is_lost,
        "beats_hz": round(device_state.rate.of(device_state.beats, now), 2),
        "dva": labels.get(device_state.dva),
        "link": link_of(heard_s or 0.0, is_lost) if speaks else None,
        "fake": is_fake,
        "round_trip_s": None,
        "commands_hz": None,
        "refused": None,
        "picture_age_s": None,
        "holder": None if holder is None else holder.holder,
        "holder_label": holder_named(holder, labels) or "",
        "level": None,
        "ends_s": None,
        "holder_known": holder is not None or device.device_type != ROBOT,
        "revocable": may_revoke,
        "camera": device_state.camera,
        "sensors": sensors_of(device_state),
    }


def rounded(number: float | None, digits: int) -> float | None:
    """Return a number for a table; None if it is unknown or endless."""
    return None if number is None or math.isinf(number) else round(number, digits)
