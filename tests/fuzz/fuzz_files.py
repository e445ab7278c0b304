"""Search for files that the program reads with a traceback, for ever, or into other folders.

    python tests/fuzz/fuzz_files.py --count 2000 --seed 7           # or: make fuzz COUNT= SEED=
    python tests/fuzz/fuzz_files.py --only manifest --count 200     # one reader

Each mutant is read in a process of its own, which is a copy of one that has loaded all modules;
what is valid is then used. Limits: 5 s of processor or sleep, 500 MB, one line of ours and its exit
code, nothing beside its folder, and nothing active in what is printed or written.
"""

from __future__ import annotations

import argparse
import io
import os
import resource
import shlex
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from random import Random

sys.path.insert(0, str(Path(__file__).parents[1]))

from fuzz import mutations
from fuzz.readers import Reader, readers

MOST_LETTERS = 600  # of a line for people
MOST_CPU_S, MOST_WALL_S, MOST_MB = 5, 60, 500
OWN_MB = 250  # of it for the mutant: a process that has run much before begins with more
CONTROLS = {chr(n) for n in (*range(9), 11, 12, *range(14, 32), 127)}
CONTROLS |= {chr(n) for n in (*range(0x202A, 0x202F), *range(0x2066, 0x206A))}
PRELOADED = """
    dva_sim.cli.program dva_sim.cli.checks dva_sim.testing.file_kinds dva_sim.testing.evidence
    dva_sim.experiments.report.report dva_sim.worlds.view dva_sim.recordings.reading
    dva_sim.experiments.report.terminal dva_sim.simulation.models dva_sim.cli.stories duckdb
"""


@dataclass(frozen=True)
class Mutant:
    """One damaged file.

    Attributes:
        reader: Reader that it is for.
        number: Number of the mutant, which with the seed gives it again.
        data: Content of the file.
        sample: Sample that it was made of.
    """

    reader: Reader
    number: int
    data: bytes
    sample: Path


def mutants(table: Sequence[Reader], folder: Path, count: int, seed: int) -> Iterator[Mutant]:
    """Yield damaged files of all readers, by their weights."""
    samples = {reader.name: reader.samples(folder / reader.name) for reader in table}
    for number in range(count):
        rng = Random(f"{seed}/{number}")
        reader = rng.choices(table, [reader.weight for reader in table])[0]
        sample = rng.choice(samples[reader.name])
        yield Mutant(reader, number, reader.mutate(sample.read_bytes(), rng), sample)


def use(mutant: Mutant, folder: Path) -> str:
    """Read a mutant, and use it if it is valid; what is wrong with how that went, or nothing."""
    from dva_sim.cli.program import call
    from dva_sim.kernel.errors import ConfigError, error_line

    reader = mutant.reader
    if reader.read is not None:
        try:
            said = str(reader.read(mutant.data) or "")
        except reader.refuses as error:
            said = error_line(error) if isinstance(error, ConfigError) else str(error)
            if len(said) > MOST_LETTERS or "\n" in said:
                return f"refuses with {len(said)} characters: {said[:200]!r}"
        return _active(said)
    place = folder / "place"
    shutil.copytree(mutant.sample.parent, place)
    file = place / mutant.sample.name
    file.write_bytes(mutant.data)
    for words in reader.uses:
        out, errors = io.StringIO(), io.StringIO()
        with chdir(place), redirect_stdout(out), redirect_stderr(errors):
            code = call(shlex.split(words.format(file, folder=place)))
        said = errors.getvalue()
        if code not in (0, 1, 2, 3, 5):
            return f"{words}: exit code {code}"
        if code in (2, 3) and "error: " not in said:
            return f"{words}: exit code {code} without a line of ours"
        if "Traceback" in said or "Warning" in said or said.count("error: ") > 1:
            return f"{words}: says {said[-600:]!r}"
        if longest := max((line for line in said.split("\n")), key=len)[MOST_LETTERS:]:
            return f"{words}: says a line of {len(longest)} letters more than one can read"
        if problem := _active(out.getvalue() + said):
            return f"{words}: prints {problem}"
        if code:
            return ""
    for path in place.rglob("*"):
        if path.suffix in (".html", ".csv", ".svg") and (problem := _active_in(path)):
            return f"{path.name} has {problem}"
    beside = [path.name for path in folder.iterdir() if path != place]
    return f"writes beside its folder: {beside}" if beside else ""


