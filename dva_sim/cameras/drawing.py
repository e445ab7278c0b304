"""Camera pictures of robots, drawn from the true state when each frame was taken.

Site and hazards are built from the scenario and its seed by the same functions as in the run, so
that a frame consists only of a pose and the figures nearby.
"""

from __future__ import annotations

import io
import math
from collections.abc import Mapping
from typing import Any

from PIL import Image

from dva_sim.agents.people.bystander import INCAPACITATED
from dva_sim.kernel.streams import Streams
from dva_sim.simulation.full.hazards import draw_incidents
from dva_sim.simulation.scenario import Scenario, site_of
from dva_sim.worlds.camera import Camera, Figure, SmokeView
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.hazards import Raster, Surroundings

WIDTH = 320  # width of a picture [pixels]
HEIGHT = 240  # height of a picture [pixels]
WIDEST = 150.0  # field of view that one flat picture can show [deg]
AIR_S = 0.5  # interval at which smoke and water are redrawn [s]
HAZE = 0.005  # extinction below which smoke is invisible [1/m]
BEST = 85  # highest quality of a JPEG
WORST = 20  # lowest quality of a JPEG

Line = dict[str, Any]


class Eyes:
    """The cameras of a run.

    Args:
        scenario: Scenario as sent by the run.
        seed: Random seed of the run.

    Attributes:
        rate: Frame rate of a robot, in virtual time [1/s].
    """

    def __init__(self, scenario: Mapping[str, Any], seed: int) -> None:
        run = Scenario.model_validate(scenario)
        site = site_of(run, seed)
        angle = math.radians(min(WIDEST, run.camera.field_of_view_deg))
        self._camera = Camera(site, WIDTH, HEIGHT, angle)
        self._incidents = draw_incidents(run.events, site, Streams(seed))
        self._real = [n for n, incident in enumerate(self._incidents) if not incident.false_alarm]
        hazards = [self._incidents[number].hazard for number in self._real]
        self._surroundings = Surroundings(site, hazards)
        self._visible = {what for hazard in hazards for what in hazard.shows}
        self._contained: dict[int, float] = {}
        self._air: dict[str, tuple[float, Raster | None]] = {}
        self._encoder = Encoder(run.camera.frame_bytes)
        self.rate = run.camera.rate_hz

    def contain(self, number: int, time: float) -> None:
        """Note that the incident with this index was contained at `time` [s]."""
        if number in self._contained:
            return
        self._contained[number] = time
        if number in self._real:
            self._surroundings.contain(self._real.index(number), time)

    def jpeg(self, frame: Line) -> bytes:
        """Return the picture of a frame."""
        time = frame["captured_ms"] / 1000
        hazards = [
            incident.hazard
            for number, incident in enumerate(self._incidents)
            if incident.is_there(time) and time < self._contained.get(number, math.inf)
        ]
        pixels = self._camera.picture(
            Pose(*frame["pose"]),
            [make_figure(*row) for row in frame["figures"]],
            hazards,
            self._smoke(time),
            self._raster("water", time),
            time,
        )
        return self._encoder.encode(Image.fromarray(pixels))

    def _smoke(self, time: float) -> SmokeView | None:
        mean = self._raster("smoke", time)
        layer = None if mean is None else self._raster("layer", time)
        return None if mean is None or layer is None else SmokeView(mean, layer)

    def _raster(self, what: str, time: float) -> Raster | None:
        """Return visible smoke or water, computed once for all robots; None if there is none."""
        if ("smoke" if what == "layer" else what) not in self._visible:
            return None
        tick = math.floor(time / AIR_S) * AIR_S
        cached = self._air.get(what)
        if cached is None or cached[0] != tick:
            raster = self._surroundings.raster(what, tick)
            cached = tick, raster if float(raster.values.max(initial=0.0)) > HAZE else None
            self._air[what] = cached
        return cached[1]


def make_figure(kind: str, index: int, x: float, y: float, heading: float, activity: str) -> Figure:
    """Return the figure of a person or robot near the camera."""
    return Figure(kind, x, y, heading, number=index, lying=activity == INCAPACITATED)


class Encoder:
    """Encodes JPEGs of about the same size as the run's modelled frames.

    Args:
        limit: Size of a frame [B]; pictures stay below it where their quality allows.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self.quality = BEST

    def encode(self, image: Image.Image) -> bytes:
        """Return a picture as JPEG; encode it again while it is too large, at a lower quality."""
        data = self._at(image, self.quality)
        while len(data) > self._limit and self.quality > WORST:
            self.quality = max(WORST, self.quality - 10)
            data = self._at(image, self.quality)
        if len(data) < 0.7 * self._limit:
            self.quality = min(BEST, self.quality + 1)
        return data

    @staticmethod
    def _at(image: Image.Image, quality: int) -> bytes:
        file = io.BytesIO()
        image.save(file, "JPEG", quality=quality)
        return file.getvalue()
