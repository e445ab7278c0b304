"""Programs for tests that start some, and a place for them to listen."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from pathlib import Path

import pytest
from programs import Programs, all_gone_after


@pytest.fixture
def programs(tmp_path: Path) -> Iterator[Programs]:
    yield from all_gone_after(tmp_path)


@pytest.fixture
def address() -> str:
    """Where nobody listens: two free ports in a row, of which the first is named."""
    while True:
        with socket.socket() as one, socket.socket() as two:
            one.bind(("127.0.0.1", 0))
            port = one.getsockname()[1]
            try:
                two.bind(("127.0.0.1", port + 1))
            except (OSError, OverflowError):
                continue
            return f"127.0.0.1:{port}"
