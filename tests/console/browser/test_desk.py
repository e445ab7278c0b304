"""The desk at a running world: two people, one event, from its report to the change of shift."""

import re
from pathlib import Path

import pytest
from helpers.console.console_program import started
from helpers.processes.patience import PATIENCE_S
from playwright.sync_api import Page, expect

SCENARIO = """\
robot: {count: 2, way_m: 16}
guard: {count: 1, mobilisation_s: 60}
bystander: {count: 0}
events: [{kind: gas_leak, room: Workshop, at_s: 3000, reported: true}]
dispatch: {containment: true, mode: ask_first}
instructions: {fire: fire.md}
horizon_s: 3600
"""
STEPS = "# Fire\n- [ ] Ring 112\n- Close the doors\n"


@pytest.fixture
def address(tmp_path: Path, programs) -> str:
    (tmp_path / "fire.md").write_text(STEPS)
    file = tmp_path / "desk.yaml"
    file.write_text(SCENARIO)
    return started(programs, file)[1]


@pytest.fixture
def both(address, visits) -> tuple[Page, Page]:
    """Two people at desks of two sizes."""
    return visits(1440, 900).open(address, "events"), visits(1024, 768).open(address, "events")


def raised(page: Page, room: str = "Kitchen") -> None:
    page.get_by_role("button", name="Raise an event").click()
    page.get_by_label("Room").select_option(label=room)
    page.get_by_role("button", name="Raise event", exact=True).click()
    expect(panel(page)).to_contain_text(f"Fire, {room}")


def panel(page: Page):
    return page.get_by_role("region", name="Event in hand")


def send(page: Page, robot: str) -> None:
    """Send a robot by itself."""
    row = panel(page).locator(".candidate").filter(has_text=robot)
    row.get_by_role("radio").check(timeout=1000 * PATIENCE_S)
    panel(page).get_by_label("by itself").check()
    panel(page).get_by_role("button", name=re.compile(f"^Send {robot}")).click()


def test_a_robot_that_a_person_sends_is_theirs_until_they_say_what_is_there(both):
    page, other = both
    raised(page)
    send(page, "robot-2")
    row = other.get_by_role("region", name="Events").locator("[data-event='1']")
    expect(row).to_contain_text("robot-2, supervise-", timeout=1000 * PATIENCE_S)
    expect(row).to_contain_text("assigned")
    expect(panel(other).get_by_role("button", name="Confirm")).to_have_count(0)

    panel(page).get_by_role("button", name="Confirm").click()
    expect(row).to_contain_text("confirmed", timeout=1000 * PATIENCE_S)
    history = panel(page).get_by_role("list").filter(has_text="Reported")
    for step in ("Reported", "Raised here by supervise-", "Sent by supervise-", "Confirmed"):
        expect(history).to_contain_text(step)


def test_steps_of_the_instructions_are_ticked_and_seen_by_the_colleague(both):
    page, other = both
    raised(page)
    other.get_by_role("button", name=re.compile("^Event 1 Fire")).click()
    panel(page).get_by_label("Ring 112").check()
    expect(panel(other)).to_contain_text("Instructions (1 of 2 done)", timeout=1000 * PATIENCE_S)
    expect(panel(other).get_by_label("Ring 112")).to_be_checked()


def test_an_alarm_is_shelved_with_a_reason_that_the_colleague_sees(both):
    page, other = both
    raised(page)
    panel(page).get_by_role("button", name="Shelve: Fire").click()
    expect(panel(page).get_by_role("button", name="Shelve it")).to_be_disabled()
    panel(page).get_by_label("For how long").select_option(label="1 hour")
    panel(page).get_by_label("Why").fill("a drill")
    panel(page).get_by_role("button", name="Shelve it").click()

    shelf = other.get_by_role("region", name="Events").locator(".shelved")
    expect(shelf).to_contain_text("Fire, Kitchen")
    expect(shelf).to_contain_text("a drill")
    shelf.get_by_role("button", name=re.compile("^Fire")).click()
    expect(panel(other)).to_contain_text(re.compile("Shelvedby supervise-.: a drill"))


def test_a_shift_is_handed_over_with_event_robot_and_note(both):
    page, other = both
    raised(page)
    page.get_by_role("button", name="Acknowledge", exact=True).click()
    send(page, "robot-2")
    page.get_by_role("button", name="Shift", exact=True).click()
    shift = page.get_by_role("region", name="Shift")
    expect(shift).to_contain_text("Event 1, high: supervise-")
    expect(shift).to_contain_text("Event 1 Reported")
    shift.get_by_label("Note for them").fill("smoke in the canteen")
    shift.get_by_role("button", name="Hand over all I have").click()
    expect(shift).to_contain_text("has not answered yet")

    offer = other.get_by_role("alert").filter(has_text="hands over to you")
    expect(offer).to_contain_text("event 1, robot-2, all that they have. “smoke in the canteen”")
    offer.get_by_role("button", name="Take over").click()
    expect(offer).to_have_count(0)
    expect(panel(other).get_by_role("button", name="Confirm")).to_be_visible(
        timeout=1000 * PATIENCE_S
    )
    expect(panel(other)).to_contain_text("Answers for it")
    expect(panel(page).get_by_role("button", name="Confirm")).to_have_count(0)


@pytest.mark.parametrize(("width", "height"), [(1440, 900), (1024, 768), (390, 844)])
def test_the_desk_needs_no_scrolling_aside_at_any_size(address, visits, width, height):
    page = visits(width, height).open(address, "events")
    raised(page)
    panel(page).get_by_role("button", name="Shelve: Fire").click()
    for name in ("Event in hand", "Shift"):
        if name == "Shift":
            page.get_by_role("button", name="Shift", exact=True).click()
        region = page.get_by_role("region", name=name)
        expect(region).to_be_visible()
        assert region.evaluate("region => region.scrollWidth <= region.clientWidth")
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
