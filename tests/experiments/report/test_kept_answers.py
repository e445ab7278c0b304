"""Answers that are kept: what a results folder answered, and whether it is still given."""

import json
from dataclasses import replace

import pytest
from generators import results
from helpers.studies.small_study import cheap, run_study, study_in
from helpers.wording import unnamed

from dva_sim.cli import answers as command
from dva_sim.experiments.execution.sampled_runs import SampledRun, sampled_jobs
from dva_sim.experiments.report import kept_answers
from dva_sim.experiments.results.manifest import manifest_of
from dva_sim.experiments.study.plan import StudyPlan
from dva_sim.kernel.errors import ConfigError, ExitCode
from dva_sim.kernel.wording import first_and_rest


def unsafe(job):
    """A run in which a safety rule is broken."""
    tables = cheap(job)
    return tables | {"runs": [tables["runs"][0] | {"violations": 1}]}


def finished(folder, *settings, is_dirty=False, episode=cheap):
    """The results of a small study, by a program without changes unless it has some."""
    folder.mkdir()
    out = run_study(study_in(folder, *settings), folder / "results", episode=episode, jobs=1)
    manifest = json.loads((out / "manifest.json").read_text())
    manifest["versions"]["dirty"] = is_dirty
    (out / "manifest.json").write_text(json.dumps(manifest))
    return out


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """The answer of a small study, and its manifest."""
    return kept_answers.answer_in(finished(tmp_path_factory.mktemp("study") / "r"))


@pytest.fixture
def kept(found, tmp_path):
    """Results, and a folder for their answer."""
    return *found, tmp_path / "answers"


def test_an_answer_is_read_as_it_was_kept(kept):
    answer, manifest, folder = kept
    file = kept_answers.keep(answer, manifest, folder)
    assert kept_answers.read(file) == answer
    assert kept_answers.all_kept(folder) == [answer]
    assert [row.level for row in answer.rows] == [0, 0.25]
    assert all(row.low <= row.mean <= row.high for row in answer.rows)
    assert (answer.seed, answer.persons, answer.status) == (3, 3, "declared")


def test_an_answer_that_is_replaced_becomes_history(kept):
    answer, manifest, folder = kept
    kept_answers.keep(replace(answer, version="0.1.0"), manifest, folder)
    kept_answers.keep(answer, manifest, folder)
    kept_answers.keep(answer, manifest, folder)  # the same again is no history
    kept_answers.keep(replace(answer, answer="In other words."), manifest, folder)
    lines = (folder / kept_answers.HISTORY).read_text().splitlines()
    assert len(lines) == 1 + len(answer.rows)
    assert all(
        line.startswith(f"{answer.study},0.1.0,{answer.date},declared") for line in lines[1:]
    )


@pytest.mark.parametrize(
    ("sampled", "now", "words", "is_stale"),
    [
        ({"a": "1", "b": "2"}, {"a": "1", "b": "2"}, "still given", False),
        ({"a": "1", "b": "2"}, {"a": "1", "b": "3"}, "1 of 2", True),
        ({"a": "1"}, {"b": "1"}, "0 of 1", True),  # its seeds or configurations are others
        ({}, {}, "real time", False),
    ],
)
def test_whether_an_answer_is_still_given_is_told_by_its_runs(kept, sampled, now, words, is_stale):
    text, found = command._described(replace(kept[0], sampled=sampled), now, "")
    assert words in text
    assert found is is_stale


def test_what_a_study_asks_for_otherwise_is_named_before_any_run(kept, tmp_path):
    answer, manifest, folder = kept
    trace = tmp_path / "cell.up"
    trace.write_text("1\n2\n")
    with_trace = f"link.trace_up={trace}"
    traced = manifest_of(StudyPlan.of(study_in(tmp_path, with_trace)))
    kept_answers.keep(answer, manifest, folder)

    def changed(before, *settings):
        return kept_answers.changed_since(before, study_in(tmp_path, *settings))

    before = kept_answers.read_manifest(answer.study, folder)
    assert changed(before) == ""
    assert changed(before, "question=In other words?") == ""
    assert changed(before, "persons=2") == "the study's file"
    assert changed(before, "robot.processing_s=0.3") == "a scenario"
    assert changed(json.loads(json.dumps(traced)), with_trace) == ""
    trace.write_text("1\n3\n")
    assert changed(json.loads(json.dumps(traced)), with_trace) == trace.name
    text, is_stale = command._described(answer, {}, "a scenario")
    assert is_stale
    assert "a scenario has changed" in text


