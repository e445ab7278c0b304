"""Camera pictures of robots, drawn from the true state when each frame was taken.

The site and the hazards are built from the scenario and its seed by the same functions as those of
the run, so that a frame needs no more than a pose and who was near.
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
        rate: Frames of a robot in a second of the run [1/s].
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
        self._shown = {what for hazard in hazards for what in hazard.shows}
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
            [figure_of(*row) for row in frame["figures"]],
            hazards,
            self._smoke(time),
            self._seen("water", time),
            time,
        )
        return self._encoder.encode(Image.fromarray(pixels))

    def _smoke(self, time: float) -> SmokeView | None:
        mean = self._seen("smoke", time)
        layer = None if mean is None else self._seen("layer", time)
        return None if mean is None or layer is None else SmokeView(mean, layer)

    def _seen(self, what: str, time: float) -> Raster | None:
        """Return the smoke or water, if there is any to be seen; worked out once for all robots."""
        if ("smoke" if what == "layer" else what) not in self._shown:
            return None
        tick = math.floor(time / AIR_S) * AIR_S
        drawn = self._air.get(what)
        if drawn is None or drawn[0] != tick:
            raster = self._surroundings.raster(what, tick)
            drawn = tick, raster if float(raster.values.max(initial=0.0)) > HAZE else None
            self._air[what] = drawn
        return drawn[1]


def figure_of(kind: str, index: int, x: float, y: float, heading: float, activity: str) -> Figure:
    """Return the figure of a person or robot near the camera."""
    return Figure(kind, x, y, heading, number=index, lying=activity == INCAPACITATED)


class Encoder:
    """JPEGs of about as many bytes as the frames of a run have.

    Args:
        most: Bytes of a frame; pictures stay below it if they can.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self.quality = BEST

    def encode(self, image: Image.Image) -> bytes:
        """Return a picture at the quality that suits; after a change of scene it is tried again."""
        data = self._at(image, self.quality)
        while len(data) > self._most and self.quality > WORST:
            self.quality = max(WORST, self.quality - 10)
            data = self._at(image, self.quality)
        if len(data) < 0.7 * self._most:
            self.quality = min(BEST, self.quality + 1)
        return data

    @staticmethod
    def _at(image: Image.Image, quality: int) -> bytes:
        file = io.BytesIO()
        image.save(file, "JPEG", quality=quality)
        return file.getvalue()
