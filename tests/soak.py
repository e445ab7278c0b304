"""Hours of live runs under load, with faults and visitors, and what their processes take.

    make soak HOURS=2 SEED=1       two hours, one after the other, of the same processes
    make soak HOURS=1 HOUR=7       what happened in the seventh hour, to processes that begin

A live run of three robots keeps its state; a second one stands in a console. Neither is recorded:
a recording ends at 128 MB, which this load fills in ten minutes, and its run ends with an error.
`dva-sim load` puts devices, sessions, reports and churn on the first one's DVA; pages, clients of
ROS, viewers and cameras come and go; processes are stopped for up to 15 s and go on. All of that is
drawn for each hour by itself, from the seed and the number of the hour.

Every ten seconds the memory, files and threads of each process are sampled, and the size of each
file; samples.csv in the folder has them. At the end a table tells how much of each is taken more in
an hour, with its 95 % interval. The exit code is 1 if one surely grows by more than is allowed, if
a run ended early, or if one printed a traceback.
"""

from __future__ import annotations

import argparse
import csv
import os
import random
import re
import signal
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from helpers.foxglove.viewer import Viewer
from helpers.processes.programs import Program, Programs, all_gone_after
from helpers.soak.slopes import Taken, slope, taken_by
from helpers.soak.visitors import CameraVisitor, PageVisitor, RosVisitor, Visitors

SCENARIO = "campus-patrol"
HOUR_S = 3600.0
SAMPLE_S = 10.0
VISIT_S = 5.0  # mean time between two visits
FAULT_S = 60.0  # mean time between two stops of a process
MAX_STOP_S = 15.0
LOAD = ("--devices", "100", "--sessions", "5", "--churn", "30", "--reports", "6")
WARM_UP = 0.1  # share of the time that is left out: caches fill
ALLOWED = Taken(memory=2.0, files=0.5, threads=0.5)  # growth in an hour that is none
Samples = dict[str, list[tuple[float, Taken]]]


@dataclass
class Soak:
    """Everything that runs, and its samples.

    Attributes:
        programs: Everything that was started.
        live: The live run.
        console: The console.
        visitors: Those who come and go.
        samples: Times [h], and what was taken then, by the process.
        sizes: Size of each file [MB] by its name.
        stops: Number of processes that were stopped for a while.
    """

    programs: Programs
    live: Program
    console: Program
    visitors: Visitors
    samples: Samples = field(default_factory=lambda: defaultdict(list))
    sizes: dict[str, list[tuple[float, float]]] = field(default_factory=lambda: defaultdict(list))
    stops: int = 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hours", type=float, default=1.0)
    parser.add_argument("--hour", type=int, default=1, help="the first that is played")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path, default=Path("results/soak"))
    wish = parser.parse_args()
    wish.keep.mkdir(parents=True, exist_ok=True)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
    for programs in all_gone_after(wish.keep):
        soak = begun(programs, wish.hours)
        try:
            played = hours_of(soak, wish.hours, wish.hour, wish.seed)
        except KeyboardInterrupt:
            played = ["stopped by hand"]
        problems = [*played, *ended(soak)]
        soak.visitors.leave()
        write(soak, wish.keep / "samples.csv")
        return told(soak, problems, wish.hours)
    return 1


def begun(programs: Programs, hours: float) -> Soak:
    """Start a live run and a console, and let visitors in."""
    lasts = str(round(HOUR_S * hours + 600.0))
    live = programs.start(
        *("live", SCENARIO, "--for", lasts, "--state", "state"),
        *("--rosbridge", "0", "--foxglove", "0", "--camera-port", "0"),
    )
    console = programs.start(
        *("console", SCENARIO, "--no-open", "--port", "0", "--audit", "audit.sqlite"),
        *("--rosbridge", "0", "--foxglove", "0"),
    )
    live.wait_to_say("shows pictures of the robots at ")
    console.wait_to_say("Foxglove: ", "Console: ")
    camera = re.findall(r"pictures of the robots at (\S+)", live.output)[0]
    doors = {
        "camera": lambda: CameraVisitor(camera),
        "page": lambda: PageVisitor(address(console, "Console")),
    }
    for name, program in (("live", live), ("console", console)):
        doors[f"ros {name}"] = lambda p=program: RosVisitor(address(p, "rosbridge"))
        doors[f"viewer {name}"] = lambda p=program: Viewer(address(p, "Foxglove"), keeps=1)
    return Soak(programs, live, console, Visitors(doors))


def address(program: Program, name: str) -> str:
    return re.findall(rf"^{name}: +(\S+)", program.output, re.MULTILINE)[0]


def hours_of(soak: Soak, hours: float, first: int, seed: int) -> list[str]:
    """Play the hours; return what went wrong, in a line each."""
    began = time.monotonic()
    number = first
    while (left := HOUR_S * hours - (time.monotonic() - began)) > 0.0:
        lasts = min(left, HOUR_S)
        print(f"hour {number}, seed {seed}: {lasts / 60:.0f} min", flush=True)
        load = soak.programs.start(
            *("load", "--dva", address(soak.live, "DVA"), *LOAD),
            *("--for", str(max(1.0, lasts - 60.0)), "--seed", str(1000 * seed + number)),
        )
        for problem in hour_of(soak, random.Random(f"{seed}/{number}"), lasts, began):
            load.send(signal.SIGINT)
            return [f"hour {number}: {problem}"]
        print(load.output.strip() or f"load: {load.complained}", flush=True)
        number += 1
    return []


