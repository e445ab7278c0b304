"""The page Events: alarms, decisions, two people at once, hostile words."""

import re

import pytest
from helpers.console.changed_lines import HOSTILE, sockets_of
from helpers.console.desk import ASKS, another, choose, new_in_hand, raised, row_of, sends
from playwright.sync_api import Page, expect


def cell(page: Page, number: int, text: str) -> None:
    """The row of an event says something, be it open or folded among the closed ones."""
    expect(page.locator(f'[data-event="{number}"]')).to_contain_text(text)


@pytest.fixture
def both(console, shared) -> tuple[Page, Page]:
    """Two people on the page Events of one console."""
    first, second = (shared(console(*ASKS).drive, "events", person=who) for who in (1, 2))
    return first, second


def test_an_event_is_acknowledged_and_somebody_is_sent(both):
    page, other = both
    number = raised(page)
    choose(page, number)

    page.get_by_role("button", name="Acknowledge", exact=True).click()
    cell(other, number, "supervise-")
    expect(page.get_by_role("button", name="Acknowledge", exact=True)).to_have_count(0)
    guard = another(page)
    page.get_by_label("Reason or note").fill("a person has to look")
    sends(page, guard).click()
    cell(other, number, guard)
    expect(page.get_by_role("region", name="Event in hand")).to_contain_text("a person has to look")


def test_of_two_who_decide_at_once_the_second_is_told_and_changes_nothing(console, both, visit):
    page, _ = both
    number = raised(page)
    deaf: list[bool] = []
    sockets_of(visit.context, "state", lambda text: None if deaf else text)
    other = visit.open(console(*ASKS).drive, "events")
    for each in (page, other):
        choose(each, number)
    deaf.append(True)
    guard = another(page)
    sends(page, guard).click()
    cell(page, number, guard)

    sends(other).click()
    expect(other.get_by_role("alert")).to_contain_text("decided on since: assign")
    deaf.clear()
    cell(other, number, guard)


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
    second = page.locator(".candidate").nth(1).locator("span").first.inner_text()
    page.keyboard.press("2")
    expect(sends(page, second)).to_be_enabled()
    page.keyboard.press("Shift+S")
    cell(other, number, second)
    page.keyboard.press("j")
    heading = page.get_by_role("region", name="Event in hand").get_by_role("heading", level=2)
    in_hand = re.compile(rf"(?<!\d){number} ")
    expect(heading).not_to_contain_text(in_hand)
    page.keyboard.press("k")
    expect(heading).to_contain_text(in_hand)


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


def test_notes_names_and_reasons_that_are_html_are_shown_as_they_are(console, visits):
    address = console(*ASKS).drive
    one, two = visits(), visits()
    sockets_of(one.context, "drive", lambda text: text.replace('"free"', f'"{HOSTILE}"'))
    page, other = (each.open(address, "events") for each in (one, two))
    page.locator(".desk-head summary").click()
    page.get_by_label("Your name").fill(HOSTILE)
    page.get_by_role("button", name="Use this name").click()
    expect(page.get_by_text(f"The log shows you as {HOSTILE}")).to_be_visible()
    row_of(page, 1).click()
    expect(page.locator(".candidate").filter(has_text=HOSTILE)).not_to_have_count(0)
    page.get_by_label("Reason or note").fill(HOSTILE)
    page.get_by_role("button", name="Note", exact=True).click()

    row_of(other, 1).click()
    expect(other.locator(".note")).to_have_text(HOSTILE)
    assert other.locator("img[src=x]").count() == 0
    other.get_by_role("link", name="Audit").click()
    expect(other.get_by_role("table", name="Audit log")).to_contain_text(HOSTILE)
    for each in (page, other):
        assert each.locator("img[src=x]").count() == 0


def test_who_may_look_sees_all_and_has_no_buttons(console, visit):
    page = visit.open(console(*ASKS).look, "events")
    cell(page, 1, "Fire")

    expect(page.get_by_text("This address may look.")).to_be_visible()
    for name in ("Acknowledge", "Send", "Raise", "Take over", "Shelve"):
        expect(page.get_by_role("button", name=name)).to_have_count(0)


def test_only_what_is_new_stands_out(both):
    page, _ = both
    new = page.locator(".desk-row.new")
    expect(page.locator(".desk-row")).not_to_have_count(0)
    expect(new).to_have_count(0)  # they are for 5 s
    raised(page)

    expect(new).to_have_count(1)
    expect(new).to_have_css("animation-name", re.compile("new-alarm"))
