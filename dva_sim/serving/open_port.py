"""A port for programs of other makers, with its token and its address."""

from __future__ import annotations

import json
import os
import secrets
import socket
from collections.abc import Collection
from dataclasses import dataclass

from dva_sim.serving.admission import Admission, own_names
from dva_sim.serving.listening import listen


@dataclass(frozen=True)
class OpenPort:
    """A port for clients of other makers.

    Attributes:
        listener: Listening socket.
        token: Token that clients have to show; empty: none is needed.
        host: Address of this machine that it listens on.
    """

    listener: socket.socket
    token: str
    host: str

    def passed(self) -> tuple[int, int]:
        """Return open files for another process: the listener, and a pipe with token and host.

        Command-line arguments would show the token to every user of this machine.
        """
        reader, writer = os.pipe()
        os.write(writer, json.dumps([self.token, self.host]).encode())
        os.close(writer)
        return self.listener.fileno(), reader

    @classmethod
    def received(cls, listener: int, token: int) -> OpenPort:
        """Return the port that another process has passed."""
        with os.fdopen(token, "rb") as pipe:
            return cls(socket.socket(fileno=listener), *json.load(pipe))

    def admission(self, programs: Collection[str] = ()) -> Admission:
        """Return the rules by which clients are admitted.

        Args:
            programs: Origins of web applications elsewhere that are admitted with the token.
        """
        names = own_names(self.host, any_port=True, programs=programs)
        return Admission(names, self.token)

    @property
    def url(self) -> str:
        """Return its address, with the token."""
        host_text = f"[{self.host}]" if ":" in self.host else self.host
        query = f"/?token={self.token}" if self.token else ""
        return f"ws://{host_text}:{self.listener.getsockname()[1]}{query}"


def open_port(host: str, port: int, option: str, has_token: bool = True) -> OpenPort:
    """Open a port.

    Args:
        host: Address of this machine to listen on.
        port: Port; 0 for any free one.
        option: Command-line option that names the port.
        has_token: True if clients need a token, which is drawn.

    Raises:
        ConfigError: the address is not of this machine, or taken.
    """
    token = secrets.token_urlsafe(24) if has_token else ""
    return OpenPort(listen(host, port, option), token, host)
