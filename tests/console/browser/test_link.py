"""The link one chooses, the time factor, the bar above all; two browsers agree."""

import pytest
from helpers.console.driving_page import release, take
from helpers.processes.patience import becomes
from playwright.sync_api import expect

SLIDERS = (
    ("Delay", "500", "500 ms"),
    ("Jitter", "40", "40 ms"),
    ("Loss", "2.5", "2.5 %"),
    ("Processing time", "300", "300 ms"),
    ("Bandwidth", "40", "1 Mbit/s"),
    ("Time factor", "3", "× 3"),
)


@pytest.fixture
def page(console, shared):
    return shared(console().drive, "network")


def test_a_slider_changes_the_world_for_every_browser(page, console, visit):
    other = visit.open(console().drive, "network")
    for slider, value, shown in SLIDERS:
        page.get_by_role("slider", name=slider).fill(value)
        for each in (page, other):
            knob = each.get_by_role("slider", name=slider)
            expect(knob).to_have_attribute("aria-valuetext", shown)
    other.reload()
    for slider, _, shown in SLIDERS:
        knob = other.get_by_role("slider", name=slider)
        expect(knob).to_have_attribute("aria-valuetext", shown)
    other.get_by_role("slider", name="Time factor").fill("1")


def test_the_status_link_tells_the_delay_and_that_it_is_modelled(page):
    page.get_by_role("button", name="250 ms").click()

    expect(page.get_by_role("status", name="Link")).to_contain_text("modelled 250 ms")
    expect(page.get_by_role("button", name="250 ms")).to_have_attribute("aria-pressed", "true")


def test_time_stands_still_while_it_is_paused(page):
    page.get_by_role("button", name="Pause").click()
    expect(page.locator(".time")).to_contain_text("paused")
    shown = page.locator(".time .figure").inner_text()
    page.wait_for_timeout(1100)  # the time is shown in seconds
    assert page.locator(".time .figure").inner_text() == shown

    page.get_by_role("button", name="Resume", exact=True).click()
    assert becomes(lambda: page.locator(".time .figure").inner_text() != shown)


def test_the_pattern_of_a_robot_changes(page):
    page.get_by_label("Pattern of robot-2").select_option("latest-wins")
    page.reload()

    expect(page.get_by_label("Pattern of robot-2")).to_have_value("latest-wins")


def test_a_page_that_may_only_look_says_so_and_offers_nothing(console, visits):
    page = visits().open(console().look, "drive")

    expect(page.get_by_text("This address is view-only.")).to_be_visible()
    for button in ("Take control", "Start", "Stop", "Release control"):
        expect(page.get_by_role("button", name=button, exact=True)).to_be_disabled()
    expect(page.get_by_role("slider", name="Delay")).to_be_disabled()


def test_who_comes_second_is_told_who_drives(console, shared, visit):
    first, second = (opened(console().drive, "drive") for opened in (shared, visit.open))
    take(first)

    second.get_by_role("button", name="Take control").click()
    expect(second.locator(".warnings")).to_contain_text("is held on")
    release(first)
