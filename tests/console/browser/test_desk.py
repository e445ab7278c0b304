"""The desk at a running world: two people, one event, from its report to the change of shift."""

import json
import re
from functools import partial
from pathlib import Path

import pytest
from helpers.console.changed_lines import sockets_of
from helpers.console.console_program import started
from helpers.console.driving_page import start, take
from helpers.processes.patience import PATIENCE_S, becomes
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


def raised(page: Page, room: str = "Kitchen", severity: str = "high") -> None:
    page.get_by_role("button", name="Raise an event").click()
    page.get_by_label("Room").select_option(label=room)
    page.get_by_label("Severity").select_option(label=severity)
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
    send(page, "robot-2")
    expect(unseen(page)).to_have_count(0)  # who has sent somebody has seen it
    other.get_by_role("link", name="Map").click()
    page.get_by_role("button", name="Shift", exact=True).click()
    shift = page.get_by_role("region", name="Shift")
    expect(shift).to_contain_text("Event 1, fire, Kitchen, high: supervise-")
    expect(shift).to_contain_text("Event 1 Reported")
    shift.get_by_label("Note for them").fill("smoke in the canteen")
    shift.get_by_role("button", name="Hand over all I have").click()
    expect(shift).to_contain_text("has not answered yet")

    offer = other.get_by_role("alert").filter(has_text="hands over to you")
    expect(offer).to_contain_text("event 1, robot-2, all that they have. “smoke in the canteen”")
    offer.get_by_role("button", name="Take over").click()
    other.get_by_role("link", name="Events").click()
    expect(offer).to_have_count(0)
    expect(shift).to_contain_text("has taken over: event 1, robot-2")
    expect(panel(other).get_by_role("button", name="Confirm")).to_be_visible(
        timeout=1000 * PATIENCE_S
    )
    expect(panel(other)).to_contain_text("Answers for it")
    expect(panel(page).get_by_role("button", name="Confirm")).to_have_count(0)


def unseen(page: Page):
    return page.locator(".desk-row.unacknowledged, .desk-row.returned")


def test_an_alarm_that_has_become_graver_is_acknowledged_again(both):
    page, other = both
    raised(page, severity="low")
    page.keyboard.press("a")
    expect(unseen(page)).to_have_count(0)
    raised(other, severity="critical")
    expect(unseen(page).filter(has_text="critical")).to_have_count(1)
    expect(page).to_have_title("(1) Fire, Kitchen")

    panel(page).get_by_role("button", name="Acknowledge", exact=True).click()
    expect(unseen(page)).to_have_count(0)
    expect(page).to_have_title(re.compile("^Events"))


def test_who_ends_an_event_has_seen_its_alarm(both):
    page, _ = both
    raised(page)
    panel(page).get_by_label("Reason or note").fill("welding")
    panel(page).get_by_role("button", name="False alarm").click()
    expect(page.get_by_role("region", name="Events")).to_contain_text("Refuted (1)")
    expect(unseen(page)).to_have_count(0)


def test_what_is_over_stands_below_what_is_open(address, visits):
    page = visits(1440, 900).open(address, "events")
    base, _, token = address.partition("?token=")
    head = {"Authorization": f"Bearer {token}"}
    rows = page.get_by_role("list", name="Open events and alarms").get_by_role("listitem")
    for action, text in [("emergency", "until released"), ("release_emergency", "over, not ackn")]:
        request = {"id": action, "action": action, "arguments": {}}
        assert page.request.post(f"{base}api/actions", headers=head, data=request).json()["ok"]
        expect(rows).to_have_text([re.compile(f"Emergency stop.*{text}")])
    raised(page, severity="low")
    expect(rows).to_have_text([re.compile("Fire, Kitchen"), re.compile("Emergency.*over, not")])


def test_what_is_shelved_is_counted_as_open(both):
    page, _ = both
    raised(page)
    panel(page).get_by_role("button", name="Shelve: Fire").click()
    panel(page).get_by_label("Why").fill("a drill")
    panel(page).get_by_role("button", name="Shelve it").click()
    for each in both:
        expect(each.get_by_role("region", name="Events")).to_contain_text("1 open, 1 not")
        expect(each.get_by_text("No open event is listed here.")).to_be_visible()


def test_a_person_drives_a_robot_to_the_event_and_the_event_is_theirs(both):
    page, other = both
    raised(page)
    panel(page).locator(".candidate").filter(has_text="robot-2").get_by_role("radio").check()
    panel(page).get_by_label("I drive").check()
    panel(page).get_by_role("button", name="Drive robot-2 there").click()

    order = page.get_by_role("region", name="Order in hand")
    expect(order).to_contain_text("Drive robot-2 there", timeout=1000 * PATIENCE_S)
    row = other.get_by_role("region", name="Events").locator("[data-event='1']")
    expect(row).to_contain_text("robot-2, console-")
    expect(row).to_contain_text("assigned")
    page.get_by_role("link", name="Events").click()
    raised(page, "Workshop")
    panel(page).locator(".candidate").filter(has_text="robot-1").get_by_role("radio").check()
    expect(panel(page).get_by_label("by itself")).to_be_checked()  # the next one is no drive


