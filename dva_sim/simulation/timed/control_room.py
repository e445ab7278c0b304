"""The DVA in a shift, with its registered devices and its knowledge of the terrain.

Responders are hired as the scenario says, operators drive one robot each at a time, and all are
registered with the DVA; it knows ways, lists of preference, stations, and where to expect events.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Protocol

import numpy as np

from dva_sim.core.assignments import Rules
from dva_sim.core.dispatch import Policy
from dva_sim.core.dva import Dva
from dva_sim.core.sessions import Permissions, Sessions
from dva_sim.core.travel_times import SiteKnowledge, Start, WaitingPlace
from dva_sim.kernel.streams import Streams
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import DETECTOR, GUARD, OPERATOR, ROBOT
from dva_sim.simulation.timed.demand import CALLERS, Demand
from dva_sim.simulation.timed.mail import Mail
from dva_sim.simulation.timed.recording import Floats
from dva_sim.simulation.timed.responders import DONE, ShiftWorld, Unit
from dva_sim.simulation.timed.scenario import Group, Point, TimedScenario, limit_of
from dva_sim.simulation.timed.travel import Place, Terrain


class Team(ShiftWorld, Protocol):
    """Team of a shift, and what is known of the terrain."""

    scenario: TimedScenario
    streams: Streams
    demand: Demand
    stations: dict[str, Place]
    units: list[Unit]
    by_device: dict[str, Unit]
    mail: Mail

    def trip(self, unit: Unit, start: Place, goal: Place) -> float:
        """Time to get somewhere [s]."""


def travel(
    shift: Team, starts: Sequence[Start], goals: Sequence[m.Position]
) -> tuple[Floats, Floats]:
    """Return the expected travel times of each responder; see `core.travel_times.Travel`.

    Where each way's time is drawn for itself it is known beforehand: choosing by it is the
    point of such a world.
    """
    terrain = shift.terrain
    units = [shift.by_device[s.device] for s in starts]
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
    lengths = []
    etas = []
    for position in goals:
        goal = terrain.known_at(position)
        ways = [terrain.length(place, goal) for place in places]
        if drawn:
            trips = [shift.trip(u, at, goal) for u, at in zip(units, places, strict=True)]
        else:
            trips = [distance / u.group.speed_mps for u, distance in zip(units, ways, strict=True)]
        lengths.append(ways)
        etas.append([a + b for a, b in zip(ready, trips, strict=True)])
    shape = len(goals), len(starts)
    return np.array(lengths).reshape(shape), np.array(etas).reshape(shape)


def place_of(terrain: Terrain, where: Point | str, number: int = 1) -> Place:
    """Return the place that a scenario names."""
    return terrain.named(where, number) if isinstance(where, str) else terrain.fix(*where)


def stations(scenario: TimedScenario, terrain: Terrain) -> dict[str, Place]:
    """Return where guards may wait, by name."""
    return {s.name: place_of(terrain, s.at) for s in scenario.dispatch.stations}


def ground_of(shift: Team) -> SiteKnowledge:
    """Return lists and stations as the core wants them."""
    places = shift.stations
    return SiteKnowledge(
        preference=_preference(shift) if shift.scenario.dispatch.preferences else None,
        stations=tuple(WaitingPlace(name, place.position) for name, place in places.items()),
        reach=_reach(shift, list(places.values())),
        demand=np.array(shift.demand.share()),
    )


def _reach(shift: Team, places: list[Place]) -> Floats:
    """Return times from stations to zones for a guard on its way: means over places."""
    terrain = shift.terrain
    speeds = [u.group.speed_mps for u in shift.units if u.kind == "guard"]
    speed = sum(speeds) / len(speeds) if speeds else 1.0
    reach = np.empty((len(places), len(terrain.zones)))
    for row, index in enumerate(places):
        for zone in range(len(terrain.zones)):
            reach[row, zone] = np.mean([terrain.length(index, s) for s in terrain.spots(zone)])
    return reach / speed


def _preference(shift: Team) -> Callable[[m.Position, Sequence[str]], Sequence[float]]:
    """Return ranks on the list of an event's zone; outside all zones the order of registration."""
    devices = {unit.name: unit.device for unit in shift.units}
    everybody = {unit.device: float(unit.number) for unit in shift.units}
    lists = {
        shift.terrain.zones.index(zone): {devices[n]: float(rank) for rank, n in enumerate(names)}
        for zone, names in shift.scenario.dispatch.preferences.items()
    }

    def rank(position: m.Position, devices: Sequence[str]) -> list[float]:
        ranks = lists.get(shift.terrain.known_at(position).zone, everybody)
        return [ranks.get(device, float("inf")) for device in devices]

    return rank


