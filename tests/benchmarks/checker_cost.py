"""Cost of the safety checkers: CPU time of runs and storms with and without them."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from benchmarks.goals import goal

from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.safety_checks import SafetyAudit
from dva_sim.storms.campaign import play_seed
from dva_sim.storms.checkers import AnswerWatch, RefusedDrivers
from dva_sim.storms.storm import Storm

SEEDS = range(1, 4)
AUDIT = "sent", "delivered", "accepted", "by_hand", "moves", "shows"
CHECKERS: dict[type, tuple[str, ...]] = {
    SafetyAudit: AUDIT,
    Run: ("show_motions", "show_page"),
    Storm: ("_look_at_bounds", "_look_at_queues"),
    RefusedDrivers: ("arrives", "sent"),
    AnswerWatch: ("look",),
}


def nothing(*_: Any) -> None:
    pass


@contextmanager
def without_checkers() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        for kind, names in CHECKERS.items():
            for name in names:
                patch.setattr(kind, name, nothing)
        patch.setattr(AnswerWatch, "watch", lambda self, passing: passing.take(passing.payload))
        yield


def run(seed: int) -> None:
    Run(scenarios.build(scenarios.load("fire-drill")), seed).run()


def storm(seed: int) -> None:
    play_seed(seed, "all")


def cpu_s(act: Callable[[int], None], seed: int) -> float:
    """CPU time of one run [s]."""
    begun = time.process_time()
    act(seed)
    return time.process_time() - begun


def ratio_of(act: Callable[[int], None], most: float) -> None:
    """Play each seed with and without them, in turns; what counts is the median."""
    act(SEEDS[0])  # loads what is loaded once
    with_them, without = [], []
    for seed in SEEDS:
        with_them.append(cpu_s(act, seed))
        with without_checkers():
            without.append(cpu_s(act, seed))
    ratio = statistics.median(a / b for a, b in zip(with_them, without, strict=True))
    print(
        f"\n{act.__name__}: {statistics.median(with_them):.2f} s of CPU time with checkers, "
        f"{statistics.median(without):.2f} s without (medians of {len(SEEDS)} seeds)"
    )
    goal(f"a {act.__name__} with checkers over one without", ratio, most=most)


def runs(_: Path) -> None:
    """Measure a run with its checkers beside one without."""
    ratio_of(run, most=1.5)


def storms(_: Path) -> None:
    """Measure a storm with its checkers beside one without."""
    ratio_of(storm, most=1.6)
