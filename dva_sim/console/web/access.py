"""Access control: host names, origins, tokens and roles.

Three questions for each request, before anything else looks at it. Does it ask for this console
by one of its own names (else another site's name leads here: DNS rebinding)? Does it come from a
page of this console, or from no page at all? And which role does its token have?
"""

from __future__ import annotations

import hmac
import ipaddress
import re
import secrets
import socket
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, fields
from http.cookies import CookieError, SimpleCookie

from dva_sim.console.wire.roles import Role

LOCAL = ("localhost", "127.0.0.1", "::1")
_HOST = re.compile(
    r"(?:\[(?P<six>[0-9a-fA-F:.]{2,45})\]|(?P<name>[A-Za-z0-9._-]{1,253}))(?::\d{1,5})?"
)


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
        """New ones, of 192 random bits each."""
        return cls(*(secrets.token_urlsafe(24) for _ in fields(cls)))

    @property
    def are_asked(self) -> bool:
        """True if a token is required."""
        return bool(self.drive)

    def role_of(self, shown: str) -> Role:
        """The role of a token; all comparisons take the same time, whatever was shown."""
        if not self.are_asked:
            return Role.SUPERVISE
        given = shown.encode("utf-8", "replace")
        fits = [
            role
            for role in (Role.SUPERVISE, Role.DISPATCH, Role.DRIVE, Role.PHONE, Role.LOOK)
            if hmac.compare_digest(given, self.of(role).encode()) and given
        ]
        return fits[0] if fits else Role.NOBODY

    def of(self, role: Role) -> str:
        """The token of a role."""
        return str(getattr(self, role.name.lower(), self.look))


@dataclass(frozen=True)
class Asked:
    """Facts of a request that identify its sender and purpose.

    Attributes:
        host: The `Host` header.
        origin: The `Origin` header; None if there is none, as outside of browsers.
        site: The `Sec-Fetch-Site` header: how the asking page and this console are related.
        mode: The `Sec-Fetch-Mode` header; `navigate` where a person opens a page.
        scheme: `http` or `https`.
        changes: True if it is more than reading: a POST or a WebSocket.
        is_page: True if it asks for the page itself.
    """

    host: str
    origin: str | None = None
    site: str = ""
    mode: str = ""
    scheme: str = "http"
    changes: bool = False
    is_page: bool = False


@dataclass(frozen=True)
class Entrance:
    """The rules of one console.

    Attributes:
        tokens: Tokens of its roles.
        cookie: Name of the cookie; browsers do not tell ports apart, so the port is in it.
        names: Under which it is served, in lower case.
        any_address: True if it is served on all addresses of the machine: then each IP address may
            be asked for. An address cannot be made to lead elsewhere, as a name can.
        secure: True if it is served over https: then its cookie goes nowhere else.
    """

    tokens: Tokens
    cookie: str
    names: Collection[str] = field(default=LOCAL)
    any_address: bool = False
    secure: bool = False

    def refusal(self, asked: Asked) -> tuple[int, str] | None:
        """Status and reason for refusing a request in any role; None if it may pass."""
        if not self.is_own(asked.host):
            return 421, "this console is not served under that name"
        if asked.origin is not None:
            if not self._is_own_page(asked):
                return 403, "a page of another site may not ask here"
        elif asked.site in ("cross-site", "same-site"):
            opened = asked.is_page and asked.mode == "navigate" and not asked.changes
            if not opened:
                return 403, "a page of another site may not ask here"
        return None

    def is_own(self, host: str) -> bool:
        """Return True if a `Host` header names this console."""
        name = name_in(host)
        if name is None:
            return False
        return name in self.names or (self.any_address and is_address(name))

    def _is_own_page(self, asked: Asked) -> bool:
        """Return True if the requesting page has the same scheme, name and port as its target."""
        return (asked.origin or "").lower() == f"{asked.scheme}://{asked.host}".lower()

    def role(self, headers: Mapping[str, str], query: Mapping[str, str]) -> Role:
        """The best role of what is shown: a token in the address, in a header, in the cookie."""
        if not self.tokens.are_asked:
            return Role.SUPERVISE
        kind, _, bearer = headers.get("authorization", "").partition(" ")
        shown = [query.get("token", ""), self._in_cookie(headers.get("cookie", ""))]
        shown.append(bearer.strip() if kind.lower() in ("bearer", "token") else "")
        return max(self.tokens.role_of(token) for token in shown)

    def _in_cookie(self, header: str) -> str:
        try:
            morsel = SimpleCookie(header).get(self.cookie)
        except CookieError:
            return ""
        return morsel.value if morsel else ""

    def cookie_for(self, role: Role) -> str:
        """The header that gives a browser its role."""
        secure = "; Secure" if self.secure else ""
        return f"{self.cookie}={self.tokens.of(role)}; HttpOnly; SameSite=Strict; Path=/{secure}"


def rules(
    host: str,
    port: int,
    names: Collection[str] = (),
    tokens: Tokens | None = None,
    *,
    secure: bool = False,
) -> Entrance:
    """The rules of a console that listens on an address.

    Args:
        host: Host as asked for, such as `127.0.0.1`, `0.0.0.0` or a name of this machine.
        names: More names under which it is asked for.
        tokens: New ones are drawn if there are none.
        secure: True if it listens by https.
    """
    known = {name.lower().strip("[]") for name in (*names, host)}
    everywhere = is_address(host) and ipaddress.ip_address(host.strip("[]")).is_unspecified
    local = is_address(host) and ipaddress.ip_address(host.strip("[]")).is_loopback
    if everywhere or local or host.lower() == "localhost":
        known.update(LOCAL)
    if everywhere:
        known.add(socket.gethostname().lower())
    cookie = f"dva_sim_{port}"
    return Entrance(tokens or Tokens.drawn(), cookie, frozenset(known), everywhere, secure)


def name_in(host: str) -> str | None:
    """The name or address in a `Host` header, in lower case; None if it is none."""
    found = _HOST.fullmatch(host)
    if found is None:
        return None
    return (found["six"] or found["name"]).lower()


def is_address(name: str) -> bool:
    """Return True if a name is an IP address."""
    try:
        ipaddress.ip_address(name.strip("[]"))
    except ValueError:
        return False
    return True
