"""Hazards for a map: where they are, and what they make of the air and the floor, coarsely."""

from __future__ import annotations

import base64
import math
import time
from collections.abc import Mapping, Sequence

import numpy as np

from dva_sim.console.wire.events import FieldShown, HazardShown, HazardsLine
from dva_sim.simulation.full.hazards import RunHazard
from dva_sim.worlds.hazards import QUANTITIES, Surroundings
from dva_sim.worlds.site import Site

MAX_CELLS = 20_000  # of one field
MIN_CELL = 0.5  # side [m]
SHARE = 0.05  # of a core that sampling may take: it is done so much the rarer
FULL = {"smoke": 3.0, "gas": 0.1, "water": 0.2, "heat": 10.0}  # what 255 means; see `QUANTITIES`


class HazardFeed:
    """Positions and extents of hazards.

    Args:
        incidents: The hazards of a run.
        surroundings: Effect of the hazards on air and floor.
        contained: Time at which incidents are contained [s], by their index in `incidents`.
    """

    def __init__(
        self,
        site: Site,
        incidents: Sequence[RunHazard],
        surroundings: Surroundings,
        contained: Mapping[int, float],
    ) -> None:
        self._incidents = incidents
        self._surroundings = surroundings
        self._contained = contained
        west, south, east, north = site.extent
        area = max(1.0, (east - west) * (north - south))
        self._cell = max(MIN_CELL, math.ceil(10 * math.sqrt(area / MAX_CELLS)) / 10)
        kinds = {what for i in incidents if not i.false_alarm for what in i.hazard.shows}
        self._kinds = [kind for kind in QUANTITIES if kind in kinds]
        self._fields: list[FieldShown] = []
        self._next = 0.0

    def line(self, now_ms: int) -> HazardsLine:
        """Return the hazards as they are now."""
        now = now_ms / 1000.0
        hazards = list[HazardShown]()
        for number, incident in enumerate(self._incidents):
            if not incident.is_there(now):
                continue
            hazard = incident.hazard
            hazards.append(
                {
                    "n": number,
                    "kind": incident.kind,
                    "x_m": round(hazard.position[0], 2),
                    "y_m": round(hazard.position[1], 2),
                    "radius_m": round(hazard.radius(now), 2),
                    "severity": round(hazard.severity(now), 2),
                    "contained": self._contained.get(number, math.inf) <= now,
                }
            )
        return {"k": "hazards", "t": now_ms, "hazards": hazards, "fields": self._sampled(now)}

    def _sampled(self, now: float) -> list[FieldShown]:
        """Return the fields, no more often than their cost allows."""
        begun = time.perf_counter()
        if begun >= self._next:
            going = [i for i in self._incidents if i.is_there(now)]
            kinds = [k for k in self._kinds if any(k in i.hazard.shows for i in going)]
            fields = (self._field(kind, now) for kind in kinds)
            self._fields = [field for field in fields if field is not None]
            took = time.perf_counter() - begun
            self._next = begun + took / SHARE
        return self._fields

    def _field(self, kind: str, now: float) -> FieldShown | None:
        values, extent, unit = self._surroundings.raster(kind, now, self._cell)
        cells = np.clip(values * (255.0 / FULL[kind]), 0.0, 255.0).round().astype(np.uint8)
        if not cells.any():
            return None
        return {
            "kind": kind,
            "cell_m": self._cell,
            "x0_m": extent[0],
            "y0_m": extent[2],
            "columns": int(cells.shape[1]),
            "rows": int(cells.shape[0]),
            "cells": base64.b64encode(cells.tobytes()).decode(),
            "full": {"value": FULL[kind], "unit": unit.replace("m2", "m²")},
        }