def hour_of(soak: Soak, rng: random.Random, lasts: float, began: float) -> Iterator[str]:
    """Play an hour: visitors, stops and samples at their times; yield what went wrong."""
    start = time.monotonic()
    plan = sorted([*times(rng, "visit", VISIT_S, lasts), *times(rng, "stop", FAULT_S, lasts)])
    plan += [(n * SAMPLE_S, "sample") for n in range(int(lasts / SAMPLE_S))]
    for at, what in sorted([*plan, (lasts, "sample")]):
        time.sleep(max(0.0, start + at - time.monotonic()))
        if what == "visit":
            soak.visitors.step(rng)
        elif what == "stop":
            stop_one(soak, rng)
        else:
            take_sample(soak, (time.monotonic() - began) / HOUR_S)
        for name, program in (("live", soak.live), ("console", soak.console)):
            if program.process.poll() is not None:
                yield f"{name} ended with {program.process.returncode}: {program.complained[-3:]}"
                return


def times(rng: random.Random, what: str, mean: float, lasts: float) -> Iterator[tuple[float, str]]:
    at = rng.expovariate(1.0 / mean)
    while at < lasts:
        yield at, what
        at += rng.expovariate(1.0 / mean)


def stop_one(soak: Soak, rng: random.Random) -> None:
    """Stop one of the processes for a while, whichever is drawn."""
    named = sorted((name, pid) for pid, name in labels(soak.programs).items())
    _, pid = named[rng.randrange(len(named))]
    with suppress(ProcessLookupError):
        os.kill(pid, signal.SIGSTOP)
        time.sleep(rng.uniform(0.5, MAX_STOP_S))
        os.kill(pid, signal.SIGCONT)
        soak.stops += 1


def labels(programs: Programs) -> dict[int, str]:
    """The processes of both runs, by what they are."""
    named: dict[int, str] = {}
    for pid, command in sorted(programs.processes().items()):
        part = re.findall(r'"part": "([^"]+)"', command)
        module = re.findall(r"-m (dva_sim\S+)( \S+)?", command)
        if " load" in command or "load_devices" in command or not (part or module):
            continue
        named[pid] = f"live {part[0]}" if part else " ".join(module[0]).strip()
    return named


def take_sample(soak: Soak, hours: float) -> None:
    for pid, name in labels(soak.programs).items():
        with suppress(OSError):
            soak.samples[f"{name} {pid}"].append((hours, taken_by(pid)))
    for path in Path(soak.live.folder).iterdir():
        if path.suffix not in (".out", ".errors", ".csv"):
            soak.sizes[path.name].append((hours, path.stat().st_size / 1e6))


def ended(soak: Soak) -> list[str]:
    """End both runs; return what they complained of."""
    problems = []
    for name, program in (("live", soak.live), ("console", soak.console)):
        program.send(signal.SIGINT)
        code = program.ends()
        if code:
            problems.append(f"{name} ended with {code}")
        problems += [f"{name}: {line}" for line in program.complained if "Traceback" in line]
    return problems


def write(soak: Soak, path: Path) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["process", "hours", "memory_mb", "files", "threads"])
        writer.writerows(
            (name, f"{hours:.5f}", f"{taken.memory:.3f}", taken.files, taken.threads)
            for name, samples in soak.samples.items()
            for hours, taken in samples
        )


def told(soak: Soak, problems: list[str], hours: float) -> int:
    """Print the table and what went wrong; return the exit code."""
    load = os.getloadavg()[2]
    print(f"visitors: {soak.visitors.came}; {soak.stops} stops; load of 15 min {load:.1f}")
    for line in sorted(set(soak.visitors.refused)):
        print(f"  kept out {soak.visitors.refused.count(line)} times: {line}")
    print(f"{'growth in an hour':44} {'memory [MB]':>26} {'files':>24} {'threads':>24}")
    for name, samples in soak.samples.items():
        kept = [(at, taken) for at, taken in samples if at > WARM_UP * hours]
        if not kept or kept[-1][0] - kept[0][0] < 0.5 * hours:
            continue
        cells = []
        for kind in Taken._fields:
            grows = slope([at for at, _ in kept], [getattr(taken, kind) for _, taken in kept])
            cells.append(f"{grows.hourly:+.2f} ({grows.low:+.2f} to {grows.high:+.2f})")
            if grows.low > getattr(ALLOWED, kind):
                problems.append(f"{name}: {kind} grows by {cells[-1]} in an hour")
        print(f"{name:44} {cells[0]:>26} {cells[1]:>24} {cells[2]:>24}")
    for name, samples in soak.sizes.items():
        print(f"{name}: {(samples[-1][1] - samples[0][1]) / hours:+.1f} MB in an hour")
    for problem in problems:
        print(problem, file=sys.stderr)
    return int(bool(problems))


if __name__ == "__main__":
    sys.exit(main())
