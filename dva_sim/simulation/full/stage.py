"""Stage of a run: scenario, random streams, clock, network, site, and the names of all agents.

Ids on the wire and names for people are made here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
import shapely

from dva_sim.agents.device import AgentDevice
from dva_sim.agents.observation import OVER_ZMQ, Cameras
from dva_sim.agents.operator.strategies import Reach
from dva_sim.agents.robot.emergency_latch import DRIVE
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.labels import with_id
from dva_sim.kernel.recorder import Recorder
from dva_sim.kernel.streams import Streams
from dva_sim.network.messaging import Transport
from dva_sim.network.patterns import Pattern, load_pattern
from dva_sim.protocol.devices import (
    CONTROL_ROOM,
    DETECTOR,
    GUARD,
    OPERATOR,
    REMOTE,
    ROBOT,
    ControlRoomRole,
)
from dva_sim.protocol.exchange import NOON
from dva_sim.protocol.messages import Position, ReleasedBy
from dva_sim.simulation.scenario import (
    Scenario,
    plan_of,
    request_timeout_s,
    robot_profiles,
    site_of,
)
from dva_sim.worlds.planning import Planner
from dva_sim.worlds.site import FOOTPRINT, Site

DVA = "02:00:00:00:00:01"
_ROOMS = {
    "dva": 0,
    "robot": 1,
    "guard": 2,
    "operator": 3,
    "detector": 4,
    "console": 5,
    "phone": 6,
    "control-room": 7,
    "ros": 8,
    "fake": 15,
}


def id_of(kind: str, number: int) -> str:
    """Return the id of the `number`-th device of a kind, from 1: locally administered."""
    return f"02:00:00:{_ROOMS[kind]:02X}:{number >> 8:02X}:{number & 0xFF:02X}"


def kind_of(id_tag: str) -> tuple[str, int]:
    """Return the kind and the number of a device by its id; of a stranger, an empty kind."""
    *_, room, high, low = id_tag.split(":")
    kind = next((kind for kind, number in _ROOMS.items() if number == int(room, 16)), "")
    return kind, int(high + low, 16)


def team_of(scenario: Scenario) -> Iterator[str]:
    """Yield all devices of a scenario by id; each report may have a detector or a caller."""
    counts = {
        "robot": scenario.robot.count,
        "guard": scenario.guard.count,
        "operator": scenario.operator.count,
        "detector": sum(event.reports for event in scenario.events),
    }
    yield from dvas_of(scenario)
    for kind, count in counts.items():
        yield from (id_of(kind, number) for number in range(1, count + 1))
    yield from control_rooms_of(scenario)


def dvas_of(scenario: Scenario) -> dict[str, str]:
    """Return the labels of the DVAs of a scenario by id: of the one, or one for each region."""
    names = scenario.dva.regions
    if not names:
        return {DVA: label_of("dva", 1)}
    return {id_of("dva", number): f"dva-{name}" for number, name in enumerate(names, 1)}


def region_finder(scenario: Scenario) -> Callable[[Position], str]:
    """Return the function that finds the region of a place, for a scenario that has regions."""
    site = site_of(scenario, seed=0)
    plan = plan_of(scenario.dva.regions, site)
    assert plan is not None, "one DVA serves everything"
    return lambda at: plan.region_at(*site.frame.to_xy(at.latitude, at.longitude))


def control_rooms_of(scenario: Scenario) -> dict[str, ControlRoomRole]:
    """Return the roles of control rooms by id: those of a scenario, and that of its dispatcher."""
    stated = dict(scenario.dva.control_rooms)
    if scenario.dispatch.person is not None:
        stated.setdefault(label_of("control-room", 1), scenario.dispatch.person.role)
    roles = {}
    for name, role in stated.items():
        id_tag = name if ":" in name else id_of("control-room", int(name.rpartition("-")[2]))
        roles[id_tag] = ControlRoomRole(role)
    return roles


def release_of(scenario: Scenario, attended: bool) -> ReleasedBy | None:
    """Return how robots are released after an emergency.

    Args:
        scenario: The scenario; the phone of the dissertation knows no release.
        attended: True if people may join.

    Returns:
        None: by a person if one who may is registered, which the DVA knows.
    """
    configured = scenario.emergency.release
    if configured is not None:
        return configured
    follows_dissertation = scenario.phone.profile.startswith("dissertation")
    return None if attended and not follows_dissertation else DRIVE


def label_of(kind: str, number: int) -> str:
    """Return its name for people: `robot-1`; of the DVA there is but one."""
    return "dva" if kind == "dva" else f"{kind}-{number}"


def address_of(kind: str, number: int) -> str:
    """Return its address in the registration, where nobody has a real one."""
    return f"192.168.{_ROOMS[kind]}.{number % 250 + 1}"


TYPES = {
    "dva": "DVA",
    "robot": ROBOT,
    "guard": GUARD,
    "operator": OPERATOR,
    "detector": DETECTOR,
    "console": OPERATOR,
    "phone": OPERATOR,
    "control-room": CONTROL_ROOM,
    "ros": REMOTE,
}


@dataclass
class Stage:
    """Stage of a run, or of a part of one.

    Attributes:
        seed: Random seed of everything but the persons.
        recorder: Recorder of the run.
        address: Function that returns the address of a new device, by kind and number.
        time_of_day: See `AgentDevice`.
        labels: Names of all devices that have ever taken part, by id.
        cameras: Addresses of the robots' pictures.
        devices: Devices that take part.
        pattern_names: Pattern of the commands for a robot, by its id, where it was changed.
        app_pattern: Function that returns the pattern of the app that holds a robot, if it has
            one of its own.
        attended: True if people may join, who could release a robot after an emergency.
        regions: Division of the site, with a DVA for each region; None: there is one DVA.

    Raises:
        ConfigError: a map that cannot be read, or that the team does not fit on.
    """

    scenario: Scenario
    seed: int
    network: Transport
    recorder: Recorder
    address: Callable[[str, int], str] = address_of
    time_of_day: tuple[float, bool] = (NOON, False)
    labels: dict[str, str] = field(default_factory=dict)
    cameras: Cameras = OVER_ZMQ
    devices: list[AgentDevice] = field(default_factory=list)
    pattern_names: dict[str, str] = field(default_factory=dict)
    app_pattern: Callable[[str], str | None] = lambda _: None
    attended: bool = False

    def __post_init__(self) -> None:
        self.streams = Streams(self.seed)
        self.site = site_of(self.scenario, self.seed)
        self.regions = plan_of(self.scenario.dva.regions, self.site)
        self.robots = robot_profiles(self.scenario)
        self.pattern = load_pattern(self.scenario.pattern, self.scenario.pattern_options)
        # One roadmap serves all: smaller robots and people fit wherever the largest robot does.
        radius = max((robot.radius_m for robot in self.robots), default=FOOTPRINT)
        self.planner = planner_of(self.site, radius)
        counts = {
            "robot": self.scenario.robot.count,
            "guard": self.scenario.guard.count,
            "operator": self.scenario.operator.count,
        }
        self._specs = {
            id_of("robot", number): profile.drive_spec()
            for number, profile in enumerate(self.robots, 1)
        }
        self.labels |= dvas_of(self.scenario)
        for kind, count in counts.items():
            for number in range(1, count + 1):
                self.labels[id_of(kind, number)] = label_of(kind, number)

    @property
    def clock(self) -> Clock:
        """The clock that everybody shares."""
        return self.network.clock

    @property
    def release(self) -> ReleasedBy | None:
        """Rule by which robots are released after an emergency, as in `release_of`."""
        return release_of(self.scenario, self.attended)

    @property
    def follows_severity(self) -> bool:
        """True if the severity of events rises with further reports."""
        configured = self.scenario.dva.severity
        return self.attended if configured is None else configured == "followed"

    def pattern_name(self, robot: str) -> str:
        """Return the name of the pattern of a robot's next drive, by its id."""
        return self.pattern_names.get(robot) or self.app_pattern(robot) or self.scenario.pattern

    def pattern_for(self, robot: str) -> Pattern:
        """Return the pattern of the next drive of a robot, by its id."""
        name = self.pattern_name(robot)
        return self.pattern() if name == self.scenario.pattern else load_pattern(name)()

    def reach(self, robot: str) -> Reach:
        """Return a robot's limits as its operator knows them; by default those of our robots."""
        spec = self._specs.get(robot) or next(iter(self._specs.values()))
        return Reach(spec.max_speed, spec.max_turn_rate, spec.drive(spec).turning_radius)

    def dvas_for(self, region: str) -> tuple[str, ...]:
        """Return the ids of the DVAs that serve a region in turn, its own first."""
        assert self.regions is not None, "one DVA serves everything"
        numbers = {name: number for number, name in enumerate(self.regions.names, 1)}
        return tuple(id_of("dva", numbers[name]) for name in self.regions.serving_order(region))

    def _dvas_known_to(
        self, kind: str, number: int, at: tuple[float, float] | None
    ) -> tuple[str, ...]:
        """Return the DVAs that a device knows; operators go round the regions."""
        if self.regions is None:
            return (DVA,)
        names = self.regions.names
        if kind == "dva":
            return (id_of(kind, number),)
        turn = number - 1 if kind == "operator" else 0
        region = names[turn % len(names)] if at is None else self.regions.region_at(*at)
        return self.dvas_for(region)

    def device(self, kind: str, number: int, at: tuple[float, float] | None = None) -> AgentDevice:
        """Return a new device: its identity and ways to talk.

        Args:
            kind: Such as `robot`.
            number: Number among those of its kind, from 1.
            at: Its first place [m], if it has one.
        """
        dvas = self._dvas_known_to(kind, number, at)
        return self.take_in(
            id_of(kind, number),
            label=self.labels[dvas[0]] if kind == "dva" else label_of(kind, number),
            device_type=TYPES[kind],
            address=self.address(kind, number),
            dvas=dvas,
        )

    def take_in(
        self,
        id_tag: str,
        *,
        label: str,
        device_type: str,
        address: str,
        dvas: tuple[str, ...] = (DVA,),
    ) -> AgentDevice:
        """Make a device that takes part, of any id, label, type and address.

        Args:
            id_tag: Its id.
            label: Its name for people.
            device_type: Type in its registration.
            address: Address in its registration.
            dvas: DVAs that it knows, its own first.
        """
        device = AgentDevice(
            id_tag=id_tag,
            label=label,
            device_type=device_type,
            address=address,
            dva=dvas[0],
            dvas=dvas,
            network=self.network,
            recorder=self.recorder,
            frame=self.site.frame,
            timeout=request_timeout_s(self.scenario),
            attempts=self.scenario.request.attempts,
            labels=self.labels,
            time_of_day=self.time_of_day,
        )
        self.devices.append(device)
        return device

    def dismiss(self, device: AgentDevice) -> None:
        """Remove a device that has left. What it did stays under its label, with its id beside."""
        self.devices.remove(device)
        id_tag = device.id_tag
        label = device.label
        self.labels[id_tag] = label if id_tag in label else with_id(label, id_tag)


@lru_cache(maxsize=4)
def planner_of(site: Site, radius: float) -> Planner:
    """Return a planner for bodies of a radius [m] on a site; the same one for the same site."""
    return Planner(site, radius)


def find_clearest_place(site: Site, room: str) -> tuple[float, float]:
    """Return the place in a room that is farthest from everything [m].

    Raises:
        ConfigError: there is no such room.
    """
    outline = site.room(room).area
    low_x, low_y, high_x, high_y = outline.bounds
    low_row, low_column = site.grid.to_cell(low_x, low_y)
    high_row, high_column = site.grid.to_cell(high_x, high_y)
    rows, columns = np.mgrid[low_row : high_row + 1, low_column : high_column + 1]
    points = site.grid.to_xy(rows + 0.5, columns + 0.5)
    inside = shapely.contains_xy(outline, points[..., 0], points[..., 1])
    best = np.argmax(np.where(inside, site.grid.clearance[rows, columns], -1.0))
    x, y = points.reshape(-1, 2)[best].tolist()
    return x, y
