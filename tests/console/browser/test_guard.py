"""A guard's page: who one is, the order and its way, what is said of it, and where one is."""

import re

import pytest
from helpers.console.browser_phone import LISTEN
from helpers.console.console_program import PHONES, Addresses
from helpers.console.desk import ASKS, NOTHING_YET, choose, raised, row_of, sends
from helpers.processes.patience import becomes
from playwright.sync_api import Page, expect

SCREEN = {"width": 360, "height": 740, "has_touch": True, "is_mobile": True}
WORDS = *PHONES, *ASKS, *NOTHING_YET, "--set=guard.kind=person", "--set=dispatch.containment=true"
THERE = """async () => { const {act} = await import('/static/js/net/actions.js');
  await act('guard_place', {x_m: 58, y_m: 37}); }"""


@pytest.fixture
def page(console, visits):
    tab = guard_at(console(*WORDS), visits(**SCREEN))
    tap(tab, "guard-1")
    yield tab
    tab.get_by_role("button", name="Leave").tap()
    expect(tab.get_by_role("heading", name="Who are you?")).to_be_visible()


@pytest.fixture
def desk(console, shared) -> Page:
    """The page of somebody who sends guards."""
    return shared(console(*WORDS).drive, "events")


def sent_to(desk: Page, event: int) -> None:
    """The first guard is sent to an event."""
    choose(desk, event)
    desk.get_by_role("radio", name="guard-1").check()
    sends(desk, "guard-1").click()


def guard_at(running: Addresses, visit) -> Page:
    tab = visit.tab()
    tab.add_init_script(f"({LISTEN})()")
    tab.goto(running.guard)
    expect(tab.get_by_role("heading", name="Who are you?")).to_be_visible()
    return tab


def tap(page: Page, name: str) -> None:
    page.get_by_role("button", name=name, exact=True).tap()


def sent(page: Page, what: str) -> list[dict]:
    return [line for line in page.evaluate("window.sent") if line.get("do") == what]


def test_an_order_is_accepted_and_followed_to_its_end_on_the_spot(page, desk):
    number = raised(desk, "gas leak", "Office 320")
    sent_to(desk, number)
    order = page.get_by_role("region", name="Order")
    expect(order).to_contain_text(re.compile(r"Gas leak in Office 320, \d\d m"))
    tap(page, "Accept")
    for name in ("Departed", "Arrived"):
        tap(page, name)
    expect(page.get_by_text("m away from the event. Have you arrived?")).to_be_visible()
    tap(page, "Not yet")
    expect(page.get_by_text("Have you arrived?")).to_have_count(0)
    assert "arrived" not in [line["what"] for line in sent(page, "guard_say")]
    for name in ("Arrived", "Yes, arrived"):
        tap(page, name)
    expect(order).to_contain_text("You: looking.")
    tap(page, "Confirm")
    expect(order).to_contain_text("No order")

    expect(row_of(desk, number)).to_contain_text("confirmed")
    sent_to(desk, number)
    expect(order).to_contain_text("contain")
    tap(page, "Accept")
    tap(page, "Contained")
    expect(page.get_by_role("alert")).to_contain_text("to contain it")
    page.evaluate(THERE)
    tap(page, "Contained")
    expect(order).to_contain_text("No order")
    steps = ["departed", "arrived", "confirmed", "contained", "contained"]
    assert [line["what"] for line in sent(page, "guard_say")] == steps
    assert sent(page, "guard_answer")[0]["accept"] is True


def test_an_order_is_declined_with_a_reason(page, desk):
    sent_to(desk, raised(desk))
    tap(page, "Decline")
    page.get_by_label("Reason").fill("I am hurt")
    tap(page, "Decline")
    expect(page.get_by_role("region", name="Order")).to_contain_text("No order")
    asked = sent(page, "guard_answer")
    assert [(line["accept"], line["reason"]) for line in asked] == [(False, "I am hurt")]


