"""The guided tour, from its button to the person's own two times."""

import re

from helpers.processes.patience import becomes
from playwright.sync_api import Page, expect


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


def drive(page: Page, leg: int) -> None:
    """Straight on until the robot is in the ring, then let it stand."""
    page.get_by_role("button", name="Take control").click()
    page.get_by_role("button", name="Start", exact=True).click()
    expect(page.get_by_role("status", name="Mode")).to_have_text("Teleoperation")
    page.keyboard.down("ArrowUp")
    assert becomes(lambda: distance(page, leg) < 0.5)
    page.keyboard.up("ArrowUp")


def test_the_tour_ends_with_both_times_and_can_be_taken_once_more(own_world, visit, tmp_path):
    page = visit.open(own_world("--robots", "2", "--people", "0")[0].drive, "map")
    tour = page.get_by_role("complementary", name="Tour")
    page.get_by_role("button", name="Take the tour").click()
    expect(page.get_by_role("status", name="Link")).to_contain_text("500 ms")

    drive(page, 0)
    page.get_by_role("button", name="Next").click()
    expect(tour.get_by_role("heading")).to_contain_text("robot-2")
    drive(page, 1)
    page.get_by_role("button", name="Show my numbers").click()

    expect(tour.get_by_role("heading", name="Your drive times at 500 ms")).to_be_visible()
    times = [float(text.split()[0]) for text in tour.locator(".bar-row b").all_inner_texts()]
    assert len(times) == 2
    assert min(times) > 1.0
    kept = re.findall(r"robot (\d) took (\S+) s", (tmp_path / "world-0.out").read_text())
    assert kept == [(str(robot), f"{time:.1f}") for robot, time in enumerate(times)]
    page.get_by_role("button", name="Do it again").click()
    expect(tour.get_by_role("heading")).to_contain_text("robot-1")
    assert distance(page, 0) > 1.5


def test_a_leg_can_be_begun_again_from_where_the_robot_is(own_world, visit):
    page = visit.open(own_world("--robots", "2", "--people", "0")[0].drive, "map")
    page.get_by_role("button", name="Take the tour").click()
    drive(page, 0)
    page.get_by_role("button", name="Next").click()
    page.get_by_role("button", name="Begin again").click()

    expect(page.get_by_role("complementary", name="Tour")).to_contain_text("0.0 s")
    expect(page.get_by_role("button", name="Take control")).to_be_enabled()
    assert distance(page, 0) > 1.5
