"""The program itself: a drive over 500 ms to the fire, whose recording holds; a real link."""

import re
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from helpers.console.keyboard_driver import NEAR_FIRE, Driver
from helpers.processes.patience import PATIENCE_S, becomes
from helpers.processes.programs import Program, Programs, all_gone_after
from playwright.sync_api import expect

DELAY_S = 0.5
NEAR_M = 2.5  # of the fire: there it can be seen


@pytest.fixture
def programs(tmp_path: Path) -> Iterator[Programs]:
    yield from all_gone_after(tmp_path)


def started(programs: Programs, *words: str | Path) -> tuple[Program, str]:
    """A console, and its address."""
    console = programs.start("console", "--no-open", "--port", "0", *words)
    console.wait_to_say("Console:")
    return console, re.findall(r"^Console: +(\S+)", console.said, re.MULTILINE)[0]


def test_of_a_real_link_nothing_can_be_chosen_but_the_robots_computers(visit, programs):
    _, address = started(programs, "--links", "real")
    page = visit.open(address, "network")

    expect(page.get_by_role("status", name="Link")).to_have_text("real")
    expect(page.get_by_role("slider")).to_have_count(1)
    expect(page.get_by_role("slider", name="Processing time")).to_be_enabled()
    expect(page.get_by_role("button", name="Pause")).to_be_disabled()
    expect(page.get_by_role("button", name="Take the tour")).to_have_count(0)
    page.get_by_role("link", name="Drive").click()
    page.get_by_role("button", name="Take control").click()
    expect(page.get_by_role("button", name="Release control")).to_be_enabled()
    expect(page.locator(".picture-age")).to_contain_text("old")


def test_a_fire_is_reached_by_keys_over_500_ms_and_confirmed(tmp_path, visit, programs):
    record = tmp_path / "drive.mcap"
    console, address = started(programs, "--record", record, *NEAR_FIRE)
    page = visit.open(address, "drive")
    base = address.partition("?")[0]
    page.get_by_role("slider", name="Delay").fill(str(1000 * DELAY_S))
    expect(page.get_by_role("status", name="Link")).to_contain_text("modelled 500 ms")

    order = page.get_by_role("region", name="Order in hand")
    expect(order).to_contain_text("fire", timeout=1000 * PATIENCE_S)
    robot = re.findall(r"Drive (\S+) there", order.inner_text())[0]
    if page.get_by_role("button", name=f"Choose {robot}").count():
        page.get_by_role("button", name=f"Choose {robot}").click()
    driver = Driver(page, base, robot, DELAY_S)
    fire = next(event for event in driver.state()["events"] if event["kind"] == "fire")
    page.get_by_role("button", name="Take control").click()
    driver.drive_to(fire["x_m"], fire["y_m"], NEAR_M)
    page.get_by_role("button", name="Confirm").click()

    assert becomes(lambda: "confirmed" in str(driver.state()["events"]))
    page.close()  # it would complain that nobody is there any more
    console.send(signal.SIGINT)
    assert console.ends() == 0
    checked = programs.start("check", record)
    assert checked.ends() == 0, checked.complained
