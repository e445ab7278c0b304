"""Coverage below 95 %, by few persons or a stop by width, is reported where users choose them."""

import pytest
from helpers.processes.command_line import call
from helpers.wording import unnamed

from dva_sim.experiments.study.answerable import OF_BANDS, coverage_remarks, of_few_persons
from dva_sim.experiments.study.loading import load_study

BARE = """\
question: Which is quicker?
persons: {persons}
factors: {{pattern: [req-rep, latest-wins]}}
parts: {{drive: {{scenario: drive-to-event}}}}
answer: {{part: drive, measure: drive_time_s, factor: pattern, contrast: [req-rep, latest-wins]}}
"""
STOP = "stop: {comparison: answer, half_width: 2.0, batch_persons: %s, most_persons: 96}\n"


@pytest.mark.parametrize(
    ("text", "names"),
    [
        (BARE.format(persons=24), []),
        (BARE.format(persons=8), ["8 to 11 persons", "skewness 2", "89 %", "75 %"]),
        (BARE.format(persons=24) + STOP % 12, ["93 %", "89 %", "batch_persons: double"]),
        (BARE.format(persons=24) + STOP % "double", []),
    ],
)
def test_a_study_says_what_its_intervals_hold(tmp_path, text, names):
    (tmp_path / "mine.yaml").write_text(text)
    remarks = " ".join(coverage_remarks(load_study(tmp_path / "mine.yaml")))
    assert unnamed(remarks, *names) == []
    assert bool(remarks) == bool(names)


@pytest.mark.parametrize("command", [("check",), ("run", "--dry-run")])
def test_check_and_a_dry_run_say_what_intervals_hold(tmp_path, command):
    (tmp_path / "mine.yaml").write_text(BARE.format(persons=8))
    assert unnamed(call(*command, "mine.yaml", cwd=tmp_path).stdout, "8 to 11 persons") == []


def test_the_remark_is_that_of_the_next_smaller_number_measured():
    assert of_few_persons(23) == of_few_persons(12) != of_few_persons(11)
    assert of_few_persons(2) == of_few_persons(min(OF_BANDS))
    assert of_few_persons(24) == ""
