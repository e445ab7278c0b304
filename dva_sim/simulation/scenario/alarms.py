"""Alarms of a table as events of the full simulation, at places where its site has floor."""

from __future__ import annotations

from typing import Any, cast

from dva_sim.kernel.config import Fail
from dva_sim.simulation.scenario.event_table import (
    EventTableConfig,
    Ground,
    TableAlarm,
    TableEvents,
    read_events,
)
from dva_sim.simulation.scenario.parts import EventConfig
from dva_sim.simulation.scenario.scenario import Scenario, site_of
from dva_sim.worlds.site import Site

FITS_M = 0.4  # radius that must fit at an event, so that a robot can get near [m]


def table_of(scenario: Scenario) -> EventTableConfig | None:
    """Return the table that a scenario has in place of a list of events, until it is expanded."""
    events = cast(Any, scenario.events)
    return events if isinstance(events, EventTableConfig) else None


def with_events(scenario: Scenario, table: EventTableConfig, error: Fail) -> Scenario:
    """Return the scenario with the alarms of its table.

    Raises:
        ConfigError: see `read_events`.
    """
    table_rows = table_events(scenario, table, error)
    scenario = scenario.model_copy(update={"events": tuple(map(_event, table_rows.alarms))})
    scenario.tell(table_rows)
    return scenario


def table_events(scenario: Scenario, table: EventTableConfig, error: Fail) -> TableEvents:
    """Return the alarms of a scenario's table, and remarks on them; raises as `read_events`."""
    site = site_of(scenario, seed=0)
    is_on_earth = scenario.site.map is None
    ground = Ground(
        rooms=[room.name for room in site.rooms],
        is_placed=True,
        to_xy=site.frame.to_xy if is_on_earth else None,
        why_not=lambda x, y: why_not(site, x, y),
        room_at=site.room_at,
        ignored=("severity", "confidence"),
    )
    return read_events(table, scenario.horizon_s, ground, lambda p, at: error(p, ("events", *at)))


def why_not(site: Site, x: float, y: float) -> str:
    """Say why no event can be at a point of a site [m]; empty: it can."""
    west, south, east, north = site.extent
    if not (west <= x <= east and south <= y <= north):
        extent = f"from ({west:g}, {south:g}) to ({east:g}, {north:g})"
        return f"is outside the site {site.name!r}, which is {extent}"
    if not site.is_free(x, y, FITS_M):
        return f"has less than {FITS_M:g} m of open floor around it on the site {site.name!r}"
    return ""


def _event(alarm: TableAlarm) -> EventConfig:
    return EventConfig(
        kind=alarm.kind,
        room=alarm.room,
        position=alarm.position,
        at_s=alarm.at_s,
        reported=True,
        false_alarm=alarm.false_alarm,
    )
