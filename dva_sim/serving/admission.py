"""Admission of requests: by the name they ask for, the page they come from, and their token.

A name of another site may lead here (DNS rebinding), and a page of another site may ask from a
browser on this machine. Both are refused before anything else looks at a request.
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
        site: The `Sec-Fetch-Site` header: how the asking page and this server are related.
        mode: The `Sec-Fetch-Mode` header; `navigate` where a person opens a page.
        scheme: `http` or `https`.
        changes: True if it is more than reading: a POST or a WebSocket.
        is_page: True if it asks for something that people open in a browser.
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
    """Names under which a port is served, and the pages that may ask it.

    Attributes:
        names: In lower case.
        any_address: True if it is served on all addresses of the machine: then each IP address may
            be asked for. An address cannot be made to lead elsewhere, as a name can.
        any_port: True if pages may ask that another port of the same names serves.
        programs: Origins of programs elsewhere that may ask.
    """

    names: Collection[str] = LOCAL
    any_address: bool = False
    any_port: bool = False
    programs: Collection[str] = ()

    def refusal(self, facts: RequestFacts) -> tuple[int, str] | None:
        """Return status and reason for refusing a request with any token; None: it may pass."""
        if not self.is_own(facts.host):
            return 421, "nothing is served here under that name"
        if facts.origin is not None:
            if not self._may_ask(facts.origin.lower(), facts):
                return 403, "a page of another site may not ask here"
        elif facts.site == "cross-site" or (facts.site == "same-site" and not self.any_port):
            opened = facts.is_page and facts.mode == "navigate" and not facts.changes
            if not opened:
                return 403, "a page of another site may not ask here"
        return None

    def is_own(self, host: str) -> bool:
        """Return True if a `Host` header names this server."""
        name = name_in(host)
        if name is None:
            return False
        return name in self.names or (self.any_address and is_address(name))

    def _may_ask(self, origin: str, facts: RequestFacts) -> bool:
        """Return True for pages of the same scheme, name and port, and for those let in besides."""
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
        names: More names under which it is asked for.
        any_port: See `OwnNames`.
        programs: See `OwnNames`.
    """
    names_here = {name.lower().strip("[]") for name in (*names, host)}
    everywhere = is_address(host) and ipaddress.ip_address(host.strip("[]")).is_unspecified
    local = is_address(host) and ipaddress.ip_address(host.strip("[]")).is_loopback
    if everywhere or local or host.lower() == "localhost":
        names_here.update(LOCAL)
    if everywhere:
        names_here.add(socket.gethostname().lower())
    return OwnNames(frozenset(names_here), everywhere, any_port, programs)


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
        """Return status and reason for refusing a request; None: it may pass.

        Args:
            facts: The request.
            query: Query of its address.
            bearer: Its `Authorization` header.
        """
        refusal = self.own.refusal(facts)
        if refusal is not None:
            return refusal
        try:
            token = parse_qs(query).get("token", [""])[0]
        except ValueError:  # more fields than anybody writes
            return 400, "the address makes no sense"
        token = token or bearer.removeprefix("Bearer ")
        token_bytes = token.encode("utf-8", "replace")
        secret = self.token.encode()
        if self.token and not hmac.compare_digest(token_bytes, secret):
            return 401, "the token is missing or wrong: add ?token=... as printed with the address"
        return None


def name_in(host: str) -> str | None:
    """Return the name or address in a `Host` header, in lower case; None if it is none."""
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
