"""The command on a few conditions: what it tells, writes and finds out."""

from dataclasses import replace

import pytest
from helpers.wording import unnamed

from dva_sim.cli import validation
from dva_sim.validation.evidence import passes, read_evidence
from dva_sim.validation.network import comparison, evidence
from dva_sim.validation.network.comparison import NetworkSetting, compare
from dva_sim.validation.network.reference import load_plan, load_runs
from dva_sim.validation.network.verdicts import grouped

pytestmark = pytest.mark.system

LABELS = (
    *("req10_d100_j0_l0_r0_p5_T2500", "pub50_d0_j0_l0_r64_p5", "pub10_d50_j0_l5_r0_p5"),
    *("req10_d50_j0_l5_r0_p5_T2500", "req10_d100_j20_l5_r0_p5_T2500"),
    "pub50_d100_j0_l0_r0_p100",
)
QUICK = NetworkSetting(seed=1, quick=True)


@pytest.fixture(scope="module", autouse=True)
def _few_runs():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(comparison, "QUICK_RUNS", 12)
        patch.setattr(comparison, "QUICK_CONTROL_RUNS", 6)
        yield


@pytest.fixture(scope="module")
def runs():
    every = load_runs({"reference": load_plan().reference})
    return [run for run in every if run.condition.label in LABELS]


@pytest.fixture(scope="module")
def compared(runs):
    return compare(grouped(runs), QUICK)


def test_each_condition_is_judged_by_its_kind(compared):
    kinds = {group.condition.label: group.kind for group in compared.groups}
    assert kinds["req10_d100_j0_l0_r0_p5_T2500"] == "lossless"
    assert kinds["pub50_d0_j0_l0_r64_p5"] == "overload"
    assert kinds["req10_d100_j20_l5_r0_p5_T2500"] == "single"
    assert kinds["pub10_d50_j0_l5_r0_p5"] == "pooled"


def test_what_is_exact_lies_in_its_band(compared):
    verdicts = {line.line: line.verdict for line in evidence.rule_of(compared)}
    assert verdicts["without loss"] == verdicts["overload"] == "holds"


def test_models_that_are_too_simple_are_found_out(compared):
    assert set(compared.controls) == {"message by message", "datagrams"}
    verdicts = {line.line: line.verdict for line in evidence.rule_of(compared)}
    assert verdicts["control: message by message"] == verdicts["control: datagrams"] == "holds"
    assert compared.controls["datagrams"].rms > 5


def test_what_is_missing_is_counted(compared):
    every, pooled = compared.missing
    assert pooled == 38
    assert every == 150 - len(compared.judged)


def test_a_line_shows_measured_and_predicted_with_its_band(compared):
    lines = {line.line: line for line in evidence.lines_of(compared, {})}
    age = lines["req10_d100_j0_l0_r0_p5_T2500 age_p50"]
    assert age.words[2:] == ("105.3", "105.1", "98.06 to 112.6", "holds")
    assert not age.holds_measured
    assert lines["req10_d100_j20_l5_r0_p5_T2500 age_p95"].holds_measured


def test_lines_of_pooled_conditions_have_z_and_no_band(compared):
    lines = {line.line: line for line in evidence.lines_of(compared, {})}
    pooled = lines["pub10_d50_j0_l5_r0_p5 applied_hz"]
    assert not unnamed(pooled.note, "z ", "p ")
    assert (pooled.low, pooled.high) == (None, None)


def test_a_condition_that_is_not_played_is_shown_with_its_reason(compared):
    group = replace(compared.groups[0], left_out="too slow")
    *_, line = evidence.lines_of(replace(compared, left_out=[group]), {})
    assert (line.line, line.verdict) == (group.condition.label, "shown only")
    assert line.note == "too slow"


def test_a_control_that_is_not_found_out_breaks_the_rule(compared):
    """A model that is too simple, and gives what was measured all the same."""
    right = replace(compared.pooled, significant=(), rms=1.0, expected=(0.5, 2.0), biases={})
    fooled = replace(compared, controls=compared.controls | {"datagrams": right})
    verdicts = {line.line: line.verdict for line in evidence.rule_of(fooled)}
    assert verdicts["control: datagrams"] == "misses"


def test_the_rule_has_a_line_for_each_thing_it_asks(compared):
    rule = list(evidence.rule_of(compared))
    assert {line.line for line in rule} >= {"without loss", "overload", "control: datagrams"}
    values = [value for line in rule for value in (line.predicted, line.low, line.high)]
    assert {type(value) for value in values} == {float, type(None)}  # as a table gives them back


@pytest.mark.parametrize("again", [False, pytest.param(True, marks=pytest.mark.soak)])
def test_the_command_writes_tables_and_figures(runs, tmp_path, capsys, monkeypatch, again):
    """And the same bytes again."""
    monkeypatch.setattr(comparison, "QUICK_RUNS", 2)
    monkeypatch.setattr(comparison, "QUICK_CONTROL_RUNS", 2)
    few = [run for run in runs if run.condition.label == LABELS[0]]
    first, second = tmp_path / "a", tmp_path / ("b" if again else "a")
    for folder in dict.fromkeys([first, second]):
        assert validation.judge_runs(few, {}, folder, QUICK, {}) == 0
    assert not unnamed(capsys.readouterr().out, "7 of 7 lines hold", "conditions are judged")
    files = [path.relative_to(first) for path in first.rglob("*") if path.is_file()]
    assert {str(f) for f in files} >= {"index.html", "evidence.csv", "figures/evidence.png"}
    for file in files:
        assert (first / file).read_bytes() == (second / file).read_bytes()
    verdicts = {line.verdict for line in read_evidence(first / "evidence.csv")}
    assert verdicts == {"holds", "shown only"}


def test_the_number_of_processes_changes_nothing(runs, monkeypatch):
    monkeypatch.setattr(comparison, "QUICK_RUNS", 2)
    one = [run for run in runs if run.condition.label == "req10_d50_j0_l5_r0_p5_T2500"]
    alone, together = (
        compare(grouped(one), NetworkSetting(quick=True, workers=workers)) for workers in (1, 2)
    )
    assert [s.z for s in alone.pooled.scored] == [s.z for s in together.pooled.scored]


def test_a_mechanism_that_is_left_out_has_its_line(runs, monkeypatch):
    monkeypatch.setattr(comparison, "QUICK_RUNS", 2)
    one = [run for run in runs if run.condition.label == "pub10_d50_j0_l5_r0_p5"]
    found = compare(grouped(one), NetworkSetting(quick=True, ablate=True))
    left_out = {name for name, *_ in evidence.ablation(found)}
    assert {"nothing", "datagrams", "tail-loss probe", "RACK"} <= left_out


def test_what_judges_nothing_does_not_pass():
    lines = list(evidence.rule_of(compare([], QUICK)))
    assert lines == []
    assert not passes(lines)
