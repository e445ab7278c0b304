"""Kills at any moment, and two runners at once: the end is that of a quiet run."""

import json
import os
import sys
from pathlib import Path
from typing import Any

import pytest
from helpers.paths import PYTHON_PATH
from helpers.processes import patience
from helpers.studies import interrupted_study as kit

STUDY = (sys.executable, "-m", "helpers.studies.interrupted_study")


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
    found = report_of(*STUDY, tmp_path)
    assert min(found["call"], found["writing"], found["clock"]) >= kit.KILLS_EACH
    assert found["equal"] == found["ended"] >= 100 // kit.KILLS_A_STUDY
    assert (found["doubled"], found["left behind"]) == (0, 0)
    assert found["pairs killed"] == kit.PAIRS
    assert found["pairs"] == found["pairs equal"]
    assert found["pairs doubled"] == 0
