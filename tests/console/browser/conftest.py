"""A browser, and worlds to look at with it."""

import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, Literal, NamedTuple

import pytest
from helpers.console.chromium import chromium
from helpers.processes.patience import PATIENCE_S, becomes
from playwright.sync_api import Browser, BrowserContext, Dialog, Page, Response, expect

ENDED = "ERR_INCOMPLETE_CHUNKED_ENCODING", "ERR_CONNECTION_REFUSED"  # with a page's world
FAKE = Path(__file__).parents[1] / "fake_world.py"

MOMENT_MS = 1000 * PATIENCE_S / 2
expect.set_options(timeout=MOMENT_MS)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker("browser")


class World(NamedTuple):
    """Addresses of a running console.

    Attributes:
        drive: Address with the token for driving.
        look: Address for looking only.
        phones: Address for phones, by https; empty without one.
    """

    drive: str
    look: str
    phones: str = ""

    @property
    def phone(self) -> str:
        """The phone's page at the console's own address, as by `adb reverse`."""
        return f"{self.base}phone?{self.phones.partition('?')[2]}"

    @property
    def base(self) -> str:
        """Without a token."""
        return self.drive.partition("?")[0]


@contextmanager
def running(folder: Path, command: list[str]) -> Iterator[World]:
    """A world from its first word until the test is over."""
    out = folder / f"world-{len(list(folder.iterdir()))}.out"
    with out.open("wb") as file:
        process = subprocess.Popen([sys.executable, *command], stdout=file, stderr=file)
    try:
        reported = re.compile(r"^(Console|Look only|Phone): +(https?:\S+)", re.MULTILINE)
        becomes(lambda: "Console:" in out.read_text() or process.poll() is not None)
        becomes(lambda: "Phone:" in out.read_text() or process.poll() is not None)
        becomes(lambda: out.read_text().endswith("\n"))
        found = dict(reported.findall(out.read_text()))
        assert "Console" in found, out.read_text()
        look = found.get("Look only", found["Console"])
        yield World(found["Console"], look, found.get("Phone", ""))
    finally:
        process.terminate()
        process.wait(PATIENCE_S)


@pytest.fixture(scope="module")
def fake(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[..., World]]:
    """Invented worlds, each started once for all tests of a file that want it."""
    known: dict[tuple[str, ...], tuple[Any, World]] = {}
    folder = tmp_path_factory.mktemp("worlds")

    def start(*words: str) -> World:
        if words not in known:
            manager = running(folder, [str(FAKE), *words])
            known[words] = manager, manager.__enter__()
        return known[words][1]

    yield start
    for manager, _ in known.values():
        manager.__exit__(None, None, None)


@pytest.fixture
def own_world(tmp_path: Path) -> Iterator[Callable[..., tuple[World, Callable[[], None]]]]:
    """Worlds that nobody else looks at, and how each is ended."""
    with ExitStack() as all_of_them:

        def start(*words: str) -> tuple[World, Callable[[], None]]:
            one = all_of_them.enter_context(ExitStack())
            return one.enter_context(running(tmp_path, [str(FAKE), *words])), one.close

        yield start


@pytest.fixture(scope="session", name="browser")  # while it runs, no other test has asyncio
def _browser() -> Iterator[Browser]:
    """The system's own, one for all files: these tests have a process of their own."""
    with chromium() as browser:
        yield browser


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
def _tabs(browser: Browser, fake: Callable[..., World]) -> Iterator[Tabs]:
    """Closed before the worlds end."""
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
