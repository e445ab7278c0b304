"""A world that lags, and a page that sleeps: what is said, and what is not."""

import json
import re

import pytest
from helpers.processes.patience import becomes
from playwright.sync_api import Page, WebSocketRoute, expect

SMALL = ("--robots", "2", "--people", "3", "--site", "office-block")


def change(page: Page, rewrite) -> None:
    """Let every line of the state pass through a function first."""

    def route(socket: WebSocketRoute) -> None:
        server = socket.connect_to_server()
        server.on_message(lambda text: socket.send(json.dumps(rewrite(json.loads(text)))))

    page.route_web_socket("**/ws/state*", route)


def lagging(line: dict[str, object]) -> dict[str, object]:
    if line["k"] == "rows":
        line["clock"] |= {"lag_s": 0.43, "held_by_lag": True}
    return line


@pytest.fixture
def page(visit) -> Page:
    return visit.context.new_page()


def test_a_world_that_lags_holds_robots_and_the_page_says_why(fake, page):
    change(page, lagging)
    page.goto(f"{fake(*SMALL).drive}#/drive")

    warning = page.locator(".warnings")
    expect(warning).to_contain_text("Robots were stopped")
    expect(warning).to_contain_text("430 ms behind")
    expect(warning).to_contain_text("250 ms")
    expect(page.locator(".hint")).to_contain_text("behind real time")


def test_silence_makes_the_page_look_old(fake, page):
    heard: list[WebSocketRoute] = []
    silent: list[bool] = []

    def route(socket: WebSocketRoute) -> None:
        server = socket.connect_to_server()
        heard.append(socket)
        server.on_message(lambda text: None if silent else socket.send(text))

    page.route_web_socket("**/ws/state*", route)
    page.goto(f"{fake(*SMALL).drive}#/map")
    expect(page.locator(".age")).to_have_text(re.compile(r"^data \d+\.\d s old$"))
    silent.append(True)

    expect(page.locator(".stale")).to_be_visible()
    expect(page.locator(".age.old")).to_be_visible()


def test_a_hole_in_what_was_heard_is_filled_by_asking_anew(fake, page):
    asked: list[str] = []

    def route(socket: WebSocketRoute) -> None:
        server = socket.connect_to_server()
        skipped: list[str] = []

        def hear(text: str) -> None:
            if json.loads(text)["s"] > 20 and not skipped:
                skipped.append(text)
            else:
                socket.send(text)

        server.on_message(hear)
        socket.on_message(lambda text: (asked.append(str(text)), server.send(text)))

    page.route_web_socket("**/ws/state*", route)
    page.goto(f"{fake(*SMALL).drive}#/map")

    assert becomes(lambda: (page.wait_for_timeout(50), any("resync" in text for text in asked))[1])
    expect(page.locator(".map-canvas")).to_have_count(3)


def test_a_lost_socket_is_opened_again_under_the_same_name(fake, page):
    sockets: list[WebSocketRoute] = []

    def route(socket: WebSocketRoute) -> None:
        server = socket.connect_to_server()
        server.on_message(lambda text: socket.send(text))
        sockets.append(socket)

    page.route_web_socket("**/ws/state*", route)
    page.goto(f"{fake(*SMALL).drive}#/map")
    expect(page.get_by_role("region", name="Map")).to_be_visible()
    who = page.evaluate("sessionStorage.getItem('dva-sim-client')")
    sockets[0].close()

    assert becomes(lambda: (page.wait_for_timeout(50), len(sockets) > 1)[1])
    expect(page.locator(".warnings")).to_be_empty()
    assert page.evaluate("sessionStorage.getItem('dva-sim-client')") == who


def test_nothing_can_be_asked_for_until_the_socket_for_driving_is_open(fake, page):
    sockets: list[WebSocketRoute] = []

    def route(socket: WebSocketRoute) -> None:
        server = socket.connect_to_server()
        server.on_message(lambda text: socket.send(text))
        sockets.append(socket)

    page.route_web_socket("**/ws/drive*", route)
    page.goto(f"{fake(*SMALL).drive}#/drive")
    button = page.get_by_role("button", name="Take control")
    expect(button).to_be_enabled()
    page.clock.install()
    page.clock.pause_at("2030-01-01")  # it is opened again a second later
    sockets[-1].close()

    expect(button).to_be_disabled()
    expect(page.locator(".hint")).to_contain_text("being opened")
    page.clock.run_for(1500)
    expect(button).to_be_enabled()
