"""The command, on few persons: what it writes, and that who knows no delay fails."""

import pytest

from dva_sim.agents.operator.published import load_split, load_targets, target_lines
from dva_sim.cli.validation import validate
from dva_sim.options.studies import ValidateOptions
from dva_sim.validation.evidence import RULE, passes, read_evidence
from dva_sim.validation.operators import experiments
from dva_sim.validation.operators.evidence import judge, rule_of
from dva_sim.validation.operators.experiments import (
    EXPERIMENTS,
    OperatorsSetting,
    measured,
    play_experiments,
)

pytestmark = pytest.mark.system

LINES = target_lines(load_targets(), load_split())


def played(strategy, *names):
    chosen = [e for e in EXPERIMENTS if e.name in names]
    setting = OperatorsSetting(strategy, persons=2, quick=True)
    found = measured(chosen, play_experiments(chosen, setting), seed=1)
    return judge(LINES, found), found


def test_an_operator_on_whom_delay_has_no_effect_fails_whatever_else_it_does():
    """The negative control: of ten not fitted lines it misses all eight that a delay is part of."""
    verdicts, found = played("oracle", "lag", "latency", "waiting", "excavator")
    assert found["S7/75"].value == pytest.approx(1.0)
    assert found["S17/increase"].value == pytest.approx(0.0)
    not_fitted = {
        line.id: v.verdict
        for line, v in zip(LINES, verdicts, strict=True)
        if line.kind == "not-fitted" and line.check[0] == "S"
    }
    without_delay = {"S11/mean", "S11/variance"}  # the steering law, not played here
    assert len(not_fitted) == 10
    assert {not_fitted[line] for line in not_fitted.keys() - without_delay} == {"misses"}
    assert not passes(rule_of(LINES, verdicts, load_split().rule, {}))


def test_delay_costs_two_persons_time_also_in_the_worst_of_their_intervals():
    _, found = played("adaptive", "lag", "excavator")
    assert found["S8/slope"].low > 1.0  # 75 ms alone take more than two persons to be sure of
    assert found["S17/increase"].low > 0.1


def test_the_seed_decides_who_the_persons_are_and_the_number_of_processes_nothing():
    chosen = [e for e in EXPERIMENTS if e.name == "latency"]

    def times(**setting):
        of = OperatorsSetting("adaptive", persons=1, quick=True, **setting)
        cells = play_experiments(chosen, of)["latency"]
        return {cell: trials["movement_time_s"].tolist() for cell, trials in cells.items()}

    alone = times()
    assert alone == times(workers=2)
    assert times(seed=2)["more"] != alone["more"]


@pytest.mark.soak
def test_what_is_written_is_the_same_bytes_each_time(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(experiments, "QUICK_PERSONS", 3)
    for name in ("one", "two"):
        out = tmp_path / name
        options = ValidateOptions("operators", out=out, quick=True, jobs=2, strategy="oracle")
        assert validate(options) == 4
    assert "negative" not in capsys.readouterr().err
    files = sorted(p.relative_to(tmp_path / "one") for p in (tmp_path / "one").rglob("*.*"))
    assert {f.name for f in files} >= {
        "evidence.csv",
        "evidence.parquet",
        "steered.csv",
        "index.html",
    }
    pictures = {"evidence", "moving", "pushed", "looks"}
    assert {f.stem for f in files if f.suffix == ".svg"} == pictures
    for file in files:
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes()
    lines = [line for line in read_evidence(tmp_path / "one/evidence.csv") if line.group != RULE]
    assert {line.line for line in lines} == {line.id for line in LINES}
    assert {line.verdict for line in lines} == {"holds", "misses", "shown only"}