def test_help_is_asked_for_and_an_event_reported_where_one_is(page):
    tap(page, "Help")
    tap(page, "Help is no longer needed")
    assert [line["what"] for line in sent(page, "guard_say")] == ["help", "help"]
    page.get_by_text("Report an event").tap()
    page.get_by_label("Kind").select_option("flood")
    page.get_by_label("Severity").select_option("critical")
    tap(page, "Report at my position")
    expect(page.get_by_role("status", name="Report")).to_have_text("Sent: flood is reported")
    asked = sent(page, "guard_report")[0]
    assert (asked["kind"], asked["severity"]) == ("flood", "critical")
    assert asked["x_m"] != 0


def test_a_tap_on_the_map_tells_where_one_is(page):
    tap(page, "I am here …")
    ground = page.locator(".map-ground")
    box = ground.bounding_box()
    assert box
    page.touchscreen.tap(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    assert becomes(lambda: sent(page, "guard_place"))
    expect(page.get_by_role("button", name="I am here …")).to_be_visible()
    page.touchscreen.tap(box["x"] + box["width"] / 3, box["y"] + box["height"] / 2)
    page.wait_for_timeout(200)
    assert len(sent(page, "guard_place")) == 1  # without being asked a tap tells nothing


def test_who_is_taken_is_not_given_twice(page, console, visits):
    other = guard_at(console(*WORDS), visits(**SCREEN))
    tap(other, "guard-1")
    expect(other.get_by_role("alert")).to_contain_text("Somebody else is already guard-1.")
    tap(other, "guard-2")
    expect(other.get_by_role("heading", name="guard-2")).to_be_visible()
    tap(other, "Leave")


def test_a_reload_leaves_one_who_one_is(page):
    expect(page.get_by_role("heading", name="guard-1")).to_be_visible()
    page.reload()
    expect(page.get_by_role("heading", name="guard-1")).to_be_visible()


@pytest.mark.parametrize("there", [True, False])
def test_the_place_by_satellite_counts_where_the_site_lies_there(console, visits, there):
    visit = visits(**SCREEN, permissions=["geolocation"])
    page = guard_at(console(*WORDS), visit)
    site = visit.context.request.get(f"{console(*WORDS).base}api/site").json()
    place = {k: site["origin"][f"{k}_deg"] for k in ("latitude", "longitude")}
    _, ymin, _, _ = site["extent_m"]
    place["latitude"] += (ymin + 5) / 111_195 if there else 1.0
    visit.context.set_geolocation(place)
    tap(page, "guard-2")
    tap(page, "By satellite")
    if there:
        assert becomes(lambda: sent(page, "guard_place"))
        asked = sent(page, "guard_place")[0]
        assert asked["y_m"] == pytest.approx(ymin + 5, abs=0.1)
        assert asked["x_m"] == pytest.approx(0, abs=0.1)
    else:
        expect(page.get_by_role("alert")).to_contain_text("not at this scenario’s site")
        assert sent(page, "guard_place") == []
    tap(page, "Leave")


def test_a_guard_says_on_the_phones_page_of_an_event_that_he_goes(console, visits, desk):
    running = console(*WORDS)
    number = raised(desk, "flood")
    page = visits(**SCREEN).tab()
    page.goto(f"{running.phone}#/event?{number}")
    who = page.get_by_label("I am", exact=True)
    who.select_option("guard-3")
    tap(page, "I go")
    expect(page.get_by_role("heading", name="guard-3")).to_be_visible()
    order = page.get_by_role("region", name="Order")
    expect(order).to_contain_text("You: getting ready.")
    expect(row_of(desk, number)).to_contain_text("guard-3")
    tap(page, "Departed")
    expect(order).to_contain_text("You: walking.")
    page.goto(f"{running.phone}#/event?{number}")
    expect(page.get_by_role("link", name="Follow the way there as guard-3")).to_be_visible()
    expect(page.get_by_text("Goes there").locator("+ dd")).to_have_text("guard-3")
    page.goto(running.guard)
    tap(page, "Leave")
