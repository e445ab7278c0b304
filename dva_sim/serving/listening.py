"""Listening sockets for HTTP."""

from __future__ import annotations

import contextlib
import errno
import socket

from dva_sim.kernel.errors import ConfigError

SEND_BYTES = 64 * 1024  # kernel send buffer of a connection: data in it goes stale
SILENT_MS = 20_000  # a connection that takes or answers nothing for this long is cut [ms]
WAITING = 1024  # maximum connections waiting to be accepted


def listen(host: str, port: int, option: str = "--port") -> socket.socket:
    """Return a listening socket, so that its port is known before anything is served.

    Args:
        host: Address of this machine.
        port: Port; 0 for any free one.
        option: Command-line option that names the port.

    Raises:
        ConfigError: the address is not of this machine, or taken.
    """
    try:
        addresses = socket.getaddrinfo(host.strip("[]"), port, type=socket.SOCK_STREAM)
        family, kind, protocol, _, address = addresses[0]
        with contextlib.ExitStack() as on_failure:
            sock = on_failure.enter_context(socket.socket(family, kind, protocol))
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            sock.bind(address)
            on_failure.pop_all()
    except OSError as error:
        text = f"cannot listen on {host} port {port}: {error.strerror}"
        if error.errno == errno.EADDRINUSE:
            text += f"; give another {option}, or {option} 0 for any that is free"
        raise ConfigError(text) from error
    # Connections inherit these.
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BYTES)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    if hasattr(socket, "TCP_USER_TIMEOUT"):
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, SILENT_MS)
    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    sock.listen(WAITING)
    sock.setblocking(False)
    return sock
