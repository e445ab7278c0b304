"""Damaged results folders, each reported in one line."""

import functools
import os
import shutil
import signal
import sys
from pathlib import Path

import pytest
from helpers.paths import PYTHON_PATH
from helpers.processes import patience
from helpers.studies import small_study as kit
from helpers.studies.small_study import run_study
from helpers.wording import unnamed

from dva_sim.experiments.execution import scheduling
from dva_sim.experiments.results.tables import write_tables
from dva_sim.kernel.errors import DvaSimError

pytestmark = pytest.mark.system


def never(job: object) -> kit.Tables:
    raise AssertionError("run again")


@pytest.mark.parametrize("damage", ["tables/runs.parquet", "manifest.json", "machine.json"])
def test_what_is_damaged_or_gone_is_made_again_from_the_journal(tmp_path, out, damage):
    whole = kit.files(out)
    for change in (lambda file: file.write_bytes(b"PAR1 no more"), Path.unlink):
        change(out / damage)
        run_study(kit.study_in(tmp_path), out, jobs=1, episode=never)
        assert kit.files(out) == whole
        assert (out / "machine.json").read_text().startswith("{")


@pytest.mark.parametrize("is_dirty", [None, True])
def test_tables_that_are_written_are_left_alone_unless_the_program_is_being_changed(
    tmp_path, out, monkeypatch, is_dirty
):
    state = {"commit": None, "dirty": is_dirty}
    monkeypatch.setattr("dva_sim.experiments.results.manifest.program_state", lambda: state)
    study = kit.study_in(tmp_path)
    whole, written = kit.files(run_study(study, out, jobs=1, episode=never)), []
    monkeypatch.setattr(
        "dva_sim.experiments.execution.session.write_tables",
        lambda *words: written.append(write_tables(*words)),
    )

    run_study(study, out, jobs=1, episode=never)
    assert len(written) == bool(is_dirty)
    state["commit"] = "of another version"
    run_study(study, out, jobs=1, episode=never)
    assert len(written) == bool(is_dirty) + 1
    state["commit"] = None
    assert kit.files(run_study(study, out, jobs=1, episode=never)) == whole


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_a_disk_that_fills_up_at_the_manifest_is_told(tmp_path, out, monkeypatch):
    whole = kit.files(out)
    (out / "manifest.json").unlink()

    def instead(folder: Path) -> None:
        (folder / f".manifest.{os.getpid()}.json").symlink_to("/dev/full")

    with monkeypatch.context() as patch:
        patch.setattr("dva_sim.experiments.execution.session._tidy", instead)
        with pytest.raises(DvaSimError, match=r"manifest\.json .* No space"):
            run_study(kit.study_in(tmp_path), out, jobs=1, episode=never)
    assert kit.files(run_study(kit.study_in(tmp_path), out, jobs=1, episode=never)) == whole


def test_what_a_killed_runner_left_behind_is_removed(tmp_path, out):
    (out / ".tables-abc").mkdir()
    (out / ".tables-abc" / "runs.duckdb").write_bytes(b"half")
    (out / ".manifest.123.json").write_text("{")
    run_study(kit.study_in(tmp_path), out, jobs=1, episode=never)
    assert [path.name for path in out.iterdir() if path.name.startswith(".")] == []


def test_a_folder_that_cannot_be_written_is_told(tmp_path, out):
    """In a mount namespace, since nobody keeps root from writing otherwise."""
    words = ["unshare", "--map-root-user", "--mount"]
    program = (
        "import subprocess, sys\nfrom helpers.studies import small_study as kit\n"
        "from dva_sim.kernel.errors import DvaSimError\n"
        "from pathlib import Path\n"
        "folder = Path(sys.argv[1])\n"
        "study = kit.load_study(folder / 'study.yaml')\n"
        "subprocess.run(['mount', '-t', 'tmpfs', 'none', folder / 'empty'], check=True)\n"
        "subprocess.run(['mount', '--bind', folder, folder], check=True)\n"
        "subprocess.run(['mount', '-o', 'remount,bind,ro', folder], check=True)\n"
        "for out in ('new', 'out'):\n"
        "    try: kit.run_study(study, folder / out, jobs=1, episode=kit.cheap)\n"
        "    except DvaSimError as error: print(error)\n"
        "from dva_sim.experiments.execution.dry_run import dry_run\n"
        "print(dry_run(study, folder / 'out').done)\n"
    )
    kit.write_study(tmp_path)
    (tmp_path / "empty").mkdir()
    can = shutil.which("unshare") and patience.run(
        [*words, "mount", "-t", "tmpfs", "none", tmp_path / "empty"], capture_output=True
    )
    if not can or can.returncode:
        pytest.skip("this system lets nobody but root mount a folder read-only")
    ran = patience.run(
        [*words, sys.executable, "-c", program, tmp_path],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": PYTHON_PATH},
        check=True,
    )
    new, old, done = ran.stdout.splitlines()
    assert unnamed(new, f"{tmp_path / 'new'} ", "Read-only file system") == []
    assert unnamed(old, f"{out} ", "Read-only file system") == []
    assert int(done) == kit.RUNS


def test_a_worker_that_was_stopped_is_ended_and_its_runs_are_made_by_another(
    tmp_path, out, monkeypatch
):
    if not Path("/proc/self/stat").exists():
        pytest.skip("this system does not tell which processes are stopped")
    monkeypatch.setattr(scheduling, "_LOOK_S", 0.2)
    mark = tmp_path / "mark"
    again = run_study(
        kit.study_in(tmp_path),
        tmp_path / "again",
        jobs=2,
        episode=functools.partial(kit.stopped_once, mark),
    )
    assert mark.exists()
    assert kit.files(again) == kit.files(out)


def ticks(count: int, limit_s: float) -> None:
    with scheduling.limited(limit_s, may_exit=False):
        for _ in range(count):
            signal.raise_signal(signal.SIGALRM)


def test_time_in_which_a_process_was_stopped_does_not_count_as_its_runs():
    """A process that was stopped for an hour finds one signal waiting, not 3600."""
    ticks(1, limit_s=3600.0)
    with pytest.raises(scheduling.RunTooLong, match=" 60 s"):
        ticks(60, limit_s=60.0)


def test_the_tables_lock_ends_with_the_runner_that_holds_it(tmp_path, out):
    def full(*_: object) -> None:
        raise DvaSimError("the disk is full")

    (out / "manifest.json").unlink()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("dva_sim.experiments.execution.session.write_tables", full)
        with pytest.raises(DvaSimError, match="full"):
            run_study(kit.study_in(tmp_path), out, jobs=1, episode=never)
    run_study(kit.study_in(tmp_path), out, jobs=1, episode=never)
