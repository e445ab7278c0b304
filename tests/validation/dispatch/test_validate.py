"""The command as a whole, on cases that take a second."""

import pytest
from helpers.wording import unnamed

from dva_sim.cli.validation import validate
from dva_sim.options.studies import ValidateOptions
from dva_sim.validation.dispatch import checks
from dva_sim.validation.dispatch.cases import load_cases
from dva_sim.validation.dispatch.checks import check_cases
from dva_sim.validation.dispatch.identities import IDENTITIES, check_identity
from dva_sim.validation.evidence import read_evidence

pytestmark = pytest.mark.system

FILE = """
cases:
  queue:
    title: A queue
    source: {source}
    formula: mmc
    parameters:
      arrival_rate: $demand.fire.between
      mean_service_s: $responders.guard.look
      servers: 2
      at_s: [1, 2, 3]
    measures: {measures}
    loosely: {{wait_beyond/1: beyond_1, wait_beyond/2: beyond_2, wait_beyond/3: beyond_3}}
    runs: 4
    quick_runs: 2
    batches: 10
    scenario:
      model: timed
      responders: [{{name: guard, count: 2, look: {{law: exponential, mean_s: 2}}}}]
      demand: [{{kind: fire, between: {{law: exponential, mean_s: 2}}}}]
      warm_up_s: 40
      horizon_s: 640
"""


def a_file(tmp_path, measures="[wait_s, utilisation]", source="''"):
    path = tmp_path / "cases.yaml"
    path.write_text(FILE.format(measures=measures, source=source))
    return str(path)


@pytest.fixture
def only_one_identity(monkeypatch):
    monkeypatch.setattr(checks, "IDENTITIES", {"rotation": IDENTITIES["rotation"]})


def test_a_right_core_passes_and_says_what_is_too_rough(tmp_path, capsys, only_one_identity):
    assert (
        validate(ValidateOptions("dispatch", cases=a_file(tmp_path), quick=True, jobs=1, seed=1))
        == 0
    )
    output = capsys.readouterr().out
    assert not unnamed(output, "lines hold", "too rough", "The rule holds", "quick run")


def test_a_full_run_that_is_too_rough_fails(tmp_path, only_one_identity):
    assert (
        validate(ValidateOptions("dispatch", cases=a_file(tmp_path), quick=False, jobs=1, seed=1))
        == 4
    )


def test_a_wrong_answer_fails(tmp_path, capsys, only_one_identity):
    path = a_file(tmp_path, measures="{utilisation: 0.6}", source="wrong on purpose")
    assert validate(ValidateOptions("dispatch", cases=path, quick=True, jobs=1, seed=1)) == 4
    output = capsys.readouterr().out
    assert not unnamed(output, ": queue utilisation", ": all checks")


@pytest.mark.soak
def test_what_is_written_is_the_same_bytes_each_time(tmp_path, only_one_identity):
    path = a_file(tmp_path)
    for name in ("one", "two"):
        validate(
            ValidateOptions("dispatch", out=tmp_path / name, cases=path, quick=True, jobs=1, seed=3)
        )
    files = sorted(p.relative_to(tmp_path / "one") for p in (tmp_path / "one").rglob("*.*"))
    assert {f.name for f in files} >= {"evidence.csv", "evidence.parquet", "index.html"}
    assert {f.stem for f in files if f.suffix == ".svg"} == {"evidence"}
    for file in files:
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes()
    lines = {line.line: line for line in read_evidence(tmp_path / "one/evidence.csv")}
    wait = lines["queue wait_s"]
    assert wait.predicted_low < wait.predicted < wait.predicted_high
    assert not unnamed(wait.note, "SE", "without controls")
    assert "seed: 3" in lines["all checks"].source


@pytest.mark.soak
def test_the_number_of_processes_changes_nothing(tmp_path):
    cases = load_cases(a_file(tmp_path))
    alone, together = (check_cases(cases, 2, True, workers) for workers in (1, 2))
    assert alone == together


def test_what_holds_without_chance_is_judged_to_the_last_digit(tmp_path):
    checks = check_cases(load_cases(a_file(tmp_path)), 1, True, 1)
    exact = [line for line in checks if line.group == "Identities"]
    assert [line.predicted_low for line in exact] == [None] * 4
    assert all(line.verdict == "holds" for line in exact)


def test_a_case_that_seems_to_differ_is_played_again_and_longer(tmp_path):
    path = a_file(tmp_path, measures="{utilisation: 0.6}", source="wrong on purpose")
    (check,) = (c for c in check_cases(load_cases(path), 1, True, 1) if c.claim == "utilisation")
    (once, *_) = check_cases(load_cases(a_file(tmp_path)), 1, True, 1)
    assert 3.5 < check.sample / once.sample < 4.5
    assert "4 times" in check.note
    assert check.verdict == "misses"


@pytest.mark.soak
@pytest.mark.parametrize("name", IDENTITIES)
def test_an_identity_holds_with_other_random_numbers(name):
    assert all(off == 0.0 for _, off in check_identity(name, seed=8))
