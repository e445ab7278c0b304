"""The published answers: this program still gives them, or they are marked."""

from pathlib import Path

import pytest
from helpers.processes.command_line import call

ANSWERS = Path(__file__).parents[3] / "experiments" / "answers"


@pytest.mark.soak
def test_a_few_runs_of_every_published_study_give_what_was_kept(tmp_path):
    ended = call("answers", cwd=tmp_path)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    kept = {file.name.partition(".")[0] for file in ANSWERS.glob("*.json")}
    assert {line.partition(":")[0] for line in ended.stdout.splitlines()} == kept
