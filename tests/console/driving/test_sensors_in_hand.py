"""Sensors that a driver reads: by a subscription of the protocol, while the robot is in hand."""

import pytest
from helpers.console.simulated_phone import PhonePage

from dva_sim.simulation.full.control_room import SENSOR_ALARMS


@pytest.fixture
def holding(monkeypatch):
    page = PhonePage(monkeypatch)
    page.register()
    page.permit()
    page.let(2.0)
    return page


def sensed(page, name):
    drive = page.seat()["drives"][0]
    return next(sensor for sensor in drive["sensors"] if sensor["name"] == name)


def subscribed(page):
    """Number of the robot's subscriptions by protocol messages."""
    return sum(isinstance(data, bytes) and b"<DevSub>" in data for *_, data in page.heard)


def test_a_driver_chooses_sensors_and_how_often_and_sees_values_with_their_age(holding):
    before = sensed(holding, "temperature")
    assert (before["rate_hz"], before["age_s"], "values" in before) == (None, None, False)
    assert holding.ask("sense", robot=0, sensors=["temperature", "lidar"], rate_hz=2.0)["ok"]
    holding.let(4.0)
    temperature = sensed(holding, "temperature")
    assert (temperature["unit"], temperature["rate_hz"]) == ("degC", 2.0)
    assert temperature["values"] == [pytest.approx(20.0, abs=3.0)]
    assert temperature["age_s"] <= 0.6
    assert temperature["alarm_at"] == SENSOR_ALARMS["temperature"].threshold
    assert sensed(holding, "lidar")["least"] > 0.0  # of many directions the nearest
    assert sensed(holding, "battery")["rate_hz"] is None
    assert subscribed(holding) >= 2


def test_another_choice_ends_the_one_before(holding):
    assert holding.ask("sense", robot=0, sensors=["temperature"], rate_hz=5.0)["ok"]
    holding.let(3.0)
    assert holding.ask("sense", robot=0, sensors=["smoke"], rate_hz=1.0)["ok"]
    holding.let(4.0)
    assert sensed(holding, "temperature")["rate_hz"] is None
    assert "values" not in sensed(holding, "temperature")
    assert "values" in sensed(holding, "smoke")
    assert holding.ask("sense", robot=0, sensors=[], rate_hz=1.0)["ok"]
    assert sensed(holding, "smoke")["rate_hz"] is None


def test_a_robot_out_of_hand_is_read_no_more(holding):
    assert holding.ask("sense", robot=0, sensors=["temperature"], rate_hz=5.0)["ok"]
    holding.let(3.0)
    sensors = holding.world.seat_sensors
    assert len(sensors._watches) == 1
    assert holding.do("release")[0]
    holding.let(2.0)
    assert sensors._watches == {}


def test_sensors_that_the_rules_withhold_are_refused_in_words(monkeypatch):
    rules = [
        {"levels": ["teleoperation", "sensors"], "sensors": ["temperature"]},
    ]
    page = PhonePage(monkeypatch, access=rules)
    page.register()
    page.permit()
    page.let(2.0)
    done = page.ask("sense", robot=0, sensors=["temperature", "smoke"], rate_hz=1.0)
    assert (done["ok"], done["text"]) == (False, "you may not read smoke")
    page.let(3.0)
    assert "values" in sensed(page, "temperature")
    assert "may read none" in page.ask("sense", robot=0, sensors=["gas"], rate_hz=1.0)["text"]
