"""Who looks and who drives: the pages that are open, and their names."""

from __future__ import annotations

import asyncio
import secrets
from collections import deque
from collections.abc import Iterable

from starlette.websockets import WebSocket

from dva_sim.console.web.access import Role
from dva_sim.console.web.feed import OWN_KEPT, PageFeed
from dva_sim.console.web.state import RunState

MOST_CLIENTS = 64
REMEMBERED = 30.0  # a page that is gone may come back under its name for so long [s]


class Driver:
    """The socket by which a page drives: answers to it, and its seat's newest line.

    Attributes:
        wake: Set when there is something to say.
        replaced: Whether a newer socket of the same page took over.
    """

    def __init__(self) -> None:
        self.wake = asyncio.Event()
        self.replaced = False
        self._answers: deque[str] = deque()
        self._seat: str | None = None

    def answer(self, text: str) -> None:
        """Say an answer; of a page that does not read, the oldest is lost."""
        if len(self._answers) >= OWN_KEPT:
            self._answers.popleft()
        self._answers.append(text)
        self.wake.set()

    def seat(self, text: str) -> None:
        """Say the newest of its seat."""
        self._seat = text
        self.wake.set()

    def next(self) -> str | None:
        """The next message; None if all is said."""
        if self._answers:
            return self._answers.popleft()
        text, self._seat = self._seat, None
        return text


class Client:
    """A page.

    Attributes:
        name: By which the simulation knows it; nobody can guess another's.
        role: What it may do.
        feed: What it gets.
        wake: Set when there may be something for it.
        watches: Robots whose pictures it says it looks at.
        driver: Its driving socket, if it has one.
        is_here: Whether its state socket is open.
        page: What the page calls itself until it is loaded anew; empty: nothing.
        ws: Its state socket, while that is open.
    """

    def __init__(self, name: str, role: Role, state: RunState, page: str = "") -> None:
        self.name, self.role, self.page = name, role, page
        self.ws: WebSocket | None = None
        self.feed = PageFeed(state, name, role >= Role.DRIVE)
        self.wake = asyncio.Event()
        self.watches: frozenset[int] = frozenset()
        self.driver: Driver | None = None
        self.is_here = True


class Clients:
    """All pages that are here, or were a moment ago.

    Args:
        state: Of the run.
    """

    def __init__(self, state: RunState) -> None:
        self._state = state
        self._all: dict[str, Client] = {}
        self._count = 0

    def here(self) -> list[Client]:
        """Those whose state socket is open."""
        return [client for client in self._all.values() if client.is_here]

    def is_full(self) -> bool:
        """Whether nobody more is let in."""
        return len(self.here()) >= MOST_CLIENTS

    def join(self, role: Role, name: str = "", page: str = "") -> Client:
        """Let a page in, under its old name if it was here a moment ago and is not any more.

        A copy of a page that is open has the same name, and gets another: they would drive the
        same robots. The very page that is open may come again, when it has lost its connection
        before we know of that.
        """
        known = self._all.get(name)
        if known is not None and known.role is role and _may_come_again(known, page):
            known.is_here, known.page = True, page
            known.feed = PageFeed(self._state, known.name, role >= Role.DRIVE)
            return known
        self._count += 1
        client = Client(f"c{self._count}-{secrets.token_hex(4)}", role, self._state, page)
        self._all[client.name] = client
        return client

    def find(self, name: str) -> Client | None:
        """The page of a name, if it is here."""
        client = self._all.get(name)
        return client if client is not None and client.is_here else None

    def leave(self, client: Client) -> None:
        """Its state socket is closed; its name is kept a while."""
        client.is_here, client.ws, client.watches = False, None, frozenset()

    def forget(self, client: Client) -> bool:
        """Forget a page that has not come back: whether it had not."""
        if client.is_here or self._all.get(client.name) is not client:
            return False
        del self._all[client.name]
        return True

    def watched(self) -> Iterable[int]:
        """Robots whose pictures somebody says to look at."""
        return (robot for client in self.here() for robot in client.watches)

    def looked(self) -> tuple[dict[str, bool], list[str]]:
        """Logs that pages look at, each with whether publications are wanted, and tables."""
        logs: dict[str, bool] = {}
        tables: set[str] = set()
        for looks in (client.feed.looks for client in self.here()):
            for name, wanted in looks.wanted.items():
                logs[name] = logs.get(name, False) or wanted.publications
            tables |= looks.tables
        return logs, sorted(tables)

    def wake(self) -> None:
        """Something is new."""
        for client in self._all.values():
            client.wake.set()


def _may_come_again(known: Client, page: str) -> bool:
    return not known.is_here or (bool(page) and page == known.page)
