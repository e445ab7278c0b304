"""Identities that hold exactly for any numbers; the only tolerance is the clock's step.

One of them turns and shuffles instances: a policy must choose the same all the same.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.core.dispatch import Assignment, Responder, Situation, Task, load_policy
from dva_sim.kernel.streams import derive_seed
from dva_sim.simulation.timed import TimedRecording, build, simulate_timed
from dva_sim.validation.dispatch.batch_measures import Floats, Ints, extract_sample, many_servers

POLICIES = (
    "nearest_idle",
    "min_eta",
    "batch_optimal",
    "priority_eta",
    "preemptive",
    "operator_aware",
    "hazard_team",
)
INSTANCES = 50
Choice = set[tuple[int, str]]
Flags = NDArray[np.bool_]


def changed_choices(seed: int) -> Iterator[tuple[str, float]]:
    """Yield cases turned and reordered: neither north nor the order of a list may matter.

    How often each chooses otherwise once a place is turned and its team shuffled.
    """
    changed = dict.fromkeys(POLICIES, 0)
    rng = np.random.Generator(np.random.PCG64(seed))
    for _ in range(INSTANCES):
        events = 1 + int(rng.integers(6))
        units = 1 + int(rng.integers(6))
        goals = rng.uniform(0, 300, (events, 2))
        starts = rng.uniform(0, 300, (units, 2))
        severities = rng.random(events)
        robots = rng.random(units) < 0.4
        order = rng.permutation(units)
        angle = float(rng.uniform(0, 2 * math.pi))
        same = np.arange(units)
        for policy in POLICIES:
            before = _choice(policy, goals, starts, severities, robots=robots, order=same)
            there = _turned(goals, angle), _turned(starts, angle)
            after = _choice(policy, *there, severities, robots=robots, order=order)
            changed[policy] += before != after
    for policy, count in changed.items():
        yield f"of {INSTANCES} choices of {policy}: changed by turning and shuffling", float(count)


def _turned(points: Floats, angle: float) -> Floats:
    """Return the points rotated about somewhere far away, shape `(n, 2)`."""
    cosine = math.cos(angle)
    sine = math.sin(angle)
    turn = np.array([[cosine, -sine], [sine, cosine]])
    return np.asarray((points - [1000.0, -500.0]) @ turn.T)


def _choice(
    policy: str, goals: Floats, starts: Floats, severities: Floats, robots: Flags, order: Ints
) -> Choice:
    """Return assignments of a policy, by event number and responder."""
    tasks = tuple(
        Task(
            event=number + 1,
            kind="fire",
            stage="confirm",
            due=True,
            severity=float(severity),
            confidence=0.9,
            detected=float(number),
            waiting_since=float(number),
        )
        for number, severity in enumerate(severities)
    )
    team = tuple(Responder(f"unit-{n}", "robot" if robots[n] else "guard") for n in order)
    away = goals[:, None, :] - starts[None, order, :]
    distance = np.hypot(away[..., 0], away[..., 1])
    speed = np.where(robots[order], 0.5, 1.4)
    operators = int(robots.sum() + 1) // 2
    situation = Situation(
        now=20.0,
        tasks=tasks,
        responders=team,
        distance=distance,
        eta=distance / speed,
        operators=operators,
    )
    advice = load_policy(policy).advise(situation, np.random.Generator(np.random.PCG64(1)))
    sent = (piece for piece in advice if isinstance(piece, Assignment))
    return {(tasks[piece.task].event, team[piece.responder].device) for piece in sent}


Deviations = Iterator[tuple[str, float]]
"""Quantities checked, and their distance from the right value: always 0."""

SLACK_S = 1e-3  # tolerance for the sum of the clock's rounding errors [s]
TIMES = ("detected", "assigned", "departed", "arrived", "confirmed", "closed")
FACTOR = 8

_PLACES: dict[str, Any] = {
    "model": "timed",
    "area": {"width_m": 400, "height_m": 300},
    "responders": [
        {"name": "east", "base": [390, 150], "speed_mps": 1.5, "after": "return"},
        {"name": "west", "base": [10, 130], "speed_mps": 1.2, "after": "stay"},
        {"name": "gate", "base": [180, 5], "speed_mps": 1.1, "after": "return"},
    ],
    "demand": [
        {"kind": "fire", "severity": 0.8, "between": {"law": "exponential", "mean_s": 240}},
        {"kind": "flood", "severity": 0.3, "between": {"law": "gamma", "mean_s": 300, "shape": 2}},
    ],
    "horizon_s": 40_000,
    "drain": True,
}
for _stream in _PLACES["demand"]:
    _stream["look"] = {"law": "lognormal", "mean_s": 60, "spread": 0.5}


def check_identity(name: str, seed: int) -> list[tuple[str, float]]:
    """Check one of `IDENTITIES`; return the number of checks and the deviation.

    Args:
        name: Name of the identity.
        seed: Random seed of the check; the identity must hold for any.
    """
    return list(IDENTITIES[name](derive_seed("identity", name, seed)))


# --- one path, known from another calculation ------------------------------------------
def _first_come_first_served(seed: int) -> Deviations:
    """Compare waits with Kiefer and Wolfowitz's recursion, event by event."""
    for guards in (1, 2, 5):
        scenario = {
            "model": "timed",
            "responders": [{"name": "guard", "count": guards}],
            "demand": [{"between": {"law": "exponential", "mean_s": 1.2 / guards}}],
            "horizon_s": 1000 / guards,
            "drain": True,
        }
        scenario["demand"][0]["look"] = {"law": "gamma", "mean_s": 1, "shape": 0.5}  # type: ignore[index]
        sample = extract_sample(_run(scenario, seed))
        waits = many_servers(sample.detected, sample.confirmed - sample.arrived, guards)
        off = abs(sample.assigned - sample.detected - waits).max()
        yield f"waits with {guards} guards against Kiefer and Wolfowitz [s]", _beyond(off)


