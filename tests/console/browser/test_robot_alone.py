"""`dva-sim robot`: one robot with its windows, at a DVA that knows nothing of it, driven by a
client that is none of this program's.
"""

import re
import signal
import subprocess
import sys

from helpers.console.accessibility import faults
from helpers.paths import ROOT
from helpers.processes.patience import PATIENCE_S
from helpers.processes.programs import Program, Programs
from playwright.sync_api import Page, expect

from dva_sim.console.robots.robot_station import two_free_ports

# The client sends no heartbeats: a robot that takes seconds for each message would lose it.
QUICK = "--set", "robot.processing_s=0.05"
CLIENT = ROOT / "protocol" / "clients" / "client.py"
"""The one beside the specification: ZeroMQ and text, and nothing of this program."""


def a_dva(programs: Programs) -> str:
    """The address of a DVA on its own."""
    address = f"127.0.0.1:{two_free_ports('127.0.0.1')}"
    words = ("--dva", address, "--for", "600", "--no-page")
    programs.start("live", "hands-on", "--only", "dva", *words)
    return address


def a_robot(programs: Programs, visit, *words: str) -> tuple[Program, Page, str]:
    """A robot, its page and the address at which it will listen."""
    robot = programs.start("robot", *words, "--no-open", "--port", "0")
    robot.wait_to_say("Console:", "Robot:")
    page = visit.tab()
    page.goto(re.findall(r"^Console: +(\S+)", robot.output, re.MULTILINE)[0])
    expect(page.get_by_role("list", name="State")).to_be_visible()
    return robot, page, re.findall(r"^Robot: +(\S+)", robot.output, re.MULTILINE)[0]


def state(page: Page) -> str:
    return page.get_by_role("list", name="State").locator("[aria-current]").inner_text()


def test_a_robot_is_registered_opened_driven_by_a_strange_client_and_switched_off(visit, programs):
    dva = a_dva(programs)
    robot, page, address = a_robot(programs, visit)
    assert state(page) == "off"
    expect(page.get_by_role("button", name="Open port")).to_be_disabled()
    expect(page.get_by_role("button", name="Take manual control")).to_be_disabled()
    expect(page.get_by_text("registered and listening first")).to_be_visible()

    page.get_by_label("DVA").fill(dva)
    page.get_by_role("button", name="Register").click()
    station = page.get_by_role("status", name="Station")
    expect(station).to_contain_text("its port is closed", timeout=1000 * PATIENCE_S)
    page.get_by_role("button", name="Open port").click()
    expect(station).to_contain_text(f"listening on {address}")
    expect(page.locator(".picture-age")).to_contain_text("old")

    ended = subprocess.run(
        [sys.executable, CLIENT, dva], capture_output=True, text=True, timeout=PATIENCE_S
    )
    assert "code 0" in ended.stdout, ended.stderr
    log = page.get_by_role("table", name="Messages")
    expect(log).to_contain_text("StopTeleOp")
    kinds = [row.split()[0] for row in log.locator("td.payload").all_inner_texts()]
    assert kinds[0] == "StartTeleOp"
    assert kinds[-1] == "StopTeleOp"
    assert kinds.count("SetTeleOp") == 20
    latency = page.get_by_role("table", name="Latency").get_by_role("row")
    expect(latency.filter(has_text="Request to reply")).not_to_contain_text("–")
    expect(latency.filter(has_text="Client to robot")).to_contain_text("–")  # no clock is shared

    page.get_by_role("button", name="Take manual control").click()
    expect(page.get_by_text("busy: held by")).to_be_visible()  # the client has gone with it
    page.get_by_role("button", name="Switch off").click()
    expect(station).to_contain_text("The robot is off")
    assert faults(page) == []
    page.close()
    robot.send(signal.SIGINT)
    assert robot.ends() == 0


def test_a_robot_that_registers_at_once_is_driven_by_hand_and_busy_for_a_client_meanwhile(
    visit, programs
):
    dva = a_dva(programs)
    robot, page, _ = a_robot(programs, visit, "pibot", "--dva", dva, *QUICK)
    robot.wait_to_say("registered at", "listening on")
    expect(page.get_by_role("list", name="State")).to_contain_text("Idle")
    page.get_by_role("button", name="Take manual control").click()
    expect(page.get_by_role("status", name="Manual control")).to_contain_text(
        "You control it manually"
    )
    page.keyboard.down("ArrowUp")
    expect(page.get_by_role("region", name="Side view")).to_contain_text("100 % PWM")
    page.keyboard.up("ArrowUp")

    other = subprocess.Popen([sys.executable, CLIENT, dva], stdout=subprocess.PIPE)
    log = page.get_by_role("table", name="Messages")
    expect(log).to_contain_text("busy: driven by hand", timeout=1000 * PATIENCE_S)
    page.get_by_role("button", name="Emergency stop").click()
    expect(page.get_by_role("status", name="Reason")).to_contain_text("by its own button")
    text, _ = other.communicate(timeout=2 * PATIENCE_S)
    assert b"code 0" in text


def test_a_dva_that_is_not_there_is_told_and_the_robot_stays_off(visit, programs):
    nobody = f"127.0.0.1:{two_free_ports('127.0.0.1')}"
    _, page, _ = a_robot(programs, visit, "--set", "request.timeout_s=0.5")
    page.get_by_label("DVA").fill("nowhere")
    page.get_by_role("button", name="Register").click()
    expect(page.get_by_text("should be HOST:PORT").first).to_be_visible()
    page.get_by_label("DVA").fill(nobody)
    page.get_by_role("button", name="Register").click()
    reported = page.get_by_role("status", name="Station")
    expect(reported).to_contain_text(f"no DVA answers at {nobody} within 1.5 s")
    assert state(page) == "off"
    assert [link.inner_text() for link in page.locator(".rail a").all()] == [
        "Map",
        "Robots",
        "Audit",
    ]
