"""Robots that drive missions in real physics, each with its own map, without any network."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache

from dva_sim.agents.observation import Observation
from dva_sim.agents.robot.field_of_view import FieldOfView, HazardSpot
from dva_sim.agents.robot.loops import Surrounded
from dva_sim.agents.robot.manoeuvres import Sensed
from dva_sim.agents.robot.missions import PERIOD, MissionGoal, Pilot, PilotStep
from dva_sim.kernel.clock import Clock
from dva_sim.worlds.bodies import RobotBody
from dva_sim.worlds.drives import DriveSpec
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.physics import PersonBody, World
from dva_sim.worlds.planning import Planner
from dva_sim.worlds.site import Site, load_site

Point = tuple[float, float]
CAMERA_ANGLE, CAMERA_RANGE = math.radians(70.0), 6.0
EMPTY = MissionGoal(((0.0, 0.0),))  # for a robot that somebody else drives


@cache
def caparica() -> Site:
    return load_site("caparica")


@cache
def map_of_caparica(clearance: float = 0.30) -> Planner:
    return Planner(caparica(), clearance)


@dataclass
class Robot:
    """One robot of a fleet, and what became of it."""

    body: RobotBody
    around: Surrounded
    pilot: Pilot
    steps: list[tuple[float, PilotStep]] = field(default_factory=list)
    speeds: list[float] = field(default_factory=list)

    @property
    def here(self) -> Point:
        return self.body.x, self.body.y

    @property
    def over(self) -> bool:
        return bool(self.steps) and self.steps[-1][1].state in ("done", "failed")

    @property
    def end(self) -> tuple[str, str]:
        """State and reason of what was told last."""
        step = self.steps[-1][1]
        return step.state, step.reason

    def states(self) -> list[str]:
        return [step.state for _, step in self.steps]

    def reasons(self) -> set[str]:
        return {step.reason for _, step in self.steps}

    def when(self, state: str) -> float:
        return next(time for time, step in self.steps if step.state == state)


class Fleet:
    """A world in which each robot looks ten times a second and does what its pilot says.

    Args:
        site: Site of the world; the robots' map is always that of caparica.
        charge: Charge of all batteries, at a time [s].
    """

    def __init__(
        self, site: Site | None = None, charge: Callable[[float], float] = lambda now: 1.0
    ) -> None:
        self.world = World(site or caparica(), 0.04)
        self.now = 0.0
        self.robots: list[Robot] = []
        self.hazards: list[HazardSpot] = []
        self.gaps: list[float] = []
        self._charge = charge

    def robot(
        self,
        number: int,
        start: tuple[float, float, float],
        errand: MissionGoal,
        spec: DriveSpec | None = None,
    ) -> Robot:
        """Robot number so-and-so, with an errand."""
        body = self.world.add_robot(f"robot-{number}", spec or DriveSpec(), Pose(*start))
        planner = map_of_caparica(body.radius)
        around = Surrounded(Clock(), self.world, body, planner)
        pilot = Pilot(
            errand,
            planner,
            around.guard,
            name=body.name,
            reach=around.reach,
            turning_radius=body.motors.turning_radius,
        )
        robot = Robot(body, around, pilot)
        self.robots.append(robot)
        return robot

    def parked(self, number: int, x: float, y: float) -> RobotBody:
        return self.world.add_robot(f"robot-{number}", DriveSpec(), Pose(x, y, 0.0))

    def person(self, x: float, y: float, vx: float = 0.0, vy: float = 0.0) -> PersonBody:
        person = self.world.add_person(f"person-{len(self.world.people) + 1}", Pose(x, y, 0.0))
        person.walk(vx, vy)
        return person

    def run(self, seconds: float, each: Callable[[], object] = lambda: None) -> None:
        """Let time pass until all errands are over."""
        end = self.now + seconds
        while self.now < end and not (self.robots and all(r.over for r in self.robots)):
            self.world.advance_to(self.now)
            each()
            for robot in self.robots:
                self._step(robot)
            self._measure()
            self.now = round(self.now + PERIOD, 6)
        self.world.advance_to(self.now)

    def _step(self, robot: Robot) -> None:
        robot.speeds.append(robot.body.speed)
        if robot.over:
            return
        step = robot.pilot.step(self._seen(robot))
        robot.body.drive(*step.intent, self.now + 2 * PERIOD)
        if not robot.steps or robot.steps[-1][1][1:] != step[1:]:
            robot.steps.append((self.now, step))

    def _seen(self, robot: Robot) -> Sensed:
        body, pose = robot.body, robot.body.pose()
        sees = map_of_caparica().line_of_sight
        view = FieldOfView(CAMERA_ANGLE, CAMERA_RANGE, sees)
        hazards = view.look(pose.x, pose.y, pose.heading, self.hazards)
        seen = Observation(0, *pose, body.speed, body.turn_rate, hazards)
        nearby = robot.around.nearby()
        return Sensed(self.now, seen, nearby, body.jammed, self._charge(self.now))

    def _measure(self) -> None:
        """The smallest gap between any two that move about."""
        bodies = [*self.world.robots, *self.world.people]
        pairs = ((a, b) for i, a in enumerate(bodies) for b in bodies[:i])
        gaps = [math.dist((a.x, a.y), (b.x, b.y)) - a.radius - b.radius for a, b in pairs]
        self.gaps.append(min(gaps, default=math.inf))
