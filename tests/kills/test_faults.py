"""Faults of the program, planted: a kill finds each of them."""

import sys

import pytest
from helpers.kills.kill import Kill, troubles
from helpers.kills.table import FOURTH_RUN
from helpers.processes import patience

pytestmark = [
    pytest.mark.system,
    pytest.mark.skipif(sys.platform != "linux", reason="no /proc"),
]

JOURNAL = """
import subprocess, sys
from dataclasses import replace
from dva_sim.experiments.execution.checkpoint import Checkpoint
add, emptied = Checkpoint.add, lambda outcome: replace(outcome, tables="{}")
"""
LOST = "Checkpoint.add = lambda *_: None"
EMPTY = "Checkpoint.add = lambda self, batch, took: add(self, map(emptied, batch), took)"
TWO_LINES = 'print("error: again", file=sys.stderr)'
ORPHAN = 'subprocess.Popen(["sleep", "999"])'


@pytest.fixture(scope="module")
def quiet(tmp_path_factory):
    return tmp_path_factory.mktemp("quiet")


@pytest.mark.parametrize(
    ("planted", "told"),
    [
        ((LOST,), ["less than 3 runs were kept"]),
        ((EMPTY, TWO_LINES), ["1 lines after exit code -9", "differs in"]),
    ],
)
def test_a_kill_finds_a_fault(planted, told, quiet, tmp_path, monkeypatch):
    monkeypatch.setenv("DVA_SIM_PLANTED", "\n".join((JOURNAL, *planted)))
    found = troubles(Kill("study", FOURTH_RUN, "KILL"), tmp_path, quiet)
    assert [line[: len(text)] for line, text in zip(found, told, strict=True)] == told


def test_a_kill_finds_an_orphan(quiet, tmp_path, monkeypatch):
    monkeypatch.setenv("DVA_SIM_PLANTED", JOURNAL + ORPHAN)
    monkeypatch.setattr(patience, "PATIENCE_S", 20.0)
    with pytest.raises(TimeoutError, match="sleep 999"):
        troubles(Kill("study", FOURTH_RUN, "KILL"), tmp_path, quiet)
