"""Designs: which levels meet, in which order, and what is refused where."""

import itertools

import numpy as np
import pytest
from helpers.studies.small_study import STUDY, cheap, run_study, study_in

from dva_sim.experiments.results.results import Results
from dva_sim.experiments.study import cell_grid
from dva_sim.experiments.study.factor_levels import size

PLAIN = STUDY.split("answer:")[0]
DELAYS = "  link.delay_s: [0, 0.25]\n"
ONLY_PATTERN = PLAIN.replace(DELAYS, "")


def levels(study, part="drive"):
    """The levels of every cell of a part, in order."""
    return [
        dict(cell.levels) for cell in cell_grid.cells(study) if cell.part == part and cell.levels
    ]


def test_without_a_design_every_level_meets_every_other(tmp_path):
    assert levels(study_in(tmp_path, text=PLAIN)) == [
        {"pattern": pattern, "link.delay_s": delay}
        for pattern, delay in itertools.product(("req-rep", "latest-wins"), (0, 0.25))
    ]


def test_zipped_factors_go_level_by_level_and_the_others_cross_them(tmp_path):
    text = PLAIN.replace(DELAYS, DELAYS + "  link.loss: [0, 0.1]\n")
    study = study_in(tmp_path, text=text + "design: {zip: [link.delay_s, link.loss]}\n")
    assert levels(study) == [
        {"pattern": "req-rep", "link.delay_s": 0, "link.loss": 0},
        {"pattern": "req-rep", "link.delay_s": 0.25, "link.loss": 0.1},
        {"pattern": "latest-wins", "link.delay_s": 0, "link.loss": 0},
        {"pattern": "latest-wins", "link.delay_s": 0.25, "link.loss": 0.1},
    ]


ROWS = """\
design:
  rows:
    - {link.delay_s: 0, link.loss: 0.1}
    - {link.delay_s: 0.5, link.loss: 0}
"""


def test_listed_rows_are_crossed_with_the_factors(tmp_path):
    study = study_in(tmp_path, text=ONLY_PATTERN + ROWS)
    assert levels(study) == [
        {"link.delay_s": delay, "link.loss": loss, "pattern": pattern}
        for (delay, loss), pattern in itertools.product(
            [(0, 0.1), (0.5, 0)], ("req-rep", "latest-wins")
        )
    ]
    assert study.factors == {
        "link.delay_s": (0, 0.5),
        "link.loss": (0.1, 0),
        "pattern": ("req-rep", "latest-wins"),
    }


def test_a_file_of_rows_means_the_same_as_the_rows(tmp_path):
    listed = cell_grid.jobs(study_in(tmp_path, text=ONLY_PATTERN + ROWS))
    (tmp_path / "rows.csv").write_text("link.delay_s,link.loss\n0,0.1\n0.5,0\n")
    filed = cell_grid.jobs(study_in(tmp_path, text=ONLY_PATTERN + "design: {csv: rows.csv}\n"))
    assert [job.key for job in filed] == [job.key for job in listed]
    assert [job.levels for job in filed] == [job.levels for job in listed]


def test_cells_of_a_file_are_read_as_yaml_would_read_them(tmp_path):
    head = "operator.strategy,link.delay_s,link.reorder,zeromq.send_buffer_bytes,"
    head += "robot.processing_s\n"
    rows = 'oracle,5e-2,true,null,0.1\r\n\n"pursuit",1,false,4096,"0.2"\r\n'
    (tmp_path / "rows.csv").write_bytes(b"\xef\xbb\xbf" + (head + rows).encode())
    study = study_in(tmp_path, text=ONLY_PATTERN + "design: {csv: rows.csv}\n")
    assert [tuple(row.values()) for row in study.listed_rows] == [
        ("oracle", 0.05, True, None, 0.1),
        ("pursuit", 1, False, 4096, 0.2),
    ]
    assert len(levels(study)) == 4


