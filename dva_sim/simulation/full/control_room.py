"""The control room: the DVA, and the operators with their phones."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from dva_sim.agents.control_room.control_room import ControlRoomAgent
from dva_sim.agents.control_room.dispatcher import ScriptedDispatcher
from dva_sim.agents.observation import Observation
from dva_sim.agents.operator.attention import DriverSeat, OperatorSetup
from dva_sim.agents.operator.drive import Teleoperation
from dva_sim.agents.operator.handheld import Console
from dva_sim.agents.operator.operator import OperatorAgent
from dva_sim.agents.operator.strategies import Truth, load_strategy
from dva_sim.agents.operator.supervision import Supervision
from dva_sim.agents.population import draw_person
from dva_sim.agents.robot.robot import EXPECTED_READY, EXPECTED_SPEED
from dva_sim.agents.tilt import Phone
from dva_sim.core.dispatch import load_policy
from dva_sim.core.dispatcher import Patrols
from dva_sim.core.dva import Dva
from dva_sim.core.permissions import Access, AccessRule
from dva_sim.core.regions.division import Division
from dva_sim.core.regions.regional_dva import RegionalDva
from dva_sim.core.roles import Roles
from dva_sim.core.sensing import Sensing, SensorAlarm
from dva_sim.core.sessions import Permissions, Sessions
from dva_sim.core.store import Store
from dva_sim.core.travel_times import Floats, SiteKnowledge, Start, WaitingPlace
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.streams import Streams
from dva_sim.network.patterns import Pattern
from dva_sim.protocol import messages as m
from dva_sim.protocol.exchange import LOW_BITS
from dva_sim.simulation.full.dva_server import DvaAgent
from dva_sim.simulation.full.regional_agent import RegionalDvaAgent
from dva_sim.simulation.full.stage import Stage, control_rooms_of, find_clearest_place, id_of
from dva_sim.simulation.scenario import (
    Scenario,
    command_timeout_s,
    guard_profile,
    phone_profile,
    population,
)
from dva_sim.worlds.hazards import GASES
from dva_sim.worlds.hazards.detectors import GAS_ALARM, HEAT_ALARM, SMOKE_ALARM
from dva_sim.worlds.site import FOOTPRINT


def add_dva(
    stage: Stage,
    permissions: Permissions | None = None,
    memory: Store | None = None,
    keep_events: bool = True,
    number: int = 1,
    life: int = 0,
) -> DvaAgent:
    """Return the DVA; sessions are drawn by the run's seed where no other `permissions` are given.

    Args:
        permissions: Permissions, if not drawn by the seed.
        memory: State that survives the DVA.
        keep_events: True to keep all past events, for a recording.
        number: Number among the DVAs of the regions.
        life: Number of its starts before this one.

    Raises:
        ConfigError: a policy that cannot be loaded.
    """
    device = stage.device("dva", number)
    draw = stage.streams[f"{_stream_of(number)}/sessions"]
    permissions = permissions or Permissions(lambda: int(draw.integers(2**LOW_BITS)))
    core = make_core(stage, permissions, number, life)
    if isinstance(core, RegionalDva):
        memory_options = {"memory": memory, "keep_events": keep_events}
        return RegionalDvaAgent(device, core, is_public=stage.attended, **memory_options)
    return DvaAgent(device, core, memory, keep_events, is_public=stage.attended)


def _stream_of(number: int) -> str:
    return "dva" if number == 1 else f"dva-{number}"


def make_core(stage: Stage, permissions: Permissions, number: int = 1, life: int = 0) -> Dva:
    """Build the DVA that a scenario wants.

    Args:
        stage: The stage.
        permissions: Permissions.
        number: Number among the DVAs of the regions.
        life: Number of its starts before this one.

    Raises:
        ConfigError: a policy that cannot be loaded.
    """
    dispatch = stage.scenario.dispatch
    permissions.own = id_of("dva", number)
    rate_hz = stage.scenario.dva.sensor_rate_hz
    policy = load_policy(dispatch.policy, dispatch.options)
    ids = {label: id_tag for id_tag, label in stage.labels.items()}
    rules = [
        AccessRule(
            holders=frozenset(rule.holders),
            robots=frozenset(rule.robots),
            levels=frozenset(rule.levels),
            sensors=None if rule.sensors is None else frozenset(rule.sensors),
            since=rule.from_s,
            until=math.inf if rule.until_s is None else rule.until_s,
        )
        for rule in stage.scenario.access
    ]
    division = None if stage.regions is None else _division(stage, permissions.own, life)
    kind = Dva if division is None else partial(RegionalDva, division=division)
    return kind(
        policy,
        _Ways(stage),
        replace(
            dispatch.rules(),
            operator_span=stage.scenario.operator.span,
            arrived_within=at_event_m(stage.scenario),
            severity_moves=stage.follows_severity,
        ),
        rng=stage.streams[f"{_stream_of(number)}/policy"],
        sessions=Sessions(permissions),
        ground=_ground(stage) if policy.relocates else SiteKnowledge(),
        access=Access(rules) if rules else Access(),
        patrols=_patrols(stage),
        sensing=Sensing({n: SENSOR_ALARMS[n] for n in stage.scenario.dva.sensors}, rate_hz),
        supervisors=frozenset(ids.get(name, name) for name in stage.scenario.dva.supervisors),
        roles=Roles(control_rooms_of(stage.scenario)),
        ask_first=dispatch.mode == "ask_first",
        policy_name=dispatch.policy.rpartition(":")[2],
        release=stage.release,
    )


def _division(stage: Stage, dva: str, life: int) -> Division:
    """Return the division of the site, as the DVA with this id knows it at first."""
    plan = stage.regions
    assert plan is not None, "one DVA serves everything"
    to_xy = stage.site.frame.to_xy
    return Division(
        dva,
        {name: stage.dvas_for(name) for name in plan.names},
        lambda place: plan.region_at(*to_xy(place.latitude, place.longitude)),
        lambda region, place: plan.outside(region, *to_xy(place.latitude, place.longitude)),
        life,
    )


SENSOR_ALARMS = {
    "temperature": SensorAlarm("fire", HEAT_ALARM),
    "smoke": SensorAlarm("fire", SMOKE_ALARM),
    "gas": SensorAlarm("gas_leak", GAS_ALARM * min(gas.lower for gas in GASES.values())),
}
"""From where on a sensor of a robot gives the alarm: where a fixed detector would. It cannot tell
which gas it is: the one that explodes first counts."""


MOVED_SINCE = 2.0  # distance that a device may have moved since its last report; assumed [m]


def at_event_m(scenario: Scenario) -> float:
    """Return the distance from which a reported event may be seen [m].

    Guards and cameras see so far; reports nearer than may be merged are of one event.
    """
    in_sight = guard_profile(scenario).habits.work.in_sight_m
    sees = max(in_sight, scenario.camera.range_m)
    return sees + scenario.dispatch.merge_distance_m + MOVED_SINCE


class _Ways:
    """Travel times as the DVA expects them: the planner's length, and a pace for each kind."""

    def __init__(self, stage: Stage) -> None:
        guards = guard_profile(stage.scenario)
        self._stage = stage
        self._paces = {
            "guard": (guards.walking_mean_mps, guards.mobilisation_s.median),
            "robot": (EXPECTED_SPEED, EXPECTED_READY),
        }

    def __call__(
        self, starts: Sequence[Start], goals: Sequence[m.Position]
    ) -> tuple[Floats, Floats]:
        """Implement `Travel`."""
        speed = np.array([self._paces[s.kind][0] for s in starts])
        ready = np.array([0.0 if s.under_way else self._paces[s.kind][1] for s in starts])
        ways = [[self._length(s.position, goal) for s in starts] for goal in goals]
        distance = np.array(ways, dtype=np.float64).reshape(len(goals), len(starts))
        return distance, ready + distance / speed

    def _length(self, start: m.Position, goal: m.Position) -> float:
        frame = self._stage.site.frame
        a = frame.to_xy(start.latitude, start.longitude)
        return self._stage.planner.distance(a, frame.to_xy(goal.latitude, goal.longitude))


