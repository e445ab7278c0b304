"""The fit of the operators: to one of the published experiments that the split calls `fit`.

    python experiments/validation/fit_operators.py --jobs 2

Free are the traits in FREE, between their ends. The rule is fixed beforehand: POINTS sets of
medians fill that box evenly (Latin hypercube, on a logarithmic scale); as many MORE fill a smaller
box around the best of them. The smallest of so many noisy losses is small by chance as well, so it
decides nothing: the FINALISTS with the smallest are played again by AGAIN other groups of persons,
the same for each of them. Taken is the one with the smallest mean loss over these; its loss in the
search is not among them. A trait's band reaches over all finalists whose mean loss is within ERRORS
standard errors of the best one's, by the differences group by group. Who is no finalist has no
such difference, so bands are narrower than all that would do as well. In all that is
POINTS + MORE + FINALISTS x AGAIN = 60 plays of the experiment.

Writes the medians into agents/people/operators.yaml, the bands into operators-bands.yaml beside it,
and everything that was tried into fit_operators.csv beside this script, which keeps the last fit
only. Two fits were made before this rule, each by the smallest loss in the search:

1. margin 0.444, motor_noise 0.0985, hand_lag_s 0.100. The first comparison followed: 7 of 10
   held-out lines passed.
2. margin 0.454, motor_noise 0.0963, hand_lag_s 0.191, after three mechanisms were mended. The
   second comparison followed: 9 of 10.

The result of each comparison is in operators-history.csv; docs/explanation/validation.md tells what
had been seen before each.
"""

from __future__ import annotations

import argparse
import csv
import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.agents.operator.published import TargetLine, load_split, load_targets, target_lines
from dva_sim.experiments.study.factor_levels import latin_hypercube
from dva_sim.kernel.streams import Streams
from dva_sim.validation.operators.experiments import EXPERIMENTS, OperatorsSetting, play_experiments

HERE = Path(__file__).parent
PEOPLE = HERE.parents[1] / "agents/people"

FREE = {"margin": (0.3, 1.0), "motor_noise": (0.02, 0.12), "hand_lag_s": (0.08, 0.20)}
FITTED = "tilt"  # the experiment
EXACTLY = ("S9/first-entry", "S9/dwell")  # drawn to their targets, the others into their bands
PERSONS, POINTS, MORE = 8, 16, 8
FINALISTS, AGAIN = 6, 6
SMALLER = 0.35  # a side of the smaller box, as a share of the whole one's
ERRORS = 2.0
SEED = 20_000  # other persons than any comparison has

Floats = NDArray[np.float64]
Row = dict[str, Any]
Traits = dict[str, float]
Loss = Callable[[Traits, int], tuple[float, dict[str, float]]]
"""The loss of a set of medians with the persons of a seed, and the values of the lines."""


def loss(lines: list[TargetLine], setting: OperatorsSetting) -> tuple[float, dict[str, float]]:
    """Sum of squares, each line by half the width of its band; and the values of the lines."""
    experiments = [e for e in EXPERIMENTS if e.name == FITTED]
    played = play_experiments(experiments, setting)
    values = experiments[0].measure(played[FITTED])
    return sum(miss(line, values[line.id]) ** 2 for line in lines), values


def miss(line: TargetLine, value: float) -> float:
    """Distance of a value from the band's middle, in half widths."""
    assert line.low is not None
    assert line.high is not None
    half = 0.5 * (line.high - line.low)
    if line.id in EXACTLY:
        assert line.target is not None
        return (value - line.target) / half
    return max(line.low - value, 0.0, value - line.high) / half


def points(box: dict[str, tuple[float, float]], count: int, name: str) -> list[dict[str, float]]:
    """Sets of medians that fill a box evenly."""
    cube = latin_hypercube(count, len(box), Streams(SEED).fresh(name))
    low, high = np.log(list(box.values())).T
    values = np.exp(low + cube * (high - low))
    return [dict(zip(box, map(float, row), strict=True)) for row in np.round(values, 4)]