def test_a_row_may_name_treatments(tmp_path):
    treatments = "treatments: {remedy: {no: {}, yes: {pattern: pub-sub, link.loss: 0.1}}}\n"
    (tmp_path / "rows.csv").write_text('remedy,link.delay_s\n"no",0\n"yes",0.25\n')
    text = PLAIN.split("factors:")[0] + "parts: {drive: {scenario: one.yaml}}\n" + treatments
    first, second = cell_grid.cells(study_in(tmp_path, text=text + "design: {csv: rows.csv}\n"))
    assert (first.scenario.link.loss, first.scenario.link.delay_s) == (0, 0)
    assert (second.scenario.pattern, second.scenario.link.loss) == ("pub-sub", 0.1)


SAMPLED = """\
design:
  {kind}: 16
  ranges:
    link.delay_s: [0, 0.5]
    link.loss: {{low: 0.001, high: 0.1, scale: log}}
    command.attempts: {{low: 1, high: 4, scale: whole}}
"""


@pytest.mark.parametrize("kind", ["latin_hypercube", "sobol"])
def test_points_fill_each_range_evenly_on_its_scale_and_meet_every_level(tmp_path, kind):
    study = study_in(tmp_path, text=ONLY_PATTERN + SAMPLED.format(kind=kind))
    found, points = levels(study), 16
    assert len(found) == 2 * points
    assert [cell["point"] for cell in found[::2]] == list(range(points))
    assert [cell["pattern"] for cell in found] == ["req-rep", "latest-wins"] * points
    delay, loss, attempts = (
        np.array([cell[key] for cell in found[::2]], dtype=float)
        for key in ("link.delay_s", "link.loss", "command.attempts")
    )
    assert sorted((delay / 0.5 * points).astype(int)) == list(range(points))
    assert sorted((np.log10(loss / 0.001) / 2 * points).astype(int)) == list(range(points))
    assert np.bincount(attempts.astype(int)).tolist() == [0, 4, 4, 4, 4]


@pytest.mark.system
@pytest.mark.parametrize("kind", ["latin_hypercube", "sobol"])
def test_points_depend_on_the_seed_of_the_study_alone(tmp_path, kind):
    text = ONLY_PATTERN + SAMPLED.format(kind=kind)
    first, again, other = (
        levels(study_in(tmp_path, *changes, text=text))
        for changes in ([], ["persons=9"], ["seed=4"])
    )
    assert first == again != other


def test_the_points_are_these_on_every_machine(tmp_path):
    study = study_in(tmp_path, text=ONLY_PATTERN + SAMPLED.format(kind="sobol"))
    values = [tuple(cell.values())[1:4] for cell in levels(study)[:4:2]]
    assert values == [(0.245664, 0.0343705, 2), (0.305481, 0.0011841, 4)]


def test_a_run_at_a_point_has_the_points_number_and_values_in_its_table(tmp_path):
    text = ONLY_PATTERN + SAMPLED.format(kind="latin_hypercube").replace(": 16", ": 2")
    out = run_study(study_in(tmp_path, text=text), tmp_path / "out", jobs=1, episode=cheap)
    runs = Results.load(out).table("runs", part="story")
    keys = ["point", "link.delay_s", "link.loss", "command.attempts", "pattern"]
    assert list(runs)[3:8] == keys
    assert sorted(set(runs["point"])) == [0, 1]
    assert len(set(runs["link.delay_s"])) == 2


def test_rows_with_too_many_levels_for_a_grid_are_points(tmp_path):
    rows = [f"{i / 1000},{i / 100},{i / 2000}" for i in range(1, 31)]
    (tmp_path / "rows.csv").write_text(
        "\n".join(["link.delay_s,robot.processing_s,link.loss", *rows])
    )
    study = study_in(tmp_path, text=ONLY_PATTERN + "design: {csv: rows.csv}\n")
    assert list(study.factors) == ["point", "pattern"]
    assert levels(study)[2] == {
        "point": 1,
        "link.delay_s": 0.002,
        "robot.processing_s": 0.02,
        "link.loss": 0.001,
        "pattern": "req-rep",
    }


