"""Conditions of an answer, stated beside it."""

import re

import pytest
from helpers.studies import synthetic_results
from helpers.wording import unnamed

from dva_sim.experiments.study.screening import KEPT, MAIN
from dva_sim.kernel.wording import signed
from dva_sim.simulation.scenario.assumptions import all_assumptions

STRATEGY = {"operator": {"strategy": "adaptive"}, "phone": {"profile": "default"}}


def reading(tmp_path, rows=None, study=None, **tables):
    facts = synthetic_results.manifest(6, 2)
    facts["study"] |= study or {}
    facts["scenarios"] = dict.fromkeys(("drive", "story"), synthetic_results.SCENARIO | STRATEGY)
    runs = synthetic_results.drive_rows(6, 2, effect_s=30.0, missed=0.0) if rows is None else rows
    return synthetic_results.reading(tmp_path / "r", runs, facts, **tables)


def texts(found):
    return {about: words.replace("\N{NO-BREAK SPACE}", " ") for about, words in found.items()}


def test_persons_are_simulated_and_how_they_steer_is_said(tmp_path):
    persons = texts(reading(tmp_path).answer.depends)["Persons"]
    parts = ("6 simulated, 2 trials each", "no human", "strategy adaptive", "not tried here")
    assert unnamed(persons, *parts) == []


def test_who_chooses_to_move_and_wait_did_so_for_a_share_of_the_time(tmp_path):
    rows = synthetic_results.drive_rows(6, 2, effect_s=30.0, missed=0.0)
    for row in rows:
        row["move_and_wait_share"] = 0.86 if row["pattern"] == "req-rep" else 0.54
    persons = texts(reading(tmp_path, rows).answer.depends)["Persons"]
    assert re.search(r"86 %.* REQ/REP.*54 %.* latest-wins", persons)


def test_other_models_of_persons_say_how_far_the_effect_reaches(tmp_path):
    effects = {("pursuit", 0): 5, ("pursuit", 1): 1, ("adaptive", 0): 20, ("adaptive", 1): -4}
    claims = {"robustness": synthetic_results.CLAIMS["robustness"]}
    rows = synthetic_results.drive_rows(6, 2, effect_s=20.0, missed=0.0)
    repeats = synthetic_results.repeat_rows(effects)
    found = reading(tmp_path, rows, study=claims, robustness=repeats)
    persons = texts(found.answer.depends)["Persons"]
    assert unnamed(persons, "2 of 3", "sign at 1 s") == []
    stop = found.robustness.stops[-1]
    own = len(found.finding.levels) - 1
    low = min(float(found.finding.low[own]), *(other.low for other in stop.others))
    high = max(float(found.finding.high[own]), *(other.high for other in stop.others))
    lead = found.answer.lead.replace("\N{NO-BREAK SPACE}", " ")
    limits = f"{signed(low, '')} to {signed(high, 's')}".replace("\N{NO-BREAK SPACE}", " ")
    assert unnamed(lead, limits, "95 % limits; means") == []


def test_where_every_pair_of_runs_gives_the_same_that_is_said_with_what_robots_did(tmp_path):
    rows = synthetic_results.drive_rows(6, 2, effect_s=0.0, missed=0.0)
    times: dict[object, float] = {}
    for row in rows:
        row["robot_share"] = 0.25
        if not row["is_reference"]:
            place = (row["person"], row["trial"], row["link.delay_s"], row["profile"])
            row["drive_time_s"] = times.setdefault(place, row["drive_time_s"])
    found = reading(tmp_path, rows).answer
    assert "same value" in found.lead
    assert unnamed(found.notes[0], "pattern", "25\N{NO-BREAK SPACE}%") == []
    usual = reading(tmp_path / "usual").answer
    assert not any("changed nothing" in note for note in usual.notes)


def test_the_answer_under_the_other_settings_that_were_run_stands_beside_it(tmp_path):
    found = reading(tmp_path)
    settings = texts(found.answer.depends)["Settings"]
    assert "for profile default." in settings
    assert "with profile dissertation." in settings
    assert settings.endswith("Not varied: phone default.")


def test_the_assumed_numbers_are_counted_and_the_screening_of_the_main_study_is_cited(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    kept = tmp_path / KEPT / f"{MAIN}.csv"
    kept.parent.mkdir(parents=True)
    effects = "key,size,mean_low,mean_high\na.b,51.6,-9,70\nc.d,{0}\nphone.warming_k,0,0,0\n"
    kept.write_text(effects.format("22,-30,-14"))
    text = texts(reading(tmp_path / "one").answer.depends)["Assumptions"]
    assert unnamed(text, str(len(all_assumptions())), MAIN, " c.d is clear of chance") == []
    assert "a.b" not in text
    kept.write_text(effects.format("22,-30,14"))
    text = texts(reading(tmp_path / "none").answer.depends)["Assumptions"]
    assert unnamed(text, MAIN, "none") == []
    assert "c.d" not in text


def test_a_study_without_a_contrast_depends_on_nothing_that_can_be_told(tmp_path):
    assert reading(tmp_path, study={"answer": None}).answer.depends == {}


@pytest.mark.parametrize(("own", "expected"), [({"replications": 3}, 3), ({}, 2)])
def test_a_part_may_have_trials_of_its_own(tmp_path, own, expected):
    parts = {"drive": {"scenario": "drive-to-event"} | own}
    assert reading(tmp_path, study={"parts": parts}).trials_of("drive") == expected
