"""Team of a run: robots, guards and bystanders, placed where they begin.

They begin at the site's bases and posts, or a given way from the event. A robot has a body, a
battery, sensors and a computer; people on foot share physics and air with it.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from numpy.typing import NDArray

from dva_sim.agents.device import AgentDevice
from dva_sim.agents.habits import OnFootHabits
from dva_sim.agents.people.bystander import BystanderAgent, draw_places
from dva_sim.agents.people.evacuation import AirAt, clean_air, refuges_of
from dva_sim.agents.people.guard import GuardAgent
from dva_sim.agents.people.person_guard import PersonGuard
from dva_sim.agents.people.profiles import Occupant, Walker
from dva_sim.agents.people.walking import Walking
from dva_sim.agents.robot.battery import Battery
from dva_sim.agents.robot.command_queue import service_times
from dva_sim.agents.robot.controller import Limits, RobotController
from dva_sim.agents.robot.emergency_latch import EmergencyLatch
from dva_sim.agents.robot.field_of_view import FieldOfView
from dva_sim.agents.robot.profile import RobotProfile
from dva_sim.agents.robot.robot import RobotAgent, RobotSetup
from dva_sim.agents.robot.sensors import make_ports, sources_of
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.errors import ConfigError
from dva_sim.simulation.full.hazards import RunHazards
from dva_sim.simulation.full.stage import Stage
from dva_sim.simulation.scenario import bystander_profile, guard_profile
from dva_sim.worlds.bodies import GRIP, RobotBody
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.lidar import Lidar
from dva_sim.worlds.physics import PersonBody, World
from dva_sim.worlds.site import FOOTPRINT

TRIES = 200
START_GAP_M = 1.5  # minimum distance between two starting positions [m]

Point = tuple[float, float]
WET_GRIP = 0.4  # friction coefficient of rubber on a wet floor; assumed
SLIPPERY_DEPTH_M = 0.002  # deeper water than this makes a floor slippery [m]
HOUSEKEEPING = 1.0  # interval of checks of a robot's battery and of the floor under it [s]
CHARGING_WITHIN_M = 0.5  # a standing robot this near its base is charged [m]
STANDING = 0.02  # a slower robot stands [m/s]
PLACES = 3  # number of places where a bystander works in turn
FLAMES_SEEN = 15.0  # distance at which flames are seen with a clear line of sight [m]
FLAMES_THROUGH = 8.0  # optical depth at which smoke hides glowing things (T. Jin, SFPE Handbook)


class TeamBuilder:
    """Makes the robots, guards and bystanders, and places them where they begin.

    A robot or guard with a given distance to the event begins on a path to it from elsewhere on
    the site, chosen by the run's seed, at the point where that distance is left.

    Args:
        world: The physics.
        hazards: Hazards of the run.
    """

    def __init__(self, stage: Stage, world: World, hazards: RunHazards) -> None:
        self._stage = stage
        self._world = world
        self._hazards = hazards
        self._around = hazards.surroundings
        self._lidar = Lidar(world)
        self._air: AirAt = self._around.at if self._around.has_any else clean_air
        self._refuges = refuges_of(stage.site)
        self._taken: list[Point] = []
        self._first_places: list[Point] = []
        self._failures: dict[str, int] = {}

    def add_robot(self, number: int, registers: bool = True) -> RobotAgent:
        """Return the `number`-th robot, in its place; it registers and begins to work.

        Args:
            number: Number, from 1.
            registers: Without that it does neither by itself.

        Raises:
            ConfigError: there is no place so far from the event, or something is in its way.
        """
        stage = self._stage
        config = self._stage.scenario.robot
        profile = stage.robots[number - 1]
        base = self._start("robot", number)
        device = stage.device("robot", number, (base.x, base.y))
        body = self._world.add_robot(device.label, profile.drive_spec(), base)
        controller = RobotController(
            device.id_tag,
            device.dva,
            Limits(config.watchdog_s, config.max_age_s),
            camera_url=stage.cameras.url(device.label, device.address),
            clock_offset=float(stage.streams[f"{device.label}/clock"].uniform(10.0, 100_000.0)),
            latch=EmergencyLatch(stage.release),
        )
        power = Power(profile, config.charge, body, base, stage.clock)
        setup = self._setup(profile, body, power)
        robot = RobotAgent(
            device,
            controller,
            world=self._world,
            body=body,
            planner=stage.planner,
            setup=setup,
            drive_of=stage.recorder.newest_drive.get,
        )
        if registers:
            device.register(robot.start)
        stage.clock.every(HOUSEKEEPING, partial(self._look_after, robot))
        return robot

    def _setup(self, profile: RobotProfile, body: RobotBody, power: Power) -> RobotSetup:
        stage = self._stage
        scenario = self._stage.scenario
        hazards = self._hazards
        camera = scenario.camera
        robot = scenario.robot
        angle = math.radians(camera.field_of_view_deg)
        sources = sources_of(self._world, body, self._around, self._lidar, power.share)
        processing = profile.processing_s if robot.processing_s is None else robot.processing_s
        configs = profile.sensors if robot.sensors is None else robot.sensors
        return RobotSetup(
            pattern=stage.pattern(),
            service=service_times(processing, stage.streams.fresh(f"{body.name}/processing")),
            frame_rate=camera.rate_hz,
            frame_bytes=camera.frame_bytes,
            view=FieldOfView(
                angle,
                camera.range_m,
                stage.planner.line_of_sight,
                smoke=hazards.smoke,
                hazy=hazards.is_hazy,
            ),
            hazards=hazards.spots,
            sensors=make_ports(
                configs, sources, lambda what: stage.streams.fresh(f"{body.name}/sensor/{what}")
            ),
            guarded=scenario.control == "coordinated",
            encode=camera.encode_s,
            charge=power.share,
            conflates=scenario.zeromq.conflates_receiver,
            limit=scenario.zeromq.high_water_mark,
        )

    def _look_after(self, robot: RobotAgent) -> None:
        """Update power, motors and friction of the floor, once a second."""
        now = self._stage.clock.now
        body = robot.body
        self._world.advance_to(now)
        robot.power(robot.charge > 0.0)
        # What motors of a user got wrong is counted, and the first time told.
        device = robot.device
        failures = robot.body.motors.failures
        counted = self._failures.get(device.label, 0)
        if failures > counted:
            device.recorder.counters["failed: an answer of a drive"] += failures - counted
            self._failures[device.label] = failures
            if not counted:
                device.tell(
                    f"is held back, as its drive fails: {robot.body.motors.first_failure}", "mode"
                )
        if self._around.may_be_wet:
            wet = self._around.at(body.x, body.y, now).water > SLIPPERY_DEPTH_M
            body.grip = WET_GRIP if wet else GRIP

    def add_guard(self, number: int) -> GuardAgent | PersonGuard:
        """Return the `number`-th guard, at its post; it registers and is on duty.

        Raises:
            ConfigError: there is no place so far from the event, or something is in its way.
        """
        stage = self._stage
        hazards = self._hazards
        post = self._start("guard", number)
        device = stage.device("guard", number, (post.x, post.y))
        walker = Walker.draw(guard_profile(stage.scenario), stage.streams[f"{device.label}/walker"])
        body = self._world.add_person(device.label, post, radius=walker.habits.walking.radius_m)
        legs = self._legs(body, walker.speed, walker.habits)
        if number in stage.scenario.guard.persons:
            return self._played(device, walker, legs)
        guard = GuardAgent(
            device,
            walker,
            stage.planner,
            legs,
            is_there=hazards.is_there,
            contain=hazards.contain,
            air=self._air,
            refuges=self._refuges,
            smoke=hazards.smoke,
        )
        device.register(guard.start)
        return guard

    def _played(self, device: AgentDevice, walker: Walker, legs: Walking) -> PersonGuard:
        """Return a guard that a person can take over and play."""
        guard = PersonGuard(
            device,
            walker,
            self._stage.planner,
            legs,
            put=lambda x, y: self._world.put(legs.body, x, y),
            contain=self._hazards.contain,
            air=self._air,
        )
        device.register(guard.start)
        return guard

    def add_bystander(self, number: int) -> BystanderAgent:
        """Return the `number`-th bystander, at the first of its places, at work.

        Raises:
            ConfigError: the site has no room for it.
        """
        stage = self._stage
        name = f"bystander-{number}"
        rng = stage.streams[f"{name}/who"]
        occupant = Occupant.draw(bystander_profile(stage.scenario), rng)
        places = self._places(name)
        habits = occupant.habits
        body = self._world.add_person(name, Pose(*places[0], 0.0), radius=habits.walking.radius_m)
        bystander = BystanderAgent(
            name,
            stage.clock,
            occupant,
            self._legs(body, occupant.speed, habits),
            planner=stage.planner,
            places=places,
            refuges=self._refuges,
            rng=stage.streams[f"{name}/walks"],
            air=self._air,
            sees=self._sees_flames,
            leaves=lambda: self._world.remove(body),
            tell=lambda what: stage.recorder.tell(stage.clock.now, name, what, "person"),
        )
        bystander.start()
        return bystander

    def _legs(self, body: PersonBody, speed: float, habits: OnFootHabits) -> Walking:
        stage = self._stage
        return Walking(
            stage.clock,
            stage.planner,
            self._world,
            body,
            speed=speed,
            doors=stage.site.doors,
            habits=habits,
        )

    def _places(self, name: str) -> list[Point]:
        """Return the places where a bystander works; nobody is at the first one yet."""
        stage = self._stage
        starts = (*stage.site.guard_posts, *stage.site.robot_bases)
        taken = [*((pose.x, pose.y) for pose in starts), *self._first_places]
        try:
            places = draw_places(stage.site, stage.streams[f"{name}/places"], PLACES, taken)
        except ConfigError as error:
            count = len(self._first_places)
            raise ConfigError(f"{error}; {count} bystanders found one") from None
        self._first_places.append(places[0])
        return places

    def _sees_flames(self, x: float, y: float, time: float) -> bool:
        sees = self._stage.planner.line_of_sight
        return any(
            spot.shines
            and math.dist((x, y), (spot.x, spot.y)) < FLAMES_SEEN
            and sees((x, y), (spot.x, spot.y))
            and self._around.optical_depth((x, y), (spot.x, spot.y), time) < FLAMES_THROUGH
            for spot in self._hazards.spots(time)
        )

    # --- where they begin ----------------------------------------------------------------

    def _start(self, kind: str, number: int) -> Pose:
        """Return where the `number`-th robot begins and is charged, or the `number`-th guard waits.

        Raises:
            ConfigError: there is no place so far from the event as it is to begin.
        """
        scenario = self._stage.scenario
        site = self._stage.site
        if kind == "robot":
            distance = scenario.robot.way_m
            places = site.robot_bases
        else:
            distance = scenario.guard.way_m
            places = site.guard_posts
        return places[number - 1] if distance is None else self._away(f"{kind}-{number}", distance)

    def _away(self, label: str, length: float) -> Pose:
        """Return a pose at a distance [m] from the event, facing along the path there."""
        site = self._stage.site
        rng = self._stage.streams.fresh(f"{label}/start")
        goal = self._hazards.incidents[0].hazard.position
        longest = 0.0
        for _ in range(TRIES):
            path = self._stage.planner.path(site.sample_free(rng, FOOTPRINT), goal)
            if path is None:
                continue
            longest = max(longest, float(np.hypot(*np.diff(path, axis=0).T).sum()))
            pose = _cut(path, length)
            if pose is not None and self._is_free(pose):
                self._taken.append((pose.x, pose.y))
                return pose
        problem = f"site {site.name!r} has no place {length:g} m from the event for {label}"
        if longest < length:
            raise ConfigError(f"{problem}; the longest way tried was {longest:.0f} m")
        without = f"without {label.partition('-')[0]}.way_m they begin anywhere"
        raise ConfigError(f"{problem}; {len(self._taken)} of the team found one; {without}")

    def _is_free(self, pose: Pose) -> bool:
        here = pose.x, pose.y
        alone = all(math.dist(here, other) >= START_GAP_M for other in self._taken)
        return alone and self._stage.site.is_free(*here, FOOTPRINT)


class Power:
    """A robot's battery, if it has one, and the base that charges it.

    Args:
        charge: Share of the capacity that it begins with.
        body: Says how far it went, and what that took.
        base: Pose of its charging base.
        clock: The run's.
    """

    def __init__(
        self, profile: RobotProfile, charge: float, body: RobotBody, base: Pose, clock: Clock
    ) -> None:
        self._battery = None
        if profile.battery is not None:
            self._battery = Battery(profile.battery, profile.mass_kg, charge)
        self._body = body
        self._base = base
        self._clock = clock

    def share(self) -> float:
        """Return the remaining share of the capacity; 1 without a battery."""
        battery = self._battery
        body = self._body
        if battery is None:
            return 1.0
        near = math.dist((body.x, body.y), (self._base.x, self._base.y)) < CHARGING_WITHIN_M
        at_base = near and abs(body.speed) < STANDING
        battery.advance(self._clock.now, body.distance, body.work, at_base)
        return battery.share


def _cut(path: NDArray[np.float64], left: float) -> Pose | None:
    """Return the pose at a distance [m] before the end of a path `(n, 2)`; None if too short."""
    steps = np.hypot(*np.diff(path, axis=0).T)
    gone = np.concatenate([[0.0], np.cumsum(steps)])
    at = float(gone[-1]) - left
    if at < 0.0:
        return None
    index = min(int(np.searchsorted(gone, at, side="right")) - 1, len(steps) - 1)
    x, y = path[index]
    ahead = path[index + 1] - path[index]
    share = (at - gone[index]) / steps[index] if steps[index] > 0.0 else 0.0
    heading = math.atan2(ahead[1], ahead[0])
    return Pose(float(x + share * ahead[0]), float(y + share * ahead[1]), heading)
