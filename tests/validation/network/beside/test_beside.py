"""A study's rows, made up here, beside the predictions: the command, its verdicts and its files."""

import csv
import shutil
from functools import partial
from pathlib import Path

import pytest
from helpers.studies.small_study import run_study
from helpers.wording import unnamed

from dva_sim.cli import validation
from dva_sim.experiments.results.results import Results
from dva_sim.experiments.study.loading import load_study
from dva_sim.kernel.errors import ConfigError, ExitCode
from dva_sim.options.studies import ValidateOptions
from dva_sim.validation.network.beside import measured, page
from dva_sim.validation.network.beside.measured import (
    Measured,
    asked_by,
    beside_of,
    measured_in,
    rows_beside,
)
from dva_sim.validation.network.beside.predictions import (
    ALLOWANCES,
    CellPrediction,
    PredictedBand,
    read_kept,
)

OWN = Path(__file__).parents[4] / "protocol/transports/repeated_udp.py"
STUDY = """
question: Which?
seed: 1
persons: 3
replications: 1
factors:
  middleware: [udp, own]
  link: [clean, far]
treatments:
  middleware:
    udp: {transport: {name: udp, options: {}}}
    own: {transport: {name: "repeated_udp.py:RepeatedUdp", options: {}}}
  link:
    clean: {link.delay_s: 0.01}
    far: {link.delay_s: 0.15}
parts:
  commands: {scenario: commands-over-middleware, changes: {set_up_s: 2, measure_s: 2}}
"""
GOOD = {
    "age_in_force_p50_s": 0.036,
    "age_in_force_p95_s": 0.058,
    "too_old_share": 0.0,
    "longest_gap_s": 0.05,
    "command_rate_hz": 20.0,
    "up_bytes": 25_000.0,
    "down_bytes": 200.0,
    "disturbed": 0,
}
BANDS = dict.fromkeys(ALLOWANCES, PredictedBand(1, 2, 3))
PREDICTED = CellPrediction("a", {"middleware": "udp"}, (1, 2, 3), BANDS)


def made(late, job):
    """A run at 10 ms; one at 150 ms is that much older, but for the second person's."""
    is_far = dict(job.cell)["link"] == "far"
    older = 0.14 if is_far and job.person != 1 else 0.0
    row = GOOD | {name: GOOD[name] + older for name in GOOD if name.startswith("age")}
    return {"runs": [row | {"disturbed": int(late and is_far)}]}


