"""The guided tour, from its button to the person's own two times."""

import json

import pytest
from helpers.console.changed_lines import sockets_of
from helpers.console.console_program import started
from helpers.console.desk import NOTHING_YET
from helpers.console.driving_page import start, take
from helpers.console.keyboard_driver import Driver
from playwright.sync_api import Page, expect

DELAY_S = 0.5
IN_THE_RING_M = 0.45
PLAN = """async (leg) => {
  const {progress} = await import('/static/js/tour/progress.js');
  const {thingAt} = await import('/static/js/store.js');
  const {robots, goals_m} = progress.value.plan;
  return [thingAt(robots[leg]).label, goals_m[leg]]; }"""


def distance(page: Page, leg: int) -> float:
    """From the robot of a leg to its goal [m]."""
    found = page.evaluate(
        """async (leg) => {
        const {progress} = await import('/static/js/tour/progress.js');
        const {tracks} = await import('/static/js/store.js');
        const {robots, goals_m} = progress.value.plan;
        const {x, y} = tracks.last(robots[leg]);
        return Math.hypot(x - goals_m[leg][0], y - goals_m[leg][1]); }""",
        leg,
    )
    return float(found)


def drive(page: Page, base: str, leg: int) -> None:
    """Drive the robot of a leg into the ring, and let it stand there."""
    take(page)
    label, goal = page.evaluate(PLAN, leg)
    Driver(page, base, label, DELAY_S).drive_to(*goal, IN_THE_RING_M)


def test_the_tour_ends_with_both_times_and_is_begun_again_from_where_robots_are(programs, visit):
    _, address = started(programs, *NOTHING_YET, "--set", "bystander.count=0")
    base = address.partition("?")[0]
    asked: list[str] = []
    sockets_of(visit.context, "drive", asked=asked.append)
    page = visit.open(address, "map")
    tour = page.get_by_role("complementary", name="Tour")
    page.get_by_role("button", name="Take the tour").click()
    expect(page.get_by_role("status", name="Link")).to_contain_text("500 ms")

    drive(page, base, 0)
    page.get_by_role("button", name="Next").click()
    expect(tour.get_by_role("heading")).to_contain_text("robot-2")
    drive(page, base, 1)
    page.get_by_role("button", name="Show my numbers").click()

    expect(tour.get_by_role("heading", name="Your drive times at 500 ms")).to_be_visible()
    times = [float(text.split()[0]) for text in tour.locator(".bar-row b").all_inner_texts()]
    assert len(times) == 2
    assert min(times) > 1.0
    told = [json.loads(line) for line in asked if '"tour_time"' in line]
    assert [one["robot"] for one in told] == [0, 1]
    assert [one["took_s"] for one in told] == pytest.approx(times, abs=0.051)
    page.get_by_role("button", name="Do it again").click()
    expect(tour.get_by_role("heading")).to_contain_text("robot-1")
    assert distance(page, 0) > 1.5

    take(page)
    start(page)
    page.keyboard.down("ArrowUp")
    expect(tour).not_to_contain_text("0.0 s")
    page.keyboard.up("ArrowUp")
    page.get_by_role("button", name="Begin again").click()
    expect(tour).to_contain_text("0.0 s")
    expect(page.get_by_role("button", name="Take control")).to_be_enabled()
    assert distance(page, 0) > 1.5