def _active(text: str) -> str:
    found = sorted(CONTROLS & set(text))
    return f"control characters {found}" if found else ""


def _active_in(path: Path) -> str:
    text = path.read_text(errors="replace")
    if path.suffix == ".csv":
        cells = [cell.lstrip('"') for line in text.split("\n") for cell in line.split(",")]
        return "a formula" if any(c.startswith("=HYPERLINK") for c in cells) else _active(text)
    return "active markup" if mutations.MARKUP in text else _active(text)


def judge(mutant: Mutant, folder: Path) -> str:
    """Use a mutant in a child process; what is wrong, or nothing."""
    folder.mkdir()
    most_mb = max(MOST_MB, _resident_mb() + OWN_MB)
    reading, writing = os.pipe()
    child = os.fork()
    if not child:
        _in_child(mutant, folder, writing)
    os.close(writing)
    status, usage = _waited(child)
    with os.fdopen(reading, "rb") as pipe:
        said = pipe.read().decode(errors="replace")
    shutil.rmtree(folder)
    if os.WIFSIGNALED(status):
        name = signal.Signals(os.WTERMSIG(status)).name
        return f"takes more than {MOST_CPU_S} s of processor, or hangs ({name})"
    if usage.ru_maxrss > most_mb * 1000:
        return f"takes {usage.ru_maxrss / 1000:.0f} MB"
    return said


def _resident_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e6


def _waited(child: int) -> tuple[int, resource.struct_rusage]:
    end = time.monotonic() + MOST_WALL_S
    while time.monotonic() < end:
        found, status, usage = os.wait4(child, os.WNOHANG)
        if found:
            return status, usage
        time.sleep(0.002)
    os.kill(child, signal.SIGKILL)
    return os.wait4(child, 0)[1:]


class SleepsTooLong(BaseException):
    """A reader that keeps its user waiting without working."""


def _limit_sleep() -> None:
    """Let those who sleep for longer than is allowed, all in all, fail at once."""
    sleep, slept = time.sleep, 0.0

    def sleep_for(seconds: float) -> None:
        nonlocal slept
        slept += seconds
        if slept > MOST_CPU_S:
            raise SleepsTooLong(f"sleeps for more than {MOST_CPU_S} s")
        sleep(seconds)

    time.sleep = sleep_for


def _in_child(mutant: Mutant, folder: Path, pipe: int) -> None:
    _limit_sleep()
    try:
        resource.setrlimit(resource.RLIMIT_CPU, (MOST_CPU_S, MOST_CPU_S + 1))
        said = use(mutant, folder)
    except BaseException as error:
        said = "".join(traceback.format_exception(error)[-3:])
    with os.fdopen(pipe, "wb") as out:
        out.write(said.encode(errors="replace"))
    os._exit(0)


def search(
    table: Sequence[Reader], count: int, seed: int, keep: Path | None = None
) -> dict[str, list[str]]:
    """Judge mutants; the faults of each reader. Files that fail are kept in a folder."""
    for name in PRELOADED.split():
        __import__(name)
    faults: dict[str, list[str]] = {}
    tally = Counter[str]()
    with tempfile.TemporaryDirectory() as folder:
        for mutant in mutants(table, Path(folder, "samples"), count, seed):
            tally[mutant.reader.name] += 1
            said = judge(mutant, Path(folder, "used"))
            if said:
                faults.setdefault(mutant.reader.name, []).append(f"{mutant.number}: {said}")
                if keep is not None:
                    keep.mkdir(exist_ok=True, parents=True)
                    name = f"{mutant.reader.name}-{mutant.number}-{mutant.sample.name}"
                    keep.joinpath(name).write_bytes(mutant.data)
    print(f"{count} mutants: {dict(tally)}")
    return faults


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="names of readers, with commas")
    parser.add_argument("--keep", type=Path, help="folder for files that fail")
    args = parser.parse_args()
    wanted = [name for name in args.only.split(",") if name]
    table = [reader for reader in readers() if not wanted or reader.name in wanted]
    began = time.monotonic()
    faults = search(table, args.count, args.seed, args.keep)
    for name, texts in faults.items():
        for text in texts:
            print(f"{name} {text}")
    number = sum(map(len, faults.values()))
    print(f"{number} faults, {args.count / (time.monotonic() - began):.1f} mutants a second")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
