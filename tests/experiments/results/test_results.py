"""A results folder as Python sees it: tables as columns, their dictionary, and what is missing."""

import math

import numpy as np
import pytest
from helpers.studies import synthetic_results as synthetic
from helpers.studies.small_study import run_study, study_in

import dva_sim
from dva_sim.experiments.results.results import Frame, Results
from dva_sim.kernel.errors import ConfigError


def test_runs_come_as_columns_of_the_same_length(results):
    assert results.runs.rows == 42
    assert set(results.runs["part"]) == {"drive", "story"}
    assert {len(column) for column in results.runs.values()} == {42}


def test_what_is_missing_is_nan_in_numbers_and_none_in_words(results):
    runs = results.runs
    odd = runs["seed"] % 2 == 1
    assert np.isnan(runs["round_trip_s"][odd]).all()
    assert {runs["outcome"][i] for i in np.flatnonzero(runs["seed"] % 3 == 0)} == {None}


def test_one_part_of_a_table_can_be_had_alone(results):
    assert results.table("runs", part="story").rows == 12


def test_rows_are_chosen_by_a_mask(results):
    runs = results.runs
    assert runs.where(runs["is_reference"]).rows == 6


def test_the_columns_are_explained_with_their_units(results):
    values = {c.name: (c.unit, c.meaning) for c in results.columns("tracks")}
    assert values["t_s"] == ("s", "time of the run")
    assert values["pattern"][1].startswith("factor of the study")
    assert values["link.delay_s"][0] == "s"


def test_sql_can_be_asked_of_a_table(results):
    means = results.runs.to_duckdb().aggregate("part, avg(round_trip_s) AS mean", "part")
    row = dict(means.fetchall())
    times = results.table("runs", part="story")["round_trip_s"]
    assert row["story"] == pytest.approx(np.nanmean(times))


@pytest.mark.parametrize("library", ["pandas", "polars"])
def test_a_library_of_frames_is_needed_only_by_who_asks_for_it(monkeypatch, library):
    monkeypatch.setitem(__import__("sys").modules, library, None)
    frame = Frame({"t_s": np.array([1.0])})
    with pytest.raises(ConfigError, match=f"pip install {library}"):
        getattr(frame, f"to_{library}")()


@pytest.mark.parametrize("library", ["pandas", "polars"])
def test_a_frame_of_another_library_has_the_same_rows(library):
    pytest.importorskip(library)
    columns = {"t_s": np.array([0.5, math.nan]), "who": np.array(["a", None], dtype=object)}
    columns["n"] = np.array([1, 2])
    frame = getattr(Frame(columns), f"to_{library}")()
    assert list(frame.columns) == ["t_s", "who", "n"]
    assert frame.shape == (2, 3)
    missing = frame.isna().sum().tolist() if library == "pandas" else frame.null_count().row(0)
    assert list(missing) == [1, 1, 0]


def test_a_notebook_shows_a_table_with_what_is_missing_left_empty():
    frame = Frame(
        {"t_s": np.array([0.125, math.nan]), "who": np.array(["a<b", None], dtype=object)}
    )
    html = frame._repr_html_()
    assert "<th>t_s</th><th>who</th>" in html
    assert "<tr><td>0.125</td><td>a&lt;b</td></tr><tr><td></td><td></td></tr>" in html
    assert "2 rows" in html


def test_a_notebook_shows_the_answer_of_a_study(tmp_path):
    rows = {"runs": synthetic.drive_rows(persons=6, trials=2)}
    folder = synthetic.write(tmp_path / "out", rows, synthetic.manifest(6, 2))
    results = dva_sim.load(folder)
    html = results._repr_html_()
    assert results.study["question"] in html
    assert results.answer.lead in html
    assert "444 runs" in html


def test_minus_zero_is_zero_in_a_table(tmp_path):
    def simulate(job):
        return {"runs": [{"turn_rate_rad_s": -0.0, "speed_mps": -0.5}]}

    out = run_study(study_in(tmp_path), tmp_path / "out", jobs=1, episode=simulate)
    runs = Results.load(out).runs
    assert not np.signbit(runs["turn_rate_rad_s"]).any()
    assert set(runs["speed_mps"]) == {-0.5}