def _ground(stage: Stage) -> SiteKnowledge:
    """Return guards at their posts; each room is a zone that counts by its floor's area."""
    frame = stage.site.frame
    stations = tuple(
        WaitingPlace(f"post {number}", m.Position(*frame.to_latlon(post.x, post.y)))
        for number, post in enumerate(stage.site.guard_posts, 1)
    )
    rooms = [room.area for room in stage.site.rooms]
    if not stations or not rooms:
        return SiteKnowledge()
    starts = [Start(s.name, "guard", s.position, under_way=True) for s in stations]
    middles = [room.representative_point() for room in rooms]
    goals = [m.Position(*frame.to_latlon(middle.x, middle.y)) for middle in middles]
    area = np.array([room.area for room in rooms])
    return SiteKnowledge(None, stations, _Ways(stage)(starts, goals)[1].T, area / area.sum())


def _patrols(stage: Stage) -> Patrols:
    """Return the beats of the scenario's robots.

    Raises:
        ConfigError: a room that the site does not have, or a place where no robot fits.
    """
    site = stage.site
    to_latlon = stage.site.frame.to_latlon
    beats: dict[str, tuple[m.Position, ...]] = {}
    for patrol in stage.scenario.patrols:
        if patrol.robot not in stage.labels.values():
            raise ConfigError(f"patrols: there is no {patrol.robot!r}; robots: robot-1 and on")
        places = [find_clearest_place(site, p) if isinstance(p, str) else p for p in patrol.places]
        for x, y in places:
            if not site.is_free(x, y, FOOTPRINT):
                raise ConfigError(f"patrols: no robot fits at x {x:g} m, y {y:g} m")
        beats[patrol.robot] = tuple(m.Position(*to_latlon(x, y)) for x, y in places)
    return Patrols(beats)


