"""A browser, and consoles to look at with it."""

from collections.abc import Callable, Iterator
from functools import cache, partial
from pathlib import Path
from typing import Any, Literal

import pytest
from helpers.console.console_program import Addresses, addresses_of
from helpers.processes.patience import PATIENCE_S
from helpers.processes.programs import all_gone_after
from playwright.sync_api import Browser, BrowserContext, Dialog, Page, Response, expect

ENDED = "ERR_INCOMPLETE_CHUNKED_ENCODING", "ERR_CONNECTION_REFUSED"  # with a page's world
MOMENT_MS = 1000 * PATIENCE_S / 2
expect.set_options(timeout=MOMENT_MS)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker("browser")


@pytest.fixture(scope="module")
def console(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[..., Addresses]]:
    """Consoles of the small office, each started once for all tests of a file that want it."""
    for programs in all_gone_after(tmp_path_factory.mktemp("consoles")):
        yield cache(partial(addresses_of, programs))


@pytest.fixture(scope="session", autouse=True)
def _own_certificates(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep those of consoles for phones where no others are."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_DATA_HOME", str(tmp_path_factory.mktemp("data")))
        yield


class Visit:
    """A person's browser: pages with what went wrong on them.

    Attributes:
        errors: Messages on the consoles of the pages, and uncaught exceptions.
    """

    def __init__(self, context: BrowserContext) -> None:
        self.context = context
        context.set_default_timeout(MOMENT_MS)
        self.errors: list[str] = []

    def open(self, address: str, page: str = "map") -> Page:
        """Go to a page and wait until the world is there."""
        tab = self.tab()
        tab.goto(f"{address}#/{page}")
        expect(tab.locator("main.page:not(.waiting)")).to_be_visible()
        return tab

    def weighs(self, address: str, role: Any, name: str) -> dict[str, int]:
        """Bytes of all that a page loads until something that it shows is there."""
        answers: list[Response] = []
        tab = self.tab()
        tab.on("response", lambda answer: answers.append(answer))  # as a bound method it fails
        tab.goto(address)
        expect(tab.get_by_role(role, name=name)).to_be_visible()
        return {answer.url: len(answer.body()) for answer in answers if answer.status == 200}

    def tab(self) -> Page:
        """An empty page, whose errors are noted."""
        tab = self.context.new_page()
        tab.on("pageerror", lambda error: self.errors.append(str(error)))
        tab.on("console", lambda message: self._note(message.type, message.text))
        tab.on("dialog", self._refuse)
        return tab

    def _refuse(self, dialog: Dialog) -> None:
        """Nothing of ours opens one, so that a script in a label would be noticed."""
        self.errors.append(f"a dialog: {dialog.message}")
        dialog.dismiss()

    def _note(self, kind: str, text: str) -> None:
        if kind == "error" and not any(why in text for why in ENDED):
            self.errors.append(text)


GO = """async (page) => {
  const {selection} = await import('/static/js/store.js');
  selection.value = null;
  for (const name of [page === 'main' ? 'devices' : 'main', page]) {
    location.hash = `#/${name}`;
    await new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
  }
  document.activeElement.blur(); }"""


class Tabs:
    """Pages that tests of a file share: loading one costs more than what most of them do with it.

    Each test has its page built afresh, from what the browser has loaded already.
    """

    def __init__(self, browser: Browser) -> None:
        self._browser = browser
        self._known: dict[tuple[str, int], tuple[Visit, Page]] = {}

    def open(
        self,
        address: str,
        page: str = "map",
        width: int = 1280,
        height: int = 800,
        scheme: Literal["light", "dark"] = "light",
        person: int = 1,
    ) -> Page:
        """Show a page of the world at an address to somebody, in a window of a size."""
        if (address, person) not in self._known:
            visit = Visit(self._browser.new_context())
            self._known[address, person] = visit, visit.open(address, page)
        _, tab = self._known[address, person]
        tab.set_viewport_size({"width": width, "height": height})
        tab.emulate_media(color_scheme=scheme)
        tab.evaluate(GO, page)
        expect(tab.locator("main.page:not(.waiting)")).to_be_visible()
        return tab

    def rest(self) -> list[str]:
        """Draw nothing until a page is wanted again; return what went wrong since the last time."""
        for _, tab in self._known.values():
            tab.evaluate("location.hash = '#/main'")
        found = [error for visit, _ in self._known.values() for error in visit.errors]
        for visit, _ in self._known.values():
            visit.errors.clear()
        return found

    def close(self) -> None:
        """Load each page again when it is wanted next."""
        for visit, _ in self._known.values():
            visit.context.close()
        self._known.clear()


@pytest.fixture(scope="module")
def _tabs(browser: Browser, console: Callable[..., Addresses]) -> Iterator[Tabs]:
    """Closed before the consoles end."""
    tabs = Tabs(browser)
    yield tabs
    tabs.close()


@pytest.fixture
def shared(_tabs: Tabs, request: pytest.FixtureRequest) -> Iterator[Callable[..., Page]]:
    """Opens pages that are shared with the file's other tests; a failed test leaves none."""
    failed = request.session.testsfailed
    yield _tabs.open
    errors = _tabs.rest()
    if errors or request.session.testsfailed > failed:
        _tabs.close()
    assert errors == []


@pytest.fixture
def visits(browser: Browser) -> Iterator[Callable[..., Visit]]:
    """Open any number of browsers; in the end none may have logged an error."""
    made: list[Visit] = []

    def visit(width: int = 1280, height: int = 800, **options: Any) -> Visit:
        size: Any = {"width": width, "height": height}
        made.append(Visit(browser.new_context(viewport=size, **options)))
        return made[-1]

    yield visit
    for each in made:
        each.context.close()
    assert [error for each in made for error in each.errors] == []


@pytest.fixture
def visit(visits: Callable[..., Visit]) -> Visit:
    """One browser."""
    return visits()
