"""A guard's page: who one is, the order and its way, what is said of it, and where one is."""

import pytest
from helpers.console.browser_phone import LISTEN
from helpers.processes.patience import becomes
from playwright.sync_api import Page, expect

SCREEN = {"width": 360, "height": 740, "has_touch": True, "is_mobile": True}
WORLD = ("--phones", "--robots", "2", "--people", "5")


@pytest.fixture
def world(fake):
    return fake(*WORLD)


@pytest.fixture
def page(world, visits):
    tab = guard_at(world, visits(**SCREEN))
    tap(tab, "guard-1")
    yield tab
    tab.get_by_role("button", name="Leave").tap()
    expect(tab.get_by_role("heading", name="Who are you?")).to_be_visible()


def guard_at(world, visit) -> Page:
    tab = visit.tab()
    tab.add_init_script(f"({LISTEN})()")
    tab.goto(world.phone.replace("/phone?", "/guard?"))
    expect(tab.get_by_role("heading", name="Who are you?")).to_be_visible()
    return tab


def tap(page: Page, name: str) -> None:
    page.get_by_role("button", name=name, exact=True).tap()


def sent(page: Page, what: str) -> list[dict]:
    return [line for line in page.evaluate("window.sent") if line.get("do") == what]


def test_an_order_is_accepted_and_followed_to_its_end(page):
    order = page.get_by_role("region", name="Order")
    expect(order).to_contain_text("Gas leak in somewhere, 42 m")
    tap(page, "Accept")
    for name in ("Departed", "Arrived"):
        tap(page, name)
    expect(page.get_by_text("42 m away from the event. Have you arrived?")).to_be_visible()
    tap(page, "Not yet")
    expect(page.get_by_text("Have you arrived?")).to_have_count(0)
    assert "arrived" not in [line["what"] for line in sent(page, "guard_say")]
    for name in ("Arrived", "Yes, arrived", "Confirm"):
        tap(page, name)
    expect(order).to_contain_text("You: confirmed.")
    tap(page, "Contained")
    expect(order).to_contain_text("No order")
    steps = ["departed", "arrived", "confirmed", "contained"]
    assert [line["what"] for line in sent(page, "guard_say")] == steps
    assert sent(page, "guard_answer")[0]["accept"] is True


def test_an_order_is_declined_with_a_reason(page):
    tap(page, "Decline")
    page.get_by_label("Reason").fill("I am hurt")
    tap(page, "Decline")
    expect(page.get_by_role("region", name="Order")).to_contain_text("declined: I am hurt")
    asked = sent(page, "guard_answer")
    assert [(line["accept"], line["reason"]) for line in asked] == [(False, "I am hurt")]


def test_help_is_asked_for_and_an_event_reported_where_one_is(page):
    tap(page, "Help")
    assert becomes(lambda: sent(page, "guard_say"))
    page.get_by_text("Report an event").tap()
    page.get_by_label("Kind").select_option("flood")
    page.get_by_label("Severity").select_option("critical")
    tap(page, "Report at my position")
    expect(page.get_by_role("status", name="Report")).to_have_text("Sent: flood reported")
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


def test_who_is_taken_is_not_given_twice(page, world, visits):
    other = guard_at(world, visits(**SCREEN))
    tap(other, "guard-1")
    expect(other.get_by_role("alert")).to_contain_text("guard-1 is taken")
    tap(other, "guard-2")
    expect(other.get_by_role("heading", name="guard-2")).to_be_visible()
    tap(other, "Leave")


def test_a_reload_leaves_one_who_one_is(page):
    expect(page.get_by_role("button", name="Accept", exact=True)).to_be_visible()
    page.reload()
    expect(page.get_by_role("heading", name="guard-1")).to_be_visible()


@pytest.mark.parametrize("there", [True, False])
def test_the_place_by_satellite_counts_where_the_site_lies_there(world, visits, there):
    visit = visits(**SCREEN, permissions=["geolocation"])
    page = guard_at(world, visit)
    site = visit.context.request.get(f"{world.base}api/site").json()
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
