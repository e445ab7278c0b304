"""Runs handed out in chunks to an executor; when workers die, none is lost and none doubled."""

from __future__ import annotations

import json
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from functools import partial
from typing import Any

from dva_sim.experiments.execution.checkpoint import Outcome, Tables
from dva_sim.experiments.execution.executors import Place
from dva_sim.experiments.execution.limit import RunTooLong, limited
from dva_sim.experiments.study.cell_grid import Job

Episode = Callable[[Job], Tables]
Batches = Generator[list[Outcome], None, None]

DESIGN_COLUMNS = ("part", "cell", "config", "is_reference", "person", "trial", "seed")
LIMIT_S = 600.0
_LOOK_S = 5.0  # how often workers are looked after while none of them answers
_AHEAD = 2  # chunks handed out for each worker, so that none of them has to wait
_CHUNK_S = 1.0  # CPU time that a chunk should take
_LONGEST_CHUNK = 64
_KILLED = "killed the process it ran in, again and again (out of memory, or beyond its limit?)"

_Chunk = Callable[[Sequence[Job]], list[Outcome]]
_UnderWay = dict["Future[list[Outcome]]", list[Job]]


def run_all(
    jobs: Sequence[Job], episode: Episode, place: Place, limit_s: float = LIMIT_S
) -> Batches:
    """Run all jobs, in no particular order, and give their outcomes in batches as they come.

    When a worker dies, the runs it had are tried again one by one, so that the one that kills
    its workers, if there is one, becomes a failure and all others are done.

    Args:
        jobs: The runs.
        episode: Makes the tables of one run; must be importable by name unless it is run here.
        place: Where they are run.
        limit_s: A run that takes longer by the wall clock has failed.

    Raises:
        PlaceLost: nobody is left to run them.
        DvaSimError: workers have another program.
    """
    plain = partial(perform_chunk, episode=episode, limit_s=limit_s, may_exit=not place.is_here)
    run = place.guarded(plain)
    waiting, suspects, pace = deque(jobs), deque[Job](), _Pace()
    while waiting or suspects:
        yield from _alone(suspects, run, episode, place)
        yield from _together(waiting, suspects, run, episode, place, pace)


def perform(
    job: Job, episode: Episode, limit_s: float = LIMIT_S, may_exit: bool = False
) -> Outcome:
    """Run one job; whatever it raises becomes its outcome."""
    start = time.thread_time()
    try:
        with limited(limit_s, may_exit):
            tables = json.dumps(_checked(episode(job), job), separators=(",", ":"), default=_scalar)
    except (Exception, RunTooLong) as error:
        text = " ".join(str(error).split())
        return Outcome(job.key, None, error=f"{type(error).__name__}: {text}")
    return Outcome(job.key, tables, time.thread_time() - start)


def perform_chunk(
    chunk: Iterable[Job], episode: Episode, limit_s: float, may_exit: bool
) -> list[Outcome]:
    """Run some jobs, one after the other."""
    return [perform(job, episode, limit_s, may_exit) for job in chunk]


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


class _Pace:
    """How long a chunk should be: about a second, so that little is lost and progress is seen."""

    def __init__(self) -> None:
        self._runs, self._cost_s = 0, 0.0

    def add(self, outcomes: Sequence[Outcome]) -> None:
        """Learn from what runs have cost."""
        self._runs += len(outcomes)
        self._cost_s += sum(outcome.cost_s for outcome in outcomes)

    def chunk(self, waiting: deque[Job], place: Place) -> list[Job]:
        """The next few jobs: fewer towards the end, so that the workers finish together."""
        if place.is_here or not self._runs:
            return [waiting.popleft()]
        rate = self._runs / max(self._cost_s, 1e-9)
        most = min(rate * _CHUNK_S, _LONGEST_CHUNK, len(waiting) // (4 * place.width))
        return [waiting.popleft() for _ in range(max(1, int(most)))]


def _together(
    waiting: deque[Job],
    suspects: deque[Job],
    run: _Chunk,
    episode: Episode,
    place: Place,
    pace: _Pace,
) -> Batches:
    """Run what waits until a worker dies; what was under way then becomes suspect."""
    if not waiting:
        return
    with place.executor(place.width, episode) as executor:
        under_way: _UnderWay = {}
        most = 1 if place.is_here else _AHEAD * place.width
        while (waiting and not suspects) or under_way:
            while waiting and not suspects and len(under_way) < most:
                chunk = pace.chunk(waiting, place)
                try:
                    under_way[executor.submit(run, chunk)] = chunk
                except place.deaths:
                    suspects.extend(chunk)
            for outcomes in _answers(under_way, suspects, place):
                pace.add(outcomes)
                yield outcomes


def _alone(suspects: deque[Job], run: _Chunk, episode: Episode, place: Place) -> Batches:
    """Run each suspect in a process of its own, so that a death tells who caused it."""
    while suspects:
        guilty: deque[Job] = deque()
        with place.executor(1, episode) as executor:
            while suspects and not guilty:
                job = suspects.popleft()
                under_way = {executor.submit(run, [job]): [job]}
                while under_way:
                    yield from _answers(under_way, guilty, place)
        for job in guilty:
            yield [Outcome(job.key, None, error=_KILLED)]


def _answers(under_way: _UnderWay, dead: deque[Job], place: Place) -> Batches:
    """What has come, after waiting for a while at most; the runs of dead workers apart."""
    done = wait(under_way, timeout=_LOOK_S, return_when=FIRST_COMPLETED).done
    place.look_after(is_idle=not done)
    for future in done:
        chunk = under_way.pop(future)
        try:
            yield future.result()
        except place.deaths:
            dead.extend(chunk)
