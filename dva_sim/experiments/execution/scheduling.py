"""Runs handed out in chunks to workers; when these die, no run is lost and none doubled.

A run that stalls is ended after a limit of time, whatever it is doing, and counts as failed.
"""

from __future__ import annotations

import faulthandler
import json
import math
import os
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import contextmanager, nullcontext
from functools import partial
from typing import Any

from dva_sim.experiments.execution.checkpoint import RunOutcome
from dva_sim.experiments.execution.executors import Workers
from dva_sim.experiments.results.tables import DESIGN_COLUMNS
from dva_sim.experiments.study.cell_grid import StudyJob
from dva_sim.kernel.errors import RunTooLong
from dva_sim.simulation.models import Tables, model_for
from dva_sim.simulation.run_measures import load_measure

Simulate = Callable[[StudyJob], Tables]
_Batches = Generator[list[RunOutcome], None, None]

LIMIT_S = 600.0
_LOOK_S = 5.0  # how often workers are looked after while none of them answers
_CHUNKS_PER_WORKER = 2  # chunks handed out for each worker, so that none of them has to wait
_CHUNK_S = 1.0  # CPU time that a chunk should take
_SEED_S = 5.0  # and how long it may take until the runs of a random seed are parted
_MAX_CHUNK = 64
GRACE = 1.5  # times the limit: then the whole process ends, if nothing else helps
_KILLED = "killed the process it ran in, again and again (out of memory, or beyond its limit?)"

_Chunk = Callable[[Sequence[StudyJob]], list[RunOutcome]]
_UnderWay = dict["Future[list[RunOutcome]]", list[StudyJob]]


def run_all(
    jobs: Sequence[StudyJob], episode: Simulate, workers: Workers, limit_s: float = LIMIT_S
) -> _Batches:
    """Run all jobs, in no particular order, and give their outcomes in batches as they come.

    When a worker dies, the runs it had are tried again one by one, so that the one that kills
    its workers, if there is one, becomes a failure and all others are done.

    Args:
        jobs: The runs.
        episode: Function that makes the tables of one run; must be importable by name unless it is
            run here.
        limit_s: A run that takes longer by the wall clock has failed.

    Raises:
        WorkersLost: nobody is left to run them.
        DvaSimError: workers have another program.
    """
    plain = partial(perform_chunk, episode=episode, limit_s=limit_s, may_exit=not workers.is_here)
    run = workers.guarded(plain)
    waiting = deque(jobs)
    suspects = deque[StudyJob]()
    pace = _Pace()
    while waiting or suspects:
        yield from _alone(suspects, run, episode, workers)
        yield from _together(waiting, suspects, run, episode, workers, pace)


def perform(
    job: StudyJob, episode: Simulate, limit_s: float = LIMIT_S, may_exit: bool = False
) -> RunOutcome:
    """Run one job; whatever it raises becomes its outcome."""
    clock = clock_of(job)
    start = clock()
    try:
        with limited(limit_s, may_exit):
            tables = json.dumps(_checked(episode(job), job), separators=(",", ":"), default=_scalar)
    except (Exception, RunTooLong) as error:
        text = " ".join(str(error).split())
        return RunOutcome(job.key, None, error=f"{type(error).__name__}: {text}")
    return RunOutcome(job.key, tables, clock() - start)


def clock_of(job: StudyJob) -> Callable[[], float]:
    """Return the clock for the cost of a run [s]: CPU time, or wall clock in real time."""
    is_real_time = job.scenario is not None and model_for(job.scenario).is_real_time
    return time.monotonic if is_real_time else time.thread_time


def perform_chunk(
    chunk: Iterable[StudyJob], episode: Simulate, limit_s: float, may_exit: bool
) -> list[RunOutcome]:
    """Run some jobs, one after the other."""
    return [perform(job, episode, limit_s, may_exit) for job in chunk]


def _checked(tables: Tables, job: StudyJob) -> Tables:
    """Return the tables, if they can be kept beside the columns of the design."""
    taken = {*DESIGN_COLUMNS, *job.levels}
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
    """Return a numpy number as Python's own."""
    if getattr(value, "shape", None) == ():
        return value.item()
    raise TypeError(f"{type(value).__name__} {value!r} cannot be kept in a table")


