"""The pages of phones and guards for everyone: sizes, themes, names, weight, no fault for axe."""

from collections.abc import Callable
from typing import Any

from helpers.console.accessibility import faults
from helpers.console.browser_phone import Hand
from helpers.console.console_program import PHONES
from playwright.sync_api import Page, expect

WORDS = *PHONES, "--set", "guard.kind=person"
SIZES = {"smallest": (320, 568), "across": (740, 360), "tablet": (820, 1180)}
LOOKS = [(size, scheme) for size in SIZES for scheme in ("light", "dark")]
TALLEST = 48  # of what is tapped, at least [px]


def screens(hand: Hand) -> list[tuple[str, Callable[[], None]]]:
    """All five, and those of a robot in hand, in an order that comes back."""

    def at(name: str) -> Callable[[], None]:
        return lambda: hand.go(name)

    def cockpit() -> None:
        hand.register()
        hand.take("robot-2", "both")
        expect(hand.page.get_by_text("is in your hands")).to_be_visible()
        hand.calibrate()
        hand.go("Teleoperation")
        expect(hand.status("Radius")).to_be_visible()

    names = ("Main", "Instructions", "Authentication", "Calibration", "Teleoperation")

    def missions() -> None:
        hand.go("Missions")
        expect(hand.page.get_by_role("button", name="Send robot-2")).to_be_visible()

    return [*((name, at(name)) for name in names), ("driving", cockpit), ("missions", missions)]


def too_wide(page: Page, width: int) -> bool:
    wide = page.evaluate(
        "Math.max(document.documentElement.scrollWidth, document.querySelector('main').scrollWidth)"
    )
    return bool(wide > width)


SMALL = """least => [...document.querySelectorAll('button, select, a.big, a.go, .field input')]
  .filter((one) => one.offsetParent && one.getBoundingClientRect().height < least - 0.5)
  .map((one) => one.outerHTML.slice(0, 120))"""


def look(page: Page, size: str, scheme: Any) -> tuple[int, int]:
    """Turn the screen into one of another size and colours."""
    width, height = SIZES[size]
    page.set_viewport_size({"width": width, "height": height})
    page.emulate_media(color_scheme=scheme)
    return width, height


def test_every_screen_fits_and_axe_finds_nothing_serious(console, visits):
    hand = Hand(visits(320, 568, has_touch=True, is_mobile=True), console(*WORDS).phone)
    for name, show in screens(hand):
        show()
        for each in LOOKS:
            width, height = look(hand.page, *each)
            assert not too_wide(hand.page, width), (name, each)
            assert hand.page.evaluate(SMALL, TALLEST) == [], (name, each)
            stop = hand.page.get_by_role("button", name="Emergency stop").bounding_box()
            assert stop is not None
            assert stop["height"] >= 64, (name, each)
            assert stop["y"] + stop["height"] <= height, (name, each)
            assert faults(hand.page) == [], (name, each)
    hand.leave()


def test_the_guards_page_fits_and_axe_finds_nothing_serious(console, visits):
    page = visits(320, 568).tab()
    page.goto(console(*WORDS).guard)
    expect(page.get_by_role("heading", name="Who are you?")).to_be_visible()
    for each in LOOKS:
        look(page, *each)
        assert faults(page) == [], each
    page.get_by_role("button", name="guard-2").click()
    expect(page.get_by_role("button", name="Accept")).to_be_visible()
    for each in LOOKS:
        width, _ = look(page, *each)
        assert not too_wide(page, width), each
        assert page.evaluate(SMALL, TALLEST) == [], each
        assert faults(page) == [], each
    page.get_by_role("button", name="Leave").click()
    expect(page.get_by_role("heading", name="Who are you?")).to_be_visible()


def test_how_to_trust_the_console_can_be_read_by_everybody(console, visits):
    page = visits(320, 568).tab()
    page.goto(f"{console(*WORDS).base}trust")
    expect(page.get_by_role("heading", name="Trust this console")).to_be_visible()
    assert page.evaluate("document.documentElement.scrollWidth") <= 320
    assert faults(page) == []


def test_public_names_are_there(console, visits):
    hand = Hand(visits(360, 740, has_touch=True, is_mobile=True), console(*WORDS).phone)
    page = hand.page
    hand.go("Authentication")
    for field in ("Server IP", "Port", "Device label", "Device type", "Device", "Permission level"):
        expect(page.get_by_label(field, exact=True)).to_have_count(1)
    for button in ("Register", "Get device list", "Get Permission Level", "Emergency stop"):
        expect(page.get_by_role("button", name=button, exact=True)).to_have_count(1)
    hand.go("Calibration")
    for field in ("Force", "Radius step", "Maximum delay"):
        expect(page.get_by_label(field, exact=True)).to_have_count(1)
    expect(page.get_by_role("button", name="Calibrate", exact=True)).to_have_count(1)
    expect(hand.status("Link")).to_have_count(1)


def test_a_phones_pages_weigh_less_than_200_kb_and_ask_nobody_else(console, visits):
    running = console(*WORDS)
    weights = visits(360, 740).weighs(running.phone, "link", "Authentication")

    assert all(url.startswith(running.base) for url in weights)
    assert not any("leaflet" in url or "uplot" in url for url in weights)
    assert sum(weights.values()) < 200_000, sum(weights.values())


def test_a_phone_says_that_the_dvas_server_is_stopped(console, visits):
    at = console(*WORDS)
    visit = visits(320, 568, has_touch=True, is_mobile=True)
    page = visit.tab()
    page.goto(at.phone)
    visit.context.request.get(at.drive)
    for action, arguments, count in (("server_stop", {}, 1), ("server_start", {"port": 5555}, 0)):
        body = {"id": f"phone-{action}", "action": action, "arguments": arguments}
        assert visit.context.request.post(f"{at.base}api/actions", data=body).ok
        warning = page.locator(".alerts").get_by_text("The DVA's server is stopped")
        expect(warning).to_have_count(count)
