"""A scene and its inhabitants for the fake world: real site, invented lives."""

from __future__ import annotations

import base64
import math
from typing import Any

import numpy as np
import shapely
from fake_phones import DVA_ADDRESS, OFFER

from dva_sim.console.views.scene import RULES, patterns_of, site_of
from dva_sim.worlds.site import Site, load_site

PATTERN = "req-rep"
LINK = {"delay_s": 0.05, "jitter_s": 0.01, "loss": 0.0, "rate_bps": 2e7, "processing_s": 0.05}
MODELLED = {**LINK, "kind": "modelled", "trace": None}
LIMITS = {
    "delay_s": [0, 5],
    "jitter_s": [0, 1],
    "loss": [0, 0.5],
    "rate_bps": [1e4, 1e9],
    "processing_s": [0, 3],
}


class Walker:
    """Somebody who goes to and fro in a room, on straight lines."""

    def __init__(self, index: int, label: str, kind: str, site: Site, rng: Any) -> None:
        self.index, self.label, self.kind = index, label, kind
        self._rng = rng
        rooms = [room for room in site.rooms if shapely.Polygon(room.polygon).area > 8]
        area = shapely.Polygon(rooms[int(rng.integers(len(rooms)))].polygon)
        self._area = area.buffer(-0.6) if not area.buffer(-0.6).is_empty else area
        self.x, self.y = self._place()
        self.heading, self.speed = 0.0, 0.0
        self._goal, self._rest = self._place(), 0.0
        self.fast = 0.4 if kind == "robot" else 1.2
        self.wanted: tuple[float, float] | None = None  # speed, turn rate under a hand
        self.mode, self.battery = "Idle", float(rng.uniform(0.3, 1.0))
        self.pattern = PATTERN

    def _place(self) -> tuple[float, float]:
        left, low, right, high = self._area.bounds
        for _ in range(50):
            x, y = self._rng.uniform(left, right), self._rng.uniform(low, high)
            if shapely.contains_xy(self._area, x, y):
                return float(x), float(y)
        return float(self._area.centroid.x), float(self._area.centroid.y)

    def step(self, dt: float) -> None:
        """Go on."""
        if self.wanted is not None:
            speed, turn = self.wanted
            self.heading += turn * dt
            x = self.x + speed * dt * math.cos(self.heading)
            y = self.y + speed * dt * math.sin(self.heading)
            if shapely.contains_xy(self._area, x, y):
                self.x, self.y = x, y
            self.speed = speed
            return
        self._rest -= dt
        if self._rest > 0:
            self.speed = 0.0
            return
        dx, dy = self._goal[0] - self.x, self._goal[1] - self.y
        gap = math.hypot(dx, dy)
        if gap < 0.3:
            self._goal, self._rest = self._place(), float(self._rng.uniform(0, 8))
            self.mode = "Idle" if self.kind == "robot" else self.mode
            return
        self.mode = "Mission" if self.kind == "robot" else self.mode
        off = (math.atan2(dy, dx) - self.heading + math.pi) % (2 * math.pi) - math.pi
        self.heading += max(-1.5 * dt, min(1.5 * dt, off))
        self.speed = self.fast if abs(off) < 0.5 else 0.0
        self.x += self.speed * dt * math.cos(self.heading)
        self.y += self.speed * dt * math.sin(self.heading)

    def row(self) -> list[int]:
        """Row for `pos`."""
        heading = (self.heading + math.pi) % (2 * math.pi) - math.pi
        x, y = round(self.x * 100), round(self.y * 100)
        return [self.index, x, y, round(heading * 1000), round(self.speed * 1000)]