def around(best: dict[str, float]) -> dict[str, tuple[float, float]]:
    """A smaller box around a set, inside the whole one."""
    box = {}
    for name, (low, high) in FREE.items():
        half = 0.5 * SMALLER * math.log(high / low)
        middle = min(max(math.log(best[name]), math.log(low) + half), math.log(high) - half)
        box[name] = math.exp(middle - half), math.exp(middle + half)
    return box


def search(loss_of: Loss) -> list[Row]:
    """Everything that is tried, in order."""
    tried: list[Row] = []

    def attempt(stage: str, traits: Traits, seed: int = SEED) -> None:
        found, values = loss_of(traits, seed)
        tried.append({"stage": stage, **traits, "seed": seed, "loss": found, **values})
        print(stage, traits, f"{found:.3f}", flush=True)

    for traits in points(FREE, POINTS, "wide"):
        attempt("wide", traits)
    for traits in points(around(ranked(tried)[0]), MORE, "near"):
        attempt("near", traits)
    for traits in ranked(tried)[:FINALISTS]:
        for number in range(AGAIN):
            attempt("again", traits, SEED + 1 + number)
    return tried


def ranked(tried: list[Row]) -> list[Traits]:
    """The sets of the search, the smallest loss first."""
    rows = sorted((row for row in tried if row["stage"] != "again"), key=lambda row: row["loss"])
    return [{name: row[name] for name in FREE} for row in rows]


def finals(tried: list[Row]) -> tuple[list[Traits], Floats]:
    """The finalists, the smallest mean loss first, and their losses `(finalists, groups)`."""
    losses: dict[tuple[float, ...], list[float]] = {}
    for row in (row for row in tried if row["stage"] == "again"):
        losses.setdefault(tuple(row[name] for name in FREE), []).append(row["loss"])
    order = sorted(losses, key=lambda values: float(np.mean(losses[values])))
    sets = [dict(zip(FREE, values, strict=True)) for values in order]
    return sets, np.array([losses[values] for values in order])


def medians_of(tried: list[Row]) -> Traits:
    """The finalist with the smallest mean loss."""
    return finals(tried)[0][0]


def bands_of(tried: list[Row]) -> dict[str, tuple[float, float]]:
    """From the lowest to the highest value of each trait in finalists that are about as good."""
    sets, losses = finals(tried)
    more = losses - losses[0]
    error = more.std(axis=1, ddof=1) / math.sqrt(more.shape[1])
    good = [
        s for s, is_good in zip(sets, more.mean(axis=1) <= ERRORS * error, strict=True) if is_good
    ]
    print(f"{len(good)} of {len(sets)} finalists are about as good as the best")
    return {name: (min(s[name] for s in good), max(s[name] for s in good)) for name in FREE}


def put(path: Path, key: str, pattern: str, text: str) -> None:
    """Replace what stands in the line of a key of a YAML file."""
    before = path.read_text(encoding="utf-8")
    after, found = re.subn(rf"(?m)^(\s*{key}: ){pattern}", rf"\g<1>{text}", before)
    if not found:
        raise SystemExit(f"{path}: no line for {key}")
    path.write_text(after, encoding="utf-8")


def write_down(tried: list[Row]) -> None:
    """Medians and bands into their files, and what was tried into a table."""
    for name, median in medians_of(tried).items():
        put(PEOPLE / "operators.yaml", name, r"\{median: [\d.]+", f"{{median: {median:.3g}")
    for name, (low, high) in bands_of(tried).items():
        put(PEOPLE / "operators-bands.yaml", name, r"\[[^]]*\]", f"[{low:.3g}, {high:.3g}]")
    with (HERE / "fit_operators.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(tried[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(tried)


def main() -> None:
    """Fit, and write down what came out."""
    parser = argparse.ArgumentParser(description="Fit the operators' medians.")
    parser.add_argument("--jobs", type=int, default=2)
    split = load_split()
    lines = [line for line in target_lines(load_targets(), split) if line.kind == "fitted"]
    workers = parser.parse_args().jobs
    setting = OperatorsSetting(split.strategy, persons=PERSONS, quick=True, workers=workers)
    tried = search(lambda traits, seed: loss(lines, replace(setting, traits=traits, seed=seed)))
    write_down(tried)
    print("best:", medians_of(tried))


if __name__ == "__main__":
    main()
