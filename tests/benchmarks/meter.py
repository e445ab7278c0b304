"""Cost of the program: instructions, which are free of noise, and CPU time.

    meter.py                      this version beside its parent
    meter.py --against COMMIT     beside another one
    meter.py --only WORD          cases whose name has the word, such as drive or start-up

Both versions are measured by this list of cases and by the same interpreter. A case that one of
them cannot do is reported as such. Under callgrind a command's start and the report are counted
only where --only names them, since that takes minutes; their CPU time is always there.
"""

from __future__ import annotations

import argparse
import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
sys.path.insert(1, str(ROOT / "tests"))

from benchmarks import runner, startup  # noqa: E402
from benchmarks.cases import CASES, RATIOS  # noqa: E402
from benchmarks.counting import FOLDER, Callgrind, Nothing, available, pinned  # noqa: E402
from helpers.processes.other_version import end_with_signals, output, version  # noqa: E402

REPEATS = 5
GIT = ["git", "-C", str(ROOT)]
Figures = dict[str, dict[str, Any]]


def parent() -> str:
    """The commit that this version is made from."""
    changed = subprocess.run([*GIT, "diff", "--quiet", "HEAD"], check=False).returncode
    return "HEAD" if changed else "HEAD~1"


def figures(root: Path, names: Sequence[str], counter: str, repeats: int) -> Figures:
    """Costs of cases in the version in a folder."""
    with tempfile.TemporaryDirectory() as folder:
        into = Path(folder) / "results"
        into.touch()
        under = Callgrind.words(Path(folder)) if counter == Callgrind.name else []
        program = [sys.executable, runner.__file__, counter, str(repeats), str(into), *names]
        environment = pinned() | {"PYTHONPATH": str(root), FOLDER: folder}
        output([*under, *program], env=environment, cwd=root)
        return {entry["case"]: entry for entry in runner.read(into)}


def measured(roots: Sequence[Path], names: Sequence[str], counter: str) -> list[Figures]:
    """Costs of cases in each version: long ones counted side by side, others timed in turns."""
    if counter != Callgrind.name:
        return [figures(root, names, counter, REPEATS) for root in roots]
    brief = [name for name in names if len(names) == 1 or not CASES[name].takes_long]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        counted = list(pool.map(lambda root: figures(root, brief, counter, 0), roots))
    timed = [figures(root, names, Nothing.name, REPEATS) for root in roots]
    return [
        {name: entry | known.get(name, {}) for name, entry in times.items()}
        for known, times in zip(counted, timed, strict=True)
    ]


def started(
    root: Path, names: Iterable[str], counter: str, *, repeats: int = startup.REPEATS
) -> Figures:
    """Costs of commands in the version in a folder."""
    environment = pinned() | {"PYTHONPATH": str(root)}
    reports = [
        startup.measured(name, counter, root, environment, repeats=repeats) for name in names
    ]
    return {each["case"]: each for each in reports}


# --- told --------------------------------------------------------------------------------------

UNITS = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""))


def count(number: float | None) -> str:
    """A number of instructions, with three digits or more."""
    if number is None:
        return "-"
    scale, letter = next(unit for unit in UNITS if number >= unit[0] or unit[0] == 1.0)
    return f"{number / scale:.2f} {letter}".rstrip()


def change(ours: float | None, theirs: float | None) -> str:
    """By how much ours is more [%]."""
    return f"{100 * (ours / theirs - 1):+.1f} %" if ours and theirs else ""


def milliseconds(seconds: float | None) -> str:
    return "-" if seconds is None else f"{1e3 * seconds:.3g}"


def lines(ours: Figures, theirs: Figures) -> Iterator[str]:
    """The table."""
    head = ("per", "instructions", "before", "change", "CPU ms", "before")
    yield f"{'':38}{head[0]:>13}" + "".join(f"{word:>13}" for word in head[1:])
    for name, here in ours.items():
        unit = CASES[name].per if name in CASES else "start"
        if "error" in here:
            yield f"{name:38}{unit:>13}  {here['error']}"
            continue
        there: Mapping[str, Any] = theirs.get(name, {})
        counts = here.get("instructions"), there.get("instructions")
        cells = count(counts[0]), count(counts[1]), change(*counts)
        cells += milliseconds(here.get("cpu_s")), milliseconds(there.get("cpu_s"))
        yield f"{name:38}{unit:>13}" + "".join(f"{cell:>13}" for cell in cells)
    for name, there in theirs.items():
        if "error" in there:
            yield f"before, {name}: {there['error']}"


def ratios(found: Figures) -> Iterator[str]:
    """Ratios of costs, in instructions or else in time."""
    for what, names in RATIOS.items():
        for measure in ("instructions", "cpu_s"):
            above, below = (found.get(name, {}).get(measure) for name in names)
            if above and below:
                yield f"{what}: {above / below:.2f}"
                break


def echo(root: Path) -> str:
    """A command over sockets beside a bare echo; by the clock, since both wait for each other."""
    program = [sys.executable, str(ROOT / "tests/benchmarks/echo.py"), "compare"]
    environment = pinned() | {"PYTHONPATH": f"{root}{os.pathsep}{ROOT / 'tests'}"}
    return output(program, env=environment, cwd=root).strip()


def main() -> int:
    """Measure and tell; the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--against", metavar="COMMIT", default="")
    parser.add_argument("--only", metavar="WORD", default="")
    asked = parser.parse_args()
    end_with_signals()
    counter, why = available()
    against = asked.against or parent()
    print(f"Python {platform.python_version()} ({platform.python_compiler()}), {sys.executable}")
    print(f"counted by {counter}" + (f"; {why}" if why else ""), flush=True)
    names = [name for name in CASES if asked.only in name]
    starts = [name for name in startup.COMMANDS if asked.only in startup.PREFIX + name]
    by = counter if asked.only or counter != Callgrind.name else Nothing.name
    if not names and not starts:
        parser.error(f"no case has {asked.only!r} in its name; see tests/benchmarks/cases.py")
    with version(against) as other:
        roots = ROOT, other
        ours, theirs = measured(roots, names, counter) if names else ({}, {})
        ours, theirs = ours | started(ROOT, starts, by), theirs | started(other, starts, by)
    print(f"beside {against}, which is meant by `before`\n")
    for line in (*lines(ours, theirs), "", *ratios(ours)):
        print(line)
    if not asked.only:
        print(echo(ROOT))
    crashed = {name for name, entry in ours.items() if "error" in entry}
    return 1 if crashed - {name for name, case in CASES.items() if case.optional} else 0


if __name__ == "__main__":
    sys.exit(main())