def add_dispatcher(stage: Stage) -> ScriptedDispatcher | None:
    """Return the person who dispatches by a script, at the first control room, if there is one."""
    profile = stage.scenario.dispatch.person
    if profile is None:
        return None
    device = stage.device("control-room", 1)
    fresh = stage.streams.fresh
    room = ControlRoomAgent(device)
    person = ScriptedDispatcher(room, profile, lambda what: fresh(f"{device.label}/{what}"))
    room.start()
    return person


def setup_of(stage: Stage, scenario: Scenario) -> OperatorSetup:
    """Pattern, rate and time-outs of operators, for a scenario with the link as it is now."""
    return setup_by(scenario, pattern=stage.pattern_for, topic=stage.cameras.topic)


def setup_by(
    scenario: Scenario,
    *,
    pattern: Callable[[str], Pattern],
    topic: Callable[[str], str | None],
) -> OperatorSetup:
    """Return what operators of a scenario drive with.

    Args:
        scenario: Rates and time-outs.
        pattern: Function that returns the pattern of a robot's commands, by its id.
        topic: Topic of the frames of a camera's URL; see `Cameras`.
    """
    command = scenario.command
    return OperatorSetup(
        pattern=pattern,
        window=command.window,
        heeds=command.heeds,
        rate_hz=command.rate_hz,
        timeout=command_timeout_s(scenario),
        attempts=command.attempts,
        guarded=scenario.control == "coordinated",
        topic=topic,
    )


def console_of(stage: Stage, scenario: Scenario) -> Console:
    """Return the equipment of a real person at a console."""
    return Console(
        setup=setup_of(stage, scenario), phone=phone_profile(scenario), reach=stage.reach
    )


def add_operator(
    stage: Stage, number: int, truth: Callable[[str], Truth[Observation]] | None = None
) -> OperatorAgent:
    """Return the `number`-th operator.

    Args:
        number: Number, from 1.
        truth: The true state of a robot by id, where somebody can tell.

    Raises:
        ConfigError: the strategy needs the truth, and nobody can tell.
    """
    scenario = stage.scenario
    config = stage.scenario.operator
    device = stage.device("operator", number)
    person = draw_person(population(config), config.population_seed, config.person + number - 1)
    strategy = load_strategy(config.strategy, config.options)
    needs_truth = config.strategy == "oracle"
    if needs_truth and truth is None:
        raise ConfigError("operator.strategy 'oracle' knows the truth: only in virtual time")
    setup = replace(setup_of(stage, scenario), truth=truth if needs_truth else None)
    seat = DriverSeat(
        device,
        person,
        Phone(
            phone_profile(scenario),
            person,
            stage.streams[f"{device.label}/phone"],
            Streams(config.population_seed).fresh(f"person-{config.person + number - 1}/phone"),
        ),
        strategy=strategy,
        reach=stage.reach,
        planner=stage.planner,
        setup=setup,
        rng=stage.streams[f"{device.label}/judgement"],
        looks=lambda what: stage.streams.fresh(f"{device.label}/look/{what}"),
    )
    kind = Supervision if scenario.control == "supervisory" else Teleoperation
    operator = OperatorAgent(seat, kind, config.span)
    device.register()
    return operator
