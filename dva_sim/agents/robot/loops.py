"""Periodic work of a robot: missions, and the guard around its driver."""

from __future__ import annotations

from collections.abc import Callable

from dva_sim.agents.observation import Observation
from dva_sim.agents.robot.collision_guard import CollisionGuard, Nearby, who_is_near
from dva_sim.agents.robot.controller import (
    TELEOPERATION,
    Mission,
    Mode,
    RobotController,
    TimedSetPoint,
)
from dva_sim.agents.robot.manoeuvres import Sensed
from dva_sim.agents.robot.missions import PERIOD, MissionGoal, Pilot
from dva_sim.agents.route_following import Reach
from dva_sim.kernel.clock import Clock
from dva_sim.worlds.bodies import RobotBody
from dva_sim.worlds.geo import GeoFrame
from dva_sim.worlds.physics import World
from dva_sim.worlds.planning import Planner

SENSOR_REACH = 8.0  # maximum distance at which others are seen [m]; assumed, as for the lidar


class Surrounded:
    """Body of a robot and its surroundings, as its loops observe and move them.

    Args:
        clock: The run's clock.
        world: The physics.
        body: The robot's own.
        planner: Planner with the map of the site.
    """

    def __init__(self, clock: Clock, world: World, body: RobotBody, planner: Planner) -> None:
        self.clock = clock
        self.world = world
        self.body = body
        self.planner = planner
        spec = body.spec
        self.guard = CollisionGuard(body.radius, spec.max_deceleration, planner.room_at)
        self.reach = Reach(spec.max_speed, spec.max_turn_rate)

    def nearby(self) -> tuple[Nearby, ...]:
        """Return the bodies in sight now."""
        return who_is_near(self.world, self.body, SENSOR_REACH, self.planner.line_of_sight)


class CollisionGuardedDrive:
    """Drive that obeys set points as far as the collision guard allows, checked periodically.

    Args:
        around: The robot and its surroundings.
        controller: Controller, which knows whether the robot is still driven.
    """

    def __init__(self, around: Surrounded, controller: RobotController) -> None:
        self._around = around
        self._controller = controller
        self._wanted = TimedSetPoint(0.0, 0.0, 0.0)
        self._looking = False

    def take(self, set_point: TimedSetPoint) -> None:
        """Take a new set point: in force at once, and guarded until it expires."""
        self._wanted = set_point
        if self._looking:
            self._apply()
        else:
            self._looking = True
            self._around.clock.every(PERIOD, self._look)

    def _look(self) -> bool:
        driven = self._controller.mode is TELEOPERATION
        self._looking = driven and self._around.clock.now < self._wanted.until
        if self._looking:
            self._apply()
        return self._looking

    def _apply(self) -> None:
        around = self._around
        speed, turn_rate, until = self._wanted
        around.world.advance_to(around.clock.now)
        slower = around.guard.limit(around.body.pose(), speed, turn_rate, around.nearby())
        around.body.drive(slower, turn_rate, until)


class MissionLoop:
    """Loop that drives missions, one at a time.

    Args:
        around: The robot and its surroundings.
        controller: Controller that receives the state of the mission.
        observe: Function that returns the current observation.
        charge: Share of the battery's charge that is left.
        on_news: Callback when the state of the mission changes.
    """

    def __init__(
        self,
        around: Surrounded,
        controller: RobotController,
        observe: Callable[[], Observation],
        charge: Callable[[], float],
        on_news: Callable[[], object],
    ) -> None:
        self._around = around
        self._controller = controller
        self._observe = observe
        self._charge = charge
        self._on_news = on_news
        self._base = around.body.x, around.body.y
        self._number = 0

    def begin(self, mission: Mission, frame: GeoFrame) -> None:
        """Drive a mission until it ends, or the robot gets another order."""
        body = self._around.body
        around = self._around
        errand = MissionGoal.of(mission, frame.to_xy, self._base)
        pilot = Pilot(
            errand,
            around.planner,
            around.guard,
            name=body.name,
            reach=around.reach,
            turning_radius=body.motors.turning_radius,
        )
        self._number += 1
        number = self._number

        def step() -> bool:
            if self._controller.mode is not Mode.MISSION or number != self._number:
                return False  # stopped, or another mission has begun since
            step = pilot.step(self._look())
            # Valid for two periods: if the loop ends, the motors stop by themselves.
            self._around.body.drive(*step.intent, self._around.clock.now + 2 * PERIOD)
            if self._controller.mission_changed(step.state, step.left, step.reason):
                self._on_news()
            return True

        around.clock.every(PERIOD, step)

    def _look(self) -> Sensed:
        view = self._observe()
        around = self._around
        return Sensed(around.clock.now, view, around.nearby(), around.body.jammed, self._charge())
