"""What stands about before a camera: people, robots, fires, leaking bottles."""

from __future__ import annotations

import math
from typing import NamedTuple

from dva_sim.worlds.camera_picture import sprites
from dva_sim.worlds.hazards.fire import HEAT_PER_AREA


class Figure(NamedTuple):
    """Somebody or something that moves, as a camera may see it.

    Attributes:
        kind: `robot`, `guard` or `bystander`.
        x: East [m].
        y: North [m].
        heading: Where it faces [rad].
        number: Tells persons apart by their looks.
        lying: Whether a person lies on the floor.
    """

    kind: str
    x: float
    y: float
    heading: float = 0.0
    number: int = 1
    lying: bool = False


class Spot(NamedTuple):
    """Where something burns, leaks or floods: kind, place and radius [m]."""

    kind: str
    x: float
    y: float
    radius: float


def sprite_of(
    thing: Figure | Spot, bearing: float, ceiling: float, time: float
) -> sprites.Sprite | None:
    """How something looks from where the lens is; a flood has nothing that stands.

    Args:
        thing: What.
        bearing: Of the line from the lens to it [rad].
        ceiling: Flames end there [m].
        time: Lets flames flicker [s].
    """
    if isinstance(thing, Spot):
        if thing.kind == "gas_leak":
            return sprites.bottle()
        return _fire(thing, ceiling, time) if thing.kind == "fire" else None
    view = sprites.view_of(thing.heading, bearing)
    if thing.kind == "robot":
        return sprites.robot(view)
    guard = thing.kind == "guard"
    if thing.lying:
        return sprites.lying(thing.number, guard)
    return sprites.person(view, thing.number, guard)


def _fire(fire: Spot, ceiling: float, time: float) -> sprites.Sprite:
    """Flames as wide as what burns, as high as its heat makes them.

    References:
        G. Heskestad, Fire Safety Journal 5 (1983) 103-108: L = 0.235 Q^(2/5) - 1.02 D, with
        the heat release Q [kW] and the diameter D [m].
    """
    heat = HEAT_PER_AREA * math.pi * fire.radius**2
    tall = 0.235 * heat**0.4 - 2.04 * fire.radius
    # Tongues leap higher than the mean; the smallest fire can still be seen.
    size = max(0.45, 2.2 * fire.radius), min(ceiling, max(0.45, 1.25 * tall))
    frame = int(time * sprites.FLAME_RATE + 3 * fire.x) % sprites.FLAME_FRAMES
    return sprites.flames(frame)._replace(size=size)