def test_the_size_of_a_design_can_be_set(tmp_path):
    text = ONLY_PATTERN + SAMPLED.format(kind="sobol")
    assert len(levels(study_in(tmp_path, "design.sobol=4", text=text))) == 2 * 4


def test_an_answer_may_run_over_a_range(tmp_path):
    text = STUDY.replace(DELAYS, "") + SAMPLED.format(kind="sobol")
    assert study_in(tmp_path, text=text).answer.over == "link.delay_s"


@pytest.mark.parametrize(
    ("scenario", "key", "low", "high"),
    [
        ("drive-to-event", "link.delay_s", 0, 1),
        ("small-shift", "intensity", 0.5, 2),
        ("tasks/course", "link.up.delay_s", 0, 1),
        ("congested-link", "bottleneck.delay_s", 0.01, 0.2),
    ],
)
def test_every_model_takes_a_sampled_factor(tmp_path, scenario, key, low, high):
    study = study_in(
        tmp_path,
        text=f"question: Does it work?\nparts: {{it: {{scenario: {scenario}}}}}\n"
        f"design: {{latin_hypercube: 3, ranges: {{{key}: [{low}, {high}]}}}}\n",
    )
    cells = cell_grid.cells(study)
    assert len({cell.config for cell in cells}) == 3
    assert all(low <= dict(cell.levels)[key] <= high for cell in cells)


def test_of_many_points_only_the_ends_of_the_ranges_are_rehearsed(tmp_path):
    study = study_in(tmp_path, text=ONLY_PATTERN + SAMPLED.format(kind="sobol"))
    chosen = [c for c in cell_grid.to_rehearse(study, cell_grid.cells(study)) if c.part == "drive"]
    assert [dict(c.levels) for c in chosen if not c.levels] == [{}]
    ends = [tuple(dict(c.levels).values()) for c in chosen if c.scenario.pattern == "req-rep"]
    assert ends == [
        (0, 0.01, 3, "req-rep"),
        (0.5, 0.01, 3, "req-rep"),
        (0.25, 0.001, 3, "req-rep"),
        (0.25, 0.1, 3, "req-rep"),
        (0.25, 0.01, 1, "req-rep"),
        (0.25, 0.01, 4, "req-rep"),
    ]


@pytest.mark.parametrize(
    ("asked", "cells"),
    [
        ("{}", 4),
        ("design: {zip: [pattern, link.delay_s]}", 2),
        ("design: {rows: [{link.loss: 0}, {link.loss: 0.1}, {link.loss: 0.2}]}", 12),
        ("design: {sobol: 8, ranges: {link.loss: [0, 0.1]}}", 32),
    ],
)
def test_how_many_cells_there_will_be_is_known_before_they_are_made(tmp_path, asked, cells):
    study = study_in(tmp_path, text=PLAIN + asked.replace("{}", "", 1))
    assert size(study) == len(levels(study)) == cells


def test_a_grid_of_ten_thousand_cells_is_taken(tmp_path):
    losses = [i / 1000 for i in range(100)]
    grid = PLAIN.replace(DELAYS, f"  link.loss: {losses}\n  link.delay_s: {losses[:50]}\n")
    assert size(study_in(tmp_path, text=grid)) == 10_000


def test_an_item_of_a_list_can_be_a_factor(tmp_path):
    (tmp_path / "fire.yaml").write_text("events: [{kind: fire, at_s: 0}]\n")
    study = study_in(
        tmp_path,
        text="question: When?\nparts: {it: {scenario: fire.yaml}}\n"
        "factors: {events.0.at_s: [0, 5]}\n",
    )
    assert [cell.scenario.events[0].at_s for cell in cell_grid.cells(study)] == [0, 5]
