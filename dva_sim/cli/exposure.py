"""Warnings, a line each, of what a command opens to a network without keys or tokens."""

from __future__ import annotations

import ipaddress
import socket
from collections.abc import Iterable

import typer

EVERYWHERE = "0.0.0.0", "::"  # addresses that stand for every address of this machine
FORGERS = (
    "anybody who reaches it can register, read and forge messages, and stop or drive the robots"
)
DRIVERS = "anybody who reaches it can do all that the page offers"
MOVERS = "anybody who reaches it can ask the DVA for robots and drive them"
VIEWERS = "anybody who reaches it can watch what the robots see"
WATCHERS = "anybody who reaches it can watch the recordings"


def warn_of_devices(hosts: Iterable[str], *, has_keys: bool, close_by: str) -> None:
    """Warn that devices listen beyond this machine without keys.

    Args:
        hosts: Addresses to listen on.
        has_keys: True if devices need keys, which needs no warning.
        close_by: The way to close them.
    """
    open_to = [] if has_keys else _beyond(hosts)
    if open_to:
        _say(f"devices listen on {_named(open_to)} without keys: {FORGERS}; {close_by}")


def warn_of_pages(hosts: Iterable[str], *, has_token: bool, can: str = DRIVERS) -> None:
    """Warn that pages are open beyond this machine without a token.

    Args:
        hosts: Addresses to listen on.
        has_token: True if pages need a token, which needs no warning.
        can: The rights of anybody who reaches them.
    """
    open_to = [] if has_token else _beyond(hosts)
    if open_to:
        _say(f"the page is on {_named(open_to)} without a token: {can}; leave out --no-token")


def warn_of_pictures(hosts: Iterable[str]) -> None:
    """Warn that pictures are open beyond this machine, though devices need keys.

    Args:
        hosts: Addresses to listen on.
    """
    if open_to := _beyond(hosts):
        _say(f"pictures are on {_named(open_to)} without a key: {VIEWERS}; leave out --camera-port")


def warn_of_clients(hosts: Iterable[str], *, has_token: bool) -> None:
    """Warn that clients of other makes may come from beyond this machine without a token.

    Args:
        hosts: Addresses to listen on.
        has_token: True if clients need a token, which needs no warning.
    """
    open_to = [] if has_token else _beyond(hosts)
    if open_to:
        _say(f"rosbridge is on {_named(open_to)} without a token: {MOVERS}; leave out --no-token")


def is_local(host: str) -> bool:
    """Return True if an address or a name can be reached from this machine alone."""
    host = host.strip("[]")
    try:
        return ipaddress.ip_address(host.partition("%")[0]).is_loopback
    except ValueError:
        pass
    try:
        addresses = [str(entry[4][0]) for entry in socket.getaddrinfo(host, None)]
    except OSError:
        return False  # the command itself reports an address that does not exist
    return bool(addresses) and all(
        ipaddress.ip_address(a.partition("%")[0]).is_loopback for a in addresses
    )


def _beyond(hosts: Iterable[str]) -> list[str]:
    return [host for host in dict.fromkeys(hosts) if not is_local(host)]


def _named(hosts: Iterable[str]) -> str:
    named = (f"{h} (every address of this machine)" if h in EVERYWHERE else h for h in hosts)
    return " and ".join(named)


def _say(what: str) -> None:
    typer.echo(f"warning: {what}", err=True)
