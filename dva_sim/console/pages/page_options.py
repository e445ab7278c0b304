"""Options of the pages: addresses, ports and tokens."""

from __future__ import annotations

from dataclasses import dataclass

DEFAULT_PORT, PHONES_PORT = 8765, 8766


@dataclass(frozen=True, kw_only=True)
class PageOptions:
    """Addresses of the pages, and the secrets they ask for.

    Attributes:
        host: Address to listen on.
        port: 0: any that is free.
        token: True if the address must contain a secret.
        phones: True if phones have an address of their own, by https.
        phones_host: Address to listen on for them.
        phones_port: 0: any that is free.
        open: True to open a browser, where there is one.
    """

    host: str = "127.0.0.1"
    port: int = DEFAULT_PORT
    token: bool = True
    phones: bool = False
    phones_host: str = "0.0.0.0"
    phones_port: int = PHONES_PORT
    open: bool = True