def _conservation(seed: int) -> Deviations:
    """Count events that do not have exactly one end."""
    scenario = copy.deepcopy(_PLACES)
    scenario["responders"][0] |= {"kind": "robot"}
    scenario["operators"] = {"count": 1}
    scenario["demand"][0] |= {"patience": {"law": "exponential", "mean_s": 400}}
    scenario["demand"][1] |= {"false_share": 0.3, "repeats": {"share": 0.2, "after": 20}}
    scenario["dispatch"] = {"containment": True, "escalate_after_s": 600, "most_waiting": 4}
    for policy in ("min_eta", "preemptive", "hazard_team", "auction"):
        scenario["dispatch"]["policy"] = policy
        run = _run(scenario, seed)
        open_ = sum(run.count(o) for o in ("unnoticed", "pending", "assigned", "on scene"))
        lost = abs(run.events - run.count()) + open_ + sum(run.violations.values())
        yield f"events lost, open or twice, rules broken, with {policy}", float(lost)


# --- the same world, seen otherwise ----------------------------------------------------
def _time_scaling(seed: int) -> Deviations:
    """Compare moments 8 times as late with a run in which everything is 8 times as slow."""
    scenario = copy.deepcopy(_PLACES)
    scenario["dispatch"] = {"policy": "priority_eta", "options": {"ageing_per_s": 0.002}}
    scenario["dispatch"]["escalate_after_s"] = 900
    slow = _run(_slower(scenario), seed)
    off = _apart(_run(scenario, seed), slow, FACTOR)
    yield f"moments with everything {FACTOR} times as slow [s]", _beyond(off)


def _relabelling(seed: int) -> Deviations:
    """Compare runs under other names, and another order of the same responders."""
    plain = _run(_PLACES, seed)
    named = copy.deepcopy(_PLACES)
    for number, group in enumerate(named["responders"]):
        group["name"] = f"post-{number}"
    yield "moments with other names [s]", _beyond(_apart(plain, _run(named, seed)))
    turned = _PLACES | {"responders": _PLACES["responders"][::-1]}
    yield "moments in another order of guards [s]", _beyond(_apart(plain, _run(turned, seed)))


