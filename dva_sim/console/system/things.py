"""Everybody whom pages show, with the numbers that other lines call them by."""

from __future__ import annotations

import math
from typing import Final

from dva_sim.console.wire.scenes import CameraShown, ThingBody, ThingShown
from dva_sim.simulation.scenario.parts import CameraConfig

# As those are drawn of whom nobody has said more than that they are there.
UNKNOWN_ROBOT: Final[ThingBody] = {
    "radius_m": 0.3,
    "max_speed_mps": 0.5,
    "max_turn_rate_radps": math.pi / 6,
}
UNKNOWN_PERSON: Final[ThingBody] = {"radius_m": 0.25}


class Things:
    """All of them.

    Attributes:
        all: In the order of their numbers.
        numbers: By id, and by label.
    """

    def __init__(self) -> None:
        self.all: list[ThingShown] = []
        self.numbers: dict[str, int] = {}

    def add(self, id_tag: str, label: str, kind: str, body: ThingBody | None = None) -> None:
        """Add somebody, who may be called by the label, too."""
        self.add_foreign(id_tag, label, kind, body)
        self.numbers[label] = self.numbers[id_tag]

    def add_foreign(
        self, id_tag: str, label: str, kind: str, body: ThingBody | None = None
    ) -> None:
        """Add somebody whose label may be that of another one."""
        number = len(self.all)
        more = body or {}
        self.all.append({"i": number, "id": id_tag, "label": label, "kind": kind, **more})
        self.numbers[id_tag] = number

    def learn(self, id_tag: str, body: ThingBody) -> None:
        """Learn more of somebody."""
        number = self.numbers[id_tag]
        self.all[number] = {**self.all[number], **body}

    def rename(self, id_tag: str, label: str) -> None:
        """Give somebody another label."""
        self.all[self.numbers[id_tag]]["label"] = label


def camera_shown(camera: CameraConfig) -> CameraShown:
    """Return the camera of all robots of a scenario."""
    return {
        "field_of_view_deg": camera.field_of_view_deg,
        "range_m": camera.range_m,
        "rate_hz": camera.rate_hz,
        "frame_bytes": camera.frame_bytes,
    }
