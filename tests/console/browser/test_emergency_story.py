"""The program itself, in an emergency: each role sees the same, and only some may release.

What each sees once anybody has pressed the button, for two simulated minutes:

- every page and phone: who has stopped which robots, and when; mode Emergency wherever a mode is;
- dispatchers and supervisors: *Release* in that bar; all others: the bar alone;
- the robot's page: *Take manual control* cannot be pressed.
"""

from __future__ import annotations

import re

import pytest
from helpers.console.console_program import PHONES, started
from helpers.processes.patience import PATIENCE_S, becomes
from playwright.sync_api import expect

ROBOTS = ("robot-1", "robot-2", "robot-3")
WITH_MODES = ("map", "robots", "robots/robot-1", "drive", "devices", "network")
PAGES = (*WITH_MODES, "events", "main", "audit")
WATCHED_S = 120.0
FASTER = 8


def seconds(page):
    """Simulated time as the page shows it [s]."""
    hours, minutes, rest = page.locator("header.bar .time .figure").inner_text().split(":")
    return 3600 * int(hours) + 60 * int(minutes) + float(rest)


@pytest.mark.parametrize("presser", ["supervise", "look", "phone"])
def test_everybody_sees_an_emergency_and_nothing_drives_until_a_dispatcher_releases_it(
    visits, programs, presser
):
    words = ["campus-patrol", "--set", "bystander.count=0", *PHONES]
    console, _ = started(programs, *words)
    console.wait_to_say("Phone:")
    said = dict(re.findall(r"^(Console|Look only|Phone): +(\S+)$", console.output, re.MULTILINE))
    addresses = {"supervise": said["Console"], "look": said["Look only"], "phone": said["Phone"]}
    pages = {role: visits(ignore_https_errors=True).tab() for role in addresses}
    for role, address in addresses.items():
        pages[role].goto(address)
    master = pages["supervise"]
    expect(master.locator("header.bar")).to_be_visible(timeout=1000 * PATIENCE_S)
    assert becomes(lambda: seconds(master) > 12.0)
    pages[presser].get_by_role("button", name="Emergency stop").click()
    bar = re.compile(r"Stopped by .* · robot-1, robot-2, robot-3")
    for page in pages.values():
        expect(page.locator(".emergency-bar")).to_have_text(bar, timeout=1000 * PATIENCE_S)
    for role in ("look", "phone"):
        assert pages[role].get_by_role("button", name="Release").count() == 0

    for name in PAGES:
        master.goto(f"{master.url.partition('#')[0]}#/{name}")
        expect(master.locator(".emergency-bar")).to_have_text(bar)
        if name in WITH_MODES:
            expect(master.locator("main")).to_contain_text("Emergency")
            expect(master.locator("main")).not_to_contain_text("Idle")
    master.goto(f"{master.url.partition('#')[0]}#/robots/robot-1")
    expect(master.get_by_role("button", name="Take manual control")).to_be_disabled()

    since = seconds(master)
    pace = f"act('pace', {{factor: {FASTER}}})"
    master.evaluate(f"import('/static/js/net/actions.js').then((m) => m.{pace})")
    assert becomes(lambda: seconds(master) > since + WATCHED_S)
    master.goto(f"{master.url.partition('#')[0]}#/robots")
    for robot in ROBOTS:
        row = master.get_by_role("listitem").filter(has=master.get_by_role("link", name=robot))
        expect(row).to_contain_text("Emergency")
        expect(row).to_contain_text("0.00 m/s")

    master.get_by_role("button", name="Release robot-1, robot-2, robot-3").click()
    for page in pages.values():
        expect(page.locator(".emergency-bar")).to_have_count(0, timeout=1000 * PATIENCE_S)
    expect(master.locator("main")).not_to_contain_text("Emergency")
