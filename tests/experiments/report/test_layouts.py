"""Layout of designs that form no grid."""

import numpy as np
from helpers.studies import synthetic_results

from dva_sim.experiments.analysis.study_view import finding_of, part_of, points_of, view_of
from dva_sim.experiments.report.cell_table import cell_table

ANSWER = {
    "part": "drive",
    "measure": "drive_time_s",
    "factor": "pattern",
    "contrast": ["req-rep", "latest-wins"],
}


def columns(cells, persons=3, slower=None):
    """Two trials of each person in each cell, whose levels are given."""
    rows = [
        {"part": "drive", "cell": number, "config": "c", **levels, "is_reference": False}
        | {"person": person, "trial": trial, "seed": person}
        | {"drive_time_s": 40.0 + person + (slower(levels) if slower else 0.0)}
        for number, levels in enumerate(cells)
        for person in range(persons)
        for trial in range(2)
    ]
    return synthetic_results.columns(rows)


def test_factors_taken_together_are_one_and_the_table_shows_them_all():
    delays, jitters = [0.0, 0.1, 0.3], [0.0, 0.01, 0.05]
    cells = [
        {"pattern": p, "link.delay_s": d, "link.jitter_s": j}
        for p in ("req-rep", "latest-wins")
        for d, j in zip(delays, jitters, strict=True)
    ]
    runs = columns(cells)
    study = {
        "factors": {"pattern": ["req-rep", "latest-wins"]}
        | {"link.delay_s": delays, "link.jitter_s": jitters},
        "design": {"zip": ["link.delay_s", "link.jitter_s"]},
        "answer": ANSWER | {"over": "link.jitter_s"},
    }
    part = part_of(study, runs, "drive")
    assert list(part.levels) == ["pattern", "link.jitter_s"]
    found = cell_table(part, "drive_time_s", points=["link.delay_s"])
    assert len(found.rows) == 6
    assert found.rows[2][:3] == ["REQ/REP", "50\N{NO-BREAK SPACE}ms", "0.3"]


def test_rows_that_leave_their_grid_empty_are_levels_of_one_factor():
    cells = [
        {"pattern": "req-rep", "link.delay_s": 0.1, "phone.profile": "default"},
        {"pattern": "pub-sub", "link.delay_s": 0.2, "phone.profile": "ideal"},
        {"pattern": "latest-wins", "link.delay_s": 0.3, "phone.profile": "dissertation"},
    ]
    runs = columns(cells)
    levels = {key: [cell[key] for cell in cells] for key in cells[0]}
    study = {"factors": levels, "design": {"rows": cells}, "answer": None}
    view = view_of(study, runs)
    assert [f.name for f in view.part.factors] == ["row"]
    assert view.over.levels[0].startswith("REQ/REP, 100")
    assert len(view.panels) == 1


def test_rows_with_an_answer_keep_their_factors_and_empty_settings_are_no_panels():
    cells = [
        {"pattern": "req-rep", "link.delay_s": 0.1, "phone.profile": "default"},
        {"pattern": "latest-wins", "link.delay_s": 0.1, "phone.profile": "default"},
    ]
    study = {
        "factors": {"pattern": ["req-rep", "latest-wins"], "link.delay_s": [0.1]}
        | {"phone.profile": ["ideal", "default"]},
        "design": {"rows": cells},
        "answer": ANSWER | {"over": "link.delay_s"},
    }
    view = view_of(study, columns(cells))
    assert view.panels == [{"phone.profile": "default"}]


def test_points_in_ranges_are_compared_at_each_and_averaged():
    delays = np.linspace(0, 0.4, 5)
    cells = [
        {"point": point, "pattern": p, "link.delay_s": delay}
        for point, delay in enumerate(delays)
        for p in ("req-rep", "latest-wins")
    ]
    runs = columns(cells, slower=lambda at: 10 * at["link.delay_s"] * (at["pattern"] == "req-rep"))
    study = {
        "factors": {"point": [0, 1, 2, 3, 4], "pattern": ["req-rep", "latest-wins"]},
        "design": {"latin_hypercube": 5, "ranges": {"link.delay_s": {"low": 0, "high": 0.4}}},
        "answer": ANSWER | {"over": None},
    }
    assert points_of(study, runs) == ["link.delay_s"]
    view = view_of(study, runs)
    assert len(view.part.trials) == 10  # two trials at each of five points
    found = finding_of(view)
    np.testing.assert_allclose(found.mean, [10 * 0.2])
    assert "average over the ranges" in found.everywhere


def test_a_reference_run_is_that_of_every_point():
    cells = [{"point": point, "pattern": "pub-sub", "x_m": float(point)} for point in range(3)]
    runs = columns(cells)
    aside = columns([{"point": np.nan, "pattern": None, "x_m": np.nan}])
    aside["is_reference"][:] = True
    both = {key: np.concatenate([runs[key], aside[key]]) for key in runs}
    study = {"factors": {"point": [0, 1, 2], "pattern": ["pub-sub"]}}
    excess = part_of(study, both, "drive").excess("drive_time_s")
    np.testing.assert_array_equal(excess, np.zeros((1, 3, 6)))
