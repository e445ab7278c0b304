"""Make `commands-over-middleware.csv.gz` of what the study `middleware` measured.

    dva-sim export results/middleware -o exported
    python experiments/traces/make_commands.py exported

A row is a command: over which middleware and link, in which run, when it was sent and when the
robot applied it [s], to 0.1 ms; empty if it never did. A run that found no connection has one row
without times.
"""

from __future__ import annotations

import csv
import gzip
import io
import sys
from collections.abc import Iterator
from pathlib import Path

OUT = Path(__file__).parent / "commands-over-middleware.csv.gz"
OF_RUN, TIMES = ("middleware", "link", "person"), ("made_s", "arrived_s")


def packed(folder: Path) -> bytes:
    """Both exported tables as one, by run and time, compressed."""
    rows = [(_run(row), *map(row.get, TIMES)) for row in _read(folder / "commands.csv")]
    connected = {run for run, *_ in rows}
    rows += [(run, "", "") for run in map(_run, _read(folder / "runs.csv")) if run not in connected]
    rows.sort(key=lambda row: (row[0], float(row[1] or 0.0)))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow((*OF_RUN, *TIMES))
    for run, *times in rows:
        writer.writerow((*run, *(f"{float(time):.4f}" if time else "" for time in times)))
    return gzip.compress(text.getvalue().encode(), mtime=0)


def _read(table: Path) -> Iterator[dict[str, str]]:
    with table.open(encoding="utf-8", newline="") as lines:
        yield from csv.DictReader(lines)


def _run(row: dict[str, str]) -> tuple[str, ...]:
    return tuple(row[key] for key in OF_RUN)


if __name__ == "__main__":
    OUT.write_bytes(packed(Path(sys.argv[1])))
