"""Runs on a local dask cluster: the same bytes, and clear errors."""

import signal
import socket
import sqlite3
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from helpers.studies import small_study as kit
from helpers.studies.dask_cluster import DaskCluster
from helpers.studies.small_study import run_study
from helpers.wording import unnamed

from dva_sim.experiments.execution import dask_cluster, scheduling
from dva_sim.experiments.execution.executors import WorkersLost
from dva_sim.experiments.results.results import Results
from dva_sim.kernel.errors import ConfigError, DvaSimError

pytestmark = pytest.mark.system


@pytest.fixture
def dask(tmp_path: Path) -> Iterator[DaskCluster]:
    folder = tmp_path / "cluster"
    folder.mkdir()
    with DaskCluster(folder) as started:
        yield started


def test_a_worker_killed_half_way_loses_and_doubles_nothing(tmp_path, plain, dask, monkeypatch):
    monkeypatch.chdir(tmp_path)
    study = kit.study_in(tmp_path)
    for _ in range(2):
        dask.add_worker()

    def kill_one(done: int, total: int) -> None:
        if done >= total // 2:
            dask.workers[0].kill()

    out = run_study(
        study, tmp_path / "out", scheduler=dask.address, episode=kit.slower, progress=kill_one
    )
    assert dask.workers[0].wait() == -9
    assert dask.workers[1].poll() is None
    assert kit.files(out) == plain
    with sqlite3.connect(out / "journal.sqlite") as journal:
        (rows,) = journal.execute("SELECT count(*) FROM runs WHERE tables IS NOT NULL").fetchone()
    journal.close()
    assert rows == kit.RUNS


def test_a_scheduler_killed_half_way_ends_in_one_line_and_another_goes_on(
    tmp_path, plain, dask, monkeypatch, capfd
):
    monkeypatch.chdir(tmp_path)
    study = kit.study_in(tmp_path)
    dask.add_worker()
    seen: list[int] = []

    def kill_it(done: int, total: int) -> None:
        seen.append(done)
        if done >= total // 2:
            dask.scheduler.kill()

    out, address = tmp_path / "out", dask.address
    monkeypatch.setattr(dask_cluster, "_CONNECT_S", 1.0)
    with pytest.raises(WorkersLost) as lost:
        run_study(study, out, scheduler=address, episode=kit.slower, progress=kill_it)
    names = (address, f"{seen[-1]} of {kit.RUNS} runs are kept", "--scheduler", "--jobs")
    assert unnamed(lost.value, *names) == []
    assert capfd.readouterr() == ("", "")  # the library's logs are not let through
    begun: list[int] = []
    run_study(study, out, jobs=1, episode=kit.cheap, progress=lambda done, _: begun.append(done))
    assert begun[0] == seen[-1] > 0
    assert kit.files(out) == plain


def test_a_cluster_nobody_works_or_answers_in_is_told(dask, monkeypatch):
    with dask_cluster.DaskCluster(dask.address) as place:
        place.look_after(is_idle=True)
        monkeypatch.setattr(dask_cluster, "_WORKERS_S", 0.0)
        with pytest.raises(WorkersLost, match=r"no workers .*'dask w"):
            place.look_after(is_idle=True)
        monkeypatch.setattr(dask_cluster, "_CONNECT_S", 0.2)
        dask.scheduler.send_signal(signal.SIGSTOP)
        with pytest.raises(WorkersLost, match="not answered"):
            place.look_after(is_idle=True)
        place.look_after(is_idle=False)  # something has come meanwhile
        dask.scheduler.send_signal(signal.SIGCONT)


def test_a_worker_with_another_profile_near_it_is_refused(tmp_path, dask):
    phones = tmp_path / "elsewhere" / "agents" / "phones"
    phones.mkdir(parents=True)
    (phones / "default.yaml").write_text("filter: none\n")
    dask.add_worker(cwd=tmp_path / "elsewhere")
    with pytest.raises(DvaSimError, match=r"tcp://.* fingerprint \w+ "):
        run_study(
            kit.study_in(tmp_path), tmp_path / "out", scheduler=dask.address, episode=kit.cheap
        )


def test_programs_differ_in_what_a_run_depends_on_not_in_their_commit():
    here = {"dva-sim": "1.0", "fingerprint": "abc", "commit": "123", "dirty": False, "numpy": "2.0"}
    assert dask_cluster.differences(here, here | {"commit": None, "dirty": None}) == ""
    assert dask_cluster.differences(here, here | {"numpy": "1.9"}) == "numpy 1.9 (here 2.0)"
    older = {name: value for name, value in here.items() if name != "fingerprint"}
    assert dask_cluster.differences(here, older) == "fingerprint None (here abc)"


def test_a_scheduler_that_is_not_there_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr(dask_cluster, "_CONNECT_S", 0.01)
    with pytest.raises(ConfigError, match=r"tcp://127\.0\.0\.1:9: nothing"):
        run_study(kit.study_in(tmp_path), tmp_path / "out", scheduler="tcp://127.0.0.1:9")


@pytest.mark.parametrize(
    ("says", "expected"),
    [(b"HTTP/1.0 400 Bad request\r\n\r\n", "something else"), (b"", r"nothing within 0\.2 s")],
)
def test_another_program_is_not_taken_for_a_scheduler(says, expected, monkeypatch):
    monkeypatch.setattr(dask_cluster, "_CONNECT_S", 30.0 if says else 0.2)
    over = threading.Event()

    def answer() -> None:
        with server.accept()[0] as caller:
            caller.sendall(says)
            over.wait()

    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        listener = threading.Thread(target=answer, daemon=True)
        listener.start()
        with pytest.raises(ConfigError, match=f"no scheduler answers at {address}: .*{expected}"):
            dask_cluster.DaskCluster(address)
        over.set()
        listener.join()


def test_what_to_install_is_told(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ConfigError, match=r"pip install -e '\.\[cluster\]'"):
        run_study(kit.study_in(tmp_path), tmp_path / "out", scheduler="tcp://127.0.0.1:9")


@pytest.mark.parametrize(
    ("episode", "names"),
    [
        (kit.deadly, ["killed the process"]),
        (kit.stalls, ["RunTooLong", "1 s"]),
        (kit.never_comes_back, ["beyond its limit"]),
    ],
)
def test_a_run_that_does_not_end_well_is_a_failure_and_its_worker_goes_on(
    tmp_path, dask, monkeypatch, episode, names
):
    monkeypatch.setattr(scheduling, "_LOOK_S", 0.2)
    monkeypatch.chdir(tmp_path)
    dask.add_worker()
    study = kit.study_in(tmp_path)
    out = run_study(study, tmp_path / "out", scheduler=dask.address, episode=episode, limit_s=1.0)
    results = Results.load(out)
    (failure,) = results.failures
    assert unnamed(failure["error"], *names) == []
    assert (failure["part"], failure["cell"], failure["person"]) == ("story", 2, 1)
    assert len(results.table("runs")["seed"]) == kit.RUNS - 1
    assert dask.workers[0].poll() is None
