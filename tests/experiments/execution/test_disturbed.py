"""Kills at any moment, two runners at once and full disks: the end is that of a quiet run."""

import json
import os
import shutil
import sys
from pathlib import Path
from typing import Any

import pytest
from helpers.paths import PYTHON_PATH
from helpers.processes import patience
from helpers.studies import interrupted_study as kit

STUDY = (sys.executable, "-m", "helpers.studies.interrupted_study")
NAMESPACE = ["unshare", "--map-root-user", "--mount"]


def report_of(*words: str | Path) -> dict[str, Any]:
    path = PYTHON_PATH
    environment = {**os.environ, "PYTHONPATH": path}
    ran = patience.run(
        list(map(str, words)), capture_output=True, text=True, env=environment, check=False
    )
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout)


@pytest.mark.invariant("S9")
@pytest.mark.soak
@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_hundred_kills_at_any_moment_lose_and_double_nothing(tmp_path):
    found = report_of(*STUDY, "kills", tmp_path)
    assert min(found["call"], found["writing"], found["clock"]) >= kit.KILLS_EACH
    assert found["equal"] == found["ended"] >= 100 // kit.KILLS_A_STUDY
    assert (found["doubled"], found["left behind"]) == (0, 0)
    assert found["pairs killed"] == kit.PAIRS
    assert found["pairs"] == found["pairs equal"]
    assert found["pairs doubled"] == 0


def mounts_are_allowed(folder: Path) -> bool:
    if shutil.which("unshare") is None:
        return False
    words = [*NAMESPACE, "mount", "-t", "tmpfs", "tmpfs", str(folder)]
    return patience.run(words, capture_output=True, check=False).returncode == 0


@pytest.mark.system
def test_a_full_disk_is_told_in_one_line_and_nothing_is_lost(tmp_path):
    if not mounts_are_allowed(tmp_path):
        pytest.skip("this system lets nobody but root mount a small disk")
    found = report_of(*NAMESPACE, *STUDY, "disk", tmp_path)
    assert len(found["errors"]) >= 3
    assert all("\n" not in line for line in found["errors"])
    assert any("journal.sqlite: " in line for line in found["errors"])
    assert any("tables cannot be written" in line for line in found["errors"])
    assert found["equal"]
    assert found["report"]
    assert "\n" not in found["report"]
    assert found["report equal"]
    assert found["left behind"] == []
