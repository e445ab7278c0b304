"""Programs that are left nowhere, and an emulated link to run them over."""

from collections.abc import Iterator

import pytest
from helpers.network.emulated_link import need_link
from helpers.processes.programs import Programs


@pytest.fixture
def programs(tmp_path) -> Iterator[Programs]:
    need_link()
    made = Programs(tmp_path)
    yield made
    made.end_all()
