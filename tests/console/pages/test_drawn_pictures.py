"""A command is as old as the picture that its person's page has drawn last."""

import math

import pytest
from helpers.console.simulated_console import Page
from helpers.wording import unnamed

from dva_sim.agents.robot.controller import Mode

LIMIT = 6.0  # of a command's age at the robot [s]


class Drawing(Page):
    """A page that draws pictures, until it draws no more."""

    def __init__(self, monkeypatch, **changes):
        super().__init__(monkeypatch, **changes)
        self.draws, self.seen = True, []

    def _want(self):
        if self.draws:
            held = self.world.seating.person(0).robots.values()
            self.seen = [
                [self.world.feed.numbers[each.robot], round(1000 * each.frame.captured)]
                for each in held
                if each.frame is not None
            ]
        if self.wanted is not None:
            self.wanted["seen"] = self.seen
        super()._want()


@pytest.fixture
def page(monkeypatch):
    page = Drawing(monkeypatch)
    page.sets_out(0.2, then=2.0)
    assert page.robot().body.speed > 0.05
    return page


def held(page):
    return next(iter(page.world.seating.person(0).robots.values()))


@pytest.mark.system
def test_while_pictures_are_drawn_the_drive_goes_on(page):
    page.let(3 * LIMIT)
    assert page.robot().controller.mode is Mode.TELEOPERATION
    assert page.seat()["alert"] == ""


def test_a_page_that_draws_no_more_is_stopped_at_the_age_limit_and_told_why(page):
    page.draws = False
    frozen = held(page).frame.captured
    page.let(LIMIT - 0.5)
    assert page.robot().controller.mode is Mode.TELEOPERATION
    page.let(1.0)
    assert held(page).frame.captured > frozen + LIMIT - 1.0  # pictures still arrive here
    assert page.robot().controller.mode is Mode.IDLE
    assert page.robot().body.speed == pytest.approx(0.0, abs=0.02)
    assert unnamed(page.seat()["alert"], "picture", "robot-1", "6.") == []


def test_the_robot_itself_finds_commands_by_a_frozen_picture_too_old(page, monkeypatch):
    """Whatever the console notices: the tick in the commands is that of the frozen picture."""
    monkeypatch.setattr(page.world.driven, "stale_s", math.inf)
    page.draws = False
    page.let(LIMIT + 1.0)
    assert page.robot().controller.mode is Mode.TELEOPERATION
    assert page.robot().body.speed == pytest.approx(0.0, abs=0.02)


def test_a_drive_that_is_started_again_over_the_same_picture_ends_at_once(page):
    page.draws = False
    page.let(LIMIT + 1.0)
    page.do("start")
    page.let(1.0)
    assert page.robot().controller.mode is Mode.IDLE
    page.draws = True
    page.let(0.2)
    assert page.do("start")[0]
    page.let(2.0)
    assert page.robot().body.speed > 0.05


def test_a_hand_that_lets_go_ends_no_drive_and_may_take_hold_again(page):
    """Pictures are reported with what a hand wants: without a hand nothing moves by old ones."""
    page.wanted = {"speed": 0.0, "turn": 0.0, "held": False}
    page.let(0.1)
    page.let_go()
    page.let(2 * LIMIT)
    assert page.robot().controller.mode is Mode.TELEOPERATION
    assert page.seat()["alert"] == ""
    page.want(0.2)
    page.let(2.0)
    assert page.robot().body.speed > 0.05
    assert page.do("stop")[0]
    page.let_go()
    page.let(2 * LIMIT)
    assert page.do("start")[0]
    page.let(1.0)
    assert page.robot().controller.mode is Mode.TELEOPERATION


def test_a_page_that_has_drawn_nothing_yet_drives_no_longer_than_the_limit(monkeypatch):
    page = Drawing(monkeypatch)
    page.draws = False
    assert page.do("take", robots=[0])[0]
    page.let(1.0)
    assert page.do("start")[0]
    page.want(0.2)
    page.let(LIMIT + 1.0)
    assert page.robot().controller.mode is Mode.IDLE
    assert "drawn no new picture" in page.seat()["alert"]


@pytest.mark.parametrize(
    "seen", [[[0, 10**12]], [[0, -5]], [[77, 5]], "x", [[0]], [[True, 5]], None]
)
def test_a_picture_that_there_never_was_makes_no_command_younger(page, seen):
    before = held(page)._drawn_tick
    for client in ("c1", "c9"):
        wish = {"n": 1, "speed": 0, "turn": 0, "held": False, "seen": seen}
        page.actions.take({"do": "input", "client": client, **wish})
    assert held(page)._drawn_tick == before


def test_a_program_that_says_nothing_of_pictures_drives_as_before(monkeypatch):
    page = Page(monkeypatch)
    page.sets_out(0.2)
    page.let(2 * LIMIT)
    assert page.robot().controller.mode is Mode.TELEOPERATION
