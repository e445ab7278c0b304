"""Measures cases of one version of the program, in a process of that version.

    runner.py COUNTER REPEATS INTO CASE...

Each case is measured in a process of its own, a copy of this one after what all drives need is
there; a line of JSON for each is added to the file INTO.
"""

from __future__ import annotations

import gc
import json
import os
import sys
import time
import traceback
from collections.abc import Iterator
from contextlib import redirect_stdout, suppress
from pathlib import Path
from typing import Any

TESTS = str(Path(__file__).parents[1])


def measured(name: str, counter: Any, repeats: int) -> dict[str, Any]:
    """Cost of one unit of a case: instructions, and the least CPU time of several repeats [s]."""
    from benchmarks.cases import CASES

    work = CASES[name].prepare()
    work()
    gc.collect()
    units, instructions = counter.count(work)
    values: dict[str, Any] = {"case": name}
    if instructions is not None:
        values["instructions"] = instructions / units
    if repeats:
        values["cpu_s"] = min(spent(work) for _ in range(repeats))
    return values


def spent(work: Any) -> float:
    """CPU time of a unit [s]."""
    began = time.process_time()
    units: float = work()
    return (time.process_time() - began) / units


def in_a_copy(name: str, counter: str, repeats: int, into: Path) -> None:
    """Measure one case in a copy of this process; an error is recorded instead."""
    if copy := os.fork():
        _, status = os.waitpid(copy, 0)
        if status:
            reported = {"case": name, "error": f"crashed ({os.waitstatus_to_exitcode(status)})"}
            write(reported, into)
        return
    from benchmarks.counting import COUNTERS

    try:
        with open(os.devnull, "w") as nowhere, redirect_stdout(nowhere):  # noqa: PTH123
            reported = measured(name, COUNTERS[counter](), repeats)
    except BaseException as error:  # pytest's skip, too
        reported = {"case": name, "error": traceback.format_exception_only(error)[-1].strip()}
    write(reported, into)
    os._exit(0)


def write(row: dict[str, Any], into: Path) -> None:
    """Append the measurements of a case."""
    with into.open("a") as file:
        file.write(json.dumps(row) + "\n")


def read(into: Path) -> Iterator[dict[str, Any]]:
    """All measurements so far."""
    yield from (json.loads(line) for line in into.read_text().splitlines())


if __name__ == "__main__":
    sys.path.insert(1, TESTS)
    from benchmarks.cases import CASES, SECOND, warm

    if any(CASES[case].per == SECOND for case in sys.argv[4:]):
        with suppress(ImportError):  # each case tells what this version lacks
            warm()
    for case in sys.argv[4:]:
        in_a_copy(case, sys.argv[1], int(sys.argv[2]), Path(sys.argv[3]))
