"""Kills of studies and reports: done again, they end as if nothing had been."""

import sys

import pytest
from helpers.kills.quick import try_kills
from helpers.kills.table import KILLS

pytestmark = [
    pytest.mark.system,
    pytest.mark.skipif(sys.platform != "linux", reason="no /proc"),
]


@pytest.mark.invariant("S9")
@pytest.mark.parametrize("subject", ["study", "study of workers", "report"])
def test_a_command_that_is_killed_goes_on_and_ends_with_the_same_bytes(subject, tmp_path):
    try_kills(subject, tmp_path)


def test_there_are_a_hundred_kills_and_no_two_alike():
    assert len(set(map(str, KILLS))) == len(KILLS) >= 100
    assert sum(each.is_quick for each in KILLS) == 20
