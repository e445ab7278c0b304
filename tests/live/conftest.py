"""A place for programs to listen."""

import random
import socket
from collections.abc import Iterator

import pytest


@pytest.fixture
def address() -> Iterator[str]:
    """First of two free consecutive ports, as an address.

    The port before them is held meanwhile, so that no other process of these tests gets them;
    nor does anybody who asks for any free port: those lie above.
    """
    for first in random.sample(range(10_000, 19_990, 3), 3_000):
        with socket.socket() as guard:
            if _takes(guard, first) and _is_free(first + 1) and _is_free(first + 2):
                yield f"127.0.0.1:{first + 1}"
                return
    pytest.fail("no three free ports in a row")


def _is_free(port: int) -> bool:
    with socket.socket() as one:
        return _takes(one, port)


def _takes(one: socket.socket, port: int) -> bool:
    try:
        one.bind(("127.0.0.1", port))
    except OSError:
        return False
    return True
