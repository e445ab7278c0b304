"""A phone on the program itself: from the scan to the tables, over modelled and over real links."""

import re
import signal

import pytest
from helpers.console.browser_phone import FORWARDS, Hand
from helpers.console.console_program import PHONES, started
from helpers.processes.patience import becomes
from playwright.sync_api import expect

from dva_sim.experiments.results.results import Results

SCREEN = {"width": 360, "height": 740, "has_touch": True, "is_mobile": True}
UNTRUSTED = {"ignore_https_errors": True}  # a certificate of this machine
ROBOT = "robot-1"
STATE = "fetch('/api/state').then((answer) => answer.json())"


def mode(hand: Hand) -> str:
    """Mode of the robot, as published."""
    robots = hand.page.evaluate(STATE)["robots"]
    return str(next(one["mode"] for one in robots if one["label"] == ROBOT))


def start(hand: Hand) -> None:
    """Begin to drive; on a machine that does much else, robots are held now and then."""
    button = hand.page.get_by_role("button", name="Start", exact=True)

    def is_driven() -> bool:
        if mode(hand) != "Teleoperation" and button.is_enabled():
            button.tap()
        hand.page.wait_for_timeout(1000)
        return mode(hand) == "Teleoperation"

    assert becomes(is_driven)


@pytest.mark.parametrize("links", ["modelled", "real"])
def test_a_phone_registers_drives_by_tilt_and_is_a_row(visits, programs, tmp_path, links):
    record, out, motion = tmp_path / "run.mcap", tmp_path / "out", tmp_path / "motion"
    words = ("--record", record, "-o", out, "--keep-motion", motion, "--links", links)
    console, _ = started(programs, *PHONES, *words)
    console.wait_to_say("Each phone must trust this computer once")
    phone = re.findall(r"^Phone: (\S+)", console.output, re.MULTILINE)[0]

    hand = Hand(visits(**SCREEN, **UNTRUSTED), phone)
    hand.register("Jane's phone")
    hand.take(ROBOT)
    expect(hand.page.get_by_text("is in your hands")).to_be_visible()
    hand.go("Calibration")
    hand.page.get_by_label("keep my motion").check()
    hand.calibrate()
    hand.go("Teleoperation")
    start(hand)
    hand.tilt(FORWARDS)
    hand.speed("0.20")
    assert becomes(lambda: hand.page.evaluate(STATE)["robots"][0]["set_speed_mps"] > 0.1)
    hand.page.wait_for_timeout(2000)
    hand.swipe(200)
    assert becomes(lambda: mode(hand) == "Idle")
    hand.page.close()
    console.send(signal.SIGINT)
    assert console.ends() == 0, console.complained

    check = programs.start("check", record)
    assert check.ends() == 0, check.output
    drives = Results.load(out).table("drives")
    assert set(drives["person_label"]) == {"person-1"}
    assert set(drives["pipeline"]) == {"default"}
    assert 20 < drives["sensor_hz"][-1] < 80
    assert sum(drives["commands_applied"]) > 5
    token = phone.rpartition("token=")[2]
    kept = [path for path in tmp_path.rglob("*") if path.is_file()]
    printed = {path for path in kept if token.encode() in path.read_bytes()}
    assert all(path.suffix == ".out" for path in printed), printed  # what the terminal showed
    assert not any(b"BEGIN" in path.read_bytes() and b"KEY" in path.read_bytes() for path in kept)
    log = programs.start("phone-log", motion / "motion-1.csv")
    assert log.ends() == 0, log.complained
    assert "Jane" not in (motion / "motion-1.csv").read_text()
