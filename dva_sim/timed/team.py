"""Who is there: responders hired as the scenario says, everybody known to the DVA."""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np

from dva_sim.core.dispatch import Policy
from dva_sim.core.ground import Ground
from dva_sim.core.permissions import Permissions
from dva_sim.core.registry import DETECTOR, GUARD, OPERATOR, ROBOT
from dva_sim.core.rules import Rules
from dva_sim.core.service import Desk
from dva_sim.core.sessions import Sessions
from dva_sim.protocol import messages as m
from dva_sim.streams import Streams
from dva_sim.timed import knowledge
from dva_sim.timed.demand import CALLERS
from dva_sim.timed.operators import Operator
from dva_sim.timed.places import Place
from dva_sim.timed.scenario import Group, limit_of
from dva_sim.timed.units import Unit

if TYPE_CHECKING:
    from dva_sim.timed.shift import Shift

ADDRESS = "192.168.1.9"  # in the registration, where nobody has a real one
FASTEST, SLOWEST = 2.0, 0.5  # bounds of a person's speed, by the group's mean
IDS = {"guard": 1, "robot": 2, "operator": 3, "caller": 4, "second": 5}
TYPES = {"guard": GUARD, "robot": ROBOT}


def id_of(kind: str, number: int) -> str:
    """The id of a device of a kind by its number."""
    return f"02:00:01:{IDS[kind]:02X}:{number >> 8:02X}:{number & 0xFF:02X}"


def hire(shift: Shift, streams: Streams, stations: dict[str, Place]) -> list[Unit]:
    """All responders, in the scenario's order."""
    of_kind: Counter[str] = Counter()
    units: list[Unit] = []
    for group in shift.scenario.responders:
        for name in shift.scenario.members(group):
            of_kind[group.kind] += 1
            number = of_kind[group.kind]
            base = _base(shift, group, name, number, stations)
            device, speed = id_of(group.kind, number), _speed(streams, group, name)
            units.append(Unit(shift, len(units), name, device, group, base, speed))
    return units


def _base(shift: Shift, group: Group, name: str, number: int, stations: dict[str, Place]) -> Place:
    base: Any = group.base
    if base is None:
        base = shift.terrain.default_base(group.kind)
    if base is None:
        return shift.terrain.origin()
    if base == "random":
        return shift.terrain.anywhere(shift.streams.fresh(f"{name}/base"))
    if isinstance(base, str) and base in stations:
        return stations[base]
    return knowledge.place_of(shift.terrain, base, number)


def _speed(streams: Streams, group: Group, name: str) -> float:
    if not group.speed_sd_mps:
        return group.speed_mps
    speed = streams.fresh(f"{name}/speed").normal(group.speed_mps, group.speed_sd_mps)
    return float(np.clip(speed, SLOWEST * group.speed_mps, FASTEST * group.speed_mps))


def open_desk(shift: Shift, policy: Policy) -> Desk:
    """The DVA's desk, with the scenario's rules; nobody falls silent, as nobody can be lost."""
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
    ground = knowledge.ground_of(shift) if policy.relocates or config.preferences else Ground()
    desk = Desk(policy, shift.travel, rules, shift.streams["dva/policy"], sessions, ground)
    desk.registry.silent_after = math.inf
    return desk


def register(shift: Shift) -> None:
    """Everybody makes itself known; who is on duty later shows no place until then."""
    mail, scenario = shift.mail, shift.scenario

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
