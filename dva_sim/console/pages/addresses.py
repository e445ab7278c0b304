"""Under which addresses and names this machine is found."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Iterable

LOCAL_HOSTS = ("localhost", "127.0.0.1", "::1")


def own_address(host: str) -> str:
    """Return this machine's address for others, if it listens on all; else that one alone."""
    # RFC 5737: nobody has it
    family = socket.AF_INET
    far = "192.0.2.1"
    local = "127.0.0.1"
    if ":" in host:
        # RFC 3849: likewise
        family = socket.AF_INET6
        far = "2001:db8::1"
        local = "::1"
    with contextlib.suppress(OSError), socket.socket(family, socket.SOCK_DGRAM) as sock:
        sock.connect((far, 9))  # of a datagram socket that sends nothing: it chooses a way
        return str(sock.getsockname()[0])
    return local


def own_hosts(more: Iterable[str]) -> list[str]:
    """Names and addresses of this machine, as far as it knows them, and others that are given."""
    name = socket.gethostname()
    hosts = [*LOCAL_HOSTS, name, f"{name.partition('.')[0]}.local", own_address("0.0.0.0"), *more]
    hosts.append(own_address("::"))
    with contextlib.suppress(OSError):
        hosts += [str(entry[4][0]) for entry in socket.getaddrinfo(name, None)]
    return list(dict.fromkeys(hosts))


def address_of(host: str, port: int, scheme: str = "http") -> str:
    """Return the address of a page's root."""
    return f"{scheme}://{f'[{host}]' if ':' in host else host}:{port}/"
