"""Costs of a run, the DVA and a study as they grow, as a table.

    .venv/bin/python tests/benchmarks/growth.py robots               # all sizes of one kind
    .venv/bin/python tests/benchmarks/growth.py rows --most 10000    # up to a size

Each size is measured in a process of its own: CPU seconds of what grows, without what every
program costs before it begins, and the most memory that the process had.
"""

from __future__ import annotations

import argparse
import json
import math
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

SIZES: dict[str, tuple[int, ...]] = {
    "robots": (1, 10, 100, 1000),
    "guards": (1, 10, 100, 300),
    "bystanders": (1, 10, 100, 300),
    "fires": (1, 10, 100),
    "floods": (1, 10, 100),
    "leaks": (1, 10, 100),
    "evacuation": (1, 30, 100, 300),
    "devices": (100, 1_000, 10_000),
    "rows": (100, 1_000, 10_000, 100_000),
}
SECONDS = {"robots": 20.0, "guards": 10.0, "bystanders": 10.0}  # simulated [s]
HAZARDS = {"fires": "fire", "floods": "flood", "leaks": "gas_leak"}
PERSONS = (("guards", 100), ("bystanders", 1), ("bystanders", 30), ("bystanders", 300))
ROOM_M = 5.0  # side of the room that each has
YARD_M = 20.0  # depth of the yard beside the rooms, where it burns
LATITUDE, LONGITUDE = 38.66, -9.2
METRES_NORTH, METRES_EAST = 111_000.0, 86_900.0  # of a degree, here


class Costs(dict[str, float]):
    """CPU seconds of each step, by its name."""

    @contextmanager
    def of(self, step: str) -> Iterator[None]:
        """Count what the block costs."""
        began = time.process_time()
        yield
        self[step] = time.process_time() - began


# --- a run -------------------------------------------------------------------------------------
def at(x: float, y: float) -> list[float]:
    """A place of the site [m], as GeoJSON has it."""
    return [LONGITUDE + x / METRES_EAST, LATITUDE + y / METRES_NORTH]


def feature(kind: str, shape: str, points: Any, **more: Any) -> dict[str, Any]:
    """One thing on the plan."""
    geometry = {"type": shape, "coordinates": points}
    return {"type": "Feature", "properties": {"kind": kind, **more}, "geometry": geometry}


