"""The people of a run who are on foot: guards, and bystanders, in the same physics and air."""

from __future__ import annotations

import math
from collections.abc import Callable

from dva_sim.agents.people.bystander import BystanderAgent, draw_places
from dva_sim.agents.people.evacuation import AirAt, clean_air, refuges_of
from dva_sim.agents.people.guard import GuardAgent
from dva_sim.agents.people.pedestrian_avoidance import RADIUS
from dva_sim.agents.people.profiles import Occupant, Walker
from dva_sim.agents.people.walking import Walking
from dva_sim.agents.robot.field_of_view import HazardSpot
from dva_sim.simulation.full.robots import Starts
from dva_sim.simulation.full.stage import Stage
from dva_sim.simulation.scenario import bystander_profile, guard_profile
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.hazards import Surroundings
from dva_sim.worlds.physics import PersonBody, World

PLACES = 3  # where a bystander works, by turns
FLAMES_SEEN = 15.0  # from so far, if nothing stands between and smoke lets one see [m]
FLAMES_THROUGH = 8.0  # optical depth at which what shines is lost in smoke (T. Jin, SFPE Handbook)

Point = tuple[float, float]


class People:
    """Makes guards and bystanders.

    Args:
        stage: Where.
        world: The physics.
        around: The hazards.
        spots: What can be seen of them, at a time [s].
        is_there: Whether something of a kind really is near a place [m].
        contain: Told of what kind is dealt with near a place [m].
        starts: Where guards wait.
    """

    def __init__(
        self,
        stage: Stage,
        world: World,
        around: Surroundings,
        spots: Callable[[float], list[HazardSpot]],
        is_there: Callable[[str, float, float], bool],
        contain: Callable[[str, float, float], object],
        starts: Starts,
    ) -> None:
        self._stage, self._world, self._around, self._spots = stage, world, around, spots
        self._is_there, self._contain, self._starts = is_there, contain, starts
        self._air: AirAt = around.at if around.has_any else clean_air
        self._refuges = refuges_of(stage.site)
        self._first_places: list[Point] = []

    def add_guard(self, number: int) -> GuardAgent:
        """The `number`-th guard, at its post; it registers and is on duty.

        Raises:
            ConfigError: the site has no post for it.
        """
        stage = self._stage
        post = self._starts.of_guard(number)
        device = stage.device("guard", number)
        walker = Walker.draw(guard_profile(stage.scenario), stage.streams[f"{device.label}/walker"])
        body = self._world.add_person(device.label, post, radius=RADIUS)
        guard = GuardAgent(
            device,
            walker,
            stage.planner,
            self._legs(body, walker.speed),
            is_there=self._is_there,
            contain=self._contain,
            air=self._air,
            refuges=self._refuges,
            smoke=self._smoke,
        )
        device.register(guard.start)
        return guard

    def add_bystander(self, number: int) -> BystanderAgent:
        """The `number`-th bystander, at the first of its places, at work.

        Raises:
            ConfigError: the site has no room for it.
        """
        stage, name = self._stage, f"bystander-{number}"
        luck = stage.streams[f"{name}/who"]
        occupant = Occupant.draw(bystander_profile(stage.scenario), luck)
        places = self._places(name)
        body = self._world.add_person(name, Pose(*places[0], 0.0), radius=RADIUS)
        bystander = BystanderAgent(
            name,
            stage.clock,
            occupant,
            self._legs(body, occupant.speed),
            planner=stage.planner,
            places=places,
            refuges=self._refuges,
            luck=stage.streams[f"{name}/walks"],
            air=self._air,
            sees=self._sees_flames,
            leaves=lambda: self._world.remove(body),
            tell=lambda what: stage.recorder.tell(stage.clock.now, name, what, "person"),
        )
        bystander.start()
        return bystander

    def _legs(self, body: PersonBody, speed: float) -> Walking:
        stage = self._stage
        return Walking(
            stage.clock, stage.planner, self._world, body, speed=speed, doors=stage.site.doors
        )

    def _places(self, name: str) -> list[Point]:
        """Where a bystander works; at the first nobody stands yet."""
        stage = self._stage
        starts = (*stage.site.guard_posts, *stage.site.robot_bases)
        taken = [*((pose.x, pose.y) for pose in starts), *self._first_places]
        places = draw_places(stage.site, stage.streams[f"{name}/places"], PLACES, taken)
        self._first_places.append(places[0])
        return places

    def _smoke(self, a: Point, b: Point) -> float:
        return self._around.optical_depth(a, b, self._stage.clock.now)

    def _sees_flames(self, x: float, y: float, time: float) -> bool:
        sees = self._stage.planner.line_of_sight
        return any(
            spot.shines
            and math.dist((x, y), (spot.x, spot.y)) < FLAMES_SEEN
            and sees((x, y), (spot.x, spot.y))
            and self._around.optical_depth((x, y), (spot.x, spot.y), time) < FLAMES_THROUGH
            for spot in self._spots(time)
        )
