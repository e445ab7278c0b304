import functools
import json
import math
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import wait
from pathlib import Path

import numpy as np
import pytest
from helpers.paths import PYTHON_PATH
from helpers.processes.patience import PATIENCE_S
from helpers.studies import small_study as kit
from helpers.studies.small_study import run_study
from helpers.wording import unnamed

from dva_sim.experiments.execution import scheduling
from dva_sim.experiments.execution.dry_run import dry_run
from dva_sim.experiments.results import manifest
from dva_sim.experiments.results.results import Results
from dva_sim.kernel.errors import ConfigError


def test_the_tables_hold_every_run_with_design_and_measures_in_order(finished):
    results = Results.load(finished)
    runs = results.table("runs")
    assert list(runs)[:9] == [
        *("part", "cell", "config", "pattern", "link.delay_s"),
        *("is_reference", "person", "trial", "seed"),
    ]
    assert len(runs["seed"]) == kit.RUNS
    delays = np.where(runs["is_reference"], 0, runs["link.delay_s"])
    expected = [math.sqrt(seed) + d for seed, d in zip(runs["seed"].tolist(), delays, strict=True)]
    assert runs["drive_time_s"].tolist() == expected
    assert set(runs["pattern"][runs["is_reference"]]) == {None}
    assert np.isnan(runs["link.delay_s"][runs["is_reference"]]).all()
    assert (runs["confirmed"] == (runs["seed"] % 3 > 0)).all()
    assert (np.isnan(runs["round_trip_s"]) == (runs["seed"] % 2 == 1)).all()
    assert [o is None for o in runs["outcome"]] == (runs["seed"] % 3 == 0).tolist()
    order = list(zip(*(runs[c].tolist() for c in ("part", "cell", "person", "trial")), strict=True))
    assert order == sorted(order)
    tracks = results.table("tracks", part="story")
    assert set(tracks["part"]) == {"story"}
    assert len(tracks["t_s"]) == 3 * 12


def test_the_manifest_says_what_was_asked_and_changed(tmp_path):
    study = kit.study_in(tmp_path, "persons=2", "robot.processing_s=0.2")
    results = Results.load(run_study(study, tmp_path / "out", jobs=1, episode=kit.cheap))
    assert results.manifest["question"] == "Which is quicker?"
    assert results.manifest["set"] == ["persons=2", "robot.processing_s=0.2"]
    assert results.manifest["scenarios"]["drive"]["robot"]["processing_s"] == 0.2
    assert results.factors == {"pattern": ["req-rep", "latest-wins"], "link.delay_s": [0, 0.25]}
    assert results.study["answer"]["contrast"] == ["req-rep", "latest-wins"]
    assert results.failures == []


@pytest.mark.system
def test_two_processes_write_the_same_bytes_as_one(tmp_path, plain):
    seen = []
    out = run_study(
        kit.study_in(tmp_path),
        tmp_path / "two",
        jobs=2,
        episode=kit.cheap,
        progress=lambda done, total: seen.append((done, total)),
    )
    assert kit.files(out) == plain
    assert seen[0] == (0, kit.RUNS)
    assert seen[-1] == (kit.RUNS, kit.RUNS)


def test_a_finished_study_is_not_run_again(tmp_path, out, plain):
    def never(job: object) -> kit.Tables:
        raise AssertionError("run again")

    assert kit.files(run_study(kit.study_in(tmp_path), out, jobs=1, episode=never)) == plain


