"""Kills of commands that start processes: none is left, and what they have recorded can be read."""

import sys

import pytest
from helpers.kills.quick import try_kills

pytestmark = [pytest.mark.system, pytest.mark.skipif(sys.platform != "linux", reason="no /proc")]


@pytest.mark.parametrize("subject", ["storms of workers", "live", "console"])
def test_nothing_that_a_killed_command_has_started_is_left(subject, tmp_path):
    try_kills(subject, tmp_path)
