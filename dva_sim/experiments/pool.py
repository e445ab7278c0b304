"""Runs spread over processes: in chunks, surviving killed workers, leaving none behind."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import partial
from typing import Any

from dva_sim.experiments.design import Job
from dva_sim.experiments.journal import Outcome, Tables
from dva_sim.experiments.limit import RunTooLong, limited

Episode = Callable[[Job], Tables]
Batches = Generator[list[Outcome], None, None]

DESIGN_COLUMNS = ("part", "cell", "config", "is_reference", "person", "trial", "seed")
LIMIT_S = 600.0
_LONGEST_CHUNK = 8  # runs lost at most when everything is killed, for each worker
_KILLED = "killed the process it ran in, twice (out of memory, or beyond its limit?)"

_Chunk = Callable[[Sequence[Job]], list[Outcome]]


def run_all(
    jobs: Sequence[Job], episode: Episode, workers: int, limit_s: float = LIMIT_S
) -> Batches:
    """Run all jobs, in no particular order, and give their outcomes in batches as they come.

    Args:
        jobs: The runs.
        episode: Makes the tables of one run; must be importable by name if `workers` > 1.
        workers: Processes; with one, everything happens in this process.
        limit_s: A run that takes longer by the wall clock has failed.
    """
    if workers <= 1:
        for job in jobs:
            yield [perform(job, episode, limit_s)]
        return
    chunk = partial(_perform_chunk, episode=episode, limit_s=limit_s)
    waiting, suspects = deque(jobs), deque[Job]()
    while waiting or suspects:
        yield from _alone(suspects, chunk, episode)
        yield from _together(waiting, suspects, chunk, episode, workers)


def perform(
    job: Job, episode: Episode, limit_s: float = LIMIT_S, may_exit: bool = False
) -> Outcome:
    """Run one job; whatever it raises becomes its outcome."""
    start = time.process_time()
    try:
        with limited(limit_s, may_exit):
            tables = json.dumps(_checked(episode(job), job), separators=(",", ":"), default=_scalar)
    except (Exception, RunTooLong) as error:
        text = " ".join(str(error).split())
        return Outcome(job.key, None, error=f"{type(error).__name__}: {text}")
    return Outcome(job.key, tables, time.process_time() - start)


def _checked(tables: Tables, job: Job) -> Tables:
    """The tables, if they can be kept beside the columns of the design."""
    taken = {*DESIGN_COLUMNS, *(factor for factor, _ in job.cell)}
    for name, rows in tables.items():
        if not (name.isascii() and name.isidentifier()):
            raise ValueError(f"table name {name!r} should be letters, digits and _")
        for row in rows:
            if not taken.isdisjoint(row):
                raise ValueError(f"table {name!r}: {sorted(taken & row.keys())} name the design")
            if any(isinstance(value, dict | list | tuple) for value in row.values()):
                raise TypeError(f"table {name!r} should hold numbers, words, true, false or None")
    return tables


def _scalar(value: Any) -> Any:
    """A numpy number as Python's own."""
    if getattr(value, "shape", None) == ():
        return value.item()
    raise TypeError(f"{type(value).__name__} {value!r} cannot be kept in a table")


def _perform_chunk(chunk: Sequence[Job], episode: Episode, limit_s: float) -> list[Outcome]:
    return [perform(job, episode, limit_s, may_exit=True) for job in chunk]


def _together(
    waiting: deque[Job], suspects: deque[Job], run: _Chunk, episode: Episode, workers: int
) -> Batches:
    """Run what waits until a worker dies; what was under way then becomes suspect."""
    if not waiting:
        return
    with _executor(workers, episode) as executor:
        under_way: dict[Future[list[Outcome]], list[Job]] = {}
        while (waiting and not suspects) or under_way:
            while waiting and not suspects and len(under_way) < 2 * workers:
                chunk = _chunk(waiting, workers)
                try:
                    under_way[executor.submit(run, chunk)] = chunk
                except BrokenProcessPool:
                    suspects.extend(chunk)
            for future in wait(under_way, return_when=FIRST_COMPLETED).done:
                chunk = under_way.pop(future)
                try:
                    yield future.result()
                except BrokenProcessPool:
                    suspects.extend(chunk)


def _alone(suspects: deque[Job], run: _Chunk, episode: Episode) -> Batches:
    """Run each suspect in a process of its own, so that a death tells who caused it."""
    while suspects:
        with _executor(1, episode) as executor:
            while suspects:
                job = suspects.popleft()
                try:
                    yield executor.submit(run, [job]).result()
                except BrokenProcessPool:
                    yield [Outcome(job.key, None, error=_KILLED)]
                    break


def _chunk(waiting: deque[Job], workers: int) -> list[Job]:
    """The next few jobs: fewer towards the end, so that the workers finish together."""
    size = max(1, min(_LONGEST_CHUNK, len(waiting) // (4 * workers)))
    return [waiting.popleft() for _ in range(size)]


@contextmanager
def _executor(workers: int, episode: Episode) -> Iterator[ProcessPoolExecutor]:
    """A pool whose processes are gone when the block ends, at once if it ends in an error."""
    method = "forkserver" if "forkserver" in multiprocessing.get_all_start_methods() else "spawn"
    context = multiprocessing.get_context(method)
    context.set_forkserver_preload([episode.__module__])
    executor = ProcessPoolExecutor(workers, mp_context=context, initializer=_begin)
    try:
        yield executor
    except BaseException:
        for process in list((executor._processes or {}).values()):
            process.kill()
        raise
    finally:
        executor.shutdown(wait=True, cancel_futures=True)


def _begin() -> None:
    """Leave Ctrl-C to the parent, and end with it however it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
