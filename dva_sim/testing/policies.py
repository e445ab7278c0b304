"""Checks of policies, in some hundred situations.

They are ordinary ones, and all the corners that a run can come to.
"""

from __future__ import annotations

import operator
import pickle
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import cycle, islice
from typing import Any, Final, Literal

import numpy as np

from dva_sim.core.dispatch import (
    Announcement,
    Assignment,
    Cover,
    Floats,
    Policy,
    Relocation,
    Responder,
    Situation,
    Task,
    load_policy,
)
from dva_sim.kernel.plugins import FAILURES
from dva_sim.protocol.event_kinds import EVENT_KINDS
from dva_sim.testing.promises import Case, Outcome, error_with_line, is_slow, kept, line

_PLACE: Final = 400.0  # edge of the site [m]
_PACE: Final = {"guard": (1.3, 20.0), "robot": (0.35, 4.0)}  # speed [m/s], mobilisation [s]


@dataclass(frozen=True)
class _Draw:
    """Parameters of a kind of situation; the rest is random.

    Attributes:
        tasks: Range of the number of tasks; the same form for guards, robots and operators.
        cut_off: Share of ways that do not exist.
        contain: Share of tasks that are for people, some of them not due yet.
        under_way: Share of responders that are shown as engaged to a policy that preempts.
        tied: All ways and waiting times are equal.
        auction: State of the auctions, for a policy that auctions.
        bids: Share of responders that have bid.
        listed: True if there are lists of preference.
    """

    tasks: tuple[int, int] = (1, 6)
    guards: tuple[int, int] = (0, 4)
    robots: tuple[int, int] = (0, 4)
    operators: tuple[int, int] = (0, 3)
    cut_off: float = 0.2
    contain: float = 0.2
    under_way: float = 0.0
    tied: bool = False
    auction: Literal["open", "over", "mixed"] | None = None
    bids: float = 0.7
    listed: bool = False


_KINDS_OF_SITUATION: Final = {
    "an ordinary one": _Draw(guards=(1, 4), robots=(1, 4), operators=(1, 3)),
    "nothing at all": _Draw((0, 0), (0, 0), (0, 0), (0, 0)),
    "no task": _Draw((0, 0), (1, 4), (1, 4), (1, 2)),
    "nobody idle": _Draw((1, 6), (0, 0), (0, 0)),
    "robots without operators": _Draw((1, 6), (0, 1), (2, 5), (0, 0)),
    "more robots than operators": _Draw((3, 8), (0, 2), (4, 8), (1, 2)),
    "no way to anywhere": _Draw(guards=(1, 4), robots=(1, 4), operators=(1, 2), cut_off=1.0),
    "few ways": _Draw((3, 8), (2, 5), (2, 5), (1, 3), cut_off=0.7),
    "ties everywhere": _Draw((2, 6), (2, 4), (2, 4), (1, 4), tied=True),
    "more tasks than responders": _Draw((20, 40), (1, 4), (1, 4), (1, 3)),
    "more responders than tasks": _Draw((1, 3), (10, 20), (10, 20), (3, 6)),
    "to be contained": _Draw(guards=(1, 4), robots=(1, 4), operators=(1, 2), contain=0.8),
    "some under way": _Draw((4, 9), (2, 5), (2, 5), (1, 3), under_way=0.5),
    "all under way": _Draw((4, 9), (2, 4), (2, 4), (0, 2), under_way=1.0),
    "an auction open": _Draw((2, 5), (1, 4), (1, 4), (1, 3), auction="open"),
    "auctions over": _Draw((2, 5), (1, 4), (1, 4), (1, 3), auction="over"),
    "auctions without bids": _Draw((2, 5), (1, 4), (1, 4), (1, 3), auction="over", bids=0.0),
    "auctions and none": _Draw((3, 8), (2, 5), (2, 5), (1, 3), auction="mixed"),
    "lists of preference": _Draw(guards=(1, 4), robots=(1, 4), operators=(1, 2), listed=True),
    "a bad night": _Draw((150, 200), (50, 80), (50, 80), (10, 30), cut_off=0.05),
}
_LARGEST: Final = _Draw((1000, 1000), (250, 250), (250, 250), (100, 100), cut_off=0.05)


