"""Access control of the console: the tokens of its roles, behind the names of its port."""

from __future__ import annotations

import hmac
import secrets
from collections.abc import Collection, Mapping
from dataclasses import dataclass, fields

from dva_sim.console.web.logins import LASTS, Logins, in_cookie, role_of
from dva_sim.console.wire.roles import Role
from dva_sim.serving.admission import OwnNames, own_names
from dva_sim.serving.users import User


@dataclass(frozen=True)
class Tokens:
    """The secrets of the roles; none of them where everybody may do everything.

    Attributes:
        look: Opens pages and pictures.
        drive: Lets robots move, too.
        phone: For phones: what a phone may, and no more.
        dispatch: Sends people and robots to events, too.
        supervise: Takes robots from their holders, too: everything.
    """

    look: str = ""
    drive: str = ""
    phone: str = ""
    dispatch: str = ""
    supervise: str = ""

    @classmethod
    def drawn(cls) -> Tokens:
        """Return the new ones, of 192 random bits each."""
        return cls(*(secrets.token_urlsafe(24) for _ in fields(cls)))

    @property
    def are_asked(self) -> bool:
        """True if a token is required."""
        return bool(self.drive)

    def role_of(self, token_text: str) -> Role:
        """Return the role of a token; all comparisons take the same time, whatever was shown."""
        if not self.are_asked:
            return Role.SUPERVISE
        token = token_text.encode("utf-8", "replace")
        fits = [
            role
            for role in (Role.SUPERVISE, Role.DISPATCH, Role.DRIVE, Role.PHONE, Role.LOOK)
            if hmac.compare_digest(token, self.of(role).encode()) and token
        ]
        return fits[0] if fits else Role.NOBODY

    def of(self, role: Role) -> str:
        """Return the token of a role."""
        return str(getattr(self, role.name.lower(), self.look))


@dataclass(frozen=True)
class Entrance:
    """The rules of one console.

    Attributes:
        tokens: Tokens of its roles.
        cookie: Name of the cookie; browsers do not tell ports apart, so the port is in it.
        own: Names under which it is served.
        secure: True if it is served over https: then its cookie goes nowhere else.
        logins: Logins of users; None: nobody logs in.
    """

    tokens: Tokens
    cookie: str
    own: OwnNames
    secure: bool = False
    logins: Logins | None = None

    def role(self, headers: Mapping[str, str], query: Mapping[str, str]) -> Role:
        """Return the best role of what is shown: token in the address, header, cookie, login."""
        if not self.tokens.are_asked:
            return Role.SUPERVISE
        kind, _, bearer = headers.get("authorization", "").partition(" ")
        tokens = [query.get("token", ""), in_cookie(headers, self.cookie)]
        tokens.append(bearer.strip() if kind.lower() in ("bearer", "token") else "")
        by_token = max(self.tokens.role_of(token) for token in tokens)
        return max(by_token, role_of(self.user(headers)))

    def user(self, headers: Mapping[str, str]) -> User | None:
        """Return the user who is logged in."""
        return None if self.logins is None else self.logins.user_of(self.session(headers))

    def session(self, headers: Mapping[str, str]) -> str:
        """Return the token of a login; empty without one."""
        return in_cookie(headers, self.login_cookie)

    @property
    def login_cookie(self) -> str:
        """Name of the cookie of logins."""
        return f"{self.cookie}_login"

    def cookie_for(self, role: Role) -> str:
        """Return the header that gives a browser its role."""
        return self._cookie(self.cookie, self.tokens.of(role))

    def cookie_of_login(self, token: str) -> str:
        """Return the header that gives a browser its login, or takes it back by an empty token."""
        lasts = round(LASTS) if token else 0
        return f"{self._cookie(self.login_cookie, token)}; Max-Age={lasts}"

    def _cookie(self, name: str, value: str) -> str:
        secure = "; Secure" if self.secure else ""
        return f"{name}={value}; HttpOnly; SameSite=Strict; Path=/{secure}"


def rules(
    host: str,
    port: int,
    names: Collection[str] = (),
    tokens: Tokens | None = None,
    *,
    secure: bool = False,
    logins: Logins | None = None,
) -> Entrance:
    """Return the rules of a console that listens on an address.

    Args:
        host: Host as asked for, such as `127.0.0.1`, `0.0.0.0` or a name of this machine.
        names: More names under which it is asked for.
        tokens: New ones are drawn if there are none.
        secure: True if it listens by https.
        logins: Logins of users; None: nobody logs in.
    """
    own = own_names(host, names)
    return Entrance(tokens or Tokens.drawn(), f"dva_sim_{port}", own, secure, logins)
