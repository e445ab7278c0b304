"""The pages for everyone: names, themes, sizes, keys, and no fault that axe-core finds."""

import pytest
from helpers.console.accessibility import faults
from playwright.sync_api import expect

PAGES = {
    "map": "Map",
    "main": "Main",
    "devices": "Devices",
    "drive": "Drive",
    "events": "Events",
    "network": "Network",
    "audit": "Audit",
}


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [360, 1280])
def test_axe_finds_nothing_serious(console, shared, width, scheme):
    found = {}
    for name, heading in PAGES.items():
        page = shared(console().drive, name, width=width, scheme=scheme)
        expect(page.get_by_role("heading", name=heading, level=1)).to_be_attached()
        page.get_by_text("Legend").first.click() if name == "map" else None
        found[name] = faults(page)

    assert not any(found.values()), found


def test_axe_finds_a_fault_that_is_planted(console, shared):
    page = shared(console().drive)
    page.evaluate("document.querySelector('.map-buttons button').removeAttribute('aria-label')")
    page.evaluate("document.querySelector('.map-buttons button').removeAttribute('title')")

    assert any("button-name" in fault for fault in faults(page))


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [360, 1280])
def test_axe_finds_nothing_serious_in_help_and_tour(console, shared, scheme, width):
    page = shared(console().drive, "drive", width=width, scheme=scheme)
    page.get_by_role("button", name="Help").click()
    expect(page.get_by_role("dialog", name="Help")).to_be_visible()
    assert faults(page) == []

    page.keyboard.press("Escape")
    page.get_by_role("button", name="Take the tour").click()
    expect(page.get_by_role("button", name="Begin again")).to_be_visible()
    assert faults(page) == []
    page.get_by_role("button", name="End the tour").click()  # nothing lies over it
    expect(page.get_by_role("button", name="Take the tour")).to_be_visible()


@pytest.mark.parametrize("width", [360, 740, 1280, 2560, 3840])
def test_nothing_is_wider_than_the_screen(console, shared, width):
    for name, heading in PAGES.items():
        page = shared(console().drive, name, width=width, height=740)
        expect(page.get_by_role("heading", name=heading, level=1)).to_be_attached()

        assert page.evaluate("document.documentElement.scrollWidth") <= width, name
        assert page.evaluate("document.querySelector('.body').scrollWidth") <= width, name
        stop = page.get_by_role("button", name="Emergency stop").bounding_box()
        assert stop is not None
        assert 0 <= stop["x"] <= width - stop["width"], name
        assert stop["height"] >= 36, name


IN_SIGHT = """e => { const {left, right, top, bottom} = e.getBoundingClientRect();
  return [[left, top], [right, top], [left, bottom], [right, bottom]].every(([x, y]) => e.contains(
    document.elementFromPoint(x + (x < right ? 9 : -9), y + (y < bottom ? 9 : -9)))); }"""


def test_on_a_small_screen_the_bar_has_two_rows_and_lies_below_nothing(console, shared):
    page = shared(console().drive, "drive", width=360, height=640)
    page.get_by_role("button", name="Take the tour").click()
    expect(page.get_by_role("button", name="Begin again")).to_be_visible()

    helps = page.get_by_role("button", name="Help").bounding_box()
    colours = page.get_by_role("button", name="Dark colours").bounding_box()
    assert helps
    assert colours
    assert helps["y"] == colours["y"]
    assert page.get_by_role("button", name="Emergency stop").evaluate(IN_SIGHT)
    page.get_by_role("button", name="End the tour").click()


def test_public_names_are_on_their_pages_once(console, shared):
    page = shared(console().drive, "drive")

    for link in PAGES.values():
        expect(page.get_by_role("link", name=link)).to_have_count(1)
    for button in ("Take control", "Release control", "Start", "Stop", "Emergency stop"):
        expect(page.get_by_role("button", name=button, exact=True)).to_have_count(1)
    for slider in ("Speed", "Turn rate", "Delay", "Jitter", "Loss", "Time factor"):
        expect(page.get_by_role("slider", name=slider)).to_have_count(1)
    for status in ("Mode", "Link"):
        expect(page.get_by_role("status", name=status)).to_have_count(1)
    for region in ("Camera", "Map", "Latency"):
        expect(page.get_by_role("region", name=region)).to_have_count(1)
    page = shared(console().drive, "network")
    for slider in ("Delay", "Jitter", "Loss", "Bandwidth", "Time factor"):
        expect(page.get_by_role("slider", name=slider)).to_have_count(1)


def test_colours_change_by_a_button_and_stay(console, visits):
    page = visits(color_scheme="light").open(console().drive)

    def background() -> str:
        return str(page.evaluate("getComputedStyle(document.body).backgroundColor"))

    assert background() == "rgb(247, 247, 245)"
    page.get_by_role("button", name="Dark colours").click()
    assert background() == "rgb(22, 25, 29)"
    page.reload()
    expect(page.get_by_role("button", name="Light colours")).to_be_visible()
    assert background() == "rgb(22, 25, 29)"


def test_focus_can_be_seen_on_everything_that_tab_reaches(console, shared):
    page = shared(console().drive, "drive")
    reached = set()
    for _ in range(40):
        page.keyboard.press("Tab")
        tag, name, outline = page.evaluate(
            "(e => [e.tagName, e.innerText || e.id, getComputedStyle(e).outlineStyle])"
            "(document.activeElement)"
        )
        assert outline != "none" or tag == "BODY", name
        reached.add(name)

    assert {"Emergency stop", "Drive", "Take control", "slider-speed", "slider-delay"} <= reached


def test_a_robot_is_taken_and_released_by_keys(console, shared):
    page = shared(console().drive, "drive")

    page.get_by_role("button", name="Take control").focus()
    page.keyboard.press("Enter")
    expect(page.get_by_role("button", name="Release control")).to_be_enabled()
    page.get_by_role("button", name="Release control").press("Space")
    expect(page.get_by_role("button", name="Take control")).to_be_enabled()


def test_the_page_weighs_less_than_700_kb_and_asks_nobody_else(console, visit):
    weights = visit.weighs(f"{console().drive}#/map", "region", "Map")

    assert all(url.startswith(console().base) for url in weights)
    assert any("leaflet.js" in url for url in weights)
    assert sum(weights.values()) < 700_000


def test_pages_are_reached_by_their_links_and_obey_their_content_security_policy(console, visit):
    page = visit.open(console().drive)
    for name in reversed(PAGES.values()):
        page.get_by_role("link", name=name).click()
        expect(page.get_by_role("heading", name=name, level=1)).to_be_attached()

    page.get_by_role("link", name="Network").click()
    page.reload()
    expect(page.get_by_role("heading", name="Network", level=1)).to_be_attached()
    assert visit.errors == []  # a blocked script or style says so in the console
