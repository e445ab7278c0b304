"""The picture a robot's camera takes: a quick 2.5-D ray-cast with walls, doors, people, hazards."""

from dva_sim.worlds.camera.raycast import Camera, encode
from dva_sim.worlds.camera.sprites import Figure, Spot
from dva_sim.worlds.camera.visibility import Smoke

__all__ = ["Camera", "Figure", "Smoke", "Spot", "encode"]
