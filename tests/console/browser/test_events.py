"""The page Events in the fake world: alarms, decisions, two people at once, hostile words."""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest
from playwright.sync_api import Page, WebSocketRoute, expect

WORLD = ("--robots", "3", "--people", "4", "--site", "office-block")


def cell(page: Page, number: int, text: str) -> None:
    """A row of the table of events says something."""
    row = page.get_by_role("table", name="Events").get_by_role("row")
    found = row.filter(has=page.get_by_role("button", name=f"Event {number}", exact=True))
    expect(found).to_contain_text(text)


def choose(page: Page, number: int) -> None:
    page.get_by_role("button", name=f"Event {number}", exact=True).click()
    panel = page.get_by_role("region", name="Event in hand")
    expect(panel.get_by_role("heading", level=2)).to_contain_text(f"{number} ")
    expect(panel.get_by_role("region", name="Proposal")).to_contain_text("robot-2, 41 s")


@pytest.fixture
def both(fake, shared) -> tuple[Page, Page]:
    """Two people on the page Events of one world."""
    first, second = (shared(fake(*WORLD).drive, "events", person=who) for who in (1, 2))
    return first, second


def raised(page: Page, kind: str = "fire") -> int:
    """Raise an event of one's own, for other tests decide on theirs."""
    page.get_by_label("Kind").select_option(label=kind)
    with new_in_hand(page) as number:
        page.get_by_role("button", name="Raise event").click()
    return number()


@contextmanager
def new_in_hand(page: Page) -> Iterator[Callable[[], int]]:
    """The number of the event that the block raises, once it is in hand.

    Until the answer is here, another event may be in hand, even one of the same kind.
    """
    reported = page.get_by_role("status", name="Raised")
    before = reported.inner_text()
    number = 0
    yield lambda: number
    expect(reported).to_have_text(re.compile(rf"^(?!{before}$)event \d+ is raised$"))
    number = int(reported.inner_text().split()[1])
    heading = page.get_by_role("region", name="Event in hand").get_by_role("heading", level=2)
    expect(heading).to_contain_text(f"{number} ")


def test_an_event_is_acknowledged_and_somebody_is_sent(both):
    page, other = both
    number = raised(page)
    choose(page, number)

    page.get_by_role("button", name="Acknowledge").click()
    cell(other, number, "supervise-")
    expect(page.get_by_role("button", name="Acknowledge")).to_be_disabled()
    proposal = page.get_by_role("region", name="Proposal")
    expect(proposal).to_contain_text("robot-3: 58 s, free")
    page.get_by_label("guard-1").check()
    page.get_by_label("Reason or note").fill("a person has to look")
    page.get_by_role("button", name="Assign").click()
    cell(other, number, "guard-1")
    expect(page.get_by_role("region", name="Event in hand")).to_contain_text("a person has to look")


def test_of_two_who_decide_at_once_the_second_is_told_and_changes_nothing(fake, both, visit):
    page, _ = both
    number = raised(page)
    deaf: list[bool] = []

    def between(ws: WebSocketRoute) -> None:
        """Drop messages to the second page while it is deaf."""
        server = ws.connect_to_server()
        server.on_message(lambda text: None if deaf else ws.send(text))

    visit.context.route_web_socket(re.compile("/ws/state"), between)
    other = visit.open(fake(*WORLD).drive, "events")
    for each in (page, other):
        choose(each, number)
    deaf.append(True)
    page.get_by_label("robot-3").check()
    page.get_by_role("button", name="Assign").click()
    cell(page, number, "robot-3")

    other.get_by_role("button", name="Assign").click()
    expect(other.get_by_role("alert")).to_contain_text("decided meanwhile: assign")
    deaf.clear()
    cell(other, number, "robot-3")


