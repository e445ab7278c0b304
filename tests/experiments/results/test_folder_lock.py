"""One process at a time writes into a results folder, and none that has ended keeps others out."""

import errno
import fcntl
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from helpers.processes import patience
from helpers.studies import small_study as kit
from helpers.studies.small_study import run_study
from helpers.wording import unnamed

from dva_sim.experiments.results import folder_lock
from dva_sim.experiments.results.folder_lock import LOCK, FolderInUse, FolderLock
from dva_sim.experiments.study import registration
from dva_sim.kernel.errors import ConfigError, DvaSimError, ExitCode

HOLDER = """
import sys, time
from pathlib import Path
from dva_sim.experiments.results.folder_lock import FolderLock
lock = FolderLock(Path(sys.argv[1]))
print("has it", flush=True)
sys.stdin.read()
"""


@pytest.fixture
def holder(tmp_path):
    """Another process that has the lock of a folder."""
    words = [sys.executable, "-c", HOLDER, str(tmp_path / "out")]
    process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert process.stdout.readline() == b"has it\n"
    yield process
    process.kill()
    process.communicate()


def test_the_second_process_is_refused_in_one_line_that_names_the_first(tmp_path, holder):
    with pytest.raises(FolderInUse) as refused:
        FolderLock(tmp_path / "out")
    reported = str(refused.value)
    assert unnamed(reported, tmp_path / "out", f"process {holder.pid} on ") == []
    assert "\n" not in reported
    assert refused.value.exit_code == ExitCode.MISTAKE == 2


def test_a_process_that_is_killed_keeps_nobody_out(tmp_path, holder):
    holder.send_signal(signal.SIGKILL)
    holder.wait(patience.PATIENCE_S)
    assert (tmp_path / "out" / LOCK).exists()
    with FolderLock(tmp_path / "out"):
        assert f"process {os.getpid()} " in (tmp_path / "out" / LOCK).read_text()
    assert list((tmp_path / "out").iterdir()) == []


def test_a_second_lock_of_the_same_process_is_refused_as_well(tmp_path):
    with FolderLock(tmp_path / "out"), pytest.raises(FolderInUse, match=f"process {os.getpid()} "):
        FolderLock(tmp_path / "out")
    FolderLock(tmp_path / "out").close()


def test_who_waited_for_a_file_that_was_removed_locks_the_new_one(tmp_path, monkeypatch):
    """Between opening and locking the last owner removes the file, and another one takes over."""
    path, lock, raced = tmp_path / LOCK, fcntl.flock, []

    def slow(file, how):
        if not raced:
            raced.append(True)
            path.unlink()
            path.touch()
        lock(file, how)

    monkeypatch.setattr(fcntl, "flock", slow)
    with FolderLock(tmp_path), pytest.raises(FolderInUse):
        FolderLock(tmp_path)


def test_a_file_system_without_locks_refuses_nobody(tmp_path, monkeypatch):
    def flock(file, how):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(folder_lock.fcntl, "flock", flock)
    with FolderLock(tmp_path), FolderLock(tmp_path):
        pass


def test_a_study_is_run_by_one_process_at_a_time(tmp_path, holder):
    study = kit.study_in(tmp_path)
    with pytest.raises(FolderInUse):
        run_study(study, tmp_path / "out", jobs=1, episode=kit.cheap)
    assert [path.name for path in (tmp_path / "out").iterdir()] == [LOCK]
    holder.kill()
    holder.wait(patience.PATIENCE_S)
    run_study(study, tmp_path / "out", jobs=1, episode=kit.cheap)
    assert (tmp_path / "out" / "manifest.json").exists()
    assert not (tmp_path / "out" / LOCK).exists()


def test_of_two_registrations_at_once_only_one_is_made(tmp_path):
    path = tmp_path / "study.registration.yaml"
    registration._write(path, "first\n", replaces=False)
    with pytest.raises(ConfigError, match="by another process"):
        registration._write(path, "second\n", replaces=False)
    assert path.read_text() == "first\n"
    registration._write(path, "third\n", replaces=True)
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [(path.name, "third\n")]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no disk that is always full")
def test_of_a_registration_that_finds_no_room_nothing_is_left(tmp_path, monkeypatch):
    path = tmp_path / "study.registration.yaml"

    def on_a_full_disk(path, *_, **__):
        path.touch()
        return os.fdopen(os.open("/dev/full", os.O_WRONLY), "w")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "open", on_a_full_disk)
        with pytest.raises(DvaSimError, match="No space left"):
            registration._write(path, "first\n", replaces=False)
    assert list(tmp_path.iterdir()) == []
