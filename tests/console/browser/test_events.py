"""The page Events in the fake world: alarms, decisions, two people at once, hostile words."""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest
from helpers.processes.patience import becomes
from playwright.sync_api import Locator, Page, WebSocketRoute, expect

NUMBERS = "rows => rows.map(row => row.dataset.event)"
WORLD = ("--robots", "3", "--people", "4", "--site", "office-block")


def cell(page: Page, number: int, text: str) -> None:
    """The row of an event says something, be it open or folded among the closed ones."""
    expect(page.locator(f'[data-event="{number}"]')).to_contain_text(text)


def row_of(page: Page, number: int) -> Locator:
    return page.get_by_role("button", name=re.compile(f"^Event {number} "))


def choose(page: Page, number: int) -> None:
    row_of(page, number).click()
    panel = page.get_by_role("region", name="Event in hand")
    expect(panel.get_by_role("heading", level=2)).to_contain_text(f"{number} ")
    expect(panel.get_by_role("region", name="Proposal")).to_contain_text("proposes robot-2")
    expect(panel.get_by_role("button", name="Send robot-2, 41 s")).to_be_enabled()


@pytest.fixture
def both(fake, shared) -> tuple[Page, Page]:
    """Two people on the page Events of one world."""
    first, second = (shared(fake(*WORLD).drive, "events", person=who) for who in (1, 2))
    return first, second


def raised(page: Page, kind: str = "fire") -> int:
    """Raise an event of one's own, for other tests decide on theirs."""
    page.get_by_role("button", name="Raise an event").click()
    page.get_by_label("Kind").select_option(label=kind)
    with new_in_hand(page) as number:
        page.get_by_role("button", name="Raise event").click()
    return number()


@contextmanager
def new_in_hand(page: Page) -> Iterator[Callable[[], int]]:
    """The number of the event that the block raises, once it is in hand.

    Until the answer is here, another event may be in hand, even one of the same kind.
    """
    before = page.locator("[data-event]").evaluate_all(NUMBERS)
    heading = page.get_by_role("region", name="Event in hand").get_by_role("heading", level=2)
    number = 0
    yield lambda: number
    expect(heading).to_be_visible()
    assert becomes(lambda: heading.inner_text().split()[0] not in before)
    number = int(heading.inner_text().split()[0])


def test_an_event_is_acknowledged_and_somebody_is_sent(both):
    page, other = both
    number = raised(page)
    choose(page, number)

    page.get_by_role("button", name="Acknowledge").click()
    cell(other, number, "supervise-")
    expect(page.get_by_role("button", name="Acknowledge")).to_have_count(0)
    page.get_by_role("radio", name="guard-1").check()
    page.get_by_label("Reason or note").fill("a person has to look")
    page.get_by_role("button", name="Send guard-1, 74 s").click()
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
    page.get_by_role("radio", name="robot-3").check()
    page.get_by_role("button", name="Send robot-3, 58 s").click()
    cell(page, number, "robot-3")

    other.get_by_role("button", name="Send robot-2, 41 s").click()
    expect(other.get_by_role("alert")).to_contain_text("decided meanwhile: assign")
    deaf.clear()
    cell(other, number, "robot-3")


def test_an_alarm_is_seen_and_one_is_shelved_and_comes_back(both):
    page, other = both
    number = raised(page, "flood")
    lists = [each.get_by_role("region", name="Events") for each in (page, other)]
    unseen = page.locator(f'.desk-row.unacknowledged[data-event="{number}"]')
    expect(unseen).to_be_visible()

    page.get_by_role("button", name="Acknowledge", exact=True).click()
    for each in (page, other):
        cell(each, number, "supervise-")
    expect(unseen).to_have_count(0)
    panel = page.get_by_role("region", name="Event in hand")
    panel.get_by_role("button", name=re.compile("^Shelve: ")).click()
    panel.get_by_label("Why").fill("a drill")
    panel.get_by_role("button", name="Shelve it").click()
    for each in lists:
        expect(each.get_by_text("Shelved (1)")).to_be_visible()
    expect(row_of(other, number)).to_have_count(0)
    lists[0].get_by_role("button", name="Unshelve").click()
    expect(lists[0].get_by_text("Shelved (1)")).to_have_count(0)
    expect(row_of(other, number)).to_be_visible()


def test_an_event_is_raised_at_a_place_clicked_on_the_map(both):
    page, other = both
    page.get_by_role("button", name="Raise an event").click()
    before = page.get_by_label("x, m").input_value()
    page.locator(".sight .map-ground").click(position={"x": 60, "y": 150})
    expect(page.get_by_label("x, m")).not_to_have_value(before)

    page.get_by_label("Kind").select_option(label="gas leak")
    with new_in_hand(page) as number:
        page.get_by_role("button", name="Raise event").click()
    cell(other, number(), "Gas leak")


def test_all_is_done_by_keys_alone(both):
    page, other = both
    page.get_by_role("button", name="Raise an event").press("Enter")
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
    row_of(page, number).press("Enter")
    page.keyboard.press("a")
    cell(other, number, "supervise-")
    page.keyboard.press("3")
    expect(page.get_by_role("button", name="Send guard-1, 74 s")).to_be_enabled()
    page.keyboard.press("Shift+S")
    cell(other, number, "guard-1")
    page.keyboard.press("j")
    heading = page.get_by_role("region", name="Event in hand").get_by_role("heading", level=2)
    expect(heading).not_to_contain_text(f"{number} ")
    page.keyboard.press("k")
    expect(heading).to_contain_text(f"{number} ")


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
    page.locator(".desk-head summary").click()
    page.get_by_label("Your name").fill(evil)
    page.get_by_role("button", name="Use this name").click()
    expect(page.get_by_text(f"The log shows you as {evil}")).to_be_visible()
    choose(page, 1)
    page.get_by_label("Reason or note").fill(evil)
    page.get_by_role("button", name="Note", exact=True).click()

    row_of(other, 1).click()
    expect(other.locator(".note")).to_have_text(evil)
    assert other.locator("img[src=x]").count() == 0
    log = shared(address, "audit", person=2)
    expect(log.get_by_role("table", name="Audit log")).to_contain_text(evil)
    for each in (page, log):
        assert each.locator("img[src=x]").count() == 0


def test_who_may_look_sees_all_and_has_no_buttons(fake, visit):
    page = visit.open(fake(*WORLD).look, "events")
    cell(page, 1, "Fire")

    expect(page.get_by_text("This address may look.")).to_be_visible()
    for name in ("Acknowledge", "Send", "Raise", "Take over", "Shelve"):
        expect(page.get_by_role("button", name=name)).to_have_count(0)


def test_only_what_is_new_stands_out(both):
    page, _ = both
    new = page.locator(".desk-row.new")
    expect(page.locator(".desk-row")).not_to_have_count(0)
    expect(new).to_have_count(0)  # they are for 5 s
    page.get_by_role("button", name="Pause").click()
    expect(page.get_by_role("button", name="Resume", exact=True)).to_be_visible()
    raised(page)

    expect(new).to_have_count(1)
    assert re.search(
        r"new-alarm",
        page.evaluate("getComputedStyle(document.querySelector('.desk-row.new')).animationName"),
    )
    page.get_by_role("button", name="Resume", exact=True).click()