class Operator:
    """A person who drives one robot at a time.

    Args:
        device: Its id.
        robots: By id.
    """

    def __init__(self, device: str, robots: dict[str, Unit]) -> None:
        self.device = device
        self._robots = robots
        self._robot: Unit | None = None

    def take(self, body: m.Body) -> bool:
        """Hear the DVA; False declines."""
        if isinstance(body, m.OrderProgress):
            robot = self._robot
            return robot is None or robot.take(body)
        if not isinstance(body, m.Order) or body.device is None:
            return False
        robot = self._robots[body.device]
        former = self._robot
        self._robot = robot
        job = None if former is None or former is robot else former.job
        if former is not None and job is not None and job.voice == self.device:
            former.take(m.OrderProgress(job.order.event_id, DONE))
        return robot.order(body, self.device)


ADDRESS = "192.168.1.9"  # address in registrations, where no device has a real one
FASTEST = 2.0  # upper bound of a person's speed, by the group's mean
SLOWEST = 0.5  # lower bound of a person's speed, by the group's mean
IDS = {"guard": 1, "robot": 2, "operator": 3, "caller": 4, "second": 5}
TYPES = {"guard": GUARD, "robot": ROBOT}


def id_of(kind: str, number: int) -> str:
    """Return the id of a device of a kind by its number."""
    return f"02:00:01:{IDS[kind]:02X}:{number >> 8:02X}:{number & 0xFF:02X}"


def hire(shift: Team, streams: Streams, stations: dict[str, Place]) -> list[Unit]:
    """Return all responders, in the scenario's order."""
    of_kind: Counter[str] = Counter()
    units: list[Unit] = []
    for group in shift.scenario.responders:
        for name in shift.scenario.members(group):
            of_kind[group.kind] += 1
            number = of_kind[group.kind]
            base = _base(shift, group, name, number, stations)
            device = id_of(group.kind, number)
            speed = _speed(streams, group, name)
            units.append(
                Unit(
                    world=shift,
                    number=len(units),
                    name=name,
                    device=device,
                    group=group,
                    base=base,
                    speed=speed,
                )
            )
    return units


def _base(shift: Team, group: Group, name: str, number: int, stations: dict[str, Place]) -> Place:
    base: Any = group.base
    if base is None:
        base = shift.terrain.default_base(group.kind)
    if base is None:
        return shift.terrain.origin()
    if base == "random":
        return shift.terrain.anywhere(shift.streams.fresh(f"{name}/base"))
    if isinstance(base, str) and base in stations:
        return stations[base]
    return place_of(shift.terrain, base, number)


def _speed(streams: Streams, group: Group, name: str) -> float:
    if not group.speed_sd_mps:
        return group.speed_mps
    speed = streams.fresh(f"{name}/speed").normal(group.speed_mps, group.speed_sd_mps)
    return float(np.clip(speed, SLOWEST * group.speed_mps, FASTEST * group.speed_mps))


def make_core(shift: Team, policy: Policy) -> Dva:
    """Return the DVA's core, with the scenario's rules; nobody can fall silent or be lost."""
    config = shift.scenario.dispatch
    rules = Rules(
        escalate_after=limit_of(config.escalate_after_s),
        containment=config.containment,
        most_waiting=config.most_waiting,
        merge_distance=shift.scenario.merge_distance,
        max_attempts=config.max_attempts,
        order_limit=limit_of(config.order_limit_s),
        bid_within=config.bid_within_s,
    )
    sessions = Sessions(Permissions(lambda: 0))
    ground = ground_of(shift) if policy.relocates or config.preferences else SiteKnowledge()
    core = Dva(
        policy,
        partial(travel, shift),
        rules,
        rng=shift.streams["dva/policy"],
        sessions=sessions,
        ground=ground,
        audit=False,
    )
    core.registry.silent_after = math.inf
    return core


def register(shift: Team) -> None:
    """Register all devices; those on duty later report no position until then."""
    mail = shift.mail
    scenario = shift.scenario

    def enter(device: str, label: str, device_type: str) -> None:
        mail.say(device, m.Registration(label, device_type, ADDRESS))

    for number, stream in enumerate(scenario.demand):
        callers = CALLERS if stream.patience or stream.repeats else 1
        for kind in ("caller", "second") if stream.repeats else ("caller",):
            for caller in range(callers):
                enter(id_of(kind, number * CALLERS + caller), kind, DETECTOR)
    for unit in shift.units:
        enter(unit.device, unit.name, TYPES[unit.kind])
        mail.takers[unit.device] = unit
    robots = {unit.device: unit for unit in shift.units if unit.kind == "robot"}
    for number in range(scenario.operators.count):
        operator = Operator(id_of("operator", number), robots)
        enter(operator.device, f"operator-{number + 1}", OPERATOR)
        mail.takers[operator.device] = operator
