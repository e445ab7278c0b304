"""The field: robots and guards of a site, the physics around them, and the hazards."""

from __future__ import annotations

import math

from dva_sim.agents.camera import CAMERA_SCHEME, HazardSpot, View
from dva_sim.agents.device import Device
from dva_sim.agents.guard import GuardAgent
from dva_sim.agents.legs import RADIUS
from dva_sim.agents.modes import Limits, RobotController
from dva_sim.agents.operator.strategies import Truth
from dva_sim.agents.people import Walker
from dva_sim.agents.robot import FRAME, RobotAgent, RobotSetup
from dva_sim.agents.sensing import SensorPort
from dva_sim.agents.walking import Walking
from dva_sim.protocol import messages as m
from dva_sim.recorder import DriveLog
from dva_sim.scenario import guard_profile
from dva_sim.simulation.incidents import Hearsay, Incident, draw_incidents
from dva_sim.simulation.names import DVA
from dva_sim.simulation.stage import Stage, place_of
from dva_sim.worlds.hazards import Fire
from dva_sim.worlds.physics import World

PHYSICS_TICK = 0.04  # two centimetres at top speed [s]
SAME_PLACE = 4.0  # what is so near a place is what is there [m]
HEAT = "heat_flux"


class Field:
    """Everything that has a place.

    Args:
        stage: Where.

    Attributes:
        contained: When an incident was dealt with [s], by its place in `incidents`.

    Raises:
        ConfigError: the site cannot hold the team or the events.
    """

    def __init__(self, stage: Stage) -> None:
        self.stage = stage
        self.world = World(stage.site, PHYSICS_TICK)
        self.incidents = draw_incidents(stage.scenario.events, stage.site, stage.streams)
        self.contained: dict[int, float] = {}
        self.robots: dict[str, RobotAgent] = {}
        self.guards: list[GuardAgent] = []
        self._others = 0

    def populate(self) -> None:
        """Put everybody in place and let them register."""
        for number in range(1, self.stage.scenario.robot.count + 1):
            self._add_robot(number)
        for number in range(1, self.stage.scenario.guard.count + 1):
            self._add_guard(number)

    def schedule_incidents(self) -> None:
        """Let the hazards break out, and those who notice them report."""
        for number, incident in enumerate(self.incidents, 1):
            self._schedule(number, incident)

    def truth(self, robot: str) -> Truth:
        """The true state of a robot."""
        return Truth(self.robots[robot].observe())

    def newest_drive(self, robot: str) -> DriveLog | None:
        """The log of a robot's newest drive, where its operator's recorder is ours."""
        drives = self.stage.recorder.drives
        return next((d for d in reversed(drives) if d.robot == robot), None)

    def in_danger(self, x: float, y: float, now: float) -> bool:
        """Whether a place [m] is within the danger radius of a hazard."""
        return any(
            math.dist(i.hazard.position, (x, y)) < i.hazard.danger_radius(now)
            for i in self._going_on(now)
        )

    # --- who is there ------------------------------------------------------------------

    def _add_robot(self, number: int) -> None:
        stage, scenario = self.stage, self.stage.scenario
        base = place_of(stage.site.robot_bases, number, "robot base", stage.site)
        device = stage.device("robot", number)
        label = device.label
        body = self.world.add_robot(label, stage.robots[number - 1].drive_spec(), base)
        controller = RobotController(
            device.id_tag,
            DVA,
            Limits(scenario.robot.watchdog_s, scenario.robot.max_age_s),
            camera_url=f"{CAMERA_SCHEME}{device.address}/{FRAME}",
            clock_offset=float(stage.streams[f"{label}/clock"].uniform(10.0, 100_000.0)),
        )

        def heat_flux(now: float) -> tuple[float]:
            self.world.advance_to(now)
            return (self._heat_at(body.pose()[:2], now),)

        sensors = {HEAT: SensorPort("kW/m2", heat_flux)}
        robot = RobotAgent(
            device,
            controller,
            self.world,
            body,
            stage.planner,
            self._setup(sensors),
            self.newest_drive,
        )
        self.robots[device.id_tag] = robot
        device.register(robot.start)

    def _setup(self, sensors: dict[str, SensorPort]) -> RobotSetup:
        scenario, camera = self.stage.scenario, self.stage.scenario.camera
        angle = math.radians(camera.field_of_view_deg)
        return RobotSetup(
            scenario.pattern,
            scenario.robot.processing_s or 0.0,
            camera.rate_hz,
            camera.frame_bytes,
            View(angle, camera.range_m, self.stage.planner.line_of_sight),
            self._spots,
            sensors,
        )

    def _add_guard(self, number: int) -> None:
        stage = self.stage
        post = place_of(stage.site.guard_posts, number, "guard post", stage.site)
        device = stage.device("guard", number)
        luck = stage.streams[f"{device.label}/walker"]
        walker = Walker.draw(guard_profile(stage.scenario), luck)
        body = self.world.add_person(device.label, post, radius=RADIUS)
        walking = Walking(
            stage.clock, stage.planner, self.world, body, walker.speed, stage.site.doors
        )
        guard = GuardAgent(device, walker, stage.planner, walking, self._is_there, self._contain)
        self.guards.append(guard)
        device.register(guard.start)

    # --- what happens ------------------------------------------------------------------

    def _schedule(self, number: int, incident: Incident) -> None:
        """Detectors are devices too: those that will notice something register and report."""
        stage, kind = self.stage, incident.kind.replace("_", " ")
        if not incident.false_alarm:
            stage.clock.call_at(
                incident.start,
                stage.recorder.tell,
                incident.start,
                incident.room or "site",
                f"{kind} breaks out",
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

    def _let_report(self, number: int, label: str, what: Hearsay, incident: Incident) -> None:
        stage = self.stage
        device = stage.device("detector", number)
        device.label = stage.labels[device.id_tag] = label
        device.register()
        stage.clock.call_at(what.time, self._report, device, incident, what.position)

    def _report(self, device: Device, incident: Incident, place: tuple[float, float]) -> None:
        position = m.Position(*self.stage.site.frame.to_latlon(*place))
        severity = incident.hazard.severity(self.stage.clock.now)
        body = m.EventReport(None, incident.kind, position, severity, 0.9, "detected")
        device.ask(DVA, body)
        device.tell(f"reports {incident.kind.replace('_', ' ')}", "event")

    # --- what agents may ask of the world ----------------------------------------------

    def _going_on(self, now: float) -> list[Incident]:
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
            if incident.kind == kind and near and incident.is_there(now):
                self.contained.setdefault(number, now)

    def _is_there(self, kind: str, x: float, y: float) -> bool:
        spots = self._spots(self.stage.clock.now)
        return any(s.kind == kind and math.dist((s.x, s.y), (x, y)) < SAME_PLACE for s in spots)

    def _heat_at(self, point: tuple[float, float], now: float) -> float:
        """Radiant heat at a place [kW/m^2]; what a wall hides does not count."""
        sees = self.stage.planner.line_of_sight
        return sum(
            i.hazard.heat_flux(now, point)
            for i in self._going_on(now)
            if isinstance(i.hazard, Fire) and sees(point, i.hazard.position)
        )
