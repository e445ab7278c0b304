"""The one fit of the operators: to the published experiment that the split calls `fit`, no other.

    python experiments/validation/fit_operators.py --jobs 2

Free are the traits in FREE, between their ends. The rule is fixed beforehand: POINTS sets of
medians fill that box evenly (Latin hypercube, on a logarithmic scale); as many MORE fill a smaller
box around the best; the best of all is taken. Its loss is known with a Monte Carlo error: that of
the same set with other persons, AGAIN times. A trait's band reaches over all sets whose loss is
within ERRORS such errors of the best.

Writes the medians into agents/people/operators.yaml, the bands into operators-bands.yaml beside it,
and everything that was tried into fit_operators.csv beside this script.
"""

from __future__ import annotations

import argparse
import csv
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from dva_sim.experiments.repeats import latin_hypercube
from dva_sim.experiments.validation.operators.experiments import EXPERIMENTS
from dva_sim.experiments.validation.operators.playing import Setting, play_experiments
from dva_sim.experiments.validation.operators.targets import (
    Line,
    lines_of,
    load_split,
    load_targets,
)
from dva_sim.streams import Streams

HERE = Path(__file__).parent
PEOPLE = HERE.parents[1] / "agents/people"

FREE = {"margin": (0.3, 1.0), "motor_noise": (0.02, 0.12), "hand_lag_s": (0.08, 0.20)}
FITTED = "tilt"  # the experiment
EXACTLY = ("S9/first-entry", "S9/dwell")  # drawn to their targets, the others into their bands
PERSONS, POINTS, MORE, AGAIN = 8, 24, 12, 4
SMALLER = 0.35  # a side of the smaller box, as a share of the whole one's
ERRORS = 2.0
SEED = 20_000  # other persons than any comparison has

Row = dict[str, Any]
Traits = dict[str, float]


def loss(lines: list[Line], setting: Setting) -> tuple[float, dict[str, float]]:
    """Sum of squares, each line by half the width of its band; and the values of the lines."""
    experiments = [e for e in EXPERIMENTS if e.name == FITTED]
    played = play_experiments(experiments, setting)
    values = experiments[0].measure(played[FITTED])
    return sum(miss(line, values[line.id]) ** 2 for line in lines), values


def miss(line: Line, value: float) -> float:
    """How far off a value is, in half widths of the band."""
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


def search(lines: list[Line], setting: Setting) -> list[Row]:
    """Everything that is tried, in order."""
    tried: list[Row] = []

    def attempt(stage: str, traits: Traits, seed: int = SEED) -> None:
        found, values = loss(lines, replace(setting, traits=traits, seed=seed))
        tried.append({"stage": stage, **traits, "seed": seed, "loss": found, **values})
        print(stage, traits, f"{found:.3f}", flush=True)

    for traits in points(FREE, POINTS, "wide"):
        attempt("wide", traits)
    for traits in points(around(medians_of(tried)), MORE, "near"):
        attempt("near", traits)
    best = medians_of(tried)
    for number in range(AGAIN):
        attempt("again", best, SEED + 1 + number)
    return tried


def medians_of(tried: list[Row]) -> Traits:
    """The best set."""
    best = min((row for row in tried if row["stage"] != "again"), key=lambda row: row["loss"])
    return {name: best[name] for name in FREE}


def bands_of(tried: list[Row]) -> dict[str, tuple[float, float]]:
    """From the lowest to the highest value of each trait in all sets that are about as good."""
    searched = [row for row in tried if row["stage"] != "again"]
    error = np.std([row["loss"] for row in tried if row["stage"] == "again"], ddof=1)
    limit = min(row["loss"] for row in searched) + ERRORS * error
    good = [row for row in searched if row["loss"] <= limit]
    print(f"{len(good)} of {len(searched)} sets have a loss of at most {limit:.3f}")
    return {n: (min(row[n] for row in good), max(row[n] for row in good)) for n in FREE}


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
    lines = [line for line in lines_of(load_targets(), split) if line.kind == "fitted"]
    workers = parser.parse_args().jobs
    setting = Setting(split.strategy, persons=PERSONS, quick=True, workers=workers)
    tried = search(lines, setting)
    write_down(tried)
    print("best:", medians_of(tried))


if __name__ == "__main__":
    main()
