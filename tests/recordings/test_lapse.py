"""The strip of moments in a report, drawn from a recording of a real run."""

import csv
import io

import numpy as np
import pytest
from helpers.studies import synthetic_results
from helpers.studies.report_text import blank_pictures
from helpers.wording import unnamed
from matplotlib.colors import to_hex
from recordings.runs import drill

from dva_sim.experiments.analysis.kept_episodes import Tables, typical_and_worst
from dva_sim.experiments.analysis.run_grid import Factor, RunGrid
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures.palette import HAZARD, look_of
from dva_sim.experiments.report.figures.style import styled
from dva_sim.experiments.report.figures.time_lapse import TypicalRun, WorstRun, kind_of
from dva_sim.recordings.writing import write_recording
from dva_sim.simulation.full.episode_measures import tables_of

pytestmark = pytest.mark.system

VALUES = [61.0, 70.0, 95.0]  # of three persons, each with a recording: the last is the worst


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    (folder / "recordings").mkdir()
    for person in range(3):
        path = folder / "recordings" / f"drill-0-{person}-0.mcap"
        write_recording(drill(), path, tables=tables_of(drill()))
    rows = [
        {"part": "drill", "cell": 0, "person": person, "trial": 0, "seed": 3}
        | {"control": "direct", "is_reference": False, "confirmation_s": value}
        for person, value in enumerate(VALUES)
    ]
    runs = synthetic_results.columns(rows)
    part = RunGrid(runs, "drill", [Factor("control", ("direct",))])
    view = StudyView(part, "confirmation_s", None, None, None, {})
    tables = Tables(runs, {}, ["control"])
    episodes = typical_and_worst(folder, "drill", "confirmation_s", tables)
    with styled(), blank_pictures():
        return {
            figure.which: figure.drawn(view, episode, synthetic_results.SCENARIO)
            for figure, episode in zip((TypicalRun(), WorstRun()), episodes, strict=True)
        }


def test_the_typical_run_is_the_median_and_the_worst_the_largest(drawn):
    assert unnamed(drawn["typical"].title, "Typical run", "70.0") == []
    assert unnamed(drawn["worst"].title, "Worst run", "95.0") == []
    assert unnamed(drawn["worst"].caption, "person 2, trial 0", "67\N{NO-BREAK SPACE}%") == []


def test_the_strip_ends_where_the_recorded_agents_were_last(drawn):
    rows = list(csv.DictReader(io.StringIO(drawn["worst"].csv.decode())))
    lasts = {row["agent"]: (float(row["x_m"]), float(row["y_m"])) for row in rows}
    tracks = drill().recorder.tracks
    assert set(lasts) == {"robot-1", "robot-2", "guard-1", "guard-2"}
    for name, place in lasts.items():
        assert place == pytest.approx((tracks[name][-1].x, tracks[name][-1].y), abs=1e-3)


def test_both_incidents_lie_within_the_frame_once_they_have_begun(drawn):
    axes = drawn["worst"].figure.axes
    assert len(axes) == 6
    seen = [
        [np.ravel(line.get_xydata()) for line in ax.lines if to_hex(line.get_color()) == HAZARD]
        for ax in axes
    ]
    assert [len(places) for places in seen] == [0, 0, 1, 2, 2, 2]  # from 19.0 and 52.9 s on
    (left, right), (low, high) = axes[0].get_xlim(), axes[0].get_ylim()
    assert all(left < x < right and low < y < high for places in seen for x, y in places)


def test_robots_and_guards_have_the_looks_they_have_in_other_figures(drawn):
    marks = {line.get_marker() for line in drawn["worst"].figure.axes[-1].lines}
    assert {look_of("robot").mark, look_of("guard").mark} <= marks
    key = drawn["worst"].figure.legends[0]
    assert [text.get_text() for text in key.get_texts()] == ["guard", "robot", "incident"]


def test_two_of_a_kind_are_told_apart_by_their_numbers(drawn):
    texts = sorted(text.get_text() for text in drawn["worst"].figure.axes[0].texts)
    assert texts == ["1", "1", "2", "2"]
    assert kind_of("robot-12") == "robot"
