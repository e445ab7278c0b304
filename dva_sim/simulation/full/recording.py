"""Results of a finished run, for display and for measures."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from dva_sim.agents.robot.robot import RobotAgent
from dva_sim.core.events import Event, State
from dva_sim.core.reports import REACH
from dva_sim.kernel.recorder import Recorder
from dva_sim.network.link import Link
from dva_sim.protocol.facts import Fact
from dva_sim.simulation.full.hazards import RunHazard
from dva_sim.simulation.scenario import Scenario
from dva_sim.worlds.hazards import Surroundings
from dva_sim.worlds.site import Site

MERGED_WITHIN = 8.5  # the DVA merges reports this near each other into one event [m]


class PersonLog(NamedTuple):
    """Record of a guard or bystander.

    Attributes:
        name: Name as in `guard-1`.
        kind: `guard` or `bystander`.
        activity: At the end.
        exposure: Time within the danger radius of a hazard and in sight of it, or in air or water
            that is dangerous [s].
        heat: Fractional effective dose of heat; at 1 half of all people are incapacitated.
        toxic: Dose of carbon monoxide.
        leaves: Time of setting out to leave [s]; infinite if never.
        out: Time of reaching the outside [s]; infinite if never.
    """

    name: str
    kind: str
    activity: str
    exposure: float
    heat: float
    toxic: float
    leaves: float = math.inf
    out: float = math.inf


class RobotLog(NamedTuple):
    """Measures of a robot.

    Attributes:
        powered: True while its battery moves it.
        distance: Length of its path [m].
        contacts: Contacts with walls and others.
        impulse: Impulse of all contacts [N s].
        person_contacts: Contacts with people.
        jams: Times that it was jammed.
        motor: Time constant of its motors [s].
        superseded: Commands that a newer one replaced while they waited.
        longest_queue: Most commands that waited at once.
    """

    powered: bool
    distance: float
    contacts: int
    impulse: float
    person_contacts: int
    jams: int
    motor: float
    superseded: int
    longest_queue: int


def log_of(robot: RobotAgent) -> RobotLog:
    """Return the measures of a robot up to now."""
    body = robot.body
    inbox = robot.inbox
    return RobotLog(
        powered=body.powered,
        distance=body.distance,
        contacts=body.contacts,
        impulse=body.impulse,
        person_contacts=body.person_contacts,
        jams=body.jams,
        motor=body.spec.motor_time_constant,
        superseded=inbox.superseded,
        longest_queue=inbox.longest,
    )


class Ending(NamedTuple):
    """Outcome of an incident, as far as the DVA knows.

    Attributes:
        outcome: `confirmed`, `refuted`, `escalated` or `expired`; `open` if none of them came
            before the run ended, and `undetected` if nobody reported it.
        time: Time [s]; infinite if it is open or undetected.
    """

    outcome: str
    time: float


@dataclass(kw_only=True)
class Playback:
    """Displayable results of a run, simulated here or read from a recording.

    Attributes:
        recorder: Events and reports of the run.
        incidents: The hazards as they were.
        surroundings: Effect of the hazards on air and floor.
        labels: Names by id.
        radii: Footprint radius of each robot, by id [m].
        duration: Length of the run [s].
        contained: Time at which incidents were contained [s], by their index in `incidents`.
        endings: Outcome of each incident, in the order of `incidents`; empty if unknown, as in a
            recording that was cut short.
        events: The events as the DVA knew them in the end.
        facts: Decisions with author and reason, in order.
        about_robots: Limits of its robots, as in `Terms.about_robots`; None: as in the profiles
            that the scenario names.
    """

    scenario: Scenario
    seed: int
    site: Site
    recorder: Recorder
    incidents: list[RunHazard]
    surroundings: Surroundings
    labels: dict[str, str]
    radii: dict[str, float]
    duration: float
    contained: dict[int, float] = field(default_factory=dict)
    endings: list[Ending] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    facts: list[Fact] = field(default_factory=list)
    about_robots: dict[str, Any] | None = None

    @property
    def people_decide(self) -> bool:
        """True if a person takes part at a control room."""
        person = self.scenario.dispatch.person is not None
        return person or any(fact.role is not None for fact in self.facts)

    def robot_named(self, label: str) -> str | None:
        """Return the id of a robot, if there is one of that name."""
        return next((robot for robot in self.radii if self.label_of(robot) == label), None)

    def label_of(self, device: str) -> str:
        """Return the name of a device by its id: the id itself for devices of other makes."""
        return self.labels.get(device, device)


@dataclass(kw_only=True)
class Recording(Playback):
    """Results of a run, from which measures are computed.

    Attributes:
        robots: Measures of the robots, by id.
        links: Modelled links to each robot and back, by its id.
        people: Record of each person on foot.
        depth: Depth of the network model: `message`, `segment` (if any connection had it), or
            `datagram`.
        persons: Numbers of the operators whose places people took.
    """

    robots: dict[str, RobotLog]
    links: dict[str, tuple[Link, Link]] = field(default_factory=dict)
    people: list[PersonLog] = field(default_factory=list)
    depth: str = "message"
    persons: tuple[int, ...] = ()

    def event_of(self, number: int) -> Event | None:
        """Return the DVA's event about incident `number`, if it knows of it."""
        return event_about(self.incidents[number], self.events, self.site, self.robots)


def ending_of(event: Event | None) -> Ending:
    """Return the outcome of an incident that was reported as `event`, or not at all."""
    if event is None:
        return Ending("undetected", math.inf)
    if "confirmed" in event.times and event.state is not State.REFUTED:
        return Ending("confirmed", event.times["confirmed"])
    if event.open:
        return Ending("open", math.inf)
    return Ending(event.state.value, event.times["closed"])


def event_about(
    incident: RunHazard, events: list[Event], site: Site, robots: Collection[str]
) -> Event | None:
    """Return the DVA's event that an incident was reported as; two near each other are one event.

    Of what only sensors of robots speak for, the robot's place is known, and not its own.
    """
    nearest: tuple[float, Event | None] = math.inf, None
    for event in events:
        at = site.frame.to_xy(event.position.latitude, event.position.longitude)
        gap = math.dist(at, incident.hazard.position)
        felt = event.sources and all(source in robots for source in event.sources)
        near = gap <= min(nearest[0], REACH if felt else MERGED_WITHIN)
        if event.kind == incident.kind and near:
            nearest = gap, event
    return nearest[1]
