"""Kills of commands that make files: done again, they end as if nothing had been."""

import sys

import pytest
from helpers.kills.kill import Kill, troubles
from helpers.kills.quick import try_kills
from helpers.kills.table import FOURTH_RUN, KILLS
from helpers.processes import patience

pytestmark = [pytest.mark.system, pytest.mark.skipif(sys.platform != "linux", reason="no /proc")]


@pytest.fixture(scope="module")
def quiet(tmp_path_factory):
    return tmp_path_factory.mktemp("quiet")


@pytest.mark.invariant("S9")
@pytest.mark.parametrize("subject", ["study", "report"])
def test_a_command_that_is_killed_goes_on_and_ends_with_the_same_bytes(subject, quiet):
    try_kills(subject, quiet)


def test_there_are_a_hundred_kills_and_no_two_alike():
    assert len(set(map(str, KILLS))) == len(KILLS) >= 100
    assert sum(each.is_quick for each in KILLS) == 20


PLANTED = {
    "an orphan": ('subprocess.Popen(["sleep", "999"])', "TimeoutError"),
    "two lines": ('print("error: again", file=sys.stderr)', "1 lines after exit code -9"),
    "a lost row": (
        "from dva_sim.experiments.execution.checkpoint import Checkpoint\n"
        "Checkpoint.add = lambda *_: None",
        "less than 3 runs were kept",
    ),
    "another row": (
        "from dva_sim.experiments.execution.checkpoint import Checkpoint\n"
        "add, emptied = Checkpoint.add, lambda outcome: replace(outcome, tables='{}')\n"
        "Checkpoint.add = lambda self, batch, took: add(self, map(emptied, batch), took)",
        "differs in",
    ),
}


@pytest.mark.parametrize("fault", PLANTED)
def test_a_kill_finds_a_fault(fault, quiet, tmp_path, monkeypatch):
    statements, told = PLANTED[fault]
    usual = "import subprocess, sys\nfrom dataclasses import replace\n"
    monkeypatch.setenv("DVA_SIM_PLANTED", usual + statements)
    monkeypatch.setattr(patience, "PATIENCE_S", 20.0)
    try:
        found = troubles(Kill("study", FOURTH_RUN, "KILL"), tmp_path, quiet)
    except TimeoutError as error:
        found = [f"{type(error).__name__}: {error}"]
    assert [line for line in found if told in line] != []
