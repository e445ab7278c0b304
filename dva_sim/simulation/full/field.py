"""The field: robots and people of a site, the physics around them, and the hazards."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

from dva_sim.agents.device import AgentDevice
from dva_sim.agents.observation import Observation
from dva_sim.agents.operator.strategies import Truth
from dva_sim.agents.people.bystander import SAFE, BystanderAgent
from dva_sim.agents.people.guard import GuardAgent
from dva_sim.agents.robot.field_of_view import HazardSpot
from dva_sim.agents.robot.robot import RobotAgent
from dva_sim.kernel.recorder import DriveLog, TrackPoint
from dva_sim.protocol import messages as m
from dva_sim.simulation.full.hazards import Hearsay, RunHazard, draw_incidents
from dva_sim.simulation.full.people import People
from dva_sim.simulation.full.robots import Machines, Starts
from dva_sim.simulation.full.stage import DVA, Stage
from dva_sim.worlds.hazards import Conditions, Surroundings
from dva_sim.worlds.physics import World

PHYSICS_TICK = 0.04  # two centimetres at top speed [s]
DANGEROUS = Conditions(
    temperature=60.0,
    heat_flux=2.5,
    extinction=math.inf,
    co=1200.0,
    gas=math.inf,
    water=0.1,
    explosive=0.2,
)
"""What makes a place dangerous, by the limits of `danger_radius` (worlds/HAZARDS.md)."""
SAME_PLACE = 4.0  # what is so near a place is what is there [m]

Danger = tuple[tuple[float, float], float]  # the middle and the radius of a place to keep off [m]


class Field:
    """Everything that has a place.

    Args:
        stage: Where.

    Attributes:
        surroundings: What the hazards make of the air and the floor.
        contained: When an incident was dealt with [s], by its place in `incidents`.

    Raises:
        ConfigError: the site cannot hold the team or the events.
    """

    def __init__(self, stage: Stage) -> None:
        self.stage = stage
        self.world = World(stage.site, PHYSICS_TICK)
        self.incidents = draw_incidents(stage.scenario.events, stage.site, stage.streams)
        self._real = [n for n, i in enumerate(self.incidents) if not i.false_alarm]
        self.surroundings = Surroundings(
            stage.site, [self.incidents[number].hazard for number in self._real]
        )
        self.contained: dict[int, float] = {}
        self.robots: dict[str, RobotAgent] = {}
        self.guards: list[GuardAgent] = []
        self.bystanders: list[BystanderAgent] = []
        self._others = 0

    def populate(self) -> None:
        """Put everybody in place and let them register."""
        starts = Starts(self.stage, self.incidents[0].hazard.position)
        machines = Machines(
            *(self.stage, self.world, self.surroundings, self._spots, self.newest_drive, starts)
        )
        for number in range(1, self.stage.scenario.robot.count + 1):
            robot = machines.add(number)
            self.robots[robot.device.id_tag] = robot
        people = People(
            *(self.stage, self.world, self.surroundings, self._spots),
            *(self._is_there, self._contain, starts),
        )
        for number in range(1, self.stage.scenario.guard.count + 1):
            self.guards.append(people.add_guard(number))
        for number in range(1, self.stage.scenario.bystander.count + 1):
            self.bystanders.append(people.add_bystander(number))

    def schedule_incidents(self) -> None:
        """Let the hazards break out, and those who notice them report."""
        for number, incident in enumerate(self.incidents, 1):
            self._schedule(number, incident)

    def truth(self, robot: str) -> Truth[Observation]:
        """The true state of a robot."""
        return Truth(self.robots[robot].observe())

    def newest_drive(self, robot: str) -> DriveLog | None:
        """The log of a robot's newest drive, where its operator's recorder is ours."""
        return self.stage.recorder.newest_drive.get(robot)

    def in_danger(self, x: float, y: float, now: float) -> bool:
        """Whether a place [m] is one where people should not be."""
        return self.is_near(self.dangers(now), x, y) or is_dangerous(
            self.surroundings.at(x, y, now)
        )

    def is_near(self, dangers: Iterable[Danger], x: float, y: float) -> bool:
        """Whether a place [m] is within a danger's radius, with no wall between."""
        sees = self.stage.planner.line_of_sight
        return any(
            math.dist(middle, (x, y)) < radius and sees(middle, (x, y))
            for middle, radius in dangers
        )

    def dangers(self, now: float) -> list[Danger]:
        """Where people should not be."""
        return [(i.hazard.position, i.hazard.danger_radius(now)) for i in self._going_on(now)]

    def whereabouts(self, now: float) -> Iterator[tuple[str, TrackPoint]]:
        """Where everybody is who is on the site, by name."""
        self.world.advance_to(now)
        for robot in self.robots.values():
            pose, mode = robot.body.pose(), robot.controller.mode.value
            yield robot.device.label, TrackPoint(now, pose.x, pose.y, pose.heading, mode)
        people: list[tuple[str, GuardAgent | BystanderAgent]] = [
            *((guard.device.label, guard) for guard in self.guards),
            *((bystander.name, bystander) for bystander in self.bystanders),
        ]
        for name, who in people:
            x, y = who.walking.place
            if who.activity != SAFE:
                yield name, TrackPoint(now, x, y, who.heading, who.activity)

    # --- what happens ------------------------------------------------------------------

    def _schedule(self, number: int, incident: RunHazard) -> None:
        """Detectors are devices too: those that will notice something register and report."""
        stage = self.stage
        if not incident.false_alarm:
            stage.clock.call_at(
                incident.start,
                stage.recorder.tell,
                incident.start,
                incident.room or "site",
                f"{incident.hazard.title} breaks out",
            )
        if incident.detected == math.inf:
            return
        label = incident.detector.name if incident.detector else "caller"
        first = Hearsay(max(incident.detected, 0.5), incident.hazard.position)
        self._let_report(number, label, first, incident)
        for other, heard in enumerate(incident.hearsay, 2):
            # Others are numbered beyond all incidents, so that each has an id of its own.
            self._others += 1
            beyond = len(self.incidents) + self._others
            self._let_report(beyond, f"caller {other} of event {number}", heard, incident)

    def _let_report(self, number: int, label: str, what: Hearsay, incident: RunHazard) -> None:
        stage = self.stage
        device = stage.device("detector", number)
        device.label = stage.labels[device.id_tag] = label
        device.register()
        stage.clock.call_at(what.time, self._report, device, incident, what.position)

    def _report(self, device: AgentDevice, incident: RunHazard, place: tuple[float, float]) -> None:
        position = m.Position(*self.stage.site.frame.to_latlon(*place))
        severity = incident.hazard.severity(self.stage.clock.now)
        body = m.EventReport(None, incident.kind, position, severity, 0.9, "detected")
        device.ask(DVA, body)
        device.tell(f"reports {incident.kind.replace('_', ' ')}", "event")
        self._sound_alarm()

    def _sound_alarm(self) -> None:
        """What detectors and callers report is heard by all who are in the building."""
        for bystander in self.bystanders:
            bystander.alarm(self.stage.clock.now)

    # --- what agents may ask of the world ----------------------------------------------

    def _going_on(self, now: float) -> list[RunHazard]:
        """What has begun, is real, and was not dealt with yet."""
        return [
            incident
            for number, incident in enumerate(self.incidents)
            if incident.is_there(now) and now < self.contained.get(number, math.inf)
        ]

    def _spots(self, now: float) -> list[HazardSpot]:
        return [spot for i in self._going_on(now) if (spot := i.spot(now)) is not None]

    def _contain(self, kind: str, x: float, y: float) -> None:
        """Somebody has dealt with what is at a place [m]: from now on it harms nobody."""
        now = self.stage.clock.now
        for number, incident in enumerate(self.incidents):
            near = math.dist(incident.hazard.position, (x, y)) < SAME_PLACE
            there = incident.is_there(now) and number not in self.contained
            if incident.kind == kind and near and there:
                self.contained[number] = now
                self.surroundings.contain(self._real.index(number), now)

    def _is_there(self, kind: str, x: float, y: float) -> bool:
        spots = self._spots(self.stage.clock.now)
        return any(s.kind == kind and math.dist((s.x, s.y), (x, y)) < SAME_PLACE for s in spots)


def is_dangerous(air: Conditions) -> bool:
    """Whether people should not be where it is like this."""
    return any(is_ >= least for is_, least in zip(air, DANGEROUS, strict=True))
