"""Keep a comparison of the operators: its values become a column of operators-history.csv.

    dva-sim validate operators -o results/evidence
    python experiments/validation/keep_comparison.py eighth results/evidence/evidence.csv

The day of the comparison, what had been seen before it, and the publications that it saw blind are
written beforehand into operators-split.yaml, under its name.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

from dva_sim.agents.operator.published import load_split, load_targets, target_lines
from dva_sim.validation.evidence import read_evidence

HISTORY = Path(__file__).with_name("operators-history.csv")


def keep(name: str, evidence: Path, history: Path = HISTORY) -> None:
    """Add a column, and rows for lines that were in no comparison yet."""
    split = load_split()
    if name not in split.comparisons:
        raise SystemExit(f"operators-split.yaml has no comparison {name!r}: write it there first")
    ids = {line.id for line in target_lines(load_targets(), split)}
    values = {e.line: e.predicted for e in read_evidence(evidence) if e.line in ids}
    with history.open(encoding="utf-8", newline="") as file:
        reader = csv.DictReader(file)
        columns = list(reader.fieldnames or ())
        rows = {row["line"]: row for row in reader}
    if name in columns:
        raise SystemExit(f"comparison {name!r} is kept already: give this one another name")
    for line, value in values.items():
        rows.setdefault(line, {"line": line})[name] = f"{value:.6g}"
    with history.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, [*columns, name], restval="", lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows.values())


if __name__ == "__main__":
    keep(sys.argv[1], Path(sys.argv[2]))
