"""Access to the page: entry, foreign pages, and the message when the world has ended."""

import http.server
import signal
import threading
from collections.abc import Iterator

import pytest
from helpers.console.console_program import OFFICE, started
from playwright.sync_api import expect


@pytest.fixture
def foreign() -> Iterator[str]:
    """The address of a page of somebody else."""

    class Page(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(b"<title>foreign</title>")

        def log_message(self, *_: object) -> None:
            """Say nothing."""

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Page)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()
    server.server_close()


def test_the_token_leaves_the_address_and_a_reload_still_gets_in(console, visit):
    page = visit.open(console().drive, "network")

    assert "token" not in page.url
    page.reload()
    expect(page.get_by_role("heading", name="Network", level=1)).to_be_attached()


@pytest.mark.parametrize("query", ["", "?token=wrong"])
def test_without_the_right_token_there_is_a_page_of_words(console, visits, query):
    guest = visits()
    page = guest.context.new_page()
    answer = page.goto(f"{console().base}{query}")

    assert answer is not None
    assert answer.status == 401
    assert "token" in page.inner_text("body").lower() or "address" in page.inner_text("body")


SOCKET = """url => new Promise(done => { const s = new WebSocket(url);
  s.onopen = () => done('open'); s.onerror = () => done('refused'); })"""
FETCH = "url => fetch(url).then(() => 'read', () => 'refused')"
POST = """url => fetch(url, {method: 'POST', credentials: 'include',
  headers: {'Content-Type': 'application/json'}, body: '{"id": "x", "robots": "all"}'})
  .then(a => a.status, () => 'refused')"""


def test_a_foreign_page_reaches_nothing_though_the_browser_has_the_cookie(console, visit, foreign):
    running = console()
    visit.open(running.drive)
    page = visit.context.new_page()
    page.goto(foreign)
    socket = running.base.replace("http", "ws")

    assert page.evaluate(SOCKET, f"{socket}ws/state") == "refused"
    assert page.evaluate(POST, f"{running.base}api/emergency") in ("refused", 401, 403)
    assert page.evaluate(FETCH, f"{running.base}api/state") == "refused"


def test_a_page_says_so_when_the_simulation_has_ended(programs, browser):
    program, address = started(programs, OFFICE)
    page = browser.new_context().new_page()
    page.goto(f"{address}#/map")
    expect(page.get_by_role("region", name="Map")).to_be_visible()
    program.send(signal.SIGINT)

    expect(page.locator(".warnings")).to_contain_text("The simulation has ended")
    page.wait_for_timeout(600)  # longer than the first try to reach it again
    expect(page.locator(".warnings")).to_contain_text("The simulation has ended")
    expect(page.locator(".stale")).to_contain_text("s ago")
    page.context.close()
