"""What a robot's-eye picture costs: drawing it, which should take less than 5 ms, and its JPEG."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest

from dva_sim.worlds.camera import Camera, Figure, SmokeView
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.hazards import Raster, make_hazard
from dva_sim.worlds.site import load_site

POSE = Pose(35.0, 16.0, 2.5)
PEOPLE = [Figure("guard", 33.4, 17.6), Figure("bystander", 32.0, 16.0), Figure("robot", 30.0, 16.5)]
FIRE = [make_hazard("fire", (31.5, 18.0), -300.0)]
SCENES: dict[str, dict[str, Any]] = {
    "empty": {},
    "people": {"figures": PEOPLE},
    "fire and smoke": {"figures": PEOPLE, "spots": FIRE, "smoke": True},
    "flood": {"figures": PEOPLE, "water": True},
}


@pytest.mark.parametrize("scene", SCENES)
def test_a_picture_of_320_by_240(benchmark, scene):
    site = load_site("caparica")
    west, south, east, north = site.extent
    options = dict(SCENES[scene])
    air = {
        share: Raster(np.full((96, 160), share), (west, east, south, north), "")
        for share in (0.05, 0.3, 0.6)
    }
    if "smoke" in options:
        options["smoke"] = SmokeView(air[0.3], air[0.6])
    if "water" in options:
        options["water"] = air[0.05]
    camera = Camera(site)
    cost = []
    for _ in range(50):
        started = time.process_time()
        camera.picture(POSE, **options)
        cost.append(time.process_time() - started)
    drawing = np.array(cost) * 1e3
    benchmark.extra_info["median_ms"] = round(float(np.median(drawing)), 2)
    print(f"\n{scene}: {np.median(drawing):.1f} ms of CPU, {drawing.min():.1f} at best")
    benchmark(lambda: camera.picture(POSE, **options))
