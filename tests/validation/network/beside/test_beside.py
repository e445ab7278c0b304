"""A study's rows, made up here, beside the predictions: the command, its verdicts and its files."""

import csv
import shutil
from functools import partial
from pathlib import Path
from statistics import fmean

import pytest
from helpers.paths import ROOT
from helpers.studies.small_study import run_study
from helpers.wording import unnamed

from dva_sim.cli import validation
from dva_sim.experiments.report.kept_answers import read
from dva_sim.experiments.results.results import Results
from dva_sim.experiments.study.loading import load_study
from dva_sim.kernel.errors import ExitCode
from dva_sim.options.studies import ValidateOptions
from dva_sim.validation.evidence import read_evidence
from dva_sim.validation.network.beside import measured
from dva_sim.validation.network.beside.measured import (
    Measured,
    asked_by,
    beside_of,
    lines_beside,
    measured_in,
    measured_in_commands,
    rule_of,
)
from dva_sim.validation.network.beside.predictions import (
    ALLOWANCES,
    CellPrediction,
    PredictedBand,
    read_kept,
)

TRACE = ROOT / "experiments/traces/commands-over-middleware.csv.gz"
ANSWER = ROOT / "experiments/answers/middleware.json"
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
    is_far = job.levels["link"] == "far"
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


def judged_in(result, *words):
    """The lines of some verdicts, without the rule."""
    return [line for line in result.lines[:-1] if line.verdict in words]


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
    *lines, _ = read_evidence(written / "evidence.csv")
    assert len(lines) == 4 * len(ALLOWANCES)
    words = {(line.line.split()[0], line.verdict) for line in lines}
    assert words == {("udp", "holds"), ("own", "shown only")}
    [age] = [line for line in lines if line.line == "udp far age_in_force_p50_s"]
    assert age.measured == pytest.approx(0.176)
    assert age.note == "runs from 0.036 to 0.176"
    assert age.low < age.predicted < age.high
    files = {str(path.relative_to(written)) for path in written.rglob("*")}
    assert {"index.html", "predictions.csv", "figures/evidence.svg"} <= files
    assert "repeated_udp" not in (written / "predictions.csv").read_text()


def test_a_row_outside_its_band_is_named_and_fails_the_model(results, capsys, monkeypatch):
    monkeypatch.setitem(GOOD, "command_rate_hz", 15.0)
    found = validation.validate(ValidateOptions("network", beside=results(), quick=True, jobs=1))
    assert found == ExitCode.GATE_FAILED
    output = capsys.readouterr().out
    assert unnamed(output, "12 of 14", "udp clean command_rate_hz", "udp far command_rate_hz") == []


def test_disturbed_runs_are_not_judged(results):
    runs = measured_in(Results.load(results(late=True)))
    found = beside_of(asked_by(load_study("study.yaml")), runs, 2, 1)
    far = [line for line in found.lines if line.line.startswith("udp far ")]
    assert {line.verdict for line in far} == {"shown only"}
    assert unnamed(far[0].note, "not judged: 0 of at least 3", "3 more were disturbed") == []
    assert found.passes
    none = beside_of(asked_by(load_study("study.yaml")), {}, 2, 1)
    assert judged_in(none, "holds", "misses") == []
    assert not none.passes


def test_of_a_study_without_results_predictions_alone_are_made(results, tmp_path):
    results()
    asked = asked_by(load_study("study.yaml"))
    found = beside_of(asked, None, 2, 1)
    notes = {line.note.partition(":")[0] for line in found.lines[:-1]}
    assert notes == {"predicted", "not predicted"}
    assert found.passes
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
    assert [unnamed(note, "1 configurations", "kept") for note in found.notes] == [[]]
    assert found.tables == {}
    assert {(e.low, e.predicted, e.high) for e in found.lines[:-1]} == {(1, 2, 3)}


def test_runs_of_a_scenario_that_is_another_one_today_are_not_predicted_again(results):
    made = Results.load(results())
    runs = measured_in(made)
    for row in made.manifest["cells"]:
        row["config"] = f"old-{row['config']}"
    old = {f"old-{config}": each for config, each in runs.items()}
    asked = asked_by(load_study("study.yaml"), made)
    assert {cell.config for cell in asked} == set(old)
    *lines, _ = beside_of(asked, old, 1, 1).lines
    assert {line.verdict for line in lines} == {"shown only"}
    assert unnamed(lines[0].note, "not predicted", "scenario has changed") == []
    assert lines[0].sample == 3


@pytest.mark.parametrize(
    ("values", "word"),
    [([2.0, 3.0, 9.0], "holds"), ([2.0, 3.1, 9.0], "misses"), ([3.1, 3.1], "shown only")],
)
def test_the_median_of_at_least_three_runs_has_to_lie_inside(values, word):
    lines = lines_beside([PREDICTED], {"a": Measured(dict.fromkeys(ALLOWANCES, values))})
    assert {line.verdict for line in lines} == {word}


def test_nine_lines_of_ten_have_to_hold():
    values = {name: [2.0, 2.0, 2.0] for name in ALLOWANCES}
    assert rule_of(lines_beside([PREDICTED], {"a": Measured(values)})).verdict == "holds"
    values["up_bytes"] = [9.0, 9.0, 9.0]
    rule = rule_of(lines_beside([PREDICTED], {"a": Measured(values)}))
    assert (rule.verdict, rule.note) == ("misses", "6 of 7")


@pytest.mark.parametrize("link", ["far", "narrow"])
def test_kept_commands_give_the_kept_answer(link):
    """Mean age in force of REQ/REP less that of PUB/SUB, 95th percentile."""
    asked = {tuple(cell.levels.values()): cell for cell in asked_by(load_study("middleware"))}
    pair = [asked[name, link] for name in ("req-rep", "pub-sub")]
    found = measured_in_commands(TRACE, pair)
    ages = [fmean(found[cell.config].values["age_in_force_p95_s"]) for cell in pair]
    [kept] = [row.mean for row in read(ANSWER).rows if row.level == link]
    assert ages[0] - ages[1] == pytest.approx(kept, abs=1e-4)