class Scene:
    """A site and all that lives on it."""

    def __init__(self, name: str, robots: int, people: int, hostile: bool) -> None:
        self.site = load_site(name)
        rng = np.random.default_rng(7)
        names = [(f"robot-{n}", "robot") for n in range(1, robots + 1)]
        names += [("guard-1", "guard"), ("guard-2", "guard")]
        names += [(f"bystander-{n}", "bystander") for n in range(1, people - 1)]
        if hostile:
            names[1] = ("<script>alert(1)</script>", "robot")
        self.all = [Walker(i, *pair, self.site, rng) for i, pair in enumerate(names)]
        self.robots = [walker for walker in self.all if walker.kind == "robot"]
        self.people = [walker for walker in self.all if walker.kind != "robot"]

    def line(self) -> dict[str, Any]:
        """The line `scene`."""
        return {
            "k": "scene",
            "t": 0,
            "scenario": "fake",
            "title": "A world that is not one",
            "seed": 1,
            "site": site_of(self.site),
            "things": [self._thing(walker) for walker in self.all],
            "patterns": patterns_of(PATTERN),
            "link": MODELLED,
            "link_limits": LIMITS,
            "watchdog_s": 3.0,
            "stale_s": 1.0,
            "rules": RULES,
            "legend": [],
            "lag_limit_s": 0.25,
            "pace_limits": [1.0, 20.0],
            "dva_address": DVA_ADDRESS,
            "phone": OFFER,
        }

    @staticmethod
    def id_of(walker: Walker) -> str:
        """By which its device is known."""
        kind = 1 if walker.kind == "robot" else 2
        return f"02:00:00:{kind:02X}:{walker.index // 256:02X}:{walker.index % 256 + 1:02X}"

    def _thing(self, walker: Walker) -> dict[str, Any]:
        is_robot = walker.kind == "robot"
        about: dict[str, Any] = {
            "i": walker.index,
            "id": self.id_of(walker),
            "label": walker.label,
            "kind": walker.kind,
            "radius_m": 0.25,
            "max_speed_mps": 0.5 if is_robot else 1.3,
            "max_turn_rate_radps": 0.5236 if is_robot else 3.0,
        }
        if is_robot:
            about["camera"] = {"field_of_view_deg": 70, "range_m": 12, "rate_hz": 10}
            about["camera"]["frame_bytes"] = 6000
        if walker.kind == "guard":
            about["person"] = True
        return about

    def tour(self) -> dict[str, Any]:
        """Two goals straight ahead."""
        two = [(r.x, r.y, r.heading) for r in self.robots[:2]]
        goals = [[x + 2 * math.cos(angle), y + 2 * math.sin(angle)] for x, y, angle in two]
        about = {"radius_m": 0.6, "length_m": 2.0, "side_rad": 0.0}
        return {"robots": [0, 1], "goals_m": goals, **about}

    def hazards(self, t: float) -> dict[str, Any]:
        """The line `hazards` at a time [s]: a fire and its smoke, a leak and its gas."""
        (x1, y1), (x2, y2) = self.spots()
        hazards = [_hazard(1, "fire", x1, y1, min(2.5, 0.3 + t / 60))]
        hazards.append(_hazard(2, "gas_leak", x2, y2, min(3.0, 0.3 + t / 40)))
        fields = [self._field("smoke", x1, y1, 2 + t / 10, 2.0, "1/m")]
        fields.append(self._field("gas", x2, y2, 2 + t / 15, 1.0, "of the lower limit"))
        return {"k": "hazards", "hazards": hazards, "fields": fields}

    def spots(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Positions of the fire and the leak."""
        xmin, ymin, xmax, ymax = self.site.extent
        low = xmin + 0.3 * (xmax - xmin), ymin + 0.4 * (ymax - ymin)
        return low, (xmin + 0.7 * (xmax - xmin), ymin + 0.6 * (ymax - ymin))

    def _field(
        self, kind: str, x: float, y: float, size: float, full: float, unit: str
    ) -> dict[str, Any]:
        xmin, ymin, xmax, ymax = self.site.extent
        cell = max(0.5, math.sqrt((xmax - xmin) * (ymax - ymin) / 8000))
        columns, rows = math.ceil((xmax - xmin) / cell), math.ceil((ymax - ymin) / cell)
        xs, ys = np.meshgrid(np.arange(columns) + 0.5, np.arange(rows) + 0.5)
        gap = np.hypot(xmin + xs * cell - x, ymin + ys * cell - y)
        values = np.clip(255 * (1 - gap / min(size, 15)), 0, 255).astype(np.uint8)
        return {
            "kind": kind,
            "cell_m": cell,
            "x0_m": xmin,
            "y0_m": ymin,
            "columns": columns,
            "rows": rows,
            "cells": base64.b64encode(values.tobytes()).decode(),
            "full": {"value": full, "unit": unit},
        }

    def events(self, t: float) -> dict[str, Any]:
        """The line `events` at a time [s]."""
        (x1, y1), (x2, y2) = self.spots()
        events = [self._event(1, "fire", x1, y1, "critical", 0.9, t, ("robot-1",))]
        if t > 10:
            events.append(self._event(2, "gas_leak", x2, y2, "high", 0.6, t, ("guard-1",)))
        return {"k": "events", "events": events}

    def _event(
        self, n: int, kind: str, x: float, y: float, word: str, value: float, t: float, who: Any
    ) -> dict[str, Any]:
        latitude, longitude = self.site.frame.to_latlon(x, y)
        return {
            "number": n,
            "kind": kind,
            "x_m": round(x, 2),
            "y_m": round(y, 2),
            "latitude_deg": latitude,
            "longitude_deg": longitude,
            "room": "somewhere",
            "severity": word,
            "severity_value": value,
            "state": ("pending", "assigned", "on_scene", "confirmed")[min(3, int(t / 15))],
            "over": False,
            "since_ms": int(t // 15 * 15000),
            "reported_ms": 0 if n == 1 else 10000,
            "assigned": list(who),
        }


def _hazard(n: int, kind: str, x: float, y: float, radius: float) -> dict[str, Any]:
    about = {"n": n, "kind": kind, "x_m": round(x, 2), "y_m": round(y, 2), "contained": False}
    return about | {"radius_m": round(radius, 2), "severity": 0.7}
