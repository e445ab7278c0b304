"""Admission of requests, by their host name, the page that sent them, and their token.

The name of another site may resolve to this machine (DNS rebinding), and a page of another site may
send requests from a browser on this machine. Both are refused before a request is processed.
"""

from __future__ import annotations

import hmac
import ipaddress
import re
import socket
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import Final
from urllib.parse import parse_qs

LOCAL: Final = ("localhost", "127.0.0.1", "::1")
_HOST = re.compile(
    r"(?:\[(?P<six>[0-9a-fA-F:.]{2,45})\]|(?P<name>[A-Za-z0-9._-]{1,253}))(?::\d{1,5})?"
)


@dataclass(frozen=True)
class RequestFacts:
    """Facts of a request that identify its sender and purpose.

    Attributes:
        host: The `Host` header.
        origin: The `Origin` header; None if there is none, as outside of browsers.
        site: The `Sec-Fetch-Site` header: relation of the sending page to this server.
        mode: The `Sec-Fetch-Mode` header; `navigate` where a person opens a page.
        scheme: `http` or `https`.
        changes: True for requests that may change something: a POST or a WebSocket.
        is_page: True if people open the requested address in a browser.
    """

    host: str
    origin: str | None = None
    site: str = ""
    mode: str = ""
    scheme: str = "http"
    changes: bool = False
    is_page: bool = False


@dataclass(frozen=True)
class OwnNames:
    """Names under which a port is served, and the pages that may send it requests.

    Attributes:
        names: Host names, in lower case.
        any_address: True if it is served on all addresses of the machine. Then any IP address is
            accepted as host: unlike a name, an address cannot be rebound to another machine.
        any_port: True if pages served by another port of the same names are admitted.
        programs: Origins of web applications elsewhere that are admitted.
    """

    names: Collection[str] = LOCAL
    any_address: bool = False
    any_port: bool = False
    programs: Collection[str] = ()

    def refusal(self, facts: RequestFacts) -> tuple[int, str] | None:
        """Return the HTTP status and reason of a refusal, whatever the token; None to admit."""
        if not self.is_own(facts.host):
            return 421, "nothing is served here under that name"
        if facts.origin is not None:
            if not self._admits(facts.origin.lower(), facts):
                return 403, "a page of another site may not ask here"
        elif facts.site == "cross-site" or (facts.site == "same-site" and not self.any_port):
            # Following a link from another site is harmless: it only opens a page.
            is_link = facts.is_page and facts.mode == "navigate" and not facts.changes
            if not is_link:
                return 403, "a page of another site may not ask here"
        return None

    def is_own(self, host: str) -> bool:
        """Return True if a `Host` header names this server."""
        name = name_in(host)
        if name is None:
            return False
        return name in self.names or (self.any_address and is_address(name))

    def _admits(self, origin: str, facts: RequestFacts) -> bool:
        """Return True for pages of the same scheme, name and port, or an admitted origin."""
        if origin == f"{facts.scheme}://{facts.host}".lower() or origin in self.programs:
            return True
        scheme, _, host = origin.partition("://")
        return self.any_port and scheme in ("http", "https") and self.is_own(host)


def own_names(
    host: str, names: Iterable[str] = (), *, any_port: bool = False, programs: Collection[str] = ()
) -> OwnNames:
    """Return the names of a server.

    Args:
        host: Host that it listens on, such as `127.0.0.1`, `0.0.0.0` or a name of this machine.
        names: Further names under which clients reach it.
        any_port: See `OwnNames`.
        programs: See `OwnNames`.
    """
    all_names = {name.lower().strip("[]") for name in (*names, host)}
    everywhere = is_address(host) and ipaddress.ip_address(host.strip("[]")).is_unspecified
    local = is_address(host) and ipaddress.ip_address(host.strip("[]")).is_loopback
    if everywhere or local or host.lower() == "localhost":
        all_names.update(LOCAL)
    if everywhere:
        all_names.add(socket.gethostname().lower())
    return OwnNames(frozenset(all_names), everywhere, any_port, programs)


@dataclass(frozen=True)
class Admission:
    """The rules of a port with one token.

    Attributes:
        own: Names and pages.
        token: Token that clients have to show; empty: none is needed.
    """

    own: OwnNames
    token: str = ""

    def refusal(self, facts: RequestFacts, query: str, bearer: str) -> tuple[int, str] | None:
        """Return the HTTP status and reason of a refusal; None to admit the request.

        Args:
            facts: The request.
            query: Query string of the request.
            bearer: `Authorization` header of the request.
        """
        refusal = self.own.refusal(facts)
        if refusal is not None:
            return refusal
        try:
            token = parse_qs(query).get("token", [""])[0]
        except ValueError:  # more fields than the parser allows
            return 400, "the address makes no sense"
        token = token or bearer.removeprefix("Bearer ")
        token_bytes = token.encode("utf-8", "replace")
        secret = self.token.encode()
        if self.token and not hmac.compare_digest(token_bytes, secret):
            return 401, "the token is missing or wrong: add ?token=... as printed with the address"
        return None


def name_in(host: str) -> str | None:
    """Return the name or address in a `Host` header, in lower case; None if it is malformed."""
    match = _HOST.fullmatch(host)
    if match is None:
        return None
    return (match["six"] or match["name"]).lower()


def is_address(name: str) -> bool:
    """Return True if a name is an IP address."""
    try:
        ipaddress.ip_address(name.strip("[]"))
    except ValueError:
        return False
    return True
