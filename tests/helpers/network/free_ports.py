"""Ports for programs that need the same port again after a restart."""

import random
import socket


def free_port() -> int:
    """The first of two that are free, below those that systems give out by themselves."""
    for _ in range(1000):
        port = random.randrange(21_000, 30_000, 2)
        with socket.socket() as one, socket.socket() as other:
            try:
                one.bind(("127.0.0.1", port))
                other.bind(("127.0.0.1", port + 1))
            except OSError:
                continue
        return port
    raise AssertionError("no port is free")
