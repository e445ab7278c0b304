"""Case files: parameters read from the scenario, and mistakes told with their place."""

import math

import pytest
from helpers.paths import ROOT

from dva_sim.kernel.errors import ConfigError
from dva_sim.validation.dispatch import exact
from dva_sim.validation.dispatch.cases import load_cases

CASE = """
cases:
  queue:
    title: A queue
    formula: {formula}
    parameters: {parameters}
    measures: {measures}
    scenario:
      model: timed
      responders: [{{name: guard, count: 2, look: {look}}}]
      demand: [{{kind: fire, between: {between}}}]
"""
GIVEN = {
    "formula": "mmc",
    "parameters": "{arrival_rate: $demand.fire.between, mean_service_s: $responders.0.look, "
    "servers: $responders.guard.count}",
    "measures": "[wait_s, delayed]",
    "look": "{law: exponential, mean_s: 3}",
    "between": "{law: exponential, mean_s: 2}",
}


def load(tmp_path, **changes):
    path = tmp_path / "mine.yaml"
    path.write_text(CASE.format(**(GIVEN | changes)))
    return load_cases(str(path))


@pytest.mark.system
def test_the_shipped_cases_are_known_exactly():
    cases = load_cases()
    assert len(cases) > 30
    assert all(math.isfinite(value) for case in cases for value in case.exact.values())
    assert all(case.source for case in cases)


def test_parameters_are_read_from_the_scenario(tmp_path):
    (case,) = load(tmp_path)
    expected = exact.mmc(1 / 2, 3.0, 2)
    assert case.exact == {"wait_s": expected["wait_s"], "delayed": expected["delayed"]}
    assert case.scenario.drain


def test_other_numbers_give_other_answers_without_code(tmp_path):
    (case,) = load(tmp_path, look="{law: exponential, mean_s: 1}")
    assert case.exact["wait_s"] == exact.mmc(1 / 2, 1.0, 2)["wait_s"]


def test_a_law_becomes_what_the_formula_wants(tmp_path):
    (case,) = load(
        tmp_path,
        formula="mg1",
        parameters="{arrival_rate: $demand.fire.between, "
        "service: {law: gamma, mean_s: 1, shape: 2}}",
    )
    assert case.exact["wait_s"] == pytest.approx(0.5 * 1.5 / (2 * 0.5))


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"formula": "mm2"}, "formula 'mm2' is unknown; known: mmc"),
        ({"measures": "[stay]"}, "measure 'stay' is unknown"),
        ({"measures": "[lost]"}, "'lost' is unknown; known: utilisation"),
        ({"measures": "{wait_s: 3.5}"}, "compared with a number: say its source"),
        ({"look": "3"}, "mean_service_s needs an exponential law, not constant"),
        ({"look": "{law: exponential, mean_s: 5}"}, "offered 1.25 of what they can do"),
        ({"parameters": "{rate: 1}"}, "has no parameter 'rate'; it has arrival_rate"),
        ({"parameters": "{arrival_rate: 0.1}"}, "needs the parameter 'mean_service_s'"),
        ({"parameters": "{arrival_rate: $demand.flood.between}"}, "there is no 'flood'"),
    ],
)
def test_a_mistake_is_told_with_the_case_and_its_line(tmp_path, changes, problem):
    with pytest.raises(ConfigError, match=problem) as error:
        load(tmp_path, **changes)
    assert str(error.value).startswith(f"{tmp_path / 'mine.yaml'}:3:3: case 'queue'")


def test_a_file_without_cases_is_refused(tmp_path):
    path = tmp_path / "none.yaml"
    path.write_text("cases: {}\n")
    with pytest.raises(ConfigError, match="at least 1"):
        load_cases(str(path))


def test_an_unknown_file_is_refused():
    with pytest.raises(ConfigError, match=r"'dispach' .*'dispatch'"):
        load_cases("dispach")


def test_the_shipped_policy_of_stages_lies_beside_the_cases():
    root = ROOT
    assert (root / "experiments/validation/stages.py").is_file()