@pytest.fixture
def results(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(OWN, tmp_path)
    (tmp_path / "study.yaml").write_text(STUDY)

    def run(late=False):
        study = load_study("study.yaml")
        return str(run_study(study, tmp_path / "out", jobs=1, episode=partial(made, late)))

    return run


def rows_in(folder):
    with (folder / "beside.csv").open() as file:
        return list(csv.DictReader(file))


@pytest.mark.system  # it draws
def test_measured_rows_stand_beside_their_bands(results, tmp_path, capsys):
    written = tmp_path / "page"
    assert (
        validation.validate(
            ValidateOptions("network", out=written, beside=results(), quick=True, jobs=1)
        )
        == 0
    )
    assert unnamed(capsys.readouterr().out, "14 of 14", "is not modelled") == []
    rows = rows_in(written)
    assert len(rows) == 4 * len(ALLOWANCES)
    words = {(row["middleware"], row["verdict"]) for row in rows}
    assert words == {("udp", "inside"), ("own", "not predicted")}
    [age] = [
        row
        for row in rows
        if (row["link"], row["measure"]) == ("far", "age_in_force_p50_s")
        and row["middleware"] == "udp"
    ]
    assert [float(age[key]) for key in ("measured", "least")] == pytest.approx([0.176, 0.036])
    assert float(age["low"]) < float(age["predicted"]) < float(age["high"])
    files = {str(path.relative_to(written)) for path in written.rglob("*")}
    assert {"index.html", "predictions.csv", "figures/beside-longest_gap_s.svg"} <= files
    assert "repeated_udp" not in (written / "predictions.csv").read_text()


def test_a_row_outside_its_band_is_named_and_fails_the_model(results, capsys, monkeypatch):
    monkeypatch.setitem(GOOD, "command_rate_hz", 15.0)
    found = validation.validate(ValidateOptions("network", beside=results(), quick=True, jobs=1))
    assert found == ExitCode.GATE_FAILED
    output = capsys.readouterr().out
    assert unnamed(output, "12 of 14", "command_rate_hz", "outside") == []


def test_disturbed_runs_are_not_judged(results):
    runs = measured_in(Results.load(results(late=True)))
    found = beside_of(asked_by(load_study("study.yaml")), runs, 2, 1)
    far = [row for row in found.rows if row.levels == {"middleware": "udp", "link": "far"}]
    assert {row.word for row in far} == {"not judged"}
    assert unnamed(far[0].why, "0 of at least 3", "3 more were disturbed") == []
    assert found.passes
    none = beside_of(asked_by(load_study("study.yaml")), {}, 2, 1)
    assert none.share == (0, 0)
    assert not none.passes


def test_of_a_study_without_results_predictions_alone_are_made(results, tmp_path):
    results()
    asked = asked_by(load_study("study.yaml"))
    found = page.evidence(beside_of(asked, None, 2, 1), {})
    assert {row["verdict"] for row in found.tables["beside"]} == {"predicted", "not predicted"}
    table = tmp_path / "mine.csv"
    with table.open("w") as file:
        writer = csv.DictWriter(file, list(found.tables["predictions"][0]))
        writer.writeheader()
        writer.writerows(found.tables["predictions"])
    assert [(config, len(seeds)) for config, seeds in read_kept(str(table))] == [
        (asked[0].config, 3),
        (asked[1].config, 3),
    ]


def test_kept_bands_are_taken_before_any_are_made(results, monkeypatch):
    asked = asked_by(load_study("middleware"))[:1]
    kept = {(asked[0].config, asked[0].seeds): BANDS}
    monkeypatch.setattr(measured, "read_kept", lambda: kept)
    found = beside_of(asked, {}, 1, 1)
    assert (found.kept, found.played) == (1, [])
    assert {row.band for row in found.rows} == {PredictedBand(1, 2, 3)}


def test_runs_of_a_scenario_that_is_another_one_today_are_not_predicted_again(results):
    made = Results.load(results())
    runs = measured_in(made)
    for row in made.manifest["cells"]:
        row["config"] = f"old-{row['config']}"
    old = {f"old-{config}": each for config, each in runs.items()}
    asked = asked_by(load_study("study.yaml"), made)
    assert {cell.config for cell in asked} == set(old)
    rows = beside_of(asked, old, 1, 1).rows
    assert {row.word for row in rows} == {"not predicted"}
    assert unnamed(rows[0].why, "scenario has changed") == []
    assert len(rows[0].values) == 3


@pytest.mark.parametrize(
    ("values", "word"),
    [([2.0, 3.0, 9.0], "inside"), ([2.0, 3.1, 9.0], "outside"), ([3.1, 3.1], "not judged")],
)
def test_the_median_of_at_least_three_runs_has_to_lie_inside(values, word):
    rows = rows_beside([PREDICTED], {"a": Measured(dict.fromkeys(ALLOWANCES, values))})
    assert {row.word for row in rows} == {word}


def test_what_is_no_middleware_study_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="middleware"):
        validation.validate(ValidateOptions("network", beside="processing-time", quick=True))
    with pytest.raises(ConfigError, match="results"):
        validation.validate(ValidateOptions("network", beside=str(tmp_path), quick=True))
    with pytest.raises(ConfigError, match="--beside"):
        validation.validate(ValidateOptions("dispatch", beside="middleware"))
