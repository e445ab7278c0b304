"""Latency that a person notices at the page, and cost of the page and the console.

The way from a key to the robot's set point, over a link without delay and with 250 ms; the time
from the command to the map; what 10 and 200 robots cost the browser; CPU of each process.
"""

from __future__ import annotations

import resource
import time
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.console_visits import Console, console, load, visit
from benchmarks.goals import goal
from helpers.console.chromium import chromium
from playwright.sync_api import Page, expect

STEPS, STEP_MS, WARM_UP_MS = 300, 130, 2000  # of keys pressed in turn
WATCH_S = 10.0
EVENTS = "[{kind: fire, at_s: 5, latest_s: 5}]"
MOST_MS = {0: 30.0, 250: 280.0}  # from a key to the set point, by the delay [ms]
DRAWN = """() => { const canvas = document.querySelectorAll('.map-canvas')[0];
  if (!canvas?.width) return false;
  const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
  let ink = 0; for (let i = 3; i < data.length; i += 400) ink += data[i] > 0;
  return ink > 100 && performance.now(); }"""
WEIGHT = """() => [...performance.getEntriesByType('navigation'),
  ...performance.getEntriesByType('resource')].reduce((sum, e) => sum + e.encodedBodySize, 0)"""
PAINT = """() => performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? NaN"""


def begin(page: Page) -> None:
    """Drive, if that is not so: a machine that lags ends each drive."""
    while page.get_by_role("status", name="Mode").inner_text() != "Teleoperation":
        button = page.get_by_role("button", name="Start", exact=True)
        if button.is_enabled():
            button.click()
        page.wait_for_timeout(300)


def turn_by_keys(page: Page) -> np.ndarray[Any, Any]:
    """Press two keys in turn; how long each took to be in the robot's set point [ms]."""
    page.wait_for_timeout(WARM_UP_MS)
    page.evaluate("probe.delays.length = 0")
    for step in range(STEPS):
        if step % 20 == 0:
            begin(page)
        key = ("ArrowLeft", "ArrowRight")[step % 2]
        page.keyboard.down(key)
        page.wait_for_timeout(STEP_MS)
        page.keyboard.up(key)
    page.wait_for_timeout(1000)
    return np.array(page.evaluate("probe.delays"))


def from_a_key_to_the_set_point(folder: Path) -> None:
    """Without delay and with 250 ms."""
    with console(folder) as running, chromium() as browser:
        page = visit(browser, f"{running.address}#/drive")
        page.get_by_role("button", name="Take control").click()
        expect(page.get_by_role("button", name="Release control")).to_be_enabled()
        for delay_ms in MOST_MS:
            page.get_by_role("button", name=f"{delay_ms} ms", exact=True).click()
            begin(page)
            delays = turn_by_keys(page)
            middle, high = np.percentile(delays, [50, 95])
            print(
                f"\nfrom a key to the set point at {delay_ms} ms: p50 {middle:.1f} ms, "
                f"p95 {high:.1f} ms, {len(delays)} of {STEPS} seen; {load()}"
            )
            goal(f"p50 at {delay_ms} ms [ms]", middle, most=MOST_MS[delay_ms])
            goal(f"p95 at {delay_ms} ms [ms]", high, most=MOST_MS[delay_ms])


def from_the_command_to_the_drawn_map(folder: Path) -> None:
    """Time, page weight and first paint."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with chromium() as browser:
        begun = time.monotonic()
        with console(folder) as running:
            serves = time.monotonic() - begun
            page = visit(browser, f"{running.address}#/map")
            drawn_ms = page.wait_for_function(DRAWN).json_value()
            drawn = time.monotonic() - begun
            cpu = sum(running.cpu_s().values())
            paint_ms, weight = page.evaluate(PAINT), page.evaluate(WEIGHT)
        assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime > before.ru_utime
    print(
        f"\nfrom the command to the drawn map: {drawn:.1f} s, of which {serves:.1f} s until the "
        f"address is told and {drawn_ms / 1000:.2f} s in the browser; {cpu:.1f} CPU s; {load()}"
    )
    goal("page weight [kB]", weight / 1000, most=700)
    goal("first paint [s]", paint_ms / 1000, most=1.0)


def a_page_of_ten_robots(folder: Path) -> None:
    """Measure the cost of a map of ten robots in the browser."""
    page_cost(folder, 10, 10, "caparica")


def a_page_of_two_hundred_robots(folder: Path) -> None:
    """Measure the cost of a map of 200 robots in the browser."""
    page_cost(folder, 200, 100, "campus")


def page_cost(folder: Path, robots: int, people: int, site: str) -> None:
    """Share of the main thread, frames and bytes while somebody looks at the map."""
    keys = {
        "robot.count": robots,
        "bystander.count": people,
        "site.name": site,
        "events": EVENTS,
        "robot.way_m": "null",
    }
    words = [f"--set={key}={value}" for key, value in keys.items()]
    with console(folder, *words) as running, chromium() as browser:
        page = visit(browser, f"{running.address}#/map")
        page.wait_for_function(DRAWN)
        page.wait_for_timeout(WARM_UP_MS)
        share, frames, size = watched(page)
    print(
        f"\n{robots} robots and {people} people on a map: main thread {share:.1%}, "
        f"{frames:.0f} frames/s, {size / 1000:.1f} kB/s; {load()}"
    )
    goal("share of the main thread", share, most=0.25)


def watched(page: Page) -> tuple[float, float, float]:
    """CPU share of the page's main thread, frames and bytes per second, while somebody looks."""
    devtools = page.context.new_cdp_session(page)
    devtools.send("Performance.enable", {"timeDomain": "threadTicks"})

    def now() -> tuple[float, float, float, float]:
        found = {m["name"]: m["value"] for m in devtools.send("Performance.getMetrics")["metrics"]}
        probe = page.evaluate("[probe.frames, probe.bytes]")
        return time.monotonic(), found["TaskDuration"], probe[0], probe[1]

    first = now()
    page.wait_for_timeout(1000 * WATCH_S)
    took, *rest = (after - before for before, after in zip(first, now(), strict=True))
    share, frames, size = (value / took for value in rest)
    return share, frames, size


def shares(running: Console, page: Page) -> str:
    """CPU of each process, as shares of a core."""
    first, begun = running.cpu_s(), time.monotonic()
    page.wait_for_timeout(1000 * WATCH_S)
    took = time.monotonic() - begun
    now = running.cpu_s()
    return ", ".join(f"{name} {(now[name] - first[name]) / took:.1%}" for name in now)


def cpu_of_each_process(folder: Path) -> None:
    """While somebody looks at the map, and while two robots are driven."""
    words = ("--set", "camera.rate_hz=10")
    with console(folder, *words) as running, chromium() as browser:
        page = visit(browser, f"{running.address}#/map")
        page.wait_for_function(DRAWN)
        page.wait_for_timeout(WARM_UP_MS)
        print(f"\nCPU while somebody looks at the map: {shares(running, page)}; {load()}")
        page.get_by_role("link", name="Drive").click()
        page.get_by_role("button", name="beside it").click()
        page.get_by_role("button", name="Take control").click()
        expect(page.get_by_role("button", name="Release control")).to_be_enabled()
        page.get_by_role("button", name="Start", exact=True).click()
        page.wait_for_timeout(WARM_UP_MS)
        page.keyboard.down("ArrowLeft")
        print(f"with two robots driven, 10 pictures a second each: {shares(running, page)}")
