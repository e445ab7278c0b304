"""The published answers: this program still gives them, or they are marked."""

import re
from pathlib import Path

import pytest
from helpers.processes.command_line import call

ANSWERS = Path(__file__).parents[3] / "experiments" / "answers"
STUDIES = sorted({file.name.partition(".")[0] for file in ANSWERS.glob("*.json")})


@pytest.mark.soak
@pytest.mark.parametrize("study", STUDIES)
def test_a_few_runs_of_a_published_study_give_what_was_kept(study, tmp_path):
    ended = call("answers", study, cwd=tmp_path)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert ended.stdout.startswith(f"{study}: ")


def test_every_shipped_study_has_an_answer():
    shipped = {file.stem for file in ANSWERS.parent.glob("*.yaml") if "." not in file.stem}
    assert shipped == set(STUDIES)


def test_no_kept_answer_names_a_folder_of_the_machine_that_made_it():
    texts = {file.name: file.read_text(encoding="utf-8") for file in ANSWERS.glob("*.json")}
    assert len(texts) > 20
    assert [name for name, text in texts.items() if re.search(r'"/\w', text)] == []