def test_every_level_is_among_the_few_runs(tmp_path):
    study = study_in(tmp_path)
    levels = {pair for job in sampled_jobs(study) for pair in job.levels.items()}
    assert levels == {(name, level) for name, some in study.factors.items() for level in some}
    parts = [job.part for job in sampled_jobs(study)]
    assert max(map(parts.count, parts)) <= 4


def test_an_answer_that_is_no_longer_given_fails_the_gate_until_it_is_marked(
    kept, tmp_path, monkeypatch
):
    answer, manifest, folder = kept
    job = next(sampled_jobs(study_in(tmp_path)))
    named = f"drive/0/{job.config}/{job.seed}"  # as up to 0.9.0
    kept_answers.keep(replace(answer, sampled={named: "1"}), manifest, folder)
    assert list(kept_answers.all_kept(folder)[0].sampled) == [f"{job.config}/{job.seed}"]
    changed = {answer.study: [SampledRun(job, "2", {})]}
    monkeypatch.setattr(command, "_sampled", lambda names, jobs: changed)
    monkeypatch.setattr(command, "_changed", lambda name, folder: "")
    assert command._compare(folder, [], False, 1) == ExitCode.GATE_FAILED
    assert command._compare(folder, [], True, 1) == ExitCode.OK
    assert command._compare(folder, [], False, 1) == ExitCode.OK
    assert kept_answers.all_kept(folder)[0].stale_since


def test_a_study_that_has_no_kept_answer_is_named(kept):
    answer, manifest, folder = kept
    kept_answers.keep(answer, manifest, folder)
    with pytest.raises(ConfigError, match=r".") as caught:
        command._compare(folder, [f"{answer.study}s"], False, 1)
    assert unnamed(str(caught.value), repr(f"{answer.study}s"), repr(answer.study)) == []


def test_only_a_whole_study_as_its_file_has_it_is_kept(tmp_path):
    changed = finished(tmp_path / "r", "persons=2")
    with pytest.raises(ConfigError, match="persons=2"):
        kept_answers.answer_in(changed)
    with pytest.raises(ConfigError, match="not committed"):
        kept_answers.answer_in(finished(tmp_path / "dirty", is_dirty=True))
    with pytest.raises(ConfigError, match="safety rules were broken"):
        kept_answers.answer_in(finished(tmp_path / "unsafe", episode=unsafe))
    with pytest.raises(ConfigError, match=r"."):
        kept_answers.answer_in(tmp_path)


def test_the_page_dates_each_answer(kept):
    answer, manifest, folder = kept
    answer = replace(answer, stale_since="9.9.9")
    kept_answers.keep(answer, manifest, folder)
    page = results.study_page(answer.study, answer.question, answer, folder)
    assert page.startswith(f"# {answer.study}\n")
    sentences = first_and_rest(answer.answer)
    assert unnamed(page, answer.question, *sentences, answer.date, "since 9.9.9", "seed 3") == []


def test_results_in_another_size_than_the_file_has_are_not_kept(tmp_path):
    folder = finished(tmp_path / "r")
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["usual"]["persons"] = 4
    (folder / "manifest.json").write_text(json.dumps(manifest))
    with pytest.raises(ConfigError, match="another size"):
        kept_answers.answer_in(folder)


def test_results_of_a_program_that_gave_other_runs_are_not_kept(tmp_path):
    folder = finished(tmp_path / "r")
    jobs = list(sampled_jobs(study_in(tmp_path)))
    rows = [SampledRun(job, "", cheap(job)["runs"][0]) for job in jobs]
    kept_answers.refuse_other_runs(folder, rows)
    run = rows[0]
    slower = {"drive_time_s": run.row["drive_time_s"] + 1.0}
    with pytest.raises(ConfigError, match="another drive_time_s"):
        kept_answers.refuse_other_runs(folder, [run._replace(row=slower)])
    with pytest.raises(ConfigError, match="as it is now"):
        kept_answers.refuse_other_runs(folder, [run._replace(job=replace(run.job, config="other"))])
