"""Programs for tests that start some."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from helpers.processes.programs import Programs, all_gone_after


@pytest.fixture
def programs(tmp_path: Path) -> Iterator[Programs]:
    yield from all_gone_after(tmp_path)