# --- better and worse ------------------------------------------------------------------
def _best_of_all(seed: int) -> Deviations:
    """Compare all events at once: the best assignment is never worse than the nearest first."""
    ways: dict[str, dict[str, Any]] = {
        "straight ways": {"area": {"width_m": 100, "height_m": 100}},
        "ways by chance": {"travel": {"law": "exponential", "mean_s": 60}},
    }
    for name, ground in ways.items():
        base = {"base": "random"} if "area" in ground else {}
        scenario = ground | {
            "model": "timed",
            "responders": [{"name": "guard", "count": 6, "from_s": 1} | base],
            "demand": [{"batch": {"count": 5}}],
            "horizon_s": 10,
            "drain": True,
        }
        worse = 0
        for trial in range(40):
            totals = [
                _total_way(_run(scenario | {"dispatch": {"policy": policy}}, seed + trial))
                for policy in ("batch_optimal", "nearest_idle", "min_eta")
            ]
            worse += totals[0] > min(totals[1:]) + SLACK_S
        yield f"of 40 days with {name}: batch_optimal worse than nearest first", float(worse)


def _oracle(seed: int) -> Deviations:
    """Compare sums of responses with those of a clairvoyant policy."""
    scenario = _PLACES | {"max_events": 6, "horizon_s": 10_000, "drain": False}
    scenario["responders"] = [g | {"after": "return"} for g in _PLACES["responders"][:2]]
    scenario["demand"] = [
        stream | {"between": {"law": "exponential", "mean_s": 150}} for stream in _PLACES["demand"]
    ]
    others = ("nearest_idle", "min_eta", "batch_optimal", "priority_eta", "random")
    worse = dict.fromkeys(others, 0)
    for trial in range(20):
        best = _total_way(
            _run(scenario | {"dispatch": {"policy": "oracle"}}, seed + trial), since="detected"
        )
        for policy in others:
            run = _run(scenario | {"dispatch": {"policy": policy}}, seed + trial)
            worse[policy] += best > _total_way(run, since="detected") + SLACK_S
    for policy, count in worse.items():
        yield f"of 20 small days: the oracle worse than {policy}", float(count)


IDENTITIES: dict[str, Callable[[int], Deviations]] = {
    "first come, first served": _first_come_first_served,
    "conservation": _conservation,
    "time scaling": _time_scaling,
    "relabelling": _relabelling,
    "rotation": changed_choices,
    "best assignment": _best_of_all,
    "oracle": _oracle,
}


# --- helpers ---------------------------------------------------------------------------
def _run(scenario: dict[str, Any], seed: int) -> TimedRecording:
    return simulate_timed(build(scenario), seed)


def _beyond(off: float) -> float:
    """Return the deviation that the clock's step does not explain."""
    return float(off) if off > SLACK_S else 0.0


def _slower(node: Any, key: str = "") -> Any:
    """Return the scenario with every time `FACTOR` times as long, and every pace as slow."""
    if isinstance(node, dict):
        return {name: _slower(value, name) for name, value in node.items()}
    if isinstance(node, list):
        return [_slower(item, key) for item in node]
    if key.endswith(("_mps", "_per_s")):
        return node / FACTOR
    return node * FACTOR if key.endswith("_s") else node


def _apart(one: TimedRecording, other: TimedRecording, factor: float = 1.0) -> float:
    """Return the largest difference between the moments of two runs [s].

    Infinite if events differ.
    """
    if one.events != other.events:
        return np.inf
    pairs = [(one.columns[name] * factor, other.columns[name]) for name in TIMES]
    if any((np.isnan(a) != np.isnan(b)).any() for a, b in pairs):
        return np.inf
    return max(float(np.nanmax(abs(a - b), initial=0.0)) for a, b in pairs)


def _total_way(run: TimedRecording, since: str = "assigned") -> float:
    return float((run.columns["arrived"] - run.columns[since]).sum())
