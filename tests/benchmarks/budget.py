"""Check that the program costs no more and no less than `budgets.csv` says.

    budget.py                     check every budget; the exit code is 1 if one is missed
    budget.py --reason "TEXT"     write what was measured into the rows that are missed

A budget is a ratio to the instructions of a fixed loop, so that a faster interpreter changes
little; memory is in MB. That little is still several per cent between builds of Python. If the
loop shows that another build is at work than wrote the file, the version that landed last is
measured here as well, and each budget moves with what that version costs. Under the build that
wrote the file, the file is the record of the version that landed last.
"""

from __future__ import annotations

import argparse
import csv
import os
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path.insert(1, str(ROOT / "tests"))

from benchmarks import meter, startup  # noqa: E402
from benchmarks.cases import CASES, LOOP  # noqa: E402
from benchmarks.counting import Nothing, available, pinned  # noqa: E402
from helpers.processes.other_version import end_with_signals, version  # noqa: E402

FILE = Path("tests/benchmarks/budgets.csv")
TOLERANCE = 0.03  # share by which a cost may differ from its budget
OF_MEMORY = 0.05  # likewise: in another folder the same version takes 2 % more, or less
SAME_BUILD = 0.005  # share by which the loop's instructions differ under one build of Python
UNITS = "loops", "MB", "instructions"
MAIN = "origin/main", "main"
STUDY = "a small study"
STUDY_WORDS = (
    "run told-no --jobs 1 --set persons=2 --set link.delay_s=[0.25]"
    " --set disturbance.kind=[revoke] --set pattern=[latest-wins,req-rep]"
)

Costs = dict[str, float]


@dataclass(frozen=True)
class Budget:
    """Row of the file.

    Attributes:
        case: Name of a case, a command's start or the study.
        unit: "loops" (instructions over those of the fixed loop), "MB", or, of the loop itself,
            "instructions".
        budget: Cost of one unit of the case.
        reason: Why it is as high as it is.
    """

    case: str
    unit: str
    budget: float
    reason: str


def read(file: Path) -> dict[str, Budget]:
    """Budgets of a file by their case.

    Raises:
        ValueError: a row has no positive budget, no reason, an unknown unit, or comes twice.
    """
    budgets: dict[str, Budget] = {}
    with file.open(newline="") as rows:
        for number, row in enumerate(csv.DictReader(rows), 2):
            budget = Budget(row["case"], row["unit"], float(row["budget"]), row["reason"].strip())
            wrong = {
                f"unit {budget.unit!r}; write {', '.join(UNITS)}": budget.unit not in UNITS,
                "budget must be above 0": not budget.budget > 0,
                "no reason; say why it costs that": not budget.reason,
                f"{budget.case!r} has a budget already": budget.case in budgets,
            }
            for mistake in (text for text, found in wrong.items() if found):
                raise ValueError(f"{file}:{number}: {mistake}")
            budgets[budget.case] = budget
    return budgets


def write(file: Path, budgets: Mapping[str, Budget]) -> None:
    """Write a file that `read` reads."""
    with file.open("w", newline="") as rows:
        writer = csv.DictWriter(rows, [field.name for field in fields(Budget)], lineterminator="\n")
        writer.writeheader()
        for budget in budgets.values():
            writer.writerow(asdict(budget) | {"budget": f"{budget.budget:.5g}"})


# --- measured ----------------------------------------------------------------------------------


def costs(root: Path, names: Mapping[str, Budget], counter: str) -> Costs:
    """Costs of the version in a folder, in the units of their budgets.

    Raises:
        RuntimeError: a case crashed.
    """
    runs = [name for name in names if name in CASES]
    starts = [name for name in names if name.startswith(startup.PREFIX)]
    starts.sort(key=lambda name: -names[name].budget)
    with ThreadPoolExecutor(os.cpu_count()) as pool:  # the longest first
        jobs = [pool.submit(meter.figures, root, runs, counter, 0)]
        for name in starts:
            command = [name.removeprefix(startup.PREFIX)]
            jobs.append(pool.submit(meter.started, root, command, counter, repeats=1))
        # The first time it may have to compile modules, which takes memory of its own.
        peak_mb = min(study_peak_mb(root) for _ in range(2)) if STUDY in names else 0.0
        figures = {name: entry for job in jobs for name, entry in job.result().items()}
    for name, entry in figures.items():
        if "error" in entry:
            raise RuntimeError(f"{name}: {entry['error']}")
    instructions: Costs = {name: entry["instructions"] for name, entry in figures.items()}
    loop = instructions[LOOP]
    units = {"loops": loop, "instructions": 1.0}
    ratios = {name: cost / units[names[name].unit] for name, cost in instructions.items()}
    return ratios | ({STUDY: peak_mb} if STUDY in names else {})


