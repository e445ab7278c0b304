"""The second listener: https, for phones."""

from __future__ import annotations

import socket
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from dva_sim.console.pages.addresses import address_of, own_address, own_hosts
from dva_sim.console.web.access import Entrance, Tokens, rules
from dva_sim.console.web.certificate_files import certificates, data_folder
from dva_sim.console.web.certificates import Hosts
from dva_sim.console.web.logins import Logins
from dva_sim.console.web.phones import PhoneDoor
from dva_sim.serving.listening import listen


class PhoneListener(NamedTuple):
    """All that phones are served with.

    Attributes:
        sock: Listening socket.
        access: Its rules.
        certificate: File with key and certificate.
        door: Address and certificate, for display.
        notices: Renewals, for people, a line each.
    """

    sock: socket.socket
    access: Entrance
    certificate: Path
    door: PhoneDoor
    notices: tuple[str, ...]


def listen_for_phones(
    host: str,
    port: int,
    names: Sequence[str],
    *,
    tokens: Tokens,
    folder: Path | None = None,
    logins: Logins | None = None,
) -> PhoneListener:
    """Listen, with a certificate of this machine.

    Args:
        host: Address of this machine, or one that means all.
        port: 0 for any that is free.
        names: More names of this machine.
        tokens: Tokens of all roles.
        folder: Folder of the certificates; by default in the user's data folder.
        logins: Logins of users; None: nobody logs in.

    Raises:
        ConfigError: the address is not of this machine, or taken.
        NoCertificate: none can be kept.
    """
    sock = listen(host, port, "--phones-port")
    try:
        port = sock.getsockname()[1]
        access = rules(host, port, (*names, *own_hosts(())), tokens, secure=True, logins=logins)
        own_host = own_address(host) if access.own.any_address else host.strip("[]")
        hosts = Hosts.of(own_hosts([*names, own_host]))
        pair = certificates(folder or data_folder() / "phones", hosts)
    except BaseException:
        sock.close()
        raise
    base = address_of(own_host, port, "https")
    token = tokens.phone
    door = PhoneDoor(f"{base}?token={token}" if token else f"{base}phone", pair.authority.der)
    return PhoneListener(sock, access, pair.leaf, door, pair.notices)