def situations(policy: Policy, count: int, seed: int) -> Iterator[tuple[str, Situation]]:
    """Name and situation, each kind in turn; the last is as large as any that the core shows.

    A policy is shown what it asks for: who is under way if it preempts, auctions and bids if it
    auctions, stations if it relocates. The arrays cannot be written to.
    """
    rng = np.random.default_rng(seed)
    kinds: Iterator[tuple[str, _Draw]] = cycle(_KINDS_OF_SITUATION.items())
    for name, kind in islice(kinds, max(0, count - 1)):
        yield name, _situation(kind, policy, rng)
    if count:
        yield "1000 tasks, 500 responders", _situation(_LARGEST, policy, rng)


def _situation(kind: _Draw, policy: Policy, rng: np.random.Generator) -> Situation:
    team = _responders(kind, rng)
    now = float(np.round(rng.uniform(100.0, 1000.0), 1))
    tasks = _tasks(kind, now, policy.auctions, rng)
    if policy.preempts:
        tasks, team = _engage(kind, tasks, team, rng)
    distance, eta = _ways(kind, tasks, team, rng)
    shape = distance.shape
    ranks = rng.integers(0, 5, shape).astype(np.float64)
    ranks[rng.random(shape) < 0.3] = np.inf
    bids = np.where(rng.random(shape) < kind.bids, eta + rng.uniform(-5.0, 5.0, shape), np.nan)
    bids[[task.auction is None for task in tasks]] = np.nan
    return Situation(
        now=now,
        tasks=tasks,
        responders=team,
        distance=_read_only(distance),
        eta=_read_only(eta),
        preference=_read_only(ranks if kind.listed else np.empty((0, 0))),
        bids=_read_only(bids if policy.auctions else np.empty((0, 0))),
        operators=_number(kind.operators, rng),
        cover=_cover(team, rng) if policy.relocates else None,
    )


def _responders(kind: _Draw, rng: np.random.Generator) -> tuple[Responder, ...]:
    guards = _number(kind.guards, rng)
    robots = _number(kind.robots, rng)

    def responder(number: int) -> Responder:
        device = f"02:00:00:01:{number // 256:02X}:{number % 256:02X}"
        return Responder(device, "guard" if number < guards else "robot")

    return tuple(responder(number) for number in range(guards + robots))


def _tasks(kind: _Draw, now: float, auctions: bool, rng: np.random.Generator) -> tuple[Task, ...]:
    number = _number(kind.tasks, rng)
    detected = np.sort(np.round(rng.uniform(0.0, now, number), 1))
    if kind.tied:
        detected[:] = 50.0
    tasks = []
    for event, when in enumerate(detected.tolist(), start=1):
        contain = bool(rng.random() < kind.contain)
        severity = 0.5 if kind.tied else float(np.round(rng.random(), 2))
        auction = _auction(kind, event, rng) if auctions and not contain else None
        tasks.append(
            Task(
                event=event,
                kind=EVENT_KINDS[int(rng.integers(len(EVENT_KINDS)))],
                stage="contain" if contain else "confirm",
                due=not contain or bool(rng.random() < 0.5),
                severity=severity,
                confidence=float(np.round(rng.random(), 2)),
                detected=when,
                waiting_since=min(now, when + 10.0 * float(rng.integers(3)) * (not kind.tied)),
                auction=auction,
            )
        )
    return tuple(tasks)


def _auction(kind: _Draw, event: int, rng: np.random.Generator) -> Literal["open", "over"] | None:
    if kind.auction == "mixed":
        stages: tuple[Literal["open", "over"] | None, ...] = ("open", "over", None)
        return stages[int(rng.integers(3))]
    if kind.auction == "open" and event > 1:
        return None
    return kind.auction


def _engage(
    kind: _Draw,
    tasks: tuple[Task, ...],
    team: tuple[Responder, ...],
    rng: np.random.Generator,
) -> tuple[tuple[Task, ...], tuple[Responder, ...]]:
    """Put some responders under way to a task each, that they could be given."""
    open_tasks = list(tasks)
    busy = list(team)
    looks = [t for t in rng.permutation(len(tasks)).tolist() if tasks[t].stage == "confirm"]
    share = rng.random(len(team)) < kind.under_way
    for r, t in zip(np.flatnonzero(share).tolist(), looks, strict=False):
        open_tasks[t] = replace(tasks[t], engaged=r)
        busy[r] = Responder(team[r].device, team[r].kind, t)
    return tuple(open_tasks), tuple(busy)


