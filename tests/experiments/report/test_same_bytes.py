"""Reports made again in other processes, where words hash otherwise, have the same bytes."""

import itertools
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from helpers.processes.patience import PATIENCE_S
from helpers.studies import synthetic_results

import dva_sim
from dva_sim.kernel.measure import names_of
from dva_sim.simulation.measures.sessions import RUN_COLUMNS

pytestmark = pytest.mark.soak

PROGRAM = """
import sys
from pathlib import Path
from dva_sim.experiments.report.report import write_report
for folder in sys.argv[1:]:
    write_report(Path(folder))
"""


def grid(folder):
    """Patterns, delays and three profiles: with a second factor to map, and danger to trade."""
    rows = {
        "runs": synthetic_results.drive_rows(3, 1, missed=0.5),
        "events": synthetic_results.story_rows(3),
        "tracks": synthetic_results.track_rows(),
    }
    for name, every in rows.items():
        few = [row for row in every if row["pattern"] != "pub-sub"]
        few = [row for row in few if row["link.delay_s"] in (0.0, 1.0)]
        aside = [row for row in few if row["profile"] == "default"]
        rows[name] = few + [row | {"profile": "third"} for row in aside]
    closed = {"part": "drive", "closing_s": 90.0, "watched_s": 300.0}
    rows["events"] += [row | closed for row in rows["events"]]
    rng = np.random.default_rng(1)
    rows["runs"] = [row | {"person_exposure_s": rng.gamma(2.0, 5.0)} for row in rows["runs"]]
    rows["robustness"] = synthetic_results.repeat_rows({("pursuit", 0): 20, ("adaptive", 0): 1})
    facts = synthetic_results.manifest(3, 1)
    facts["study"]["factors"] |= {"pattern": ["req-rep", "latest-wins"]}
    facts["study"]["factors"] |= {"link.delay_s": [0.0, 1.0]}
    facts["study"]["factors"] |= {"profile": ["default", "dissertation", "third"]}
    facts["study"] |= synthetic_results.CLAIMS | {"map": {"models": "profile"}}
    return synthetic_results.write(folder, rows, facts)


def points(folder):
    """Saltelli's sample over two ranges: eight pairs of points and what lies between."""
    rng, patterns = np.random.default_rng(2), ("req-rep", "latest-wins")
    pairs = rng.random((8, 2, 2))
    where = [
        place for a, b in pairs for place in (a, np.array([b[0], a[1]]), np.array([a[0], b[1]]), b)
    ]
    rows = [
        {"part": "drive", "cell": 2 * point + n, "point": point, "pattern": pattern, "seed": person}
        | {"link.delay_s": float(x), "robot.processing_s": float(y), "person": person, "trial": 0}
        | {"is_reference": False, "drive_time_s": 40.0 + 9 * x * (n == 0) + y + rng.normal()}
        for point, (x, y) in enumerate(where)
        for n, pattern in enumerate(patterns)
        for person in range(3)
    ]
    facts = synthetic_results.manifest(3, 1)
    ranges = {"link.delay_s": {"low": 0, "high": 1}}
    ranges |= {"robot.processing_s": {"low": 0.01, "high": 1, "scale": "log"}}
    facts["study"]["factors"] = {"point": list(range(len(where))), "pattern": list(patterns)}
    facts["study"]["design"] = {"sobol": len(where), "ranges": ranges}
    facts["study"]["answer"] |= {"over": None, "within": {}}
    return synthetic_results.write(folder, {"runs": rows}, facts)


def shifts(folder):
    """Three policies at two loads, two shifts of an hour each."""
    return synthetic_results.write_shifts(folder, 2)


def contest(folder):
    """Two transports beside none and eight flows."""
    places = itertools.product(("udp", "tcp"), ("0", "8"), range(4))
    rows = [
        {"part": "drive", "cell": 0, "transport": transport, "crowd": crowd, "person": person}
        | {"is_reference": False, "trial": 0, "seed": person}
        | dict.fromkeys(names_of(RUN_COLUMNS), 1.0)
        | {"movement_time_s": 80.0 + 40 * (transport == "tcp") + person}
        for transport, crowd, person in places
    ]
    facts = synthetic_results.manifest(4, 1)
    facts["study"]["factors"] = {"transport": ["udp", "tcp"], "crowd": ["0", "8"]}
    facts["study"]["answer"] = {"part": "drive", "measure": "movement_time_s", "over": "crowd"}
    facts["study"]["answer"] |= {"factor": "transport", "contrast": ["tcp", "udp"]}
    facts["scenarios"] = {"drive": {"model": "transports", "bottleneck": {"rate_bps": 1e6}}}
    return synthetic_results.write(folder, {"runs": rows}, facts)


KINDS = {
    *("map", "answer", "distributions", "differences", "heat_map", "scatter", "delay_budget"),
    *("command_age", "tradeoff", "endings", "trade", "way", "brought"),
}


def test_every_kind_of_figure_and_page_are_the_same_whatever_hashes_are(tmp_path):
    folders = [write(tmp_path / "1" / write.__name__) for write in (grid, points, shifts, contest)]
    shutil.copytree(tmp_path / "1", tmp_path / "2")
    root = str(Path(dva_sim.__file__).parents[1])
    both = [
        subprocess.Popen(
            [sys.executable, "-c", PROGRAM, *(f.name for f in folders)],
            cwd=tmp_path / seed,
            env=os.environ | {"PYTHONHASHSEED": seed, "PYTHONPATH": root},
        )
        for seed in "12"
    ]
    try:
        assert [process.wait(PATIENCE_S) for process in both] == [0, 0]
    finally:
        for process in both:
            process.kill()
    first, second = (
        {str(path.relative_to(tmp_path / seed)): path.read_bytes() for path in files}
        for seed in "12"
        for files in [sorted((tmp_path / seed).rglob("*.*"))]
    )
    assert {Path(name).stem for name in first if name.endswith(".svg")} == KINDS
    assert sum(name.endswith("report.html") for name in first) == 4
    assert set(first) == set(second)
    assert [name for name in first if first[name] != second[name]] == []
