"""The search of the built pages puts the right page among the first three."""

import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from urllib.parse import quote

import pytest
from helpers.paths import ROOT
from playwright.sync_api import Browser, Page, expect
from search_words import WORDS

pytestmark = pytest.mark.browser

SOUGHT = {
    "my own map": "how-to/own-map-and-trace",
    "compare two patterns on my trace": "how-to/own-map-and-trace",
    "attach my robot": "how-to/own-robot-protocol",
    "turtlebot": "how-to/own-robot-ros",
    "killed run resume": "how-to/cluster-and-resume",
    "users login": "how-to/users",
    "video of a run": "how-to/record-and-replay",
    "register hypotheses": "how-to/preregister",
    "export parquet": "how-to/export",
    "several DVAs": "explanation/several-dvas",
    "drive_time_s": "reference/measures",
    "response_s": "reference/measures",
    "command_age_p95_s": "reference/measures",
}


class _Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *_: object) -> None:
        pass


@pytest.fixture(scope="module")
def search(
    browser: Browser, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[Page, str]]:
    """A browser's page, and the address at which the built pages are searched."""
    pytest.importorskip("sphinx", reason="needs what builds the pages: make docs")
    site: Path = tmp_path_factory.mktemp("site")
    build = [sys.executable, "-m", "sphinx", "--quiet", str(ROOT / "docs"), str(site)]
    subprocess.run(build, check=True, cwd=ROOT)
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(_Quiet, directory=str(site))) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        page = browser.new_page()
        yield page, f"http://127.0.0.1:{server.server_port}/search.html?q="
        page.close()
        server.shutdown()


@pytest.mark.parametrize(("words", "name"), SOUGHT.items())
def test_the_right_page_is_among_the_first_three(search, words, name):
    page, address = search
    page.goto(address + quote(words))
    expect(page.locator(".search-summary")).to_contain_text("found")
    links = page.locator("ul.search > li > a").evaluate_all("all => all.map(one => one.href)")
    assert any(f"/{name}.html" in link for link in links[:3]), links[:3]


def test_a_page_that_is_not_there_is_not_found(search):
    page, address = search
    page.goto(address + "zzyzx")
    expect(page.locator(".search-summary")).to_contain_text("did not match any documents")


def test_search_words_are_of_pages_that_exist():
    assert [name for name in WORDS if not (ROOT / "docs" / f"{name}.md").is_file()] == []
