"""Pages that hear nothing more: each age counts on, and all else that was reported is greyed."""

import re
import secrets
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import Any
from urllib.parse import urlsplit

import pytest
from helpers.console.console_program import PHONES, Addresses
from helpers.console.driving_page import start, take
from helpers.console.stopped_network import StoppableNetwork, network_to
from playwright.sync_api import Page, expect

WORDS = *PHONES, "--set", "guard.kind={6: person}"
SILENCE_MS = 9000
SOMETHING = re.compile(r"\S")
# At least as old as the silence: the page's clock runs on while it is looked at.
NO_DATA, AS_OF = re.compile(r"no data for (9|\d\d)"), re.compile(r"as of (9|\d\d+) s ago")
HAND = {"width": 360, "height": 740, "has_touch": True, "is_mobile": True}

# For each page: values that it has to show, and what brings them there.
PAGES: dict[str, tuple[str, ...]] = {
    "drive": (".watchdog", ".stop-reason", ".picture-age", ".mode-status", ".latency .figures b"),
    "map": (".lists .state", ".card dd", ".bar .time .figure", ".bar .age"),
    "events": (".desk-row .state small", ".facts dd", ".picture-age"),
    "robots": (".robot-cards dd",),
    "robots/robot-1": (".robot-bar .mode-status", ".sensors dd", ".view-panel b", ".picture-age"),
    "devices": (".devices-page td.n",),
    "network": (".figures-panel td.n",),
    "main": (".server .state",),
    "phone#/main": (".cards small", ".link-status"),
    "phone#/teleoperation": (".figures-phone span", ".figures-phone small", ".picture-age"),
    "guard": (".order-card h2", ".order-card p"),
}

# Leaves of a page that show a number with a unit, an age or one of the listed values.
TEXTS = """listed => {
  const AGE = /\\d ?(s|ms|m\\/s|rad\\/s|%|°|°C)( |$)|\\d:\\d\\d/;
  const SET = '.slider, .presets, .scale-bar, .legend, .warnings, .alerts, .log, .requests, h3, '
    + 'dt, .chart, .raise, .link, .desk-head, .robot-view, option, .station, .faults, button';
  const found = new Set(document.querySelectorAll(listed.join()));
  for (const one of document.querySelectorAll('#app *')) {
    const own = [...one.childNodes].filter(n => n.nodeType === 3).map(n => n.data).join('');
    if (AGE.test(own) && !one.closest(SET) && one.checkVisibility()) found.add(one);
  }
  window.watched = [...found].map(one => [one, one.textContent]);
  return [...found].map(one => one.textContent);
}"""
# Those of them that stand as if nothing had happened, and whether each page says since when.
FROZEN = """() => window.watched.filter(([one, before]) => {
  const greyed = one.closest('.reported');
  const isGreyed = greyed && getComputedStyle(greyed).filter === 'grayscale(1)'
    && getComputedStyle(greyed).backgroundImage.includes('gradient');
  return one.isConnected && one.textContent === before && !isGreyed;
}).map(([one, before]) => `${one.className}: ${before}`)"""


class Cut:
    """Opens pages over a network that can be cut."""

    def __init__(self, ends: ExitStack) -> None:
        self._ends = ends
        self.network: StoppableNetwork | None = None

    def open(self, page: Page, address: str) -> None:
        self.network = self._ends.enter_context(network_to(urlsplit(address).port or 0))
        page.goto(urlsplit(address)._replace(netloc=f"127.0.0.1:{self.network.port}").geturl())

    def now(self) -> None:
        assert self.network is not None
        self.network.cut()


@pytest.fixture
def cut() -> Iterator[Cut]:
    with ExitStack() as ends:
        yield Cut(ends)


@pytest.fixture
def at(console: Callable[..., Addresses]) -> Addresses:
    """A console that has something in all places of all pages."""
    return console(*WORDS)


def address_of(at: Addresses, name: str) -> str:
    """Return the address of a page."""
    document, _, screen = name.partition("#")
    if screen == "/teleoperation":  # as the console's operator, who needs no registration
        return f"{at.base}phone?{at.drive.partition('?')[2]}#/authentication"
    if name.startswith(("phone", "guard")):
        return f"{at.phone.replace('/phone?', f'/{document}?')}#{screen}"
    return f"{at.drive}#/{name}"


def act(browser: Any, at: Addresses, action: str, arguments: dict[str, Any]) -> None:
    """Do something at the console as a program beside the page."""
    context = browser.new_context()
    context.request.get(at.drive)
    body = {"id": secrets.token_hex(8), "action": action, "arguments": arguments}
    answer = context.request.post(f"{at.base}api/actions", data=body)
    assert answer.ok, answer.text()
    context.close()


