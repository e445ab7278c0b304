"""Case files: parameters read from the scenario."""

import math

import pytest
from helpers.dva.queue_case import load_case
from helpers.paths import ROOT

from dva_sim.validation.dispatch import exact
from dva_sim.validation.dispatch.cases import load_cases


@pytest.mark.system
def test_the_shipped_cases_are_known_exactly():
    cases = load_cases()
    assert len(cases) > 30
    assert all(math.isfinite(value) for case in cases for value in case.exact.values())
    assert all(case.source for case in cases)


def test_parameters_are_read_from_the_scenario(tmp_path):
    (case,) = load_case(tmp_path)
    expected = exact.mmc(1 / 2, 3.0, 2)
    assert case.exact == {"wait_s": expected["wait_s"], "delayed": expected["delayed"]}
    assert case.scenario.drain


def test_other_numbers_give_other_answers_without_code(tmp_path):
    (case,) = load_case(tmp_path, look="{law: exponential, mean_s: 1}")
    assert case.exact["wait_s"] == exact.mmc(1 / 2, 1.0, 2)["wait_s"]


def test_a_law_becomes_what_the_formula_wants(tmp_path):
    (case,) = load_case(
        tmp_path,
        formula="mg1",
        parameters="{arrival_rate: $demand.fire.between, "
        "service: {law: gamma, mean_s: 1, shape: 2}}",
    )
    assert case.exact["wait_s"] == pytest.approx(0.5 * 1.5 / (2 * 0.5))


def test_the_shipped_policy_of_stages_lies_beside_the_cases():
    root = ROOT
    assert (root / "experiments/validation/stages.py").is_file()
