"""The picture a robot's camera takes: a quick 2.5-D ray-cast with walls, doors, people, hazards.

It may import sites and hazards. Begin with `picture.py`.
"""

from dva_sim.worlds.camera.picture import Camera
from dva_sim.worlds.camera.sprites import Figure
from dva_sim.worlds.camera.visibility import SmokeView

__all__ = ["Camera", "Figure", "SmokeView"]
