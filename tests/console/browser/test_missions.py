"""Missions by hand, on the phone and on the driving page."""

import json
from collections.abc import Iterator

import pytest
from helpers.console.browser_phone import Hand
from helpers.console.changed_lines import sockets_of
from helpers.console.console_program import PHONES, Addresses
from helpers.processes.patience import becomes
from playwright.sync_api import Page, expect

WORDS = *PHONES, "--set=guard.kind=person"


@pytest.fixture
def running(console) -> Addresses:
    return console(*WORDS)


@pytest.fixture
def hand(running, visits) -> Iterator[Hand]:
    one = Hand(visits(width=390, height=844, has_touch=True, is_mobile=True), running.phone)
    yield one
    one.leave()


def tap(page: Page, across: float, down: float) -> None:
    """Tap the map at shares of its size."""
    box = page.locator(".map-ground").bounding_box()
    assert box
    place = {"x": across * box["width"], "y": down * box["height"]}
    page.locator(".map-ground").click(position=place)


def progress(page: Page):
    return page.get_by_role("status", name="Progress", exact=True)


def test_a_phone_sends_its_robot_on_a_patrol_and_cancels_it(hand):
    page = hand.page
    hand.register()
    hand.take(level="missions")
    hand.tap("Go on: Missions", "link")
    expect(progress(page)).to_have_text("No mission yet.")
    page.get_by_label("Mission", exact=True).select_option("patrol")
    send = page.get_by_role("button", name="Send robot-1")
    expect(send).to_be_disabled()
    tap(page, 0.4, 0.5)
    tap(page, 0.6, 0.5)
    send.tap()
    expect(progress(page)).to_contain_text("Under way, 2 places left")
    [order] = hand.sent("mission_order")
    assert (order["what"], len(order["places_m"])) == ("patrol", 2)
    hand.tap("Cancel mission")
    expect(progress(page)).to_have_text("Ended early: cancelled.")
    expect(send).to_be_enabled()


def test_a_permission_to_drive_is_none_for_missions(hand):
    hand.hold()
    hand.go("Missions")
    expect(hand.page.get_by_text("You hold no robot for missions.")).to_be_visible()


def test_the_driving_page_sends_a_robot_to_an_event_and_back(running, visit):
    page = visit.open(running.drive, "drive")
    page.get_by_label("Permission level").select_option("both")
    page.get_by_role("button", name="Take control").click()
    page.get_by_label("Mission", exact=True).select_option("inspect")
    page.get_by_role("button", name="Send robot-1").click()
    expect(progress(page)).to_contain_text("Under way")
    page.get_by_role("button", name="Cancel mission").click()
    page.get_by_label("Mission", exact=True).select_option("return_to_base")
    page.get_by_role("button", name="Send robot-1").click()
    expect(progress(page)).to_have_text("Done.")
    page.get_by_role("button", name="Release control").click()
    expect(page.get_by_role("region", name="Missions")).to_have_count(0)


def test_sensors_are_read_while_driving_beside_the_picture(hand):
    page = hand.page
    hand.drive()
    page.get_by_text("Choose sensors").tap()
    page.get_by_label("Temperature", exact=True).check()
    page.get_by_label("Frequency").select_option("2")
    page.get_by_text("Choose sensors").tap()
    value = page.get_by_role("region", name="Sensors of robot-1").get_by_role("listitem")
    expect(value).to_contain_text("°C")
    expect(value).to_contain_text("s old, alarm from 58 °C")
    assert hand.sent("sense")[-1]["rate_hz"] == 2
    picture, shown = page.locator(".surface").bounding_box(), value.bounding_box()
    assert picture
    assert shown
    assert picture["y"] + picture["height"] <= shown["y"]
    hand.is_driving()


def test_the_driving_page_reads_sensors_of_a_robot_in_hand(running, visit):
    lines, silent = list[str](), [True]

    def before(text: str) -> str:
        """Return a line of a console that has not yet done what was asked."""
        line = json.loads(text)
        for drive in line.get("drives", ()) if silent else ():
            lines.append(text)
            for sensor in drive.get("sensors", ()):
                sensor |= {"rate_hz": None, "age_s": None}
        return json.dumps(line)

    page = visit.context.new_page()
    sockets_of(page, "", before)
    page.goto(f"{running.drive}#/drive")
    page.get_by_role("button", name="Take control").click()
    page.get_by_text("Choose sensors").click()
    lines.clear()
    smoke = page.get_by_label("Smoke", exact=True)
    smoke.check()  # and stays so, though the console has not said so yet
    assert becomes(lambda: (page.wait_for_timeout(50), len(lines) > 5)[1])
    expect(smoke).to_be_checked()
    silent.clear()
    region = page.get_by_role("region", name="Sensors of robot-1")
    expect(region.get_by_role("listitem")).to_contain_text("alarm from")
    page.get_by_role("button", name="Release control").click()
    expect(region).to_have_count(0)
