"""Messages before, during and after a run: plans, progress, and how to resume."""

import time
from types import SimpleNamespace

import pytest
from helpers.processes.command_line import ended
from helpers.studies import small_study as kit
from helpers.wording import unnamed

from dva_sim.cli import study_runs
from dva_sim.cli.study_runs import RunPace, duration
from dva_sim.experiments.execution import dry_run as module
from dva_sim.experiments.execution import session
from dva_sim.experiments.execution.checkpoint import Checkpoint, RunOutcome
from dva_sim.experiments.execution.dry_run import DryRun, _spread, dry_run
from dva_sim.experiments.execution.session import StudySession
from dva_sim.experiments.results.manifest import manifest_of
from dva_sim.experiments.study.cell_grid import StudyJob
from dva_sim.experiments.study.plan import StudyPlan
from dva_sim.options.studies import RunOptions


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0.2, "0 s"), (89, "89 s"), (90, "2 min"), (3600, "60 min"), (5400, "1 h 30 min")],
)
def test_durations_are_said_as_people_would(seconds, words):
    assert duration(seconds) == words


def test_the_rate_counts_what_this_session_made_not_what_was_done_before_slow_runs_by_the_minute():
    pace = RunPace(iter([0.0, 120.0]).__next__)
    pace.line(0, 10)
    assert pace.line(3, 10).split(", ") == ["3/10 runs", "1.5 runs/min", "5 min left"]
    pace = RunPace(iter([0.0, 9.0, 11.0]).__next__)
    pace.line(0, 1000)
    assert pace.line(40, 1000).split(", ") == ["40/1000 runs", "4.4 runs/s"]
    assert pace.line(44, 1000).split(", ") == ["44/1000 runs", "4.0 runs/s", "4 min left"]
    pace = RunPace(iter([100.0, 110.0, 130.0]).__next__)
    assert pace.line(600, 1000) == "600/1000 runs"
    assert pace.line(620, 1000).split(", ") == ["620/1000 runs", "2.0 runs/s", "3 min left"]
    assert pace.line(1000, 1000) == "1000/1000 runs, 13.3 runs/s"


def test_a_dry_run_of_a_fresh_folder_tries_some_runs_and_keeps_none(tmp_path):
    plan = dry_run(kit.study_in(tmp_path), tmp_path / "out", jobs=2, probe=kit.cheap)
    assert (plan.runs, plan.done, plan.workers) == (kit.RUNS, 0, 2)
    assert plan.tried == 5  # the reference and four cells; both parts share them
    assert plan.estimate_s is not None
    assert not (tmp_path / "out").exists()


def test_an_estimate_is_of_the_clock_and_rests_on_several_persons(tmp_path, monkeypatch):
    spent, persons = {"cpu": 0.0, "wall": 0.0}, []

    def slow(job: StudyJob) -> kit.Tables:
        persons.append(job.person)
        spent["cpu"] += 2.0
        spent["wall"] += 10.0
        return kit.cheap(job)

    module = "dva_sim.experiments.execution.dry_run"
    monkeypatch.setattr(f"{module}.clock_of", lambda _: lambda: spent["cpu"])
    monkeypatch.setattr(f"{module}.time", SimpleNamespace(monotonic=lambda: spent["wall"]))
    monkeypatch.setattr(f"{module}.executors.cores", lambda: 2)
    plan = dry_run(kit.study_in(tmp_path), tmp_path / "out", jobs=8, probe=slow)
    assert plan.cpu_s == 2.0 * kit.RUNS
    assert plan.estimate_s == pytest.approx(5 * plan.cpu_s / 2)  # on two cores, not eight
    assert len(set(persons)) > 1


def test_what_is_done_tells_the_pace_of_the_rest(tmp_path):
    study, out = kit.study_in(tmp_path), tmp_path / "out"
    out.mkdir()
    jobs = list(StudyPlan.of(study).jobs)
    with Checkpoint(out, manifest_of(StudyPlan.of(study))["hash"]) as checkpoint:
        checkpoint.add([RunOutcome(jobs[0].key, "{}", 2.0)], wall_s=3.0)
    plan = dry_run(study, out, jobs=2)
    assert plan.cpu_s == 2.0 * (kit.RUNS - 1)
    assert plan.estimate_s == pytest.approx(1.5 * plan.cpu_s)


