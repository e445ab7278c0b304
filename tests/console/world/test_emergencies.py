"""Emergencies at pages: shown the same everywhere, and released only by those who may."""

from __future__ import annotations

import pytest
from helpers.console.simulated_console import Page

from dva_sim.simulation.full.stage import id_of

pytestmark = pytest.mark.invariant("S3")


@pytest.fixture
def page(monkeypatch):
    one = Page(monkeypatch)
    one.are_open("c1", role="supervise")
    one.let(3.0)
    return one


def stopped(page):
    """Names of those who have stopped robots, by label, as all pages show them."""
    page.let(1.5)
    rows = page.lines_of("rows")[-1]["robots"]
    labels = {thing["i"]: thing["label"] for thing in page.world.feed.things.all}
    assert all((row["mode"] == "Emergency") == (row["emergency"] is not None) for row in rows)
    return {labels[row["i"]]: row["emergency"]["by"] for row in rows if row["emergency"]}


def test_everybody_sees_who_stopped_which_robots(page):
    assert page.do("emergency", robots="all")[0]
    assert stopped(page) == {"robot-1": "page c1", "robot-2": "page c1"}
    rows = page.world.devices()
    assert [row["doing"] for row in rows if row["type"] == "Robot"] == ["Emergency"] * 2


def test_the_person_who_pressed_it_is_named(page):
    page.do("room_join", name="ana", role="supervise")
    page.do("emergency", robots=["robot-2"])
    page.do("emergency", client="c9", robots="all")
    assert stopped(page) == {"robot-1": "page c9", "robot-2": "ana"}


def test_a_driver_starts_nothing_until_somebody_releases_the_robot(page):
    assert page.do("take", robots=["robot-1"])[0]
    page.do("emergency", robots="all")
    done, text = page.do("start", within=40.0)
    assert not done
    assert "release" in text or "not started" in text
    assert page.do("release_emergency", robots=["robot-1"], role="supervise")[0]
    page.let(2.0)
    assert page.do("start")[0]


@pytest.mark.parametrize(
    ("role", "released"), [("look", False), ("drive", False), ("dispatch", True)]
)
def test_a_release_needs_the_right(page, role, released):
    page.do("emergency", robots="all")
    done, text = page.do("release_emergency", client="c2", robots="all", role=role)
    assert done == released
    assert ("needs dispatch" in text) != released
    assert bool(stopped(page)) != released


def test_one_robot_is_released_and_the_other_stays_stopped(page):
    page.do("emergency", robots="all")
    assert page.do("release_emergency", robots=["robot-2"], role="supervise")[0]
    assert set(stopped(page)) == {"robot-1"}


def test_there_is_nothing_to_release_without_an_emergency(page):
    assert not page.do("release_emergency", robots="all", role="supervise")[0]


@pytest.mark.parametrize(("role", "rule"), [("drive", "drive"), ("supervise", "person")])
def test_whether_a_person_has_to_release_depends_on_the_pages_that_are_open(
    monkeypatch, role, rule
):
    page = Page(monkeypatch)
    page.are_open("c1", role=role)
    page.let(3.0)
    page.do("emergency", robots="all")
    page.let(1.5)
    robot = page.world.run.field.robots[id_of("robot", 1)]
    assert robot.controller.latch.released_by == rule
