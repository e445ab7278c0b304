"""Build a run from a scenario, let its time pass, and keep what happened."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from dva_sim.agents.camera import HazardSpot, View
from dva_sim.agents.device import Device
from dva_sim.agents.guard import GuardAgent, Walker
from dva_sim.agents.modes import Limits, Mode, RobotController
from dva_sim.agents.operator.agent import OperatorAgent
from dva_sim.agents.operator.drive import DriverSeat, OperatorSetup
from dva_sim.agents.operator.person import draw_person
from dva_sim.agents.operator.strategies import STRATEGIES, Oracle, Reach, Truth
from dva_sim.agents.robot import RobotAgent, RobotSetup
from dva_sim.agents.tilt import Phone
from dva_sim.clock import Clock
from dva_sim.core.dispatch import POLICIES
from dva_sim.core.registry import DETECTOR, GUARD, OPERATOR, ROBOT
from dva_sim.core.service import Desk, Pace
from dva_sim.errors import ConfigError
from dva_sim.network.link import ConstantRate, Link, LinkConfig, make_link
from dva_sim.network.patterns import Network
from dva_sim.protocol import messages as m
from dva_sim.recorder import DriveLog, Recorder, TrackPoint
from dva_sim.scenario import (
    Scenario,
    guard_profile,
    phone_profile,
    population,
    robot_profile,
    site_of,
)
from dva_sim.simulation.dva import DvaAgent
from dva_sim.simulation.incidents import Incident, draw_incidents
from dva_sim.simulation.names import DVA, address_of, id_of, label_of
from dva_sim.simulation.recording import Recording, event_about
from dva_sim.simulation.watch import broken_event_rules, broken_rules
from dva_sim.streams import Streams
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.physics import World
from dva_sim.worlds.planning import Planner
from dva_sim.worlds.site import Site

LAN = LinkConfig(delay_s=0.0005, rate_bps=1e9, queue_bytes=10_000_000)
PHYSICS_TICK = 0.04  # two centimetres at top speed [s]
WATCH_PERIOD = 0.5  # how often tracks are sampled and rules are checked [s]
FILM_PERIOD = 0.1  # the same where pictures are wanted [s]
ROBOT_PACE = 0.35  # what the DVA expects of a teleoperated robot [m/s]
ROBOT_READY = 4.0  # and of its operator [s]


def simulate(scenario: Scenario, seed: int, keep_traffic: bool = False) -> Recording:
    """Run one scenario.

    Args:
        scenario: What the run consists of.
        seed: Decides all luck but the persons'.
        keep_traffic: Keep messages and the operators' views, for pictures.

    Raises:
        ConfigError: the site cannot hold the team or the events.
    """
    return _Run(scenario, seed, keep_traffic).run()


def rehearse(scenario: Scenario, seed: int) -> None:
    """Build a run without letting any time pass, to find what cannot work before it counts.

    Raises:
        ConfigError: a map or trace that cannot be read, a team or an event without a place.
    """
    _Run(scenario, seed, keep_traffic=False).build()


@dataclass
class _Run:
    """The parts of a run while it is built and while it lasts."""

    scenario: Scenario
    seed: int
    keep_traffic: bool
    labels: dict[str, str] = field(default_factory=dict)
    links: dict[str, tuple[Link, Link]] = field(default_factory=dict)
    robots: dict[str, RobotAgent] = field(default_factory=dict)
    guards: list[GuardAgent] = field(default_factory=list)
    _last_mission: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        scenario = self.scenario
        self.clock, self.streams = Clock(), Streams(self.seed)
        self.recorder = Recorder(self.keep_traffic)
        self._watch_period = FILM_PERIOD if self.keep_traffic else WATCH_PERIOD
        self.site = site_of(scenario, self.seed)
        self.planner = planner_of(self.site, robot_profile(scenario).radius_m)
        self.world = World(self.site, PHYSICS_TICK)
        self.incidents = draw_incidents(scenario.events, self.site, self.streams)
        lan = Link(LAN, ConstantRate(LAN.rate_bps), self.streams, "lan")
        self._lan = lan, lan
        self.network = Network(self.clock, self._links, self.recorder.message_sent)
        self.dva = DvaAgent(self._device(DVA, "dva", "DVA", "192.168.1.1"), self._desk())

    def build(self) -> None:
        """Put everybody in place."""
        for number in range(1, self.scenario.robot.count + 1):
            self._add_robot(number)
        for number in range(1, self.scenario.guard.count + 1):
            self._add_guard(number)
        for number in range(1, self.scenario.operator.count + 1):
            self._add_operator(number)
        self._add_reports()

    def run(self) -> Recording:
        """Build, then let time pass until all is settled or the horizon is reached."""
        self.build()
        self.dva.start()
        self.clock.every(self._watch_period, self._watch)
        self._let_time_pass()
        self.world.advance_to(self.clock.now)
        self._watch()
        events = list(self.dva.desk.book.events.values())
        return Recording(
            self.scenario,
            self.seed,
            self.site,
            self.recorder,
            self.incidents,
            events,
            self.robots,
            self.labels,
            self.links,
            self.clock.now,
        )

    def _let_time_pass(self) -> None:
        now, horizon = 0.0, self.scenario.horizon_s
        while now < horizon and not self._settled():
            now = min(now + 1.0, horizon)
            self.clock.run(now)

    def _settled(self) -> bool:
        """Whether every incident is known and closed, and nobody drives any more."""
        events = list(self.dva.desk.book.events.values())
        return (
            bool(events)
            and not any(e.open for e in events)
            and all(d.ended is not None for d in self.recorder.drives)
            and all(
                event_about(i, events, self.site) is not None
                for i in self.incidents
                if i.detected < math.inf
            )
        )

    # --- who is there ------------------------------------------------------------------

    def _device(self, id_tag: str, label: str, device_type: str, address: str) -> Device:
        command = self.scenario.command
        return Device(
            id_tag,
            label,
            device_type,
            address,
            DVA,
            self.network,
            self.recorder,
            self.site.frame,
            command.timeout_s,
            command.attempts,
            self.labels,
        )

    def _new(self, kind: str, number: int, device_type: str) -> Device:
        return self._device(
            id_of(kind, number), label_of(kind, number), device_type, address_of(kind, number)
        )

    def _desk(self) -> Desk:
        dispatch, guards = self.scenario.dispatch, guard_profile(self.scenario)
        return Desk(
            policy=POLICIES[dispatch.policy](),
            distance=self._distance,
            paces={
                "guard": Pace(guards.walking_mean_mps, guards.mobilisation_s.median),
                "robot": Pace(ROBOT_PACE, ROBOT_READY),
            },
            escalate_after=dispatch.escalate_after_s,
            rng=self.streams["dva/policy"],
        )

    def _distance(self, start: m.Position, goal: m.Position) -> float:
        frame = self.site.frame
        a = frame.to_xy(start.latitude, start.longitude)
        return self.planner.distance(a, frame.to_xy(goal.latitude, goal.longitude))

    def _add_robot(self, number: int) -> None:
        scenario, camera = self.scenario, self.scenario.camera
        base = _place_of(self.site.robot_bases, number, "robot base", self.site)
        device = self._new("robot", number, ROBOT)
        label = device.label
        self.links[device.id_tag] = (
            make_link(scenario.link, "up", self.streams, f"{label}/link"),
            make_link(scenario.link, "down", self.streams, f"{label}/link"),
        )
        body = self.world.add_robot(label, robot_profile(scenario).drive_spec(), base)
        controller = RobotController(
            device.id_tag,
            DVA,
            Limits(scenario.robot.watchdog_s, scenario.robot.max_age_s),
            clock_offset=float(self.streams[f"{label}/clock"].uniform(10.0, 100_000.0)),
        )
        angle = math.radians(camera.field_of_view_deg)
        view = View(angle, camera.range_m, self.planner.line_of_sight)
        setup = RobotSetup(
            scenario.pattern,
            scenario.robot.processing_s,
            camera.rate_hz,
            camera.frame_bytes,
            view,
            self._spots,
        )
        robot = RobotAgent(
            device, controller, self.world, body, self.planner, setup, self._newest_drive
        )
        self.robots[device.id_tag] = robot
        device.register(robot.start)

    def _add_guard(self, number: int) -> None:
        post = _place_of(self.site.guard_posts, number, "guard post", self.site)
        device = self._new("guard", number, GUARD)
        walker = Walker.draw(guard_profile(self.scenario), self.streams[f"{device.label}/walker"])
        guard = GuardAgent(device, walker, self.planner, (post.x, post.y), self._is_there)
        self.guards.append(guard)
        position = m.Position(*self.site.frame.to_latlon(post.x, post.y))
        device.register(lambda: self.dva.desk.place(device.id_tag, position))

    def _add_operator(self, number: int) -> None:
        scenario, config = self.scenario, self.scenario.operator
        device = self._new("operator", number, OPERATOR)
        index = config.person + number - 1
        person = draw_person(population(scenario), config.population_seed, index)
        robot = robot_profile(scenario)
        reach = Reach(robot.max_speed_mps, robot.max_turn_rate_rad_s)
        strategy = STRATEGIES[config.strategy](person, reach)
        command = scenario.command
        setup = OperatorSetup(
            scenario.pattern,
            command.rate_hz,
            command.timeout_s,
            command.attempts,
            truth=self._truth if isinstance(strategy, Oracle) else None,
        )
        phone_luck = self.streams[f"{device.label}/phone"]
        seat = DriverSeat(
            device,
            person,
            Phone(phone_profile(scenario), person.hand_lag, phone_luck),
            strategy,
            self.planner,
            setup,
            self.streams[f"{device.label}/judgement"],
        )
        OperatorAgent(seat)
        device.register()

    def _add_reports(self) -> None:
        """Detectors are devices too: those that will notice something register and report."""
        for number, incident in enumerate(self.incidents, 1):
            self.clock.call_at(
                incident.start,
                self.recorder.tell,
                incident.start,
                incident.room or "site",
                f"{incident.kind.replace('_', ' ')} breaks out",
            )
            if incident.detected == math.inf:
                continue
            device = self._new("detector", number, DETECTOR)
            self.labels[device.id_tag] = incident.detector.name if incident.detector else "caller"
            device.label = self.labels[device.id_tag]
            device.register()
            self.clock.call_at(max(incident.detected, 0.5), self._report, device, incident)

    def _report(self, device: Device, incident: Incident) -> None:
        x, y = incident.hazard.position
        position = m.Position(*self.site.frame.to_latlon(x, y))
        severity = incident.hazard.severity(self.clock.now)
        body = m.EventReport(None, incident.kind, position, severity, 0.9, "detected")
        device.ask(DVA, body)
        device.tell(f"reports {incident.kind.replace('_', ' ')}", "event")

    # --- what the agents may ask of the world ------------------------------------------

    def _links(self, source: str, destination: str) -> tuple[Link, Link]:
        """A robot's link is the only one that matters; everybody else is on the LAN."""
        if destination in self.links:
            return self.links[destination]
        if source in self.links:
            up, down = self.links[source]
            return down, up
        return self._lan

    def _spots(self, now: float) -> list[HazardSpot]:
        return [spot for i in self.incidents if (spot := i.spot(now)) is not None]

    def _is_there(self, kind: str, x: float, y: float) -> bool:
        now = self.clock.now
        return any(s.kind == kind and math.dist((s.x, s.y), (x, y)) < 4.0 for s in self._spots(now))

    def _truth(self, robot: str) -> Truth:
        return Truth(self.robots[robot].observe())

    def _newest_drive(self, robot: str) -> DriveLog | None:
        return next((d for d in reversed(self.recorder.drives) if d.robot == robot), None)

    # --- watching ----------------------------------------------------------------------

    def _watch(self) -> None:
        """Sample tracks and check the rules that must hold at every moment."""
        now, recorder = self.clock.now, self.recorder
        self.world.advance_to(now)
        for robot in self.robots.values():
            pose, label = robot.body.pose(), robot.device.label
            recorder.tracks[label].append(
                TrackPoint(now, pose.x, pose.y, pose.heading, robot.controller.mode.value)
            )
            drive = self._newest_drive(robot.device.id_tag)
            if robot.controller.mode is Mode.MISSION:
                self._last_mission[label] = now
            mission = self._last_mission.get(label, 0.0)
            for rule, what in broken_rules(robot, drive, self.scenario.robot, mission, now):
                recorder.violated(rule, now, label, what)
        for guard in self.guards:
            label = guard.device.label
            recorder.tracks[label].append(
                TrackPoint(now, guard.x, guard.y, guard.heading, guard.activity)
            )
            if self._in_danger(guard.x, guard.y, now):
                recorder.exposure[label] += self._watch_period
        deadline = self.scenario.dispatch.escalate_after_s
        for rule, what in broken_event_rules(self.dva.desk.book, deadline, now):
            recorder.violated(rule, now, "dva", what)

    def _in_danger(self, x: float, y: float, now: float) -> bool:
        return any(
            now >= i.start and math.dist(i.hazard.position, (x, y)) < i.hazard.danger_radius(now)
            for i in self.incidents
        )


_PLANNERS: dict[tuple[str, float], tuple[Site, Planner]] = {}


def planner_of(site: Site, radius: float) -> Planner:
    """The planner of a site, kept for the next run on it in this process."""
    key = site.name, radius
    known = _PLANNERS.get(key)
    if known is None or known[0] is not site:
        known = _PLANNERS[key] = site, Planner(site, radius)
    return known[1]


def _place_of(places: tuple[Pose, ...], number: int, what: str, site: Site) -> Pose:
    if number > len(places):
        problem = f"site {site.name!r} has {len(places)} {what}s, the scenario needs {number}"
        raise ConfigError(problem)
    return places[number - 1]