def test_a_probe_ends_when_its_time_is_up_but_not_after_one_or_two(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "PROBE_S", 0.0)
    plan = dry_run(kit.study_in(tmp_path), tmp_path / "out", probe=kit.cheap)
    assert plan.tried == 3


@pytest.fixture
def told(tmp_path, monkeypatch, capsys):
    """Function that returns what `run --dry-run` says of a plan."""

    def tell(plan: DryRun) -> str:
        monkeypatch.setattr(study_runs, "dry_run", lambda *_, **__: plan)
        study_runs.plan(RunOptions(str(kit.write_study(tmp_path)), tmp_path / "out"))
        return capsys.readouterr().out

    return tell


def test_a_run_that_does_not_end_in_time_costs_as_much_at_least(tmp_path, monkeypatch):
    def never(job: object) -> kit.Tables:
        while True:
            time.thread_time()

    monkeypatch.setattr(module, "MAX_TRIAL_S", 0.02)
    monkeypatch.setattr(module, "_SHORT_S", 0.02)
    plan = dry_run(kit.study_in(tmp_path), tmp_path / "out", jobs=1, probe=never)
    assert (plan.tried, plan.is_least) == (1, True)
    assert plan.estimate_s is not None
    assert plan.estimate_s > 0


def test_a_run_that_fails_when_tried_is_told(tmp_path, told):
    def falls(job: object) -> kit.Tables:
        raise RuntimeError("fell\ndeep")

    plan = dry_run(kit.study_in(tmp_path), tmp_path / "out", probe=falls)
    assert (plan.tried, plan.estimate_s) == (0, None)
    assert "failed: RuntimeError: fell deep\n" in told(plan)


@pytest.mark.parametrize(
    ("plan", "names"),
    [
        ((42, 42, 9, 1, 2, 0.0, 0, ""), ["nothing is left"]),
        ((42, 0, 9, 1, 1, 300.0, 5, ""), ["about 5 min", "1 process,", "5 runs tried now"]),
        ((42, 7, 9, 1, 2, 30.0, 0, ""), ["about 30 s", "2 processes,", "done already"]),
        ((42, 0, 9, 1, 2, 7200.0, 1, "", True), ["more than 2 h 0 min", "1 run tried", "stopped"]),
        ((42, 0, 9, 1, 2, 30.0, 4, "", False, "ValueError: no"), ["4 runs", "failed: ValueError"]),
        ((42, 0, 9, 1, 2, 122.0, 7, "", False, "", 114.0), ["about 2 min", "(2 min of CPU time)"]),
    ],
)
def test_an_estimate_says_what_it_rests_on(told, plan, names):
    assert unnamed(told(DryRun(*plan)), *names) == []


def test_a_plan_says_that_a_study_may_stop_early(told):
    reported = told(DryRun(42, 7, 9, 4, 2, 30.0, 0, ""))
    assert unnamed(reported, "at most 42 runs", " 9 ", "up to 4 rounds", "7 of them", "out") == []


def test_a_probe_spreads_over_the_design():
    for count in (1, 2, 3, 9, 100, 101):
        assert sorted(_spread(count)) == list(range(count))
    first = _spread(100)[:5]
    assert min(abs(a - b) for a in first for b in first if a != b) >= 10


def test_what_is_stopped_says_in_a_line_that_the_same_command_goes_on(tmp_path, monkeypatch):
    study = kit.write_study(tmp_path)

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(StudySession, "run", stop)
    code, _, error = ended("run", study, "-o", tmp_path / "out", "-j", "1", "--quiet")
    assert (code, error.count("\n")) == (130, 1)
    assert unnamed(error, "0 of 42", "run the same command again") == []


def test_ctrl_c_while_tables_are_written_says_that_all_runs_are_done(tmp_path, monkeypatch):
    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(session, "write_tables", stop)
    with pytest.raises(KeyboardInterrupt, match="42 of 42 runs"):
        kit.run_study(kit.study_in(tmp_path), tmp_path / "out", jobs=1, episode=kit.cheap)