def study_peak_mb(root: Path) -> float:
    """Peak memory of the largest process of a small study [MB]."""
    with tempfile.TemporaryDirectory() as folder:
        asked = [*shlex.split(STUDY_WORDS), "-o", f"{folder}/results"]
        words = [sys.executable, "-P", "-m", "dva_sim.cli", *asked]
        return startup.started(words, pinned() | {"PYTHONPATH": str(root)}).peak_mb


def landed() -> str:
    """The last commit that landed on the main branch, other than this version.

    Raises:
        LookupError: Git does not know any.
    """

    def answer(*words: str) -> str:
        asked = subprocess.run([*meter.GIT, *words], capture_output=True, text=True, check=False)
        return asked.stdout.strip() if not asked.returncode else ""

    head = answer("rev-parse", "HEAD")
    for branch in MAIN:
        if (base := answer("merge-base", "HEAD", branch)) and base != head:
            return base
    if before := answer("rev-parse", "--verify", meter.parent()):
        return before
    raise LookupError("Git knows no version before this one")


def moved(
    ours: Mapping[str, Budget], theirs: Mapping[str, Budget], here: Costs
) -> dict[str, Budget]:
    """Budgets for this build of Python.

    Args:
        ours: Budgets of this version.
        theirs: Budgets of the version that landed last.
        here: Costs of that version under this build.
    """
    return {
        name: replace(budget, budget=budget.budget / theirs[name].budget * here[name])
        for name, budget in ours.items()
        if name in theirs and name in here
    }


# --- judged ------------------------------------------------------------------------------------


def missed(budgets: Mapping[str, Budget], measured: Costs) -> Iterator[str]:
    """Names of cases that cost more than they may, or so much less that the budget says little."""
    for name, budget in budgets.items():
        most = OF_MEMORY if budget.unit == "MB" else TOLERANCE
        if name != LOOP and abs(measured[name] / budget.budget - 1) > most:
            yield name


def lines(budgets: Mapping[str, Budget], measured: Costs) -> Iterator[str]:
    """The table, and what to do about each budget that is missed."""
    yield f"{'':38}{'budget':>12}{'now':>12}{'change':>12}"
    for name, budget in budgets.items():
        numbers = f"{budget.budget:12.4g}{measured[name]:12.4g}"
        yield f"{name:38}{numbers}{meter.change(measured[name], budget.budget):>12} {budget.unit}"
    for name in missed(budgets, measured):
        now, most = measured[name], budgets[name].budget
        dearer = f"costs {now:.4g} {budgets[name].unit}, its budget is {most:.4g}"
        todo = "make it cheaper, or raise the budget" if now > most else "lower the budget"
        yield f"{name}: {dearer} ({meter.change(now, most)}): {todo} in {FILE} and say why"


def rewritten(
    recorded: Mapping[str, Budget], budgets: Mapping[str, Budget], measured: Costs, *, reason: str
) -> dict[str, Budget]:
    """The file's budgets, changed by as much as each was missed, with a reason.

    Args:
        recorded: Budgets of the file.
        budgets: The same for this build of Python.
        measured: Costs under this build.
        reason: Why those that were missed are what they are now.
    """
    changed = dict(recorded)
    for name in missed(budgets, measured):
        share = measured[name] / budgets[name].budget
        changed[name] = replace(recorded[name], budget=recorded[name].budget * share, reason=reason)
    return changed


def for_this_build(budgets: Mapping[str, Budget], counter: str) -> Mapping[str, Budget]:
    """Budgets that the version that landed last gives under a build that did not write the file."""
    try:
        commit = landed()
    except LookupError as error:
        print(f"another build of Python than wrote {FILE}, and {error}: growth is only rough")
        return budgets
    print(f"another build of Python than wrote {FILE}: beside {commit[:8]}", flush=True)
    with version(commit) as other:
        theirs = read(other / FILE) if (other / FILE).exists() else budgets
        common = {name: budget for name, budget in budgets.items() if name in theirs}
        here = costs(other, common, counter)
    return moved(budgets, theirs, here)


def main() -> int:
    """Check the budgets and tell; the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--reason", default="", help="write what was measured, with this reason")
    asked = parser.parse_args()
    end_with_signals()
    counter, why = available()
    if counter == Nothing.name:
        print(f"budgets are not checked: {why}")
        return 0
    recorded = budgets = read(ROOT / FILE)
    measured = costs(ROOT, budgets, counter)
    if abs(measured[LOOP] / recorded[LOOP].budget - 1) > SAME_BUILD:
        budgets = for_this_build(recorded, counter)
    for line in lines(budgets, measured):
        print(line)
    if asked.reason:
        write(ROOT / FILE, rewritten(recorded, budgets, measured, reason=asked.reason))
        return 0
    return 1 if any(missed(budgets, measured)) else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except (RuntimeError, ValueError) as error:
        sys.exit(f"error: {error}")