def _ways(
    kind: _Draw,
    tasks: tuple[Task, ...],
    team: tuple[Responder, ...],
    rng: np.random.Generator,
) -> tuple[Floats, Floats]:
    """Return the path length [m] and ETA [s], shape `(tasks, responders)`."""
    goals = rng.uniform(0.0, _PLACE, (len(tasks), 1, 2))
    starts = rng.uniform(0.0, _PLACE, (1, len(team), 2))
    distance = np.abs(goals - starts).sum(axis=2)
    if kind.tied:
        distance[:] = 100.0
    distance[rng.random(distance.shape) < kind.cut_off] = np.inf
    for_people = np.array([task.stage == "contain" for task in tasks], dtype=bool)
    robots = np.array([responder.kind == "robot" for responder in team], dtype=bool)
    distance[np.ix_(for_people, robots)] = np.inf
    speed, mobilisation = np.array([_PACE[responder.kind] for responder in team]).reshape(-1, 2).T
    return distance, mobilisation + distance / speed


def _cover(team: tuple[Responder, ...], rng: np.random.Generator) -> Cover:
    stations = int(rng.integers(0, 5))
    zones = int(rng.integers(1, 7))
    eta = np.round(rng.uniform(0.0, 300.0, (len(team), stations)))
    stuck = [responder.kind == "robot" or responder.engaged is not None for responder in team]
    eta[np.array(stuck, dtype=bool)] = np.inf
    eta[rng.random(eta.shape) < 0.1] = np.inf
    reach = np.round(rng.uniform(20.0, 300.0, (stations, zones)))
    reach[rng.random(reach.shape) < 0.1] = np.inf
    bound_for = tuple(
        int(rng.integers(stations)) if stations and not busy and rng.random() < 0.2 else None
        for busy in stuck
    )
    names = tuple(f"station-{number}" for number in range(1, stations + 1))
    demand = rng.dirichlet(np.ones(zones))
    return Cover(names, _read_only(eta), _read_only(reach), _read_only(demand), bound_for)


def _number(bounds: tuple[int, int], rng: np.random.Generator) -> int:
    return int(rng.integers(bounds[0], bounds[1] + 1))


def _read_only(array: Floats) -> Floats:
    array.setflags(write=False)
    return array


SITUATIONS: Final = 200
SLOW: Final = 0.1  # time of a decision above which an episode is slow [s]
TOO_MANY_ROBOTS: Final = "sends more robots than operators are free; the core drops the rest"


def check_policy(
    policy: str | Callable[..., Policy],
    options: Mapping[str, Any] | None = None,
    *,
    count: int = SITUATIONS,
    slow: float = SLOW,
) -> Outcome:
    """See that a policy keeps what every policy promises.

    Two instances get the same generated situations, all kinds in turn, with the same
    random numbers: they must advise the same. What the quicker one took is how long a decision
    takes, without what is only done once.

    Args:
        policy: Name, as in a scenario, or its class.
        options: Keyword arguments of its constructor.
        count: Number of situations.
        slow: A decision that takes longer earns a warning [s].

    Raises:
        BrokenPromises: it does not; a line for each promise.
        ConfigError: there is none of that name, or it cannot be made with these options.
    """
    original, twin = (load_policy(policy, options) for _ in range(2))
    breaches: dict[str, list[str]] = {}
    slowest = 0.0, ""
    for number, (kind, situation) in enumerate(situations(original, count, 1), start=1):
        where = f"situation {number} ({kind})"
        answer = _ask(original, situation, number)
        twin_answer = _ask(twin, situation, number)
        slowest = max(slowest, (min(answer.took, twin_answer.took), where))
        for promise, case in _broken(original, situation, answer, twin_answer):
            breaches.setdefault(promise, []).append(f"{case}in {where}")
    dropped = breaches.pop(TOO_MANY_ROBOTS, [])
    warnings = [line(TOO_MANY_ROBOTS, dropped)] if dropped else []
    warnings += is_slow(slowest[0], slow, f"in {slowest[1]}")
    return kept([line(*each) for each in breaches.items()], warnings, count, slowest[0])


@dataclass(frozen=True)
class _Answer:
    """Advice, the time that it took [s], and broken promises."""

    advice: Any
    took: float
    broke: tuple[Case, ...] = ()


def _ask(policy: Policy, situation: Situation, seed: int) -> _Answer:
    before = _contents(situation)
    rng = np.random.default_rng(seed)
    started = time.perf_counter()
    try:
        advice = policy.advise(situation, rng)
    except FAILURES as error:
        return _Answer(
            (), time.perf_counter() - started, (("raises", f"{error_with_line(error)} "),)
        )
    took = time.perf_counter() - started
    changed = before != _contents(situation)
    return _Answer(advice, took, (("changes the situation", ""),) if changed else ())


