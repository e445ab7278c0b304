"""What every policy promises, tried in some hundred situations."""

from __future__ import annotations

import operator
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any, Final

import numpy as np

from dva_sim.checking.promises import Case, Outcome, line, said
from dva_sim.checking.situations import situations
from dva_sim.core.dispatch import (
    Announcement,
    Assignment,
    Policy,
    Relocation,
    Situation,
)
from dva_sim.plugins import FAILURES

SITUATIONS: Final = 200
SLOW: Final = 0.1  # [s] of one decision; above that an episode is no longer fast
TOO_MANY_ROBOTS: Final = "sends more robots than operators are free; the core drops the rest"


def try_policy(
    make: Callable[[], Policy], count: int = SITUATIONS, seed: int = 1, slow: float = SLOW
) -> Outcome:
    """Try a policy in generated situations, all kinds in turn.

    Two of it are made, and shown the same with the same luck: they must advise the same. What
    the quicker one took is how long a decision takes, without what is only done once.

    Args:
        make: Makes the policy.
        count: How many situations.
        seed: Of their luck.
        slow: A decision that takes longer earns a warning [s].
    """
    policy, twin = make(), make()
    found: dict[str, list[str]] = {}
    slowest = 0.0, ""
    for number, (kind, situation) in enumerate(situations(policy, count, seed), start=1):
        where = f"situation {number} ({kind})"
        answer, other = _ask(policy, situation, number), _ask(twin, situation, number)
        slowest = max(slowest, (min(answer.took, other.took), where))
        for promise, case in _broken(policy, situation, answer, other):
            found.setdefault(promise, []).append(f"{case}in {where}")
    warnings = [line(p, cases) for p, cases in found.items() if p == TOO_MANY_ROBOTS]
    if slowest[0] > slow:
        warnings.append(f"is slow: {slowest[0]:.2g} s in {slowest[1]}; should be {slow:g} s")
    broken = tuple(line(p, cases) for p, cases in found.items() if p != TOO_MANY_ROBOTS)
    return Outcome(broken, tuple(warnings), count, slowest[0])


@dataclass(frozen=True)
class _Answer:
    """Advice, how long it took [s], and what happened that should not."""

    advice: Any
    took: float
    broke: tuple[Case, ...] = ()


def _ask(policy: Policy, situation: Situation, seed: int) -> _Answer:
    before, rng = _contents(situation), np.random.default_rng(seed)
    started = time.perf_counter()
    try:
        advice = policy.advise(situation, rng)
    except FAILURES as error:
        return _Answer((), time.perf_counter() - started, (("raises", f"{said(error)} "),))
    took = time.perf_counter() - started
    changed = before != _contents(situation)
    return _Answer(advice, took, (("changes the situation", ""),) if changed else ())


def _broken(
    policy: Policy, situation: Situation, answer: _Answer, other: _Answer
) -> Iterator[Case]:
    """The promises that an answer breaks, also in comparison with the other one's."""
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
        if repr(advice) != repr(other.advice):
            yield "advises differently with the same history and random seed", ""


def _misshapen(policy: Policy, situation: Situation, advice: Sequence[Any]) -> Iterator[Case]:
    """Advice of a wrong type, or about what is not there."""
    stations = len(situation.cover.stations) if situation.cover else 0
    wanted = {
        Assignment: {"task": len(situation.tasks), "responder": len(situation.responders)},
        Announcement: {"task": len(situation.tasks)},
        Relocation: {"responder": len(situation.responders), "station": stations},
    }
    for piece in advice:
        if type(piece) not in wanted:
            yield "gives something that is no advice", f"a {type(piece).__name__} "
            continue
        if isinstance(piece, Announcement) and not policy.auctions:
            yield "announces a task without `auctions = True`", ""
        if isinstance(piece, Relocation) and not policy.relocates:
            yield "relocates somebody without `relocates = True`", ""
        for name, count in wanted[type(piece)].items():
            if not _is_place(place := getattr(piece, name), count):
                yield f"names a {name} that is not there", f"{place!r} of {count} "


def _is_place(place: object, count: int) -> bool:
    if isinstance(place, bool):
        return False
    try:
        return 0 <= operator.index(place) < count  # type: ignore[arg-type]
    except TypeError:
        return False


def _twice(advice: Sequence[Any]) -> Iterator[Case]:
    for name, kinds in {
        "responder": (Assignment, Relocation),
        "task": (Assignment, Announcement),
    }.items():
        places = [getattr(piece, name) for piece in advice if isinstance(piece, kinds)]
        for place in sorted({place for place in places if places.count(place) > 1})[:1]:
            yield f"uses a {name} twice", f"{name} {place} "


def _forbidden(policy: Policy, situation: Situation, advice: Sequence[Any]) -> Iterator[Case]:
    """Well-formed advice that the rules do not allow."""
    robots = 0
    for piece in advice:
        if isinstance(piece, Relocation):
            yield from _bad_move(situation, piece)
            continue
        task = situation.tasks[piece.task]
        if isinstance(piece, Announcement):
            if task.stage == "contain" or not task.due or task.auction or task.engaged is not None:
                yield "announces a task that is not to be announced", f"{_told(piece.task, task)} "
            continue
        who = situation.responders[piece.responder]
        robots += who.kind == "robot" and who.engaged is None
        if not np.isfinite(situation.eta[piece.task, piece.responder]):
            pair = f"responder {piece.responder} to task {piece.task} "
            yield "sends somebody who would never arrive", pair
        if task.engaged is not None:
            yield "gives a task that somebody is under way to", f"task {piece.task} "
        if who.engaged is not None and not policy.preempts:
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


def _told(place: int, task: Any) -> str:
    due = "" if task.due else ", not due"
    return f"task {place} ({task.stage}{due}, auction {task.auction or 'none'})"


def _contents(value: Any) -> dict[str, Any]:
    """All that a situation holds, arrays as they are now."""
    held: dict[str, Any] = {}
    for field in fields(value):
        inner = getattr(value, field.name)
        if isinstance(inner, np.ndarray):
            held[field.name] = (inner.shape, inner.tobytes())
        elif field.name == "cover" and inner is not None:
            held[field.name] = _contents(inner)
        else:
            held[field.name] = inner
    return held
