"""A driver with keys, who turns, moves and waits by the robot's true position."""

import math
import time
from typing import Any

import numpy as np
from helpers.console.driving_page import start
from helpers.processes.patience import PATIENCE_S
from playwright.sync_api import Page

from dva_sim.worlds.planning import Planner
from dva_sim.worlds.site import load_site

TURN_RATE = math.radians(30)
LONGEST_S = 4.0  # maximum time of driving straight between two looks [s]
ROOM = 0.8  # gap between a straight path and the nearest wall, if possible [m]
STEP = 0.1  # [m]
AHEAD = 0.12  # a heading that will do [rad]
FIRE = "events=[{kind: fire, room: North office, at_s: 3, latest_s: 3, reported: true}]"
NEAR_FIRE = "--set", "robot.way_m=6", "--set", FIRE
"""Words for a console whose fire begins at once near its robots: driving takes real time."""
SITE = "import('/static/js/store.js').then(store => store.scene.value.site.name)"


class Driver:
    """Drives one robot of a page that has been started.

    Args:
        page: The page for driving.
        base: Address of the console.
        robot: Label.
        delay: One-way delay of the link [s], the age of what the driver sees.
    """

    def __init__(self, page: Page, base: str, robot: str, delay: float) -> None:
        self._page, self._base, self._robot, self._delay = page, base, robot, delay
        self._planner = Planner(load_site(page.evaluate(SITE)), 0.45)
        self._down: set[str] = set()

    def state(self) -> dict[str, Any]:
        """All that a script may ask for."""
        found: dict[str, Any] = self._page.request.get(f"{self._base}api/state").json()
        return found

    def pose(self) -> tuple[float, float, float]:
        """Position and heading of the robot."""
        rows = self.state()["robots"]
        row = next(row for row in rows if row["label"] == self._robot)
        return row["x_m"], row["y_m"], row["heading_rad"]

    def drive_to(self, x: float, y: float, near: float) -> None:
        """Follow the planned way until the robot is near enough.

        Raises:
            TimeoutError: it never was.
        """
        end = time.monotonic() + PATIENCE_S
        while math.dist(self.pose()[:2], (x, y)) > near:
            if time.monotonic() > end:
                raise TimeoutError(f"{self._robot} stands at {self.pose()}, not near {x}, {y}")
            self._leg(x, y, near)
        self._hold(set())

    def _leg(self, x: float, y: float, near: float) -> None:
        """Turn towards the next waypoint, then go straight on for a part of the way."""
        here = self.pose()
        way = self._planner.path(here[:2], (x, y))
        points = [(x, y)] if way is None else [(float(a), float(b)) for a, b in way]
        seen = [p for p in points if self._is_free(here[:2], p)]
        ahead = max(seen or points[:1], key=lambda p: math.dist(p, here[:2]))
        off = math.atan2(ahead[1] - here[1], ahead[0] - here[0]) - here[2]
        off = (off + math.pi) % (2 * math.pi) - math.pi
        if abs(off) > AHEAD:
            self._press({"ArrowLeft" if off > 0 else "ArrowRight"}, abs(off) / TURN_RATE)
        else:
            far = min(math.dist(ahead, here[:2]), math.dist((x, y), here[:2]) - 0.5 * near)
            self._press({"ArrowUp"}, min(LONGEST_S, max(0.2, far / 0.5)))

    def _is_free(self, here: tuple[float, float], there: tuple[float, float]) -> bool:
        """True if a straight path with some clearance is free."""
        steps = max(2, int(math.dist(here, there) / STEP))
        room = self._planner.room_at(np.linspace(here, there, steps))
        least = min(ROOM, float(room[0]), float(room[-1]))
        return self._planner.line_of_sight(here, there) and bool(np.all(room >= least - 0.05))

    def _press(self, keys: set[str], seconds: float) -> None:
        """Hold keys for a while, then wait until the effect is visible."""
        start(self._page, 1000 * (4 * self._delay + 0.5))
        self._hold(keys)
        self._page.wait_for_timeout(1000 * seconds)
        self._hold(set())
        self._page.wait_for_timeout(1000 * (2 * self._delay + 0.5))

    def _hold(self, keys: set[str]) -> None:
        for key in self._down - keys:
            self._page.keyboard.up(key)
        for key in keys - self._down:
            self._page.keyboard.down(key)
        self._down = set(keys)
