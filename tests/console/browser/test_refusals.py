"""The emergency stop of every address, and refusals: each is shown at once, and asked for once."""

import json
import re
from collections.abc import Callable
from typing import Any

import pytest
from helpers.console.console_program import PHONES, Addresses
from helpers.console.driving_page import free_all, release, start, take
from playwright.sync_api import Page, Route, WebSocketRoute, expect

WORDS = *PHONES, "--set", "guard.kind=person"
WHY = "the reason of the server"
# Where each role's page is, and words on it once the world is there.
ADDRESSES: dict[str, tuple[Callable[[Addresses], str], str]] = {
    "look": (lambda at: f"{at.look}#/map", "you may look"),
    "supervise": (lambda at: f"{at.drive}#/map", "you may supervise"),
    "phone": (lambda at: at.phone, "Authentication"),
    "guard": (lambda at: at.guard, "Who are you?"),
}
RED = "rgb(163, 0, 0)"
ALL = "robot-1, robot-2, robot-3 at 0:"


def press(page: Page) -> None:
    page.get_by_role("button", name="Emergency stop").click()


@pytest.mark.parametrize("path", ["request", "socket"])
@pytest.mark.parametrize("role", ADDRESSES)
def test_every_address_stops_robots_and_says_which_stand(
    console: Callable[..., Any], visit: Any, role: str, path: str
) -> None:
    page = visit.tab()
    if path == "socket":
        page.route("**/api/emergency", lambda _: None)  # never answered
    else:
        refuse_over_socket(page, lambda _: None, "emergency")
    address, words = ADDRESSES[role]
    page.goto(address(console(*WORDS)))
    expect(page.get_by_text(words, exact=True)).to_be_visible()
    press(page)
    expect(page.locator(".stopped")).to_contain_text(ALL)
    expect(page.locator(".unconfirmed-stop")).to_have_count(0)
    red = page.get_by_role("button", name="Emergency stop")
    assert red.evaluate("e => getComputedStyle(e).backgroundColor") == RED  # under the pointer, too
    page.locator(".stopped").get_by_role("button", name="Dismiss").click()
    expect(page.locator(".stopped")).to_have_count(0)


def test_a_confirmation_stays_until_its_robot_is_ordered_again(
    console: Callable[..., Any], visit: Any
) -> None:
    page = visit.open(console(*WORDS).drive, "drive")
    press(page)
    free_all(page)
    take(page)
    start(page)
    press(page)
    stopped = page.locator(".stopped")
    expect(stopped).to_have_text(re.compile("confirmed: .*robot-1.* at 0:"))
    expect(page.get_by_role("status", name="Mode")).to_have_text("Emergency")
    free_all(page)
    expect(stopped).to_contain_text("robot-1")
    start(page)
    expect(stopped).to_contain_text("confirmed: robot-2, robot-3 at 0:")
    release(page)


def refuse_over_socket(page: Page, heard: Callable[[str], object], *actions: str) -> None:
    """Refuse some actions of a page over its socket, as the server would; the rest goes on."""

    def route(socket: WebSocketRoute) -> None:
        server = socket.connect_to_server()

        def take(text: str | bytes) -> None:
            line = json.loads(text)
            if line["do"] not in actions:
                server.send(text)
                return
            refusal = {"k": "done", "id": line["id"], "ok": False}
            if heard(line["do"]):
                socket.send(json.dumps(refusal | {"text": WHY, "outcome": "refused"}))

        socket.on_message(take)
        server.on_message(lambda text: socket.send(text))

    page.route_web_socket("**/ws/drive*", route)


def refuse_request(page: Page, status: int, asked: list[str]) -> None:
    def refuse(route: Route) -> None:
        asked.append("request")
        route.fulfill(status=status, json={"ok": False, "text": WHY})

    page.route("**/api/emergency", refuse)


@pytest.mark.parametrize("status", [401, 403, 400, 415])
def test_a_refused_emergency_request_is_shown_and_not_repeated(
    console: Callable[..., Any], visits: Callable[..., Any], status: int
) -> None:
    visit = visits()
    page = visit.tab()
    asked: list[str] = []
    refuse_request(page, status, asked)
    refuse_over_socket(page, lambda _: None, "emergency")  # of which nothing is heard
    page.clock.install()
    page.goto(f"{console(*WORDS).look}#/map")
    expect(page.get_by_text("you may look", exact=True)).to_be_visible()
    press(page)
    expect(page.locator(".unconfirmed-stop")).to_contain_text(f"refused: {WHY}")
    page.clock.run_for(5000)
    assert asked == ["request"]
    expect(page.locator(".unconfirmed-stop")).to_have_count(1)
    visit.errors.clear()  # the browser notes each refused request


# For each action that a page asks for over its socket: what asks for it, and where it is shown.
ASKED: dict[str, tuple[str, str, Callable[[Page], object]]] = {
    "emergency": ("map", ".unconfirmed-stop", press),
    "pace": ("map", ".warning", lambda page: page.get_by_role("button", name="Pause").click()),
    "take": ("drive", ".warning", lambda p: p.get_by_role("button", name="Take control").click()),
    "room_join": ("events", ".warning", lambda _: None),
    "event_proposal": ("events", ".event-panel .warning", lambda _: None),
}


@pytest.mark.parametrize("action", ASKED)
def test_a_refusal_over_the_socket_is_shown_and_not_repeated(
    console: Callable[..., Any], visit: Any, action: str
) -> None:
    name, place, ask = ASKED[action]
    page = visit.tab()
    asked: list[str] = []
    page.route("**/api/emergency", lambda _: None)
    refuse_over_socket(page, lambda what: asked.append(what) or True, action)
    page.clock.install()
    page.goto(f"{console(*WORDS).drive}#/{name}")
    expect(page.locator("main.page:not(.waiting)")).to_be_visible()
    ask(page)
    expect(page.locator(place).filter(has_text=WHY)).to_be_visible()
    count = len(asked)
    page.clock.run_for(5000)
    assert len(asked) == count
    expect(page.locator(place).filter(has_text=WHY)).to_be_visible()


def test_a_socket_that_is_closed_for_what_was_sent_is_told_with_its_reason(
    console: Callable[..., Any], visit: Any
) -> None:
    page = visit.tab()

    def close(socket: WebSocketRoute) -> None:
        socket.on_message(lambda _: socket.close(code=1008, reason=WHY))

    page.goto(f"{console(*WORDS).drive}#/map")
    expect(page.get_by_role("button", name="Pause")).to_be_enabled()
    page.route_web_socket("**/ws/drive*", close)
    page.reload()
    page.get_by_role("button", name="Pause").click()
    expect(page.locator(".warning").filter(has_text=WHY)).to_be_visible()