def write_site(folder: Path, places: int) -> Path:
    """An open hall in which everybody has a room without walls: as dense at each size."""
    across = max(2, math.ceil(math.sqrt(places)))
    side = ROOM_M * across

    def ring(x: float, y: float, width: float, depth: float) -> list[list[float]]:
        corners = ((x, y), (x + width, y), (x + width, y + depth), (x, y + depth), (x, y))
        return [at(*corner) for corner in corners]

    plan = [feature("wall", "LineString", ring(0.0, 0.0, side, side + YARD_M))]
    plan += [feature("room", "Polygon", [ring(0.01, side, side - 0.02, YARD_M)], name="Yard")]
    plan += [feature("exit", "LineString", [at(side, 1.0), at(side, 4.0)], name="Gate")]
    for number in range(across * across):
        x, y = ROOM_M * (number % across), ROOM_M * (number // across)
        room = [ring(x + 0.01, y + 0.01, ROOM_M - 0.02, ROOM_M - 0.02)]
        plan.append(feature("room", "Polygon", room, name=f"Room {number + 1}"))
        plan.append(feature("robot_base", "Point", at(x + 1.5, y + 2.5), heading_deg=0))
        plan.append(feature("guard_post", "Point", at(x + 3.5, y + 2.5), heading_deg=0))
    plan.append(feature("operator_desk", "Point", at(1.0, 1.0), heading_deg=0))
    collection = {"type": "FeatureCollection", "features": plan}
    (folder / "big.geojson").write_text(json.dumps(collection))
    site = folder / "big.yaml"
    site.write_text(
        f"name: big\norigin: {{latitude: {LATITUDE}, longitude: {LONGITUDE}}}\n"
        "plan: big.geojson\nresolution_m: 0.25\n"
    )
    return site


def model_in(folder: Path, site: Path, counts: dict[str, int], *more: str) -> tuple[Any, Any]:
    """A run's model and scenario: so many robots, guards and bystanders, and more lines."""
    from dva_sim.kernel.yaml_files import load_yaml
    from dva_sim.simulation.models import model_of

    lines = [f"site: {{name: {site}}}", "control: supervisory"]
    lines += [f"{kind.removesuffix('s')}: {{count: {count}}}" for kind, count in counts.items()]
    (folder / "run.yaml").write_text("\n".join([*lines, *more]))
    document = load_yaml(folder / "run.yaml")
    model = model_of(document)
    return model, model.build(document, {})


def burning(count: int, hazard: str, seconds: float) -> list[str]:
    """Hazards of a kind in the yard, from the first second on."""
    events = ", ".join([f"{{kind: {hazard}, at_s: 1, room: Yard}}"] * count)
    return [f"horizon_s: {seconds}", f"events: [{events}]"]


def a_run(kind: str, size: int, folder: Path) -> Costs:
    """A run with so many robots on patrol, guards or bystanders."""
    import dva_sim.simulation.models  # noqa: F401  what every program loads does not count

    costs = Costs()
    counts = {"robots": 0, "guards": 0 if kind == "robots" else 1, "bystanders": 0} | {kind: size}
    more = burning(1, "fire", SECONDS[kind])
    if kind == "robots":
        rounds = ((n, n, n % size + 1) for n in range(1, size + 1))
        more += ["patrols:"]
        more += [f"  - {{robot: robot-{n}, places: [Room {a}, Room {b}]}}" for n, a, b in rounds]
    site = write_site(folder, size)
    with costs.of("prepare"):
        model, scenario = model_in(folder, site, counts, *more)
        model.rehearse(scenario, 1)
    with costs.of("run"):
        recording = model.simulate(scenario, 1)
    with costs.of("measure"):
        model.rows(recording)
    return costs


def hazards_and_persons(kind: str, size: int, folder: Path) -> Costs:
    """Runs of 10 s with so many hazards and ever more persons; fields are solved before."""
    costs = Costs()
    for who, persons in PERSONS:
        counts = {"robots": 0, "guards": 1, "bystanders": 0} | {who: persons}
        more = burning(size, HAZARDS[kind], 10.0)
        model, scenario = model_in(folder, write_site(folder, persons), counts, *more)
        model.simulate(scenario, 1)
        with costs.of(f"{persons} {who if persons > 1 else who.removesuffix('s')}"):
            model.simulate(scenario, 1)
    return costs


def an_evacuation(kind: str, size: int, folder: Path) -> Costs:
    """120 s of the shipped scenario with so many bystanders."""
    from dva_sim.simulation import scenario as scenarios
    from dva_sim.simulation.full import run

    costs = Costs()
    changes = {"bystander.count": size, "horizon_s": 120.0}
    with costs.of("prepare"):
        scenario = scenarios.build(scenarios.load(kind), changes)
        run.rehearse(scenario, 1)
    with costs.of("run"):
        run.simulate(scenario, 1)
    return costs


# --- the DVA -----------------------------------------------------------------------------------
def the_dva(kind: str, size: int, folder: Path) -> Costs:
    """A DVA with so many devices: 80 % detectors, 10 % guards, 5 % robots, 5 % operators."""
    import numpy as np

    from dva_sim.core.assignments import Rules
    from dva_sim.core.dispatch import POLICIES
    from dva_sim.core.dva import Dva
    from dva_sim.core.sessions import Permissions, Sessions
    from dva_sim.protocol import messages as m

    costs, sent = Costs(), iter(range(1, 10**9))
    kinds = ["Sensor"] * 16 + ["Guard"] * 2 + ["Robot", "TeleOp"]
    core = Dva(
        POLICIES["min_eta"](),
        lambda starts, goals: (np.full((len(goals), len(starts)), 10.0),) * 2,
        Rules(),
        rng=np.random.default_rng(1),
        sessions=Sessions(Permissions(lambda: 7)),
    )

    def message(number: int, body: m.Body) -> m.Message:
        source = "02:00:00:00:{:02X}:{:02X}".format(*divmod(number, 256))
        session = None if isinstance(body, m.Heartbeat) else 0
        return m.Message("02:00:00:00:00:01", next(sent), source, "12:00:00", session, body)

    def place(number: int) -> m.Position:
        return m.Position(LATITUDE + number * 1e-6, LONGITUDE)

    def status(number: int) -> m.Body | None:
        if kinds[number % 20] == "Guard":
            return m.PersonStatus("waiting", place(number))
        return m.RobotStatus("Idle", place(number), 0.0, 0.0, 0.0, 5)

    with costs.of("join"):
        for number in range(size):
            name = kinds[number % 20]
            core.handle(message(number, m.Registration(name, name, "192.168.1.9")), 0.0)
    with costs.of("second"):
        for number in range(size):
            core.note(message(number, m.Heartbeat()), 1.0)
            if kinds[number % 20] in ("Guard", "Robot"):
                core.note(message(number, status(number)), 1.0)
        core.tick(1.0)
    with costs.of("100 ticks"):
        for _ in range(100):
            core.tick(1.0)
            core.next_deadline()
    with costs.of("10 reports"):
        for number in range(0, 200, 20):
            report = m.EventReport(None, "fire", place(97 * number), 0.5, 0.9, "detected")
            _, sends = core.handle(message(number, report), 1.0)
            while sends:
                sends += core.delivered(sends.pop(0), 1.0)
    return costs


# --- a study -----------------------------------------------------------------------------------
STUDY = """\
question: Which is quicker?
seed: 3
persons: {persons}
replications: {trials}
factors:
  pattern: [req-rep, latest-wins]
  link.delay_s: [0, 0.1, 0.25, 0.5, 1]
parts:
  drive: {{scenario: drive-to-event}}
answer:
  part: drive
  measure: drive_time_s
  factor: pattern
  contrast: [req-rep, latest-wins]
  over: link.delay_s
  smallest_effect_s: 2.0
"""


def like(rows: dict[str, list[dict[str, Any]]], job: Any) -> dict[str, list[dict[str, Any]]]:
    """The rows of one real run, with times that differ from run to run."""
    delay = job.scenario.link.delay_s * (2.0 if job.scenario.pattern == "req-rep" else 1.0)
    time_s = 40.0 + 20.0 * delay + (job.seed * 0.618 % 1.0) * 5.0 + job.person % 7
    return {"runs": [rows["runs"][0] | {"drive_time_s": time_s}], "events": rows["events"]}


def a_study(kind: str, size: int, folder: Path) -> Costs:
    """A study with so many runs, none of which is simulated: what everything else costs."""
    from helpers.studies.small_study import run_study

    from dva_sim import api
    from dva_sim.experiments.study.cell_grid import cells, jobs
    from dva_sim.experiments.study.file_kinds import open_study
    from dva_sim.simulation.models import model_for

    costs = Costs()
    persons = min(1_000, size // 10)
    file = folder / "growth.yaml"
    file.write_text(STUDY.format(persons=persons, trials=size // 10 // persons))
    with costs.of("open"):
        study = open_study(file)
    job = jobs(study, cells(study))[0]
    real = model_for(job.scenario).tables(job.scenario, job.seed, False)
    with costs.of("run"):
        run_study(study, folder / "one", jobs=1, episode=partial(like, real))
    with costs.of("report"):
        api.report(folder / "one")
    with costs.of("compare"):
        api.compare(folder / "one", folder / "one").frame("drive_time_s", ["pattern"])
    with costs.of("go on"):
        run_study(study, folder / "one", jobs=1, episode=partial(like, real))
    with costs.of("export"):
        api.export(folder / "one", folder / "csv")
    return costs


MEASURED: dict[str, Callable[[str, int, Path], Costs]] = {
    "robots": a_run,
    "guards": a_run,
    "bystanders": a_run,
    **dict.fromkeys(HAZARDS, hazards_and_persons),
    "evacuation": an_evacuation,
    "devices": the_dva,
    "rows": a_study,
}


def measure(kind: str, size: int) -> dict[str, float]:
    """Costs of one size, in this process."""
    with tempfile.TemporaryDirectory() as folder:
        costs = MEASURED[kind](kind, size, Path(folder))
    return costs | {"MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024}


def main() -> None:
    """Measure one kind and print it as a table of Markdown."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("kind", choices=SIZES)
    parser.add_argument("--most", type=int, default=10**6, help="no larger sizes")
    parser.add_argument("--only", type=int, help="this size, here, as JSON")
    asked = parser.parse_args()
    if asked.only is not None:
        print(json.dumps(measure(asked.kind, asked.only)))
        return
    for number, size in enumerate(size for size in SIZES[asked.kind] if size <= asked.most):
        words = [sys.executable, __file__, asked.kind, "--only", str(size)]
        output = subprocess.run(words, stdout=subprocess.PIPE, text=True, check=True).stdout
        costs = json.loads(output.splitlines()[-1])
        if not number:
            heads = [name if name == "MB" else f"{name} [s]" for name in costs]
            print(f"| {asked.kind} | {' | '.join(heads)} |")
            print("|---" * (len(costs) + 1) + "|")
        print(
            f"| {size:,} | {' | '.join(f'{value:.3g}' for value in costs.values())} |", flush=True
        )


if __name__ == "__main__":
    main()
