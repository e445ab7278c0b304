"""A contrast that rests on a class of the user's that failed is withheld, and all say why."""

import json

import pytest
from helpers.processes.command_line import call
from helpers.studies.report_text import blank_pictures

import dva_sim
from dva_sim.experiments.report.summary import Reading
from dva_sim.experiments.results.results import Results
from dva_sim.kernel.errors import ExitCode

POLICY = """
from dva_sim.core.dispatch import Policy
class Mine(Policy):
    def advise(self, situation, rng):
        raise RuntimeError("no idea")
"""
STUDY = """
question: Is mine better?
seed: 5
persons: 2
replications: 1
factors:
  dispatch.policy: [min_eta, "mine.py:Mine"]
parts:
  shift: {scenario: small-shift, changes: {horizon_s: 3600}}
answer:
  part: shift
  measure: response_mean_s
  factor: dispatch.policy
  contrast: ["mine.py:Mine", min_eta]
  smallest_effect_s: 2
comparisons:
  waiting:
    part: shift
    measure: confirmation_mean_s
    factor: dispatch.policy
    contrast: ["mine.py:Mine", min_eta]
"""


@pytest.fixture
def study(tmp_path):
    (tmp_path / "mine.py").write_text(POLICY)
    (tmp_path / "study.yaml").write_text(STUDY)
    return tmp_path / "study.yaml"


@pytest.mark.system
def test_a_policy_that_always_fails_is_compared_with_nothing(study, tmp_path):
    out = tmp_path / "out"
    with blank_pictures():
        ran = call("run", study, "-o", out, "--jobs", "1")
    assert ran.returncode == ExitCode.RUNS_FAILED
    assert "part shift" in ran.stderr
    reading = Reading(Results.load(out))
    assert reading.finding is None
    assert reading.answer.lead.startswith("The answer is withheld")
    assert [c.difference for c in reading.judgement.compared if c.difference is not None] == []
    assert any("no contrast" in line for line in reading.warnings)
    assert "The answer is withheld" in (out / "report.html").read_text()
    assert not list(out.glob("figures/answer*"))
    assert json.loads(call("show", out, "--json").stdout)["answer"]["finding"] is None
    for more in ((), ("--fail-if", "share(confirmed) < 95 %"), ("--json",)):
        compared = call("compare", out, out, *more)
        assert compared.returncode == ExitCode.MISTAKE
        assert "part shift of A" in compared.stderr


def test_without_a_failure_nothing_is_withheld(study, tmp_path):
    (tmp_path / "mine.py").write_text(POLICY.replace('raise RuntimeError("no idea")', "return []"))
    results = dva_sim.run(study, tmp_path / "out", jobs=1, report=False)
    assert Reading(results).distrusted == {}
    assert Reading(results).finding is not None
