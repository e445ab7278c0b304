"""Situations small enough to see: ETA as rows, responders as letters."""

import re

import numpy as np

from dva_sim.core.dispatch import Assignment, Cover, Responder, Situation, Task

INF = float("inf")
RNG = np.random.default_rng(1)


def look(event=1, kind="flood", severity=0.5, since=0.0, **more):
    """A task to confirm."""
    values = {"severity": severity, "detected": since, "waiting_since": since, "confidence": 0.9}
    return Task(**{"event": event, "kind": kind, "stage": "confirm", "due": True} | values | more)


def act(event=1, kind="fire", due=True, severity=0.5):
    """A task to contain."""
    return look(event, kind, severity, stage="contain", due=due)


def situation(team, eta, tasks=None, now=100.0, operators=9, distance=None, **more):
    """Guards and robots as letters, such as "ggr"; "g3" is a guard under way to task 3."""
    kinds = {"g": "guard", "r": "robot"}
    responders = [
        Responder(f"{kinds[letter]}-{number}", kinds[letter], int(task) if task else None)
        for number, (letter, task) in enumerate(re.findall(r"([gr])(\d*)", team))
    ]
    shape = len(eta), len(responders)
    eta = np.array(eta, dtype=float).reshape(shape)
    distance = eta if distance is None else np.array(distance, dtype=float).reshape(shape)
    tasks = tuple(tasks or [look(number) for number in range(1, len(eta) + 1)])
    for array in (eta, distance):
        array.setflags(write=False)
    return Situation(
        now=now,
        tasks=tasks,
        responders=tuple(responders),
        distance=distance,
        eta=eta,
        operators=operators,
        **more,
    )


def cover(eta, reach, demand, bound_for=()):
    """Stations by number."""
    names = tuple(f"station-{number}" for number in range(len(reach)))
    eta, reach, demand = (np.array(x, dtype=float) for x in (eta, reach, demand))
    return Cover(names, eta, reach, demand, bound_for or (None,) * len(eta))


def pairs(policy, seen):
    """Assignments as pairs (task, responder)."""
    advice = policy.advise(seen, RNG)
    return [(a.task, a.responder) for a in advice if isinstance(a, Assignment)]


def total_eta(seen, chosen):
    return sum(float(seen.eta[task, responder]) for task, responder in chosen)
