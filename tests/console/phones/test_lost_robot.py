"""A robot that does not answer ends in a message with its address, and never in a hang."""

import pytest
from helpers.console.simulated_phone import HeldPhone, PhonePage
from helpers.wording import unnamed

from dva_sim.agents.robot.controller import Mode


@pytest.fixture
def page(monkeypatch):
    page = PhonePage(monkeypatch)
    assert page.register()["ok"]
    return page


def address(page):
    return page.robot().device.address


def test_a_robot_that_is_dead_before_anybody_drives_is_told_with_its_address(page):
    page.robot().device.silent = True
    assert page.permit()["ok"]  # the DVA does not know yet
    page.let(9.5)
    assert page.seat()["phase"] == "held"
    assert unnamed(page.seat()["alert"], "robot-1", "link lost", address(page)) == []
    page.let(20.0)
    assert page.seat()["phase"] == "free"  # now it does
    assert unnamed(page.seat()["alert"], "robot-1", "revoked", "link lost", address(page)) == []


def test_a_device_that_is_alive_and_never_answers_is_told_with_its_address(page):
    page.world.run.network.serve(page.robot().device.id_tag, lambda request: None)
    assert page.permit()["ok"]
    page.let(9.5)
    assert unnamed(page.seat()["alert"], "robot-1", "link lost", address(page)) == []
    page.let(20.0)
    assert unnamed(page.seat()["alert"], "link lost", address(page)) == []


def test_a_fake_device_ends_in_a_message_and_not_in_a_hang(page):
    """One that was added by hand, whose name breaks nothing: it is listed and never answers."""
    assert page.ask("fake_add", label="fake/<b>robot</b>", type="Robot")["ok"]
    listed = {one["label"]: one for one in page.ask("phone_devices")["devices"]}
    fake = listed["fake/<b>robot</b>"]
    assert page.ask("phone_permission", device=fake["id"], level="teleoperation")["ok"]
    page.let(9.5)
    words = f"fake/<b>robot</b>: link lost: no answer at {fake['address']}"
    assert page.seat()["alert"] == words
    done, text = page.do("start")
    assert not done
    assert "fake/<b>robot</b>" in text
    assert words.partition(": ")[2] in page.seat()["alert"]
    assert page.permit()["ok"]  # and another robot can be chosen


def test_to_start_a_dead_robot_ends_in_the_same_words(page):
    assert page.permit()["ok"]
    page.let(1.0)
    page.robot().device.silent = True
    done, text = page.do("start")
    assert not done
    assert unnamed(text, "robot-1", "link lost", address(page), "3 attempts") == []
    assert page.seat()["alert"] == text
    assert page.seat()["phase"] == "held"


def test_a_robot_that_dies_in_mid_drive_is_alerted_after_three_attempts(page):
    page.drives_by_tilt(then=2.0)
    page.robot().device.silent = True
    page.let(8.0)
    assert page.seat()["phase"] == "driving"
    page.let(4.0)
    assert "link lost" in page.seat()["alert"]
    assert page.seat()["phase"] == "held"
    page.robot().device.silent = False
    page.let(10.0)
    assert page.robot().body.speed == 0.0
    assert page.robot().controller.mode is not Mode.TELEOPERATION


@pytest.mark.system
def test_without_a_picture_one_drives_on_in_sight_of_the_robot(page):
    assert page.permit()["ok"]
    assert page.calibrate()["ok"]
    held = HeldPhone(page)
    held.tilt(10.3)
    for one in page.world.seating.persons.values():
        for robot in one.robots.values():
            robot._picture.close()  # the camera is broken, and all else works
    assert page.do("start")[0]
    page.let(25.0)
    assert page.seat()["phase"] == "driving"
    assert page.robot().controller.mode is Mode.TELEOPERATION
    assert page.seat()["drives"][0]["command"][0] > 0.2