def opened(page: Page, cut: Cut, at: Addresses, name: str) -> None:
    """Show a page of the world, with a value in each of its places."""
    page.clock.install()
    cut.open(page, address_of(at, name))
    if name == "guard":
        page.get_by_role("button", name="guard-6").click()
        expect(page.get_by_role("heading", name="guard-6")).to_be_visible()
        beside = {"kind": "flood", "severity": "low", "x_m": 50.5, "y_m": 16.0}
        act(page.context.browser, at, "event_raise", beside)
    if name == "phone#/teleoperation":
        # The DVA may have given the robot away just before; a person asks again.
        goes_on = page.get_by_role("link", name="Go on")
        button = page.get_by_role("button", name="Take control")
        while not goes_on.is_visible():
            button.or_(goes_on).first.wait_for()
            if button.is_visible():
                button.tap()
            page.wait_for_timeout(1000)
        page.evaluate("location.hash = '#/teleoperation'")
    if name == "drive":
        take(page)
        start(page)
    if name == "map":
        page.get_by_role("region", name="Robots").get_by_role("button", name="robot-1").click()
    for selector in PAGES[name]:
        expect(page.locator(selector).first).to_have_text(SOMETHING)
    if page.locator(".picture-age").count():
        expect(page.locator(".picture-age").first).to_contain_text("s old")


@pytest.mark.parametrize("name", PAGES)
def test_on_a_network_that_falls_silent_nothing_stands_as_if_it_were_live(
    at: Addresses, cut: Cut, visits: Callable[..., Any], name: str
) -> None:
    is_small = name.startswith(("phone", "guard"))
    page = visits(**HAND if is_small else {"width": 1440, "height": 900}).tab()
    opened(page, cut, at, name)
    expect(page.locator("[data-stale]")).to_have_count(0)  # a busy machine may be late for once
    cut.now()
    texts = page.evaluate(TEXTS, list(PAGES[name]))
    print(name, texts)
    page.clock.run_for(SILENCE_MS)

    assert page.evaluate(FROZEN) == []
    expect(page.locator(".silence")).to_contain_text("No data since 0:")
    for picture in page.locator(".camera").all():
        expect(picture.locator(".veil")).to_have_class("veil hatched")
        expect(picture.locator(".picture-age")).to_contain_text(NO_DATA)
    for overlay in page.locator(".map-box").all():
        expect(overlay.locator(".stale")).to_contain_text(AS_OF)


PACES = [({"paused": False, "factor": 1}, 1), ({"paused": False, "factor": 4}, 4)]
PACES += [({"paused": True}, 0)]
# Change the pace, and wait until time is known by it: with the second line from then on.
CHANGE = """async pace => {
  const {act} = await import('/static/js/net/actions.js');
  const {rows} = await import('/static/js/store.js');
  await act('pace', pace);
  for (let n = 0; n < 2; n += 1) {
    const before = rows.value;
    await new Promise(done => rows.subscribe(now => now !== before && done()));
  } }"""
AGES = """() => [Date.now() / 1000, ...[...document.querySelectorAll(
  '.alarm > b, .desk-row:not(.over) .state small')].map(one =>
    one.textContent.split(':').reduce((sum, part) => 60 * sum + Number(part), 0))]"""


@pytest.mark.parametrize(("pace", "factor"), PACES)
def test_ages_of_alarms_and_events_follow_the_time_of_the_world(
    at: Addresses,
    cut: Cut,
    visit: Any,
    pace: dict[str, Any],
    factor: int,
) -> None:
    page = visit.tab()
    opened(page, cut, at, "events")
    page.evaluate(CHANGE, pace)
    expect(page.locator(".bar .time .soft")).to_have_text(
        "paused" if pace["paused"] else f"×{pace['factor']}"
    )
    cut.now()
    before = page.evaluate(AGES)
    page.clock.run_for(SILENCE_MS)
    after = page.evaluate(AGES)
    assert len(before) > 1
    passed, *older = [b - a for a, b in zip(before, after, strict=True)]
    assert passed >= SILENCE_MS / 1000
    later = factor * passed
    assert older == pytest.approx([later] * len(older), abs=1 + later / 10)


@pytest.fixture(autouse=True)
def _usual_pace(at: Addresses, browser: Any) -> Iterator[None]:
    yield
    act(browser, at, "pace", {"paused": False, "factor": 1})
