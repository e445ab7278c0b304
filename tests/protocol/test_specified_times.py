"""Times in the specification are those of the program."""

import re

import pytest
from helpers.paths import ROOT

from dva_sim.agents import device, dva_watch
from dva_sim.agents.operator import refusals
from dva_sim.agents.robot import controller, robot, sensors
from dva_sim.core import handovers
from dva_sim.protocol import devices
from dva_sim.simulation.scenario import Scenario

PAGE = (ROOT / "protocol/README.md").read_text(encoding="utf-8")
FULL = Scenario()


def passage(opening):
    """The row or the item of a list that begins so, on one line."""
    found = re.search(
        rf"^(?:\| |- (?:\*\*)?){re.escape(opening)}.*?(?=^\||^- |^$|\Z)", PAGE, re.M | re.S
    )
    assert found is not None, opening
    return " ".join(found[0].split())


@pytest.mark.parametrize(
    ("opening", "value"),
    [
        ("registration |", device.RENEW_PERIOD),
        ("heartbeat |", device.HEARTBEAT_PERIOD),
        ("heartbeat |", dva_watch.SILENT_AFTER),
        ("forgetting |", devices.FORGET_AFTER),
        ("watchdog of a robot |", FULL.robot.watchdog_s),
        ("age limit of a command |", FULL.robot.max_age_s),
        ("drive without a valid command |", controller.LEASE_S),
        ("`DevSub` | ends", sensors.LEASE),
        ("`StartTeleOp` or a mission", controller.INQUIRY_WAIT_S),
        ("`STALE`", refusals.LATE_FOR),
        ("The asker repeats", handovers.ANSWER_WITHIN),
        ("The asker repeats", handovers.DECLINED_FOR),
        ("The next session begins", handovers.STOP_WITHIN),
        ("The next session begins", handovers.FETCH_WITHIN),
        ("`OK` is a promise.", FULL.dispatch.depart_within_s),
        ("`OK` is a promise.", FULL.dispatch.still_within_s),
    ],
)
def test_a_time_is_that_of_the_program(opening, value):
    assert f"{value:g} s" in passage(opening)


def test_a_robot_reports_its_status_each_second():
    rows = (ROOT / "protocol/messages.csv").read_text(encoding="utf-8").splitlines()
    (row,) = [line for line in rows if line.startswith("RobotStatus,")]
    assert robot.STATUS_PERIOD == 1.0
    assert "each second" in row
