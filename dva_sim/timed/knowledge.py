"""What the DVA may know of the ground: ways, lists, stations and where events are expected."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from dva_sim.core.ground import Ground, Start, Station
from dva_sim.protocol import messages as m
from dva_sim.timed.ledger import Floats
from dva_sim.timed.places import Place, Terrain
from dva_sim.timed.scenario import Point, TimedScenario

if TYPE_CHECKING:
    from dva_sim.timed.shift import Shift


def travel(
    shift: Shift, starts: Sequence[Start], goals: Sequence[m.Position]
) -> tuple[Floats, Floats]:
    """See `core.ground.Travel`: what may be expected of each responder.

    Where each way's time is drawn for itself it is known beforehand: choosing by it is the
    point of such a world.
    """
    terrain, units = shift.terrain, [shift.by_device[s.device] for s in starts]
    places = [
        unit.place if unit.leg is None else terrain.known_at(s.position)
        for s, unit in zip(starts, units, strict=True)
    ]
    ready = [
        0.0 if s.under_way or unit.equipped else unit.group.mobilisation.mean
        for s, unit in zip(starts, units, strict=True)
    ]
    if shift.scenario.way == "none":
        length = np.zeros((len(goals), len(starts)))
        return length, length + ready
    drawn = not isinstance(shift.scenario.way, str)
    lengths, etas = [], []
    for position in goals:
        goal = terrain.known_at(position)
        ways = [terrain.length(place, goal) for place in places]
        if drawn:
            trips = [shift.trip(u, at, goal) for u, at in zip(units, places, strict=True)]
        else:
            trips = [way / u.group.speed_mps for u, way in zip(units, ways, strict=True)]
        lengths.append(ways)
        etas.append([a + b for a, b in zip(ready, trips, strict=True)])
    shape = len(goals), len(starts)
    return np.array(lengths).reshape(shape), np.array(etas).reshape(shape)


def place_of(terrain: Terrain, where: Point | str, number: int = 1) -> Place:
    """The place that a scenario names."""
    return terrain.named(where, number) if isinstance(where, str) else terrain.fix(*where)


def stations(scenario: TimedScenario, terrain: Terrain) -> dict[str, Place]:
    """Where guards may wait, by name."""
    return {s.name: place_of(terrain, s.at) for s in scenario.dispatch.stations}


def ground_of(shift: Shift) -> Ground:
    """Lists and stations as the core wants them."""
    places = shift.stations
    return Ground(
        preference=_preference(shift) if shift.scenario.dispatch.preferences else None,
        stations=tuple(Station(name, place.position) for name, place in places.items()),
        reach=_reach(shift, list(places.values())),
        demand=np.array(shift.demand.share()),
    )


def _reach(shift: Shift, places: list[Place]) -> Floats:
    """From each station to each zone for a guard on its way: the mean over the zone's places."""
    terrain = shift.terrain
    speeds = [u.group.speed_mps for u in shift.units if u.kind == "guard"]
    speed = sum(speeds) / len(speeds) if speeds else 1.0
    reach = np.empty((len(places), len(terrain.zones)))
    for row, place in enumerate(places):
        for zone in range(len(terrain.zones)):
            reach[row, zone] = np.mean([terrain.length(place, s) for s in terrain.spots(zone)])
    return reach / speed


def _preference(shift: Shift) -> Callable[[m.Position, Sequence[str]], Sequence[float]]:
    """Ranks on the list of an event's zone; outside all zones the order of registration."""
    devices = {unit.name: unit.device for unit in shift.units}
    everybody = {unit.device: float(unit.number) for unit in shift.units}
    lists = {
        shift.terrain.zones.index(zone): {devices[n]: float(rank) for rank, n in enumerate(names)}
        for zone, names in shift.scenario.dispatch.preferences.items()
    }

    def rank(position: m.Position, asked: Sequence[str]) -> list[float]:
        ranks = lists.get(shift.terrain.known_at(position).zone, everybody)
        return [ranks.get(device, float("inf")) for device in asked]

    return rank
