"""The picture a robot's camera takes: a quick 2.5-D ray-cast with walls, doors, people, hazards.

It may import sites and hazards. Begin with `raycast.py`.
"""

from dva_sim.worlds.camera.picture import Camera, encode
from dva_sim.worlds.camera.sprites import Figure
from dva_sim.worlds.camera.visibility import SmokeView

__all__ = ["Camera", "Figure", "SmokeView", "encode"]
