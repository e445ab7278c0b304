"""Scheduling of runs to workers."""

import gc
from collections import defaultdict
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from helpers.studies import small_study as kit

from dva_sim.experiments.execution import scheduling
from dva_sim.experiments.execution.executors import LocalProcesses, Workers
from dva_sim.experiments.study import cell_grid
from dva_sim.experiments.study.cell_grid import StudyJob

FIRST = 4  # runs handed out one by one: nothing is known yet of what they cost


class TwoWorkers(Workers):
    """Two who do at once what they are given, and whose chunks are kept."""

    width = 2

    def __init__(self) -> None:
        self.chunks: list[Sequence[StudyJob]] = []

    @contextmanager
    def executor(self, width: int, task: Any) -> Iterator[Executor]:
        yield _Kept(self.chunks)


class _Kept(Executor):
    def __init__(self, chunks: list[Sequence[StudyJob]]) -> None:
        self._chunks = chunks

    def submit(self, fn: Any, /, chunk: Sequence[StudyJob], **_: Any) -> Future[Any]:
        self._chunks.append(chunk)
        future: Future[Any] = Future()
        future.set_result(fn(chunk))
        return future


def handed_out(folder: Path, persons: int, episode: Any = kit.cheap) -> list[Sequence[StudyJob]]:
    """Runs person by person, as a study hands them out: five for each random seed of the drive."""
    study = kit.study_in(folder, f"persons={persons}")
    jobs = sorted(
        (job for job in cell_grid.jobs(study, cell_grid.cells(study)) if job.part == "drive"),
        key=lambda job: (job.person, job.trial),
    )
    workers = TwoWorkers()
    done = [
        outcome.key for batch in scheduling.run_all(jobs, episode, workers) for outcome in batch
    ]
    assert sorted(done) == sorted(job.key for job in jobs)
    return workers.chunks


def parted(chunks: list[Sequence[StudyJob]]) -> int:
    """Number of random seeds in more than one chunk."""
    homes = defaultdict(set)
    for number, chunk in enumerate(chunks):
        for job in chunk:
            homes[job.seed].add(number)
    return sum(len(numbers) > 1 for numbers in homes.values())


def test_runs_of_one_seed_go_to_one_worker_but_for_the_first_and_the_last(tmp_path):
    assert parted(handed_out(tmp_path, persons=20)) <= 3


def test_the_last_chunks_are_small_so_that_workers_end_together(tmp_path):
    chunks = handed_out(tmp_path, persons=20)
    assert [len(chunk) for chunk in chunks[:FIRST]] == [1] * FIRST
    assert len(chunks[-1]) == 1
    left = 0
    for chunk in reversed(chunks[FIRST:]):
        left += len(chunk)
        assert len(chunk) <= max(1, left // 2)


def test_a_seed_whose_runs_take_long_is_parted(tmp_path, monkeypatch):
    """At 5 ms each, no more than 2 of the 5 runs fit into 12.5 ms."""
    monkeypatch.setattr(kit, "BUSY_S", 0.005)
    monkeypatch.setattr(scheduling, "_SEED_S", 0.0125)
    monkeypatch.setattr(scheduling, "_CHUNK_S", 0.005)
    assert max(map(len, handed_out(tmp_path, persons=2, episode=kit.busy))) <= 2


def test_workers_look_for_garbage_rarely_and_this_process_as_before():
    before = gc.get_threshold()
    with LocalProcesses(1) as workers, workers.executor(1, len) as pool:
        assert pool.submit(gc.get_threshold).result()[0] == 20_000
    assert gc.get_threshold() == before