def _broken(
    policy: Policy, situation: Situation, answer: _Answer, twin_answer: _Answer
) -> Iterator[Case]:
    """Yield the promises that an answer breaks, also compared with its twin's answer."""
    yield from answer.broke
    advice = answer.advice
    if not isinstance(advice, Sequence) or isinstance(advice, str | bytes):
        yield "returns no sequence of advice", f"a {type(advice).__name__} "
        return
    bad = list(_misshapen(policy, situation, advice))
    yield from bad
    if not bad:
        yield from _twice(advice)
        yield from _forbidden(policy, situation, advice)
        if repr(advice) != repr(twin_answer.advice):
            yield "advises differently with the same history and random seed", ""


def _misshapen(policy: Policy, situation: Situation, advice: Sequence[Any]) -> Iterator[Case]:
    """Yield the advice of a wrong type, or about missing tasks, responders or stations."""
    stations = len(situation.cover.stations) if situation.cover else 0
    lengths = {
        Assignment: {"task": len(situation.tasks), "responder": len(situation.responders)},
        Announcement: {"task": len(situation.tasks)},
        Relocation: {"responder": len(situation.responders), "station": stations},
    }
    for piece in advice:
        if type(piece) not in lengths:
            yield "gives something that is no advice", f"a {type(piece).__name__} "
            continue
        if isinstance(piece, Announcement) and not policy.auctions:
            yield "announces a task without `auctions = True`", ""
        if isinstance(piece, Relocation) and not policy.relocates:
            yield "relocates somebody without `relocates = True`", ""
        for name, count in lengths[type(piece)].items():
            if not _is_place(index := getattr(piece, name), count):
                yield f"names a {name} that is not there", f"{index!r} of {count} "


def _is_place(index: object, count: int) -> bool:
    if isinstance(index, bool):
        return False
    try:
        return 0 <= operator.index(index) < count  # type: ignore[arg-type]
    except TypeError:
        return False


def _twice(advice: Sequence[Any]) -> Iterator[Case]:
    for name, kinds in {
        "responder": (Assignment, Relocation),
        "task": (Assignment, Announcement),
    }.items():
        places = [getattr(piece, name) for piece in advice if isinstance(piece, kinds)]
        for index in sorted({index for index in places if places.count(index) > 1})[:1]:
            yield f"uses a {name} twice", f"{name} {index} "


def _forbidden(policy: Policy, situation: Situation, advice: Sequence[Any]) -> Iterator[Case]:
    """Yield the well-formed advice that the rules do not allow."""
    robots = 0
    for piece in advice:
        if isinstance(piece, Relocation):
            yield from _bad_move(situation, piece)
            continue
        task = situation.tasks[piece.task]
        if isinstance(piece, Announcement):
            if task.stage == "contain" or not task.due or task.auction or task.engaged is not None:
                due = "" if task.due else ", not due"
                yield (
                    "announces a task that is not to be announced",
                    f"task {piece.task} ({task.stage}{due}, auction {task.auction or 'none'}) ",
                )
            continue
        responder = situation.responders[piece.responder]
        robots += responder.kind == "robot" and responder.engaged is None
        if not np.isfinite(situation.eta[piece.task, piece.responder]):
            pair = f"responder {piece.responder} to task {piece.task} "
            yield "sends somebody who would never arrive", pair
        if task.engaged is not None:
            yield "gives a task that somebody is under way to", f"task {piece.task} "
        if responder.engaged is not None and not policy.preempts:
            case = f"responder {piece.responder} "
            yield "redirects somebody without `preempts = True`", case
    if robots > situation.operators:
        yield TOO_MANY_ROBOTS, f"{robots} robots, {situation.operators} operators "


def _bad_move(situation: Situation, move: Relocation) -> Iterator[Case]:
    assert situation.cover is not None
    case = f"responder {move.responder} to station {move.station} "
    if situation.responders[move.responder].engaged is not None:
        yield "relocates somebody who is under way", case
    elif not np.isfinite(situation.cover.eta[move.responder, move.station]):
        yield "relocates somebody who would never arrive", case


def _contents(situation: Situation) -> bytes:
    """Return the contents of a situation, with its arrays, for later comparison."""
    return pickle.dumps([getattr(situation, field.name) for field in fields(situation)])
