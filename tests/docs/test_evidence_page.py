"""The page of evidence: its head, its misses, and a table of today's targets and bands."""

import math
import re

import generators
import pytest
from generators import evidence

from dva_sim.agents.operator.published import load_split, load_targets, target_lines
from dva_sim.experiments.study.loading import load_study
from dva_sim.validation.dispatch.cases import load_cases
from dva_sim.validation.evidence import RULE, SUBJECTS, judged, passes
from dva_sim.validation.evidence_page import TITLES
from dva_sim.validation.network.beside.measured import asked_by
from dva_sim.validation.network.beside.predictions import read_kept
from dva_sim.validation.network.reference import load_plan, load_runs
from dva_sim.validation.operators.evidence import judge

PAGE = evidence.page()
KEPT = evidence.kept()


def claims(subject):
    return {line.line: line for line in KEPT[subject] if line.group != RULE}


def test_the_page_is_generated_and_has_all_four_subjects():
    assert generators.PAGES["explanation/evidence.md"] is evidence.page
    assert all(KEPT[subject] for subject in SUBJECTS)
    assert re.findall(r"^## (.*)$", PAGE, re.MULTILINE) == [TITLES[s] for s in SUBJECTS]


def test_the_head_names_every_subject_whose_rule_fails():
    head = PAGE.split("\n\n")[1]
    fail = [TITLES[subject] for subject in SUBJECTS if not passes(KEPT[subject])]
    assert head.startswith(f"**{len(fail)} of {len(SUBJECTS)} rules fail: ")
    assert [TITLES[s] for s in SUBJECTS if TITLES[s] in head] == fail


@pytest.mark.parametrize("subject", SUBJECTS)
def test_every_line_that_misses_has_a_row_with_its_source_or_the_one_above(subject):
    section = PAGE.partition(f"## {TITLES[subject]}\n")[2].partition("\n## ")[0]
    missing = [line for line in judged(KEPT[subject]) if line.verdict == "misses"]
    assert [line.line for line in missing if f"| `{line.line}` |" not in section] == []
    sources = {line.source for line in missing}
    assert [source for source in sources if evidence.prose(source) not in section] == []


def test_kept_lines_of_operators_are_those_of_the_targets():
    lines = target_lines(load_targets(), load_split())
    kept = claims("operators")
    for today in judge(lines, {}):
        then = kept[today.line]
        assert (then.measured, then.low, then.high) == (today.measured, today.low, today.high)
        assert (then.group, then.claim, then.source) == (today.group, today.claim, today.source)
    assert len(kept) == len(lines)


@pytest.mark.system  # exact values take seconds
def test_kept_lines_of_dispatch_have_the_exact_values_of_the_cases():
    kept = claims("dispatch")
    exact = {
        f"{case.name} {measure}": value
        for case in load_cases()
        for measure, value in case.exact.items()
    }
    off = [name for name, value in exact.items() if not math.isclose(kept[name].measured, value)]
    assert off == []


def test_kept_lines_of_middleware_have_the_kept_bands():
    bands = read_kept()
    kept = claims("middleware")
    for cell in asked_by(load_study("middleware")):
        for measure, band in bands.get((cell.config, cell.seeds), {}).items():
            line = kept[" ".join((*cell.levels.values(), measure))]
            assert (line.low, line.predicted, line.high) == band


def test_kept_lines_of_the_network_are_of_kept_measurements():
    labels = {run.condition.label for run in load_runs(load_plan().sources)}
    assert {line.split()[0] for line in claims("network")} == labels


@pytest.mark.system  # it draws
def test_the_figure_has_a_panel_for_each_subject_and_stands_beside_the_page():
    drawn = evidence.picture().decode()
    assert len(re.findall(r'<g id="axes_\d+">', drawn)) == len(SUBJECTS)
    assert f"({evidence.PICTURE.rpartition('/')[2]})" in PAGE
