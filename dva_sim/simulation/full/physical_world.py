"""Bodies of a run: robots and people of a site, physics around them, hazards."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace

from dva_sim.agents.device import AgentDevice
from dva_sim.agents.observation import Observation
from dva_sim.agents.operator.strategies import Truth
from dva_sim.agents.people.bystander import SAFE, BystanderAgent
from dva_sim.agents.people.guard import GuardAgent
from dva_sim.agents.people.person_guard import PersonGuard
from dva_sim.agents.robot.robot import RobotAgent
from dva_sim.kernel.recorder import TrackPoint
from dva_sim.protocol import messages as m
from dva_sim.protocol.event_kinds import severity_word
from dva_sim.simulation.full.hazards import Danger, Hearsay, RunHazard, RunHazards
from dva_sim.simulation.full.stage import Stage
from dva_sim.simulation.full.team import TeamBuilder
from dva_sim.worlds.hazards import Conditions
from dva_sim.worlds.physics import World

PHYSICS_TICK = 0.04  # step of the physics: two centimetres at top speed [s]
DANGEROUS = Conditions(
    temperature=60.0,
    heat_flux=2.5,
    extinction=math.inf,
    co=1200.0,
    gas=math.inf,
    water=0.1,
    explosive=0.2,
)
"""Causes of danger at a place, by the limits of `danger_radius` (docs/explanation/hazards.md)."""
LOOK_AGAIN = 10.0  # interval of checks whether a hazard has become graver [s]; assumed
REPORT_AGAIN = 2.0  # pause after a report that was refused or not answered [s]


class Field(RunHazards):
    """Bodies of a run.

    Raises:
        ConfigError: the site cannot hold the team or the events.
    """

    def __init__(self, stage: Stage) -> None:
        super().__init__(stage)
        self.world = World(stage.site, PHYSICS_TICK)
        self.robots: dict[str, RobotAgent] = {}
        self.guards: list[GuardAgent | PersonGuard] = []
        self.bystanders: list[BystanderAgent] = []
        self._others = 0

    def populate(self) -> None:
        """Place all agents and let them register."""
        scenario = self.stage.scenario
        team = TeamBuilder(self.stage, self.world, self)
        for number in range(1, scenario.robot.count + 1):
            robot = team.add_robot(number)
            self.robots[robot.device.id_tag] = robot
        self.guards += [team.add_guard(n + 1) for n in range(scenario.guard.count)]
        self.bystanders += [team.add_bystander(n + 1) for n in range(scenario.bystander.count)]

    def people(self) -> Iterator[tuple[str, GuardAgent | PersonGuard | BystanderAgent]]:
        """Yield all people on the site, by name."""
        for guard in self.guards:
            yield guard.device.label, guard
        for bystander in self.bystanders:
            yield bystander.name, bystander

    def schedule_incidents(self) -> None:
        """Schedule the hazards, and the reports of agents that notice them."""
        for number, incident in enumerate(self.incidents, 1):
            self._schedule(number, incident)

    def truth(self, robot: str) -> Truth[Observation]:
        """Return the true state of a robot."""
        return Truth(self.robots[robot].observe())

    def is_near(self, dangers: Iterable[Danger], x: float, y: float) -> bool:
        """Return True if a place [m] is within a danger's radius, with no wall between."""
        sees = self.stage.planner.line_of_sight
        return any(
            math.dist(middle, (x, y)) < radius and sees(middle, (x, y))
            for middle, radius in dangers
        )

    def place_of(self, device: str) -> m.Position | None:
        """Return the true position of a robot or guard, by its id."""
        robot = self.robots.get(device)
        if robot is not None:
            return m.Position(*self.stage.site.frame.to_latlon(robot.body.x, robot.body.y))
        guards = (g for g in self.guards if g.device.id_tag == device)
        places = (self.stage.site.frame.to_latlon(*g.walking.place) for g in guards)
        return next((m.Position(*place) for place in places), None)

    def places(self) -> dict[str, m.Position]:
        """Return the places of all robots and guards, by id."""
        devices = [*self.robots, *(guard.device.id_tag for guard in self.guards)]
        return {device: at for device in devices if (at := self.place_of(device)) is not None}

    def whereabouts(self, now: float) -> Iterator[tuple[str, TrackPoint]]:
        """Yield the position of everybody on the site, by name."""
        self.world.advance_to(now)
        for robot in self.robots.values():
            pose = robot.body.pose()
            mode = robot.controller.mode.value
            yield robot.device.label, TrackPoint(now, pose.x, pose.y, pose.heading, mode)
        for name, agent in self.people():
            x, y = agent.walking.place
            if agent.activity != SAFE:
                yield name, TrackPoint(now, x, y, agent.heading, agent.activity)

    # --- what happens ------------------------------------------------------------------

    def _schedule(self, number: int, incident: RunHazard) -> None:
        """Schedule detectors that will notice a hazard: they register and report as devices."""
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
        device = stage.device("detector", number, what.position)
        device.label = stage.labels[device.id_tag] = label
        device.register(hears_dva=len(device.dvas) > 1)
        stage.clock.call_at(what.time, self._report, device, incident, what.position)

    def _report(self, device: AgentDevice, incident: RunHazard, place: tuple[float, float]) -> None:
        position = m.Position(*self.stage.site.frame.to_latlon(*place))
        severity = incident.hazard.severity(self.stage.clock.now)
        body = m.EventReport(None, incident.kind, position, severity, 0.9, "detected")
        self._say(device, body)
        device.tell(f"reports {incident.kind.replace('_', ' ')}", "event")
        self._sound_alarm()
        if self.stage.follows_severity:
            self._follow(device, incident, body)

    def _follow(self, device: AgentDevice, incident: RunHazard, told: m.EventReport) -> None:
        """Let a detector or caller report again whenever the severity has risen."""

        def look() -> bool:
            nonlocal told
            now = self.stage.clock.now
            severity = incident.hazard.severity(now)
            goes_on = any(incident is one for one in self._going_on(now))
            if goes_on and severity_word(severity) != severity_word(told.severity):
                told = replace(told, severity=severity)
                self._say(device, told)
                device.tell(f"reports that it is {severity_word(severity)}", "event")
            return goes_on

        self.stage.clock.every(LOOK_AGAIN, look)

    def _say(self, device: AgentDevice, body: m.EventReport) -> None:
        """Report until the DVA has accepted it: detectors report an event only once."""

        def again() -> None:
            self.stage.clock.call_after(REPORT_AGAIN, self._say, device, body)

        device.ask(device.dva, body, lambda reply: None if reply.code == m.OK else again(), again)

    def _sound_alarm(self) -> None:
        """Sound the alarm that everybody in the building hears after a report."""
        for bystander in self.bystanders:
            bystander.alarm(self.stage.clock.now)


def is_dangerous(air: Conditions) -> bool:
    """Return True if people should not be in such conditions."""
    return any(is_ >= least for is_, least in zip(air, DANGEROUS, strict=True))
