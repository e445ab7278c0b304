"""The picture a robot's camera takes: a quick 2.5-D ray-cast with walls, doors, people, hazards."""

from dva_sim.worlds.camera_picture.air import Smoke
from dva_sim.worlds.camera_picture.camera import Camera, encode
from dva_sim.worlds.camera_picture.things import Figure, Spot

__all__ = ["Camera", "Figure", "Smoke", "Spot", "encode"]
