"""Bodies that people walk with: those of the physics, and free ones where there is none."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, Protocol

from dva_sim.kernel.clock import Clock

RADIUS: Final = 0.2
"""Of the disc that stands for a person, seen from above [m]: as much floor as an ellipse of
0.46 m by 0.28 m, and a little more; assumed."""
SIDEWAYS: Final = 0.12  # half as deep as a chest: of who squeezes through a gap; assumed [m]


class Body(Protocol):
    """What is walked with, or walked around."""

    @property
    def x(self) -> float:
        """Position [m]."""

    @property
    def y(self) -> float:
        """Position [m]."""

    @property
    def velocity(self) -> tuple[float, float]:
        """Along x and y [m/s]."""

    @property
    def radius(self) -> float:
        """Of the circle around it [m]."""


class Legs(Body, Protocol):
    """A body that does what its owner wants, as far as it can."""

    def walk(self, vx: float, vy: float) -> None:
        """Want to walk with this velocity [m/s] until told otherwise."""

    def take_up(self, radius: float) -> None:
        """Be so wide from now on [m]."""


class Ground(Protocol):
    """Where one walks: the physics, or open ground without any."""

    def advance_to(self, time: float) -> None:
        """Let everybody move up to `time` [s]."""

    def neighbours(self, x: float, y: float, within: float) -> Sequence[tuple[Body, float]]:
        """Who is near a point, and how far away, the nearest first [m]."""


class FreeBody:
    """A body that nothing stops: it has at once the velocity that is wanted.

    Args:
        clock: Tells for how long it has moved.
        x: First position [m].
        y: First position [m].
    """

    def __init__(self, clock: Clock, x: float, y: float) -> None:
        self._clock, self._since = clock, clock.now
        self._x, self._y, self.radius = x, y, RADIUS
        self.velocity = 0.0, 0.0

    @property
    def x(self) -> float:
        """See `Body`."""
        return self._x + self.velocity[0] * (self._clock.now - self._since)

    @property
    def y(self) -> float:
        """See `Body`."""
        return self._y + self.velocity[1] * (self._clock.now - self._since)

    def walk(self, vx: float, vy: float) -> None:
        """See `Legs`."""
        self._x, self._y, self._since = self.x, self.y, self._clock.now
        self.velocity = vx, vy

    def take_up(self, radius: float) -> None:
        """See `Legs`."""
        self.radius = radius


class OpenGround:
    """Ground without physics, for who walks alone.

    Attributes:
        bodies: Who is there.
    """

    def __init__(self) -> None:
        self.bodies: list[Body] = []

    def advance_to(self, time: float) -> None:
        """See `Ground`: free bodies move by themselves."""

    def neighbours(self, x: float, y: float, within: float) -> list[tuple[Body, float]]:
        """See `Ground`."""
        found = [(body, math.dist((body.x, body.y), (x, y))) for body in self.bodies]
        return sorted((f for f in found if f[1] <= within), key=lambda f: f[1])
