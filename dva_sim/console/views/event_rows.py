"""Rows about events for pages, as the DVA publishes them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from dva_sim.agents.control_room.control_room import ControlRoomAgent
from dva_sim.console.events.decisions import UNKNOWN_ROOM, about_event
from dva_sim.console.wire.events import SiteEventShown
from dva_sim.protocol import messages as m
from dva_sim.protocol.event_kinds import severity_word
from dva_sim.worlds.geo import GeoFrame
from dva_sim.worlds.site import Site

MAX_OVER: Final = 50  # events that are over


def event_rows(
    agent: ControlRoomAgent, labels: Mapping[str, str], site: Site | None, frame: GeoFrame
) -> list[SiteEventShown]:
    """Return the events that a control room knows: the latest that are over, and all open ones.

    Args:
        agent: Control room.
        labels: Labels of devices, by id.
        site: Site, if one is known.
        frame: Origin of the map.
    """
    events = agent.events
    over = sorted(number for number, status in events.items() if status.closed_for is not None)
    numbers = (*over[-MAX_OVER:], *sorted(events.keys() - set(over)))
    return [
        event_row(
            events[number],
            received_at=agent.received_at[number],
            labels=labels,
            site=site,
            frame=frame,
        )
        for number in numbers
    ]


def event_row(
    status: m.EventStatus,
    *,
    received_at: float,
    labels: Mapping[str, str],
    site: Site | None,
    frame: GeoFrame,
) -> SiteEventShown:
    """Return an event as the DVA states it at a time [s]."""
    x, y = frame.to_xy(status.position.latitude, status.position.longitude)
    sent = dict.fromkeys((status.responder, status.operator, status.actor))
    is_over = status.closed_for is not None
    return {
        "number": status.event_id,
        "kind": status.kind,
        "x_m": round(x, 2),
        "y_m": round(y, 2),
        "latitude_deg": status.position.latitude,
        "longitude_deg": status.position.longitude,
        "room": site.room_at(x, y) if site is not None else UNKNOWN_ROOM,
        "severity": severity_word(status.severity),
        "severity_value": round(status.severity, 2),
        "state": status.event_state.replace("_", " "),
        "over": is_over,
        "since_ms": round(1000 * (received_at - status.state_for)),
        "reported_ms": round(1000 * (received_at - status.age)),
        "assigned": [] if is_over else [labels.get(i, i) for i in sent if i is not None],
        **about_event(status, received_at),
    }
