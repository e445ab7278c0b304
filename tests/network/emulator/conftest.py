"""Programs that are left nowhere, and an emulated link to run them over."""

import pytest
from helpers.network.emulated_link import need_link
from helpers.processes.programs import Programs


@pytest.fixture
def programs(programs: Programs) -> Programs:
    need_link()
    return programs
