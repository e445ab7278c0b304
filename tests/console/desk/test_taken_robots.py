"""A driver whose robot is taken away reads by whom it was, and why."""

import pytest
from helpers.console.simulated_phone import FIRE, PhonePage


def test_a_driver_is_told_who_took_the_robot_and_why(monkeypatch: pytest.MonkeyPatch):
    page = PhonePage(monkeypatch, client="c1", bystander__count=0, events=FIRE)
    page.are_open("c1", "c2", role="supervise")
    page.let(2.0)
    assert page.do("room_join", client="c2", role="supervise", name="ana")[0]
    assert page.do("take", robots=["robot-1"])[0]
    about = {"robot": "robot-1", "reason": "nearer to the fire"}
    assert page.do("take_over", client="c2", role="supervise", **about)[0]
    page.let(1.0)
    mine = [line for line in page.lines_of("seat") if line["seat"] == "c1"]
    alerts = [line["alert"] for line in mine if line["alert"]]
    assert alerts[-1] == "robot-1: the permission was revoked by ana: nearer to the fire"