@pytest.fixture
def started() -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Starts runners in processes of their own; none of them outlives the test."""
    runners: list[subprocess.Popen[str]] = []

    def start(study: Path, out: Path, jobs: int = 2) -> subprocess.Popen[str]:
        program = [sys.executable, "-m", "helpers.studies.small_study"]
        runner = subprocess.Popen(
            [*program, str(study), str(out), str(jobs)],
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONPATH": PYTHON_PATH},
            cwd=study.parent,
        )
        runners.append(runner)
        return runner

    try:
        yield start
    finally:
        for runner in runners:
            runner.kill()
            runner.wait()
            runner.stdout.close()


def stopped(runner: subprocess.Popen[str], when: int, how: signal.Signals) -> str:
    """Stop a runner once it has done some runs; what it and its processes said in the end."""
    assert runner.stdout is not None
    for line in runner.stdout:
        if int(line) >= when:
            break
    runner.send_signal(how)
    return runner.communicate(timeout=PATIENCE_S)[0]  # only returns when its workers are gone too


@pytest.mark.system
def test_a_runner_that_was_killed_goes_on_and_ends_with_the_same_bytes(tmp_path, started):
    """It is killed among its first runs, and goes on to stop among the repeats."""
    study, out = kit.write_study(tmp_path, kit.REPEATED), tmp_path / "killed"
    runner = started(study, out)
    stopped(runner, 3, signal.SIGKILL)
    assert runner.returncode == -signal.SIGKILL
    assert 3 <= dry_run(kit.load_study(study), out).done < kit.RUNS

    def stop(done: int, total: int) -> None:
        if done >= kit.RUNS + 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_study(kit.load_study(study), out, jobs=1, episode=kit.cheap, progress=stop)
    assert kit.RUNS < dry_run(kit.load_study(study), out).done < kit.REPEATED_RUNS
    again = kit.files(run_study(kit.load_study(study), out, jobs=2, episode=kit.cheap))
    whole = run_study(kit.load_study(study), tmp_path / "whole", jobs=1, episode=kit.cheap)
    assert again == kit.files(whole)
    assert "robustness.parquet" in again


@pytest.mark.system
def test_ctrl_c_keeps_what_is_done_and_says_how_to_go_on(tmp_path, plain, started):
    study, out = kit.write_study(tmp_path), tmp_path / "stopped"
    runner = started(study, out)
    reported = stopped(runner, 3, signal.SIGINT)
    assert runner.returncode == 130
    assert unnamed(reported, "of 42 runs", "kept") == []
    assert 3 <= dry_run(kit.study_in(tmp_path), out).done < kit.RUNS
    assert kit.files(run_study(kit.study_in(tmp_path), out, jobs=1, episode=kit.cheap)) == plain


def changed_and_back(trace):
    trace.write_text("1\n2\n3\n")
    trace.write_text("1\n2\n")


@pytest.mark.parametrize(
    "disturb",
    [lambda trace: trace.write_text("1\n2\n3\n"), changed_and_back, Path.unlink],
    ids=["changed", "changed and back", "gone"],
)
def test_no_run_is_kept_that_may_have_read_another_file_than_the_others(tmp_path, disturb):
    trace = tmp_path / "cell.up"
    trace.write_text("1\n2\n")
    study, out = kit.study_in(tmp_path, f"link.trace_up={trace}"), tmp_path / "out"

    def edit(done: int, _: int) -> None:
        if done == 5:
            disturb(trace)

    with pytest.raises(ConfigError, match=r"cell\.up has changed since the study began"):
        run_study(study, out, jobs=1, episode=kit.cheap, progress=edit)
    trace.write_text("1\n2\n")
    assert dry_run(study, out).done == 5

    finished = kit.files(run_study(study, out, jobs=1, episode=kit.cheap))
    whole = run_study(study, tmp_path / "whole", jobs=1, episode=kit.cheap)
    assert finished == kit.files(whole)


def test_a_new_profile_that_hides_a_shipped_one_is_a_change(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    mine = tmp_path / "agents/robots/servrobot.yaml"

    def hide(done: int, _: int) -> None:
        if done == 5:
            mine.parent.mkdir(parents=True)
            mine.write_text("mass_kg: 5\n")

    with pytest.raises(ConfigError, match=r"servrobot\.yaml has changed"):
        run_study(
            kit.study_in(tmp_path), tmp_path / "out", jobs=1, episode=kit.cheap, progress=hide
        )


@pytest.mark.system
def test_ctrl_c_while_a_lock_of_the_pool_is_taken_ends_the_run_all_the_same(tmp_path, monkeypatch):
    """Raised there it would leave the lock taken; then nobody could end the pool."""

    def wait_and_press(futures, **words):
        for future in futures:
            future._condition.acquire()
            os.kill(os.getpid(), signal.SIGINT)
            future._condition.release()
        return wait(futures, **words)

    monkeypatch.setattr(scheduling, "wait", wait_and_press)
    with pytest.raises(KeyboardInterrupt, match="which are kept"):
        run_study(kit.study_in(tmp_path), tmp_path / "out", jobs=2, episode=kit.cheap)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.system
def test_of_two_runners_on_one_folder_one_makes_the_study(tmp_path, plain, started):
    """The other is refused, unless it has begun when the first one has ended."""
    study, out = kit.write_study(tmp_path), tmp_path / "shared"
    pair = [started(study, out, jobs=1) for _ in range(2)]
    for runner in pair:
        runner.communicate(timeout=PATIENCE_S)
    assert min(runner.returncode for runner in pair) == 0
    assert kit.files(out) == plain


@pytest.mark.parametrize("jobs", [1, pytest.param(2, marks=pytest.mark.system)])
def test_a_run_that_fails_is_named_and_the_others_go_on_and_it_is_tried_again(
    tmp_path, plain, jobs
):
    study, out = kit.study_in(tmp_path), tmp_path / "out"
    results = Results.load(run_study(study, out, jobs=jobs, episode=kit.unlucky))
    (failure,) = results.failures
    assert failure["error"].startswith("RuntimeError: the robot fell")  # in one line
    assert [failure[key] for key in ("part", "cell", "person", "trial")] == ["drive", -1, 1, 0]
    assert len(results.table("runs")["seed"]) == kit.RUNS - 1
    plan = dry_run(study, out, jobs=1)
    assert (plan.done, plan.tried) == (kit.RUNS - 1, 0)  # the runs that are done tell the rest
    assert plan.estimate_s > 0
    assert kit.files(run_study(study, out, jobs=1, episode=kit.cheap)) == plain


@pytest.mark.system
@pytest.mark.parametrize(
    ("episode", "jobs", "limit_s", "names"),
    [
        (kit.deadly, 2, None, ["killed the process"]),
        (kit.stalls, 1, 1.0, ["RunTooLong", "1 s"]),
        (kit.stalls, 2, 1.0, ["RunTooLong", "1 s"]),
        (kit.never_comes_back, 2, 1.0, ["beyond its limit"]),  # and is ended with its process
    ],
)
def test_a_run_that_does_not_end_well_is_a_failure_and_the_others_go_on(
    tmp_path, monkeypatch, episode, jobs, limit_s, names
):
    monkeypatch.setattr(scheduling, "_LOOK_S", 0.2)
    limit = {} if limit_s is None else {"limit_s": limit_s}
    study = kit.study_in(tmp_path)
    results = Results.load(run_study(study, tmp_path / "out", jobs=jobs, episode=episode, **limit))
    (failure,) = results.failures
    assert unnamed(failure["error"], *names) == []
    assert (failure["part"], failure["cell"], failure["person"]) == ("story", 2, 1)
    assert len(results.table("runs")["seed"]) == kit.RUNS - 1


@pytest.mark.system
def test_a_worker_killed_once_changes_nothing(tmp_path, plain):
    mark = tmp_path / "mark"
    episode = functools.partial(kit.deadly_once, mark)
    out = run_study(kit.study_in(tmp_path), tmp_path / "out", jobs=2, episode=episode)
    assert mark.exists()
    assert kit.files(out) == plain


@pytest.mark.parametrize(
    ("tables", "expected"),
    [
        ({"runs": [{"seed": 1}]}, "name the design"),
        ({"runs": [{"pattern": 1}]}, "name the design"),
        ({"../runs": []}, "should be letters"),
        ({"runs": [{"x": [1]}]}, "should hold numbers"),
        ({"runs": [{"x": {1}}]}, "cannot be kept"),
    ],
)
def test_tables_that_cannot_be_kept_are_failures(tmp_path, tables, expected):
    study = kit.study_in(tmp_path)
    out = run_study(study, tmp_path / "out", jobs=1, episode=lambda _: tables)
    assert expected in Results.load(out).failures[-1]["error"]


def test_numpy_numbers_are_kept_as_numbers(tmp_path):
    rows = [{"n": np.int64(2), "x": np.float32(0.5), "ok": np.bool_(True)}]
    out = run_study(
        kit.study_in(tmp_path), tmp_path / "out", jobs=1, episode=lambda _: {"runs": rows}
    )
    runs = Results.load(out).table("runs", part="story")
    assert [runs[c].dtype.kind for c in ("n", "x", "ok")] == ["i", "f", "b"]
    assert runs["x"][0] == 0.5


@pytest.mark.parametrize("setting", ["seed=4", "robot.processing_s=0.3"])
def test_the_folder_of_another_study_is_refused_with_or_without_a_journal(
    tmp_path, out, plain, setting
):
    study = kit.study_in(tmp_path, setting)
    for _ in range(2):
        with pytest.raises(ConfigError, match="holds another study"):
            run_study(study, out, jobs=1, episode=kit.cheap)
        assert kit.files(out) == plain
        (out / "journal.sqlite").unlink(missing_ok=True)


def test_a_folder_whose_runs_were_made_with_another_numpy_is_refused(
    tmp_path, out, plain, monkeypatch
):
    monkeypatch.setattr(manifest, "version", lambda name: f"other {name}")
    with pytest.raises(ConfigError, match="libraries were changed"):
        run_study(kit.study_in(tmp_path), out, jobs=1, episode=kit.cheap)
    assert kit.files(out) == plain


def test_a_dry_run_counts_and_writes_nothing(tmp_path):
    plan = dry_run(kit.study_in(tmp_path), tmp_path / "out")
    assert (plan.runs, plan.done, plan.cells, plan.estimate_s) == (kit.RUNS, 0, 9, None)
    assert not (tmp_path / "out").exists()


def test_times_and_costs_stay_apart_from_the_results(finished):
    machine = json.loads((finished / "machine.json").read_text())
    assert machine["jobs"] == 1
    assert set(machine["cpu_s_per_run"]) == {
        *("drive/-1", *(f"drive/{i}" for i in range(4)), *(f"story/{i}" for i in range(4)))
    }
