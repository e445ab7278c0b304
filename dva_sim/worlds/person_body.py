"""A person's body: legs push it towards the velocity that is wanted."""

from __future__ import annotations

import math
from typing import Final

import pymunk

from dva_sim.worlds.bodies import (
    AT_REST,
    PERSON,
    ROBOT,
    Asked,
    Body,
    Timing,
    set_force,
    set_velocity,
)
from dva_sim.worlds.geo import Pose

RELAXATION: Final = 0.5  # of a person's velocity towards the wanted one [s]
MOST_PUSH: Final = 3.0  # force of a person's legs by mass [m/s^2]; assumed


class PersonBody(Body):
    """A person seen from above, a disc that walks any way; made by `World.add_person`.

    Legs push towards the wanted velocity as in the model of social forces, with bounded force;
    whom to keep clear of is for the walker to decide.

    References:
        D. Helbing, P. Molnar: Social force model for pedestrian dynamics. Physical Review E
        51(5), 1995: relaxation time 0.5 s.
    """

    kind = PERSON

    def __init__(self, world: Timing, name: str, pose: Pose, radius: float, mass: float) -> None:
        body = pymunk.Body(mass, math.inf)
        body.position = pose.x, pose.y
        shape = pymunk.Circle(body, radius)
        # Who brushes past a wall or somebody else is not held back.
        shape.friction, shape.elasticity, shape.collision_type = 0.0, 0.0, self.kind
        super().__init__(world, name, body, shape)
        self.radius, self._mass, self._circle = radius, mass, shape
        self._asked = Asked((0.0, 0.0))

    def walk(self, vx: float, vy: float) -> None:
        """Want to walk with this velocity [m/s] from the next tick on, until told otherwise.

        Raises:
            ValueError: it is not finite.
        """
        if not (math.isfinite(vx) and math.isfinite(vy)):
            raise ValueError(f"{self.name} cannot walk at {vx} m/s, {vy} m/s")
        self._asked.put(self._world.next_tick(), (vx, vy))
        self._world.wake(self)

    def take_up(self, radius: float) -> None:
        """Be so wide from now on [m]: who turns sideways fits through a narrower gap."""
        self.radius = radius
        self._circle.unsafe_set_radius(radius)

    def push(self, tick: int, dt: float) -> bool:
        """Apply the force of the legs for one tick; False if the person stands and shall stand."""
        wx, wy = self._asked.at(tick)
        vx, vy = self.velocity
        if wx == wy == 0.0 and abs(vx) + abs(vy) < AT_REST:
            set_velocity(self._raw, (0.0, 0.0))
            return bool(self._asked.coming)
        ax, ay = (wx - vx) / RELAXATION, (wy - vy) / RELAXATION
        asked = math.hypot(ax, ay)
        share = self._mass * min(1.0, MOST_PUSH / asked) if asked > 0.0 else 0.0
        set_force(self._raw, (ax * share, ay * share))
        return True

    def meets(self, other: Body | None, now: float) -> None:
        """It begins to touch somebody, or a wall (None)."""
        if other is not None and other.kind == ROBOT:
            self._touch.begin(now)

    def parts(self, other: Body | None, now: float) -> None:
        """It touches somebody, or a wall (None), no longer."""
        if other is not None and other.kind == ROBOT:
            self._touch.end(now)

    def feels(self, other: Body | None, impulse: float) -> None:
        """A contact with somebody, or a wall (None), has stopped or pushed it [N s]."""
        self._world.wake(self)
        if other is not None and other.kind == ROBOT:
            self.impulse += impulse