def test_an_alarm_is_seen_and_one_is_shelved_and_comes_back(both):
    page, other = both
    raised(page, "flood")
    alarms = page.get_by_role("region", name="Alarms")
    one = alarms.locator(".alarm").filter(has_text="flood")
    expect(alarms).to_contain_text("not seen")
    expect(one).to_contain_text("unacknowledged")

    one.get_by_role("button", name="Seen").click()
    expect(one).to_contain_text("acknowledged by supervise-")
    expect(other.get_by_role("region", name="Alarms")).to_contain_text("acknowledged by supervise-")
    one.get_by_role("button", name="Shelve for 15 minutes").click()
    expect(alarms.get_by_text("Shelved (1)")).to_be_visible()
    expect(other.get_by_role("region", name="Alarms").get_by_text("Shelved (1)")).to_be_visible()
    alarms.get_by_text("Shelved (1)").click()
    alarms.get_by_role("button", name="Unshelve").click()
    expect(alarms.get_by_text("Shelved (1)")).to_have_count(0)


def test_an_event_is_raised_at_a_place_clicked_on_the_map(both):
    page, other = both
    before = page.get_by_label("x, m").input_value()
    page.locator(".raise .map-ground").click(position={"x": 60, "y": 150})
    expect(page.get_by_label("x, m")).not_to_have_value(before)

    cell(other, raised(page, "gas leak"), "Gas leak")


def test_all_is_done_by_keys_alone(both):
    page, other = both
    expect(page.get_by_role("button", name="Raise event")).to_be_enabled()
    page.get_by_label("Room").focus()
    page.keyboard.press("ArrowDown")
    page.get_by_label("x, m").focus()
    page.keyboard.press("Tab")
    page.keyboard.press("Tab")
    with new_in_hand(page) as raised_number:
        page.keyboard.press("Enter")
    number = raised_number()
    cell(other, number, "Fire")
    page.get_by_role("button", name=f"Event {number}", exact=True).press("Enter")
    page.get_by_role("button", name="Acknowledge").press("Space")
    cell(other, number, "supervise-")


def test_what_needs_words_asks_for_them_and_does_nothing_without(both):
    page, other = both
    number = raised(page)
    choose(page, number)
    page.get_by_role("button", name="False alarm").click()
    expect(page.get_by_text("Enter a reason or note first.")).to_be_visible()
    expect(page.get_by_label("Reason or note")).to_be_focused()

    page.get_by_label("Reason or note").fill("burnt toast")
    page.get_by_role("button", name="False alarm").click()
    cell(other, number, "refuted")


def test_notes_and_names_that_are_html_are_shown_as_they_are(fake, shared):
    evil = "<img src=x onerror=alert(1)>"
    address = fake(*WORLD, "--hostile").drive
    page, other = (shared(address, "events", person=who) for who in (1, 2))
    page.get_by_label("Your name").fill(evil)
    page.get_by_role("button", name="Use this name").click()
    expect(page.get_by_text(f"The log shows you as {evil}")).to_be_visible()
    choose(page, 1)
    page.get_by_label("Reason or note").fill(evil)
    page.get_by_role("button", name="Note", exact=True).click()

    other.get_by_role("button", name="Event 1", exact=True).click()
    expect(other.locator(".note")).to_have_text(evil)
    assert other.locator("img[src=x]").count() == 0
    log = shared(address, "audit", person=2)
    expect(log.get_by_role("table", name="Audit log")).to_contain_text(evil)
    for each in (page, log):
        assert each.locator("img[src=x]").count() == 0


def test_who_may_look_sees_all_and_has_no_buttons(fake, visit):
    page = visit.open(fake(*WORLD).look, "events")
    expect(page.get_by_role("table", name="Events")).to_contain_text("Fire")

    expect(page.get_by_text("This address may look.")).to_be_visible()
    for name in ("Acknowledge", "Assign", "Raise event", "Take over", "Seen", "Shelve"):
        expect(page.get_by_role("button", name=name)).to_have_count(0)


def test_only_what_is_new_stands_out(both):
    page, _ = both
    new = page.locator(".alarm.new")
    expect(page.locator(".alarm")).not_to_have_count(0)
    expect(new).to_have_count(0)  # they are for 5 s
    page.get_by_role("button", name="Pause").click()
    expect(page.get_by_role("button", name="Resume", exact=True)).to_be_visible()
    page.get_by_role("button", name="Raise event").click()

    expect(new).to_have_count(1)
    assert re.search(
        r"new-alarm",
        page.evaluate("getComputedStyle(document.querySelector('.alarm.new')).animationName"),
    )
    page.get_by_role("button", name="Resume", exact=True).click()
