"""A study that cannot answer its question says so before it is run; one contrast is taken."""

import re

import pytest
from helpers.processes.command_line import call
from helpers.studies import synthetic_results
from helpers.wording import unnamed

from dva_sim.experiments.analysis.study_view import view_of
from dva_sim.experiments.study.answerable import only_contrast, why_unanswered
from dva_sim.experiments.study.loading import load_study

BARE = """\
question: Which is quicker?
persons: {persons}
replications: 1
factors: {factors}
parts: {{drive: {{scenario: drive-to-event}}}}
"""
TWO, THREE = "pattern: [req-rep, latest-wins]", "link.delay_s: [0, 0.25, 0.5]"
ANSWER = "answer: {part: drive, measure: drive_time_s, factor: pattern, "
ANSWER += "contrast: [req-rep, latest-wins], over: link.delay_s}\n"
PREDICTED = "predictions: [{text: Later., direction: above}]\n"
APART = """\
design:
  rows:
    - {pattern: req-rep, link.delay_s: 0}
    - {pattern: latest-wins, link.delay_s: 0.25}
"""
TOGETHER = APART.replace("0.25", "0")


def study_file(folder, factors, persons=4, more=""):
    path = folder / "mine.yaml"
    path.write_text(BARE.format(factors=f"{{{factors}}}", persons=persons) + more)
    return path


@pytest.mark.parametrize(
    ("factors", "expected"),
    [
        ({"a": (1, 2)}, ("a", (1, 2), None)),
        ({"a": (1, 2), "b": (1, 2, 3)}, ("a", (1, 2), "b")),
        ({"b": (1, 2, 3), "a": (1, 2), "c": (1,)}, ("a", (1, 2), "b")),
        ({"a": (1, 2), "b": (1, 2)}, None),
        ({"a": (1, 2), "b": (1, 2, 3), "c": (1, 2, 3)}, None),
        ({"b": (1, 2, 3)}, None),
        ({"c": (1,)}, None),
        ({}, None),
    ],
)
def test_a_contrast_is_the_only_one_where_one_factor_has_two_levels(factors, expected):
    assert only_contrast(factors) == expected


@pytest.mark.parametrize(
    ("factors", "persons", "more", "words"),
    [
        (TWO, 4, "", ()),
        (f"{TWO}, {THREE}", 4, "", ()),
        (f"{TWO}, {THREE}", 4, ANSWER, ()),
        ("pattern: [req-rep]", 4, "", ("no factor",)),
        (f"{TWO}, link.delay_s: [0, 0.25]", 4, "", ("pattern and link.delay_s", "'answer'")),
        (THREE, 4, "", ("link.delay_s allows several contrasts",)),
        (TWO, 1, "", ("2 persons", "persons is 1")),
        ("", 4, APART + ANSWER, ("req-rep", "latest-wins", "never")),
        ("", 4, TOGETHER + ANSWER, ()),
    ],
)
def test_a_study_says_what_it_cannot_answer(tmp_path, factors, persons, more, words):
    told = list(why_unanswered(load_study(study_file(tmp_path, factors, persons, more))))
    assert len(told) == (1 if words else 0)
    assert unnamed(" ".join(told), *words) == []


@pytest.mark.parametrize("command", [("check",), ("run", "--dry-run")])
def test_check_and_a_dry_run_warn_of_it(tmp_path, command):
    path = study_file(tmp_path, TWO, persons=1)
    (told,) = why_unanswered(load_study(path))
    ended = call(*command, path, cwd=tmp_path)
    assert ended.returncode == 0
    assert f"warning: {told}\n" in ended.stdout


def test_settings_that_leave_two_levels_compare_these(tmp_path):
    three = "pattern: [req-rep, pub-sub, latest-wins]"
    path = study_file(tmp_path, f"{three}, {THREE}", more=ANSWER + PREDICTED)
    left = load_study(path, ["factors.pattern=[req-rep, pub-sub]"])
    assert left.answer.contrast == ("req-rep", "pub-sub")
    assert unnamed(left.lost[0], "req-rep with pub-sub", "'latest-wins'") == []
    assert left.predictions[0].contrast == ("req-rep", "latest-wins")  # and so it is not run
    alone = load_study(path, ["factors.pattern=req-rep"])
    assert alone.answer is None
    assert unnamed(alone.lost[0], "not be computed", "'latest-wins'") == []
    assert list(why_unanswered(alone)) == []  # said once


def test_the_only_contrast_is_the_answer_of_a_study_without_one(tmp_path):
    rows = [
        {"part": "drive", "cell": cell, "person": person, "trial": 0, "seed": person}
        | {"pattern": pattern, "is_reference": False}
        | {"drive_time_s": 50.0 + (9.0 + person % 3) * cell}
        for person in range(8)
        for cell, pattern in enumerate(["latest-wins", "req-rep"])
    ]
    declared = {"question": "Which?", "factors": {"pattern": ["latest-wins", "req-rep"]}}
    facts = synthetic_results.manifest(8, 1)
    parts = facts["study"]["parts"]
    facts["study"] = declared | {"parts": parts, "persons": 8, "replications": 1, "seed": 1}
    reading = synthetic_results.reading(tmp_path / "r", rows, facts)
    assert view_of(declared, reading.runs).contrast == ("latest-wins", "req-rep")
    assert re.search("shorter .*latest-wins.*REQ/REP.*\N{MINUS SIGN}9.9", reading.answer.lead)
    assert "No answer was declared" in " ".join(reading.answer.notes)
