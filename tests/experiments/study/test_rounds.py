"""A study that may stop early: the same rounds, and so the same bytes, after any interruption."""

import json
from pathlib import Path
from typing import Any

import pytest
from helpers.studies import small_study as kit
from helpers.studies.report_text import words_of
from helpers.studies.small_study import run_study
from helpers.wording import unnamed

from dva_sim.experiments.report.study_size import not_reached
from dva_sim.experiments.report.summary import Reading
from dva_sim.experiments.report.terminal import show
from dva_sim.experiments.results.results import Results
from dva_sim.experiments.study.cell_grid import StudyJob

STOP = "stop: {part: drive, measure: drive_time_s, half_width: 0.1, batch_persons: 2, "
TEXT = kit.STUDY + STOP + "most_persons: 40}\n"


def steady(job: StudyJob) -> kit.Tables:
    """Run up to a second longer than the reference run, for any person."""
    return {"runs": [{"drive_time_s": 0.0 if job.is_reference else (job.seed % 1000) / 1000}]}


def stopped(folder: Path) -> dict[str, Any]:
    return dict(Results.load(folder).manifest["stopped"])


def test_a_study_stops_after_the_round_that_is_enough(tmp_path):
    study = kit.study_in(tmp_path, text=TEXT)
    out = run_study(study, tmp_path / "out", jobs=1, episode=steady)
    how = stopped(out)
    assert how["why"] == "enough"
    assert 1 < how["rounds"] < how["of"] == 20
    runs = Results.load(out).table("runs", part="drive")
    assert set(runs["person"].tolist()) == set(range(3 + 2 * (how["rounds"] - 1)))


@pytest.mark.system
def test_an_interrupted_study_stops_after_the_same_round(tmp_path):
    study = kit.study_in(tmp_path, text=TEXT)
    plain = run_study(study, tmp_path / "plain", jobs=1, episode=steady)
    last = Results.load(plain).manifest["runs"]

    for at in (5, 44, 60, last - 1):

        def interrupt(done: int, total: int, at: int = at) -> None:
            if done == at:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt, match=f"after {at} of"):
            run_study(study, tmp_path / "out", jobs=1, episode=steady, progress=interrupt)
    out = run_study(study, tmp_path / "out", jobs=1, episode=steady)
    assert kit.files(out) == kit.files(plain)


def test_a_study_that_never_has_enough_runs_all_its_rounds(tmp_path):
    text = TEXT.replace("half_width: 0.1", "half_width: 0.0001").replace("40", "7")
    study = kit.study_in(tmp_path, text=text)
    out = run_study(study, tmp_path / "out", jobs=1, episode=steady)
    how = stopped(out)
    assert 0.0001 < how.pop("half_width") < 1
    assert how == {"rounds": 3, "of": 3, "why": "limit"}


@pytest.mark.parametrize(("asked", "is_told"), [(0.0001, True), (50.0, False)])
def test_what_was_asked_and_not_reached_is_said_first(asked, is_told, tmp_path, capsys):
    text = TEXT.replace("half_width: 0.1", f"half_width: {asked}").replace("40", "7")
    out = run_study(kit.study_in(tmp_path, text=text), tmp_path / "out", jobs=1, episode=steady)
    results = Results.load(out)
    show(results, None, columns=False, rows=3)
    printed = capsys.readouterr().out.splitlines()
    page = words_of(out)
    assert printed[1].startswith("Asked and not reached") is is_told
    assert (f"{results.question} Asked and not reached" in page) is is_told
    assert not is_told or unnamed(page, "with 7 persons", "the widest is ±0.") == []


def test_older_results_that_do_not_say_how_far_they_came_still_say_what_was_asked(tmp_path):
    text = TEXT.replace("half_width: 0.1", "half_width: 0.0001").replace("40", "7")
    out = run_study(kit.study_in(tmp_path, text=text), tmp_path / "out", jobs=1, episode=steady)
    manifest = json.loads((out / "manifest.json").read_text())
    del manifest["stopped"]["half_width"]
    (out / "manifest.json").write_text(json.dumps(manifest))
    text = not_reached(Reading(Results.load(out)))
    assert unnamed(text, "Asked and not reached", "with 7 persons") == []
    assert "widest" not in text


def test_a_spent_budget_ends_after_a_whole_round_and_stays_ended(tmp_path):
    study = kit.study_in(tmp_path, text=kit.STUDY + "budget_s: 0.000001\n")
    seen = []
    out = run_study(
        study, tmp_path / "out", jobs=1, episode=steady, progress=lambda *now: seen.append(now)
    )
    assert stopped(out) == {"rounds": 1, "of": 2, "why": "budget"}
    assert seen[-1] == (28, 28)  # two persons of three
    first = kit.files(out)
    assert kit.files(run_study(study, out, jobs=1, episode=steady)) == first
    assert json.loads(first["manifest.json"])["status"]["reproducible"] is False


def test_a_budget_that_is_not_spent_changes_nothing_but_the_label(tmp_path):
    study = kit.study_in(tmp_path, text=kit.STUDY + "budget_s: 3600\n")
    out = run_study(study, tmp_path / "out", jobs=1, episode=steady)
    assert stopped(out) == {"rounds": 2, "of": 2, "why": None}
    assert len(Results.load(out).table("runs")["seed"]) == kit.RUNS
