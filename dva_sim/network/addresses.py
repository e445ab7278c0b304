"""Addresses of devices, as people write them: `HOST:PORT`."""

from __future__ import annotations

import socket
from typing import Final

from dva_sim.kernel.errors import ConfigError

EXAMPLE: Final = "as in 127.0.0.1:5600"
HIGHEST: Final = 65_534  # port; a device listens at the next one, too


def check_address(text: str, where: str = "") -> None:
    """Reject an invalid address.

    Args:
        text: Address as given.
        where: Option that it was given to, with a space behind it.

    Raises:
        ConfigError: which part of it is wrong.
    """
    if problem := problem_of(text):
        raise ConfigError(f"{where}{text!r} {problem}")


def problem_of(text: str) -> str:
    """Return what is wrong with an address; empty if nothing is."""
    host, colon, port = text.rpartition(":")
    if "[" in text or "::" in text:
        return f"is an IPv6 address, which is not supported; give IPv4 or a name, {EXAMPLE}"
    if text.count(":") > 1:
        return f"has two colons; should be HOST:PORT, {EXAMPLE}"
    if not colon:
        return f"has no port; should be HOST:PORT, {EXAMPLE}"
    if not host or any(sign.isspace() or sign == "/" for sign in host):
        return f"has no host before the colon; should be HOST:PORT, {EXAMPLE}"
    if not (port.isascii() and port.isdigit()):
        return f"has no number as its port; should be HOST:PORT, {EXAMPLE}"
    if not 0 < int(port) <= HIGHEST:
        return f"has port {port}; should be from 1 to {HIGHEST}, as the next one is used, too"
    return ""


def address_towards(peers: str) -> str:
    """Return the address at which the first of some peers, `HOST:PORT,...`, finds this machine."""
    host = peers.split(",")[0].partition(":")[0]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as way:
        try:
            way.connect((host, 1))  # nothing is sent by that
        except OSError:
            return "127.0.0.1"
        return str(way.getsockname()[0])