def test_who_leaves_the_page_in_a_drive_ends_it_and_no_robot_counts_as_lost(both):
    page, other = both
    page.get_by_role("link", name="Drive").click()
    take(page)
    start(page)
    page.get_by_role("link", name="Events").click()
    other.get_by_role("link", name="Map").click()
    robots = other.get_by_role("listitem").filter(has_text="robot-1")
    expect(robots).to_contain_text("Idle", timeout=1000 * PATIENCE_S)


def test_a_robot_on_its_rounds_is_sent_by_itself(tmp_path, programs, visits):
    rounds = "patrols: [{robot: robot-2, places: [Kitchen, Workshop]}]\noperator: {count: 1}\n"
    file = tmp_path / "rounds.yaml"
    file.write_text(SCENARIO.replace("instructions: {fire: fire.md}\n", rounds))
    page = visits(1440, 900).open(started(programs, file)[1], "events")
    raised(page)
    send(page, "robot-2")
    row = page.get_by_role("region", name="Events").locator("[data-event='1']")
    expect(row).to_contain_text("robot-2, supervise-", timeout=1000 * PATIENCE_S)


def test_another_responder_is_sent_instead_of_the_one_who_is_on_the_way(both):
    page, _ = both
    raised(page)
    send(page, "robot-2")
    expect(panel(page).get_by_role("button", name="Take off robot-2")).to_be_visible(
        timeout=1000 * PATIENCE_S
    )
    panel(page).locator(".candidate").filter(has_text="guard-1").get_by_role("radio").check()
    instead = panel(page).get_by_role("button", name="Send guard-1 instead of robot-2")
    expect(instead).to_be_visible()
    expect(instead).not_to_have_class("primary")


RENAMED = """() => new Promise(done => new MutationObserver(() => {
  const button = document.querySelector('[data-deed=send]');
  if (button?.textContent.includes('robot-1')) done(button.disabled);
}).observe(document.querySelector('.desk-panel'),
  {subtree: true, childList: true, characterData: true}))"""


def test_a_button_whose_proposal_has_changed_is_not_pressed_by_mistake(address, visits):
    visit = visits(1440, 900)
    robots: list[str] = ["robot-2"]

    def proposes(text: str) -> str:
        line = json.loads(text)
        if proposal := line.get("proposal"):
            proposal["label"] = robots[-1]
        return json.dumps(line)

    sockets_of(visit.context, "drive", proposes)
    page = visit.open(address, "events")
    raised(page)
    expect(panel(page).get_by_role("button", name="Send robot-2")).to_be_enabled()
    robots.append("robot-1")
    assert page.evaluate(RENAMED)
    expect(panel(page).get_by_role("button", name="Send robot-1")).to_be_enabled()


def test_the_worst_alarm_opens_by_a_key_on_each_page(both):
    page, other = both
    other.get_by_role("link", name="Robots").click()
    raised(page)
    expect(other.get_by_role("region", name="Worst alarm")).to_be_visible()
    other.keyboard.press("e")
    expect(panel(other)).to_contain_text("1 Fire, Kitchen")


IS_WHOLE = "one => one.getBoundingClientRect().bottom <= innerHeight"
PAIR = "button => [getComputedStyle(button).color, getComputedStyle(button).backgroundColor]"


@pytest.mark.parametrize("name", ["Shift", "Sound of alarms"])
def test_a_pressed_button_is_seen_also_under_the_pointer(both, name):
    page, _ = both
    button = page.get_by_role("button", name=name, exact=True)
    button.click()
    expect(button).to_have_attribute("aria-pressed", "true")
    pressed = button.evaluate(PAIR)
    page.mouse.move(700, 400)
    assert button.evaluate(PAIR) == pressed
    assert "rgba" not in str(pressed)


@pytest.mark.parametrize(("width", "height"), [(1440, 900), (1024, 768), (390, 844)])
def test_the_desk_needs_no_scrolling_aside_nor_for_its_main_buttons(address, visits, width, height):
    page = visits(width, height).open(address, "events")
    raised(page)
    panel(page).get_by_role("button", name=re.compile("^Send")).wait_for(timeout=1000 * PATIENCE_S)
    for name in ("Send", "Acknowledge", "False alarm", "Note"):  # in a control room none is below
        button = panel(page).get_by_role("button", name=re.compile(f"^{name}"))
        # While the machine is late, a line at the top says so, and moves all that is below.
        assert width < 1024 or becomes(partial(button.evaluate, IS_WHOLE)), name
    panel(page).get_by_role("button", name="Shelve: Fire").click()
    for name in ("Event in hand", "Shift"):
        if name == "Shift":
            page.get_by_role("button", name="Shift", exact=True).click()
        region = page.get_by_role("region", name=name)
        expect(region).to_be_visible()
        assert region.evaluate("region => region.scrollWidth <= region.clientWidth")
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