class _Pace:
    """Size of a chunk: about a second of work, so that little is lost by a kill.

    Runs of one random seed plan the same ways to the same places, and a process plans each once:
    they stay together, unless workers would wait for each other at the end.
    """

    def __init__(self) -> None:
        self._runs = 0
        self._cost_s = 0.0

    def add(self, outcomes: Sequence[RunOutcome]) -> None:
        """Learn from what runs have cost."""
        self._runs += len(outcomes)
        self._cost_s += sum(outcome.cost_s for outcome in outcomes)

    def chunk(self, waiting: deque[StudyJob], workers: Workers) -> list[StudyJob]:
        """Return the next jobs: fewer towards the end, so that the workers finish together."""
        if workers.is_here or not self._runs:
            return [waiting.popleft()]
        rate = self._runs / max(self._cost_s, 1e-9)
        width = workers.width
        left = len(waiting)
        usual = min(rate * _CHUNK_S, _MAX_CHUNK, left // (4 * width))
        most = max(usual, min(rate * _SEED_S, _MAX_CHUNK, left // width))
        chunk = [waiting.popleft()]
        while waiting and len(chunk) + 1 <= (most if waiting[0].seed == chunk[-1].seed else usual):
            chunk.append(waiting.popleft())
        return chunk


def _together(
    waiting: deque[StudyJob],
    suspects: deque[StudyJob],
    run: _Chunk,
    episode: Simulate,
    workers: Workers,
    pace: _Pace,
) -> _Batches:
    """Run the waiting jobs until a worker dies; jobs under way then become suspects."""
    if not waiting:
        return
    with workers.executor(workers.width, episode) as executor:
        under_way: _UnderWay = {}
        most = 1 if workers.is_here else _CHUNKS_PER_WORKER * workers.width
        while (waiting and not suspects) or under_way:
            while waiting and not suspects and len(under_way) < most:
                chunk = pace.chunk(waiting, workers)
                try:
                    under_way[executor.submit(run, chunk)] = chunk
                except workers.deaths:
                    suspects.extend(chunk)
            for outcomes in _answers(under_way, suspects, workers):
                pace.add(outcomes)
                yield outcomes


def _alone(suspects: deque[StudyJob], run: _Chunk, episode: Simulate, workers: Workers) -> _Batches:
    """Run each suspect in a process of its own, so that a death tells who caused it."""
    while suspects:
        guilty: deque[StudyJob] = deque()
        with workers.executor(1, episode) as executor:
            while suspects and not guilty:
                job = suspects.popleft()
                under_way = {executor.submit(run, [job]): [job]}
                while under_way:
                    yield from _answers(under_way, guilty, workers)
        for job in guilty:
            yield [RunOutcome(job.key, None, error=_KILLED)]


def _answers(under_way: _UnderWay, dead: deque[StudyJob], workers: Workers) -> _Batches:
    """Yield finished chunks, after a limited wait; queue the runs of dead workers separately."""
    done = wait(under_way, timeout=_LOOK_S, return_when=FIRST_COMPLETED).done
    workers.look_after(is_idle=not done)
    for future in done:
        chunk = under_way.pop(future)
        try:
            yield future.result()
        except workers.deaths:
            dead.extend(chunk)


def run_job(job: StudyJob, measures: Sequence[str] = ()) -> Tables:
    """Simulate a job; rows by table. Ways are kept for the first trial of the first person.

    Args:
        job: The run.
        measures: The study's own, which every process loads for itself.
    """
    first = job.person == 0 and job.trial == 0
    own = [load_measure(name) for name in measures]
    return model_for(job.scenario).tables(job.scenario, job.seed, first, own)


@contextmanager
def limited(seconds: float, may_exit: bool) -> Iterator[None]:
    """Limit the wall-clock time of the block [s].

    Time in which the whole process was stopped (Ctrl-Z) does not count. Python code is ended by
    an exception, again and again until it gives in. Code that never comes back to Python cannot
    be ended so; its process is ended if `may_exit`, which takes no part in Python at all and so
    works in every case. Signals reach the main thread only: in any other one, nothing but the
    end of the process limits a block.

    Raises:
        RunTooLong: from inside the block.
    """
    is_main = threading.current_thread() is threading.main_thread()
    with open(os.devnull, "w") as nowhere:  # noqa: PTH123
        if may_exit:
            faulthandler.dump_traceback_later(GRACE * seconds + 1.0, exit=True, file=nowhere)
        try:
            with _by_signal(seconds) if is_main else nullcontext():
                yield
        finally:
            if may_exit:
                faulthandler.cancel_dump_traceback_later()


@contextmanager
def _by_signal(seconds: float) -> Iterator[None]:
    """Send signals at each of several ticks, since a stopped process misses all but one."""
    ticks = math.ceil(seconds)
    left = ticks

    def tick(*_: object) -> None:
        nonlocal left
        left -= 1
        if left <= 0:
            raise RunTooLong(f"took more than its {seconds:g} s")

    before = signal.signal(signal.SIGALRM, tick)
    signal.setitimer(signal.ITIMER_REAL, seconds / ticks, seconds / ticks)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
