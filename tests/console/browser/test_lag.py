"""A world that lags, and a page that sleeps: what is said, and what is not."""

import json
import re

import pytest
from helpers.console.changed_lines import sockets_of
from helpers.processes.patience import becomes
from playwright.sync_api import Page, expect


def lagging(text: str) -> str:
    line = json.loads(text)
    if line["k"] == "rows":
        line["clock"] |= {"lag_s": 0.43, "held_by_lag": True}
    return json.dumps(line)


@pytest.fixture
def page(visit) -> Page:
    return visit.context.new_page()


def test_a_world_that_lags_holds_robots_and_the_page_says_why(console, page):
    sockets_of(page, "state", lagging)
    page.goto(f"{console().drive}#/drive")

    warning = page.locator(".warnings")
    expect(warning).to_contain_text("Robots were stopped")
    expect(warning).to_contain_text("430 ms behind")
    expect(warning).to_contain_text("250 ms")
    expect(page.locator(".hint")).to_contain_text("behind real time")


def test_silence_makes_the_page_look_old(console, page):
    silent: list[bool] = []
    sockets_of(page, "state", lambda text: None if silent else text)
    page.goto(f"{console().drive}#/map")
    expect(page.locator(".map-canvas")).to_have_count(3)
    expect(page.locator(".age")).to_have_text(re.compile(r"^data \d+\.\d s old$"))
    silent.append(True)

    expect(page.locator(".stale")).to_be_visible()
    expect(page.locator(".age.old")).to_be_visible()


def test_a_picture_that_still_comes_is_hatched_when_all_else_is_silent(console, page):
    silent: list[bool] = []
    sockets_of(page, "state", lambda text: None if silent else text)
    page.goto(f"{console().drive}#/drive")
    expect(page.locator(".picture-age")).to_contain_text("s old")
    expect(page.locator(".veil")).not_to_have_class("veil hatched")
    silent.append(True)

    expect(page.locator(".veil")).to_have_class("veil hatched")
    expect(page.locator(".picture-age")).to_have_text(re.compile(r"s old, no data for \d+\.\d+ s$"))


def test_a_hole_in_what_was_heard_is_filled_by_asking_again(console, page):
    asked, skipped = list[str](), list[str]()

    def hole(text: str) -> str | None:
        if json.loads(text)["s"] <= 20 or skipped:
            return text
        skipped.append(text)
        return None

    sockets_of(page, "state", hole, asked.append)
    page.goto(f"{console().drive}#/map")

    assert becomes(lambda: (page.wait_for_timeout(50), any("resync" in text for text in asked))[1])
    expect(page.locator(".map-canvas")).to_have_count(3)


def test_a_lost_socket_is_opened_again_under_the_same_name(console, page):
    sockets = sockets_of(page, "state")
    page.goto(f"{console().drive}#/map")
    expect(page.get_by_role("region", name="Map")).to_be_visible()
    who = page.evaluate("sessionStorage.getItem('dva-sim-client')")
    sockets[0].close()

    assert becomes(lambda: (page.wait_for_timeout(50), len(sockets) > 1)[1])
    expect(page.locator(".warnings")).to_be_empty()
    assert page.evaluate("sessionStorage.getItem('dva-sim-client')") == who


def test_nothing_can_be_asked_for_until_the_socket_for_driving_is_open(console, page):
    sockets = sockets_of(page, "drive")
    page.goto(f"{console().drive}#/drive")
    button = page.get_by_role("button", name="Take control")
    expect(button).to_be_enabled()
    page.clock.install()
    page.clock.pause_at("2030-01-01")  # it is opened again a second later
    sockets[-1].close()

    expect(button).to_be_disabled()
    expect(page.locator(".hint")).to_contain_text("Connecting")
    page.clock.run_for(1500)
    expect(button).to_be_enabled()
