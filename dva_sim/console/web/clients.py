"""Pages that are open, and programs: their names, which all may see, and keys, which nobody may.

The name says in the state and in the audit log who sits in a seat. Only the key, which the server
draws and shows to its owner alone, opens the seat.
"""

from __future__ import annotations

import asyncio
import hmac
import secrets
from collections import deque
from collections.abc import Iterable
from typing import Any

from starlette.websockets import WebSocket

from dva_sim.console.web.feed import PageFeed
from dva_sim.console.web.state import RunState
from dva_sim.console.wire.limits import OWN_KEPT
from dva_sim.console.wire.roles import Role

MAX_CLIENTS = 80  # design: 64 pages and 16 phones
REMEMBERED = 30.0  # a page that is gone may come back under its name for so long [s]
MAX_PROGRAMS = 64
PROGRAM_REMEMBERED = 600.0  # a program's seat is given back after this without a request [s]


class Driver:
    """The socket by which a page drives: answers to it, and its seat's newest line.

    Attributes:
        wake: Set when there is something to say.
        replaced: True once a newer socket of the same page took over.
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
        """Return the next message; None if all is said."""
        if self._answers:
            return self._answers.popleft()
        text = self._seat
        self._seat = None
        return text


class Client:
    """A page, or a program that sits in a seat.

    Attributes:
        name: By which the simulation knows it, and everybody who may look.
        key: Opens its seat; never shown to others.
        role: Role of the page.
        feed: Lines for the page.
        wake: Set when there may be something for it.
        watches: Robots whose pictures it says it looks at.
        driver: Its driving socket, if it has one.
        is_here: True while its state socket is open.
        page: Name that the page gives itself until it is loaded again; empty: none.
        ws: Its state socket, while that is open.
        asked: Time of a program's newest request [s].
        user: Name of the user who is logged in; empty: none.
        login: Token of that login.
    """

    def __init__(self, name: str, role: Role, state: RunState, page: str = "") -> None:
        self.name = name
        self.role = role
        self.page = page
        self.key = secrets.token_urlsafe(24)
        self.ws: WebSocket | None = None
        self.asked = 0.0
        self.user = ""
        self.login = ""
        self.feed = PageFeed(state, name, role >= Role.DRIVE)
        self.wake = asyncio.Event()
        self.watches: frozenset[int] = frozenset()
        self.driver: Driver | None = None
        self.is_here = True

    @property
    def page_role(self) -> str:
        """Role of an open page by which one drives or decides; empty otherwise."""
        return self.role.name.lower() if self.is_here and self.role >= Role.DRIVE else ""


class Clients:
    """All pages that are here, or were a moment ago.

    Args:
        state: State of the run.
    """

    def __init__(self, state: RunState) -> None:
        self._state = state
        self._all: dict[str, Client] = {}
        self._count = 0

    def here(self) -> list[Client]:
        """Return pages whose state socket is open."""
        return [client for client in self._all.values() if client.is_here]

    def acting(self) -> dict[str, str]:
        """Return who is there and may act, each with the role of its page.

        A phone drives from its own seat, and a program from the one that it asks for: their role
        is empty.
        """
        return {
            client.name: client.page_role
            for client in self._all.values()
            if client.role.acts and (client.is_here or client.asked)
        }

    def yielding(self, role: Role) -> Client | None:
        """Return the page that makes room for one of a role: of a lower role, idle ones first."""
        lesser = [client for client in self.here() if client.role < role]
        return min(lesser, key=lambda each: (each.role, each.driver is not None), default=None)

    def is_full(self) -> bool:
        """Return True if no place for a page is free."""
        return len(self.here()) >= MAX_CLIENTS

    def join(self, role: Role, key: str = "", page: str = "") -> Client:
        """Let a page in, under its old name if it was here a moment ago and is not any more.

        A copy of a page that is open has the same key, and gets another: they would drive the
        same robots. The very page that is open may come again, when it has lost its connection
        before we know of that.

        Args:
            role: Shown by its token.
            key: Key of the page that it was; empty: none.
            page: Name that it gives itself.
        """
        client_there = self._by_key(key)
        if (
            client_there is not None
            and client_there.role is role
            and _may_come_again(client_there, page)
        ):
            client_there.is_here = True
            client_there.page = page
            client_there.feed = PageFeed(self._state, client_there.name, role >= Role.DRIVE)
            return client_there
        return self._add(Client(self._new_name("c"), role, self._state, page))

    def add_program(self, role: Role, now: float) -> tuple[Client | None, Client | None]:
        """Return a new program and the one of a lower role whose place it takes, if any.

        Args:
            role: Shown by its token.
            now: Time [s].
        """
        programs = [client for client in self._all.values() if client.asked and not client.is_here]
        least = None
        if len(programs) >= MAX_PROGRAMS:
            least = min(programs, key=lambda each: (each.role, each.asked))
            if least.role >= role:
                return None, None
            self.remove(least)
        program = self._add(Client(self._new_name("p"), role, self._state))
        program.is_here = False
        program.asked = now
        return program, least

    def silent_programs(self, now: float) -> list[Client]:
        """Return the programs that have made no request for long, and forget them."""
        long_ago = now - PROGRAM_REMEMBERED
        silent = [
            client
            for client in self._all.values()
            if 0.0 < client.asked < long_ago and not client.is_here
        ]
        for client in silent:
            del self._all[client.name]
        return silent

    def remove(self, program: Client) -> None:
        """Forget a program."""
        self._all.pop(program.name, None)

    def _new_name(self, kind: str) -> str:
        self._count += 1
        return f"{kind}{self._count}-{secrets.token_hex(4)}"

    def _add(self, client: Client) -> Client:
        self._all[client.name] = client
        return client

    def _by_key(self, key: str) -> Client | None:
        key_bytes = key.encode("utf-8", "replace")
        fits = [c for c in self._all.values() if hmac.compare_digest(key_bytes, c.key.encode())]
        return fits[0] if fits else None

    def named(self, name: str) -> Client | None:
        """Return the page of a name, if it is here."""
        client = self._all.get(name)
        return client if client is not None and client.is_here else None

    def find(self, key: Any, role: Role) -> Client | None:
        """Return the page or program of a key, if its token has the same role as before."""
        client = self._by_key(key) if isinstance(key, str) else None
        is_there = client is not None and (client.is_here or client.asked)
        return client if client is not None and is_there and client.role is role else None

    def leave(self, client: Client) -> None:
        """Note that its state socket is closed; its name is kept a while."""
        client.is_here, client.ws, client.watches = False, None, frozenset()

    def forget(self, client: Client) -> bool:
        """Forget a page that has not come back: whether it had not."""
        if client.is_here or self._all.get(client.name) is not client:
            return False
        del self._all[client.name]
        return True

    def watched(self) -> Iterable[int]:
        """Return robots whose pictures somebody says to look at."""
        return (robot for client in self.here() for robot in client.watches)

    def looked(self) -> tuple[dict[str, bool], list[str]]:
        """Return logs that pages look at, each with whether publications are wanted, and tables."""
        logs: dict[str, bool] = {}
        tables: set[str] = set()
        for looks in (client.feed.looks for client in self.here()):
            for name, log_filter in looks.wanted.items():
                logs[name] = logs.get(name, False) or log_filter.publications
            tables |= looks.tables
        return logs, sorted(tables)

    def wake(self) -> None:
        """Wake it for something new."""
        for client in self._all.values():
            client.wake.set()


def _may_come_again(client: Client, page: str) -> bool:
    return not client.is_here or (bool(page) and page == client.page)
