"""Logins of users: sessions in cookies that end, and attempts that are slowed down."""

from __future__ import annotations

import asyncio
import secrets
from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from pathlib import Path
from typing import Final

from dva_sim.console.wire.roles import Role
from dva_sim.kernel.errors import ConfigError
from dva_sim.serving.users import User, UserFile, is_password_of

LASTS: Final = 10 * 3600.0  # a session: a shift, and what is left of the one before [s]
LOOK_AGAIN: Final = 1.0  # from one look whether the file has changed to the next [s]
FREE_TRIES: Final = 3  # attempts that fail before the next one has to wait
MAX_WAIT: Final = 60.0  # after many attempts that have failed [s]
MAX_SESSIONS: Final = 1000
MAX_TRIED: Final = 4096  # names and addresses whose failures are remembered


class TooSoon(Exception):
    """An attempt to log in that has to wait.

    Attributes:
        wait_s: Time until the next attempt is looked at [s].
    """

    def __init__(self, wait_s: float) -> None:
        super().__init__(f"too many attempts: try again in {wait_s:.0f} s")
        self.wait_s = wait_s


@dataclass(frozen=True)
class Session:
    """A login.

    Attributes:
        name: Name of the user.
        ends: Time of its end [s].
    """

    name: str
    ends: float


@dataclass
class _Failures:
    count: int = 0
    until: float = 0.0  # no attempt is looked at before [s]


class Logins:
    """Logins of a console.

    Args:
        path: File of the users.
        clock: Function that returns the time [s].

    Raises:
        ConfigError: the file has no users, or cannot be read.
    """

    def __init__(self, path: Path, clock: Callable[[], float]) -> None:
        self._path = path
        self._clock = clock
        self._users = UserFile(path).users
        if not self._users:
            raise ConfigError("has no users; add one: dva-sim users add NAME", path)
        self._stamp = _stamp(path)
        self._looked = clock()
        self._sessions: OrderedDict[str, Session] = OrderedDict()
        self._failures: OrderedDict[str, _Failures] = OrderedDict()

    async def log_in(self, name: str, password: str, address: str) -> str | None:
        """Return the token of a new session; None if name and password do not fit.

        Args:
            name: Name of the user.
            password: As it was typed.
            address: Address of the browser.

        Raises:
            TooSoon: too many attempts of that name, or from that address, have failed.
        """
        keys = f"name {name}", f"address {address}"
        now = self._clock()
        wait = max(self._failures.get(key, _Failures()).until for key in keys) - now
        if wait > 0.0:
            raise TooSoon(max(1.0, wait))
        for key in keys:  # until it is known better: attempts at the same time are slowed as well
            self._fail(key, now)
        user = self._user(name)
        fits = await asyncio.to_thread(is_password_of, user, password)
        if not fits or user is None or user.locked:
            return None
        for key in keys:
            self._failures.pop(key, None)
        token = secrets.token_urlsafe(24)
        self._sessions[token] = Session(name, self._clock() + LASTS)
        while len(self._sessions) > MAX_SESSIONS:
            self._sessions.popitem(last=False)
        return token

    def _fail(self, key: str, now: float) -> None:
        failures = self._failures.setdefault(key, _Failures())
        failures.count += 1
        if failures.count > FREE_TRIES:
            doublings = min(failures.count - FREE_TRIES, 10)
            failures.until = now + min(MAX_WAIT, 2.0**doublings)
        self._failures.move_to_end(key)
        while len(self._failures) > MAX_TRIED:
            self._failures.popitem(last=False)

    def log_out(self, token: str) -> None:
        """End a session."""
        self._sessions.pop(token, None)

    def user_of(self, token: str) -> User | None:
        """Return the user of a session that goes on: neither over, nor of a user locked since."""
        session = self._sessions.get(token)
        if session is None or session.ends < self._clock():
            self.log_out(token)
            return None
        user = self._user(session.name)
        return None if user is None or user.locked else user

    def _user(self, name: str) -> User | None:
        """Return a user as the file has it now; of one that cannot be read, nobody."""
        now = self._clock()
        if now - self._looked >= LOOK_AGAIN:
            self._looked = now
            stamp = _stamp(self._path)
            if stamp != self._stamp:
                self._stamp = stamp
                try:
                    self._users = UserFile(self._path).users
                except ConfigError:
                    self._users = {}  # nobody, until it can be read again
        return self._users.get(name)


def role_of(user: User | None) -> Role:
    """Return the role of a user."""
    return Role.NOBODY if user is None else Role[user.role.upper()]


def in_cookie(headers: Mapping[str, str], cookie: str) -> str:
    """Return the value of a cookie; empty if there is none."""
    try:
        morsel = SimpleCookie(headers.get("cookie", "")).get(cookie)
    except CookieError:
        return ""
    return morsel.value if morsel else ""


def _stamp(path: Path) -> tuple[int, int] | None:
    try:
        facts = path.stat()
    except OSError:
        return None
    return facts.st_mtime_ns, facts.st_size
