"""The files of targets and of the split: complete, consistent, and true to where they come from."""

import csv
import runpy
from datetime import date

import pytest

from dva_sim.agents.operator.published import (
    ComparisonConfig,
    blind_lines,
    check_comparisons,
    load_history,
    load_split,
    load_targets,
    ranges,
    target_lines,
)
from dva_sim.kernel import resources
from dva_sim.kernel.errors import ConfigError
from dva_sim.validation.evidence import read_evidence

_COMPARISONS = ("first", "second", "third")
LINES = {line.id: line for line in target_lines(load_targets(), load_split())}


def test_the_shipped_split_assigns_every_check_once():
    kinds = load_split().kinds()
    assert kinds.keys() == load_targets().checks.keys()
    counts = {kind: list(kinds.values()).count(kind) for kind in set(kinds.values())}
    assert counts == {"exact": 11, "not-fitted": 14, "fitted": 32, "remembered": 2}


def test_no_publication_is_both_fitted_to_and_not_fitted():
    split = load_split()
    assert split.fit.keys().isdisjoint(split.not_fitted)
    assert len(split.fit) == 9


def test_what_each_comparison_found_is_kept_line_by_line():
    path = resources.find("operators", "experiments/validation").with_name("operators-history.csv")
    rows = {r["line"]: r for r in csv.DictReader(path.read_text(encoding="utf-8").splitlines())}
    early = [line for line in LINES.values() if line.kind != "beside" and line.check[0] == "S"]
    assert rows.keys() >= {line.id for line in early}
    not_fitted = [line for line in early if line.kind == "not-fitted"]
    passed = [sum(line.holds(float(rows[line.id][n])) for line in not_fitted) for n in _COMPARISONS]
    assert passed == [7, 9, 8]


def test_the_first_comparison_of_a_line_alone_counts_as_blind():
    split = load_split()
    assert blind_lines(LINES.values(), split, load_history()) == {
        "first": (7, 10),
        "fourth": (10, 32),
    }
    blind = ComparisonConfig(day=date(2026, 11, 30), seen="nothing", blind=("ucy-2",))
    seen_twice = dict.fromkeys(("first", "second"), split.comparisons["first"])
    with pytest.raises(ConfigError, match="ucy-2"):
        check_comparisons(split.model_copy(update={"comparisons": {"n": blind}}))
    with pytest.raises(ConfigError, match="blind twice"):
        check_comparisons(split.model_copy(update={"comparisons": seen_twice}))


def test_each_comparison_has_a_column_and_each_column_a_comparison():
    columns = {name for values in load_history().values() for name in values}
    assert columns == load_split().comparisons.keys()


def test_a_comparison_is_kept_once_and_only_if_it_was_written_down_before(tmp_path):
    script = resources.find("operators", "experiments/validation").with_name("keep_comparison.py")
    keep = runpy.run_path(str(script))["keep"]
    rows = [(line, values) for line, values in load_history().items() if line[0] == "A"]
    history = tmp_path / "history.csv"
    history.write_text("line,sixth\n" + "".join(f"{x},{v['sixth']}\n" for x, v in rows))
    evidence = script.parents[2] / "docs/generators/evidence.csv"
    for name in ("ninetieth", "sixth"):
        with pytest.raises(SystemExit, match=name):
            keep(name, evidence, history)

    keep("seventh", evidence, history)
    kept = {row["line"]: row for row in csv.DictReader(history.read_text().splitlines())}
    assert kept["A1/ratio"]["sixth"] == str(dict(rows)["A1/ratio"]["sixth"])
    (judged,) = [e.predicted for e in read_evidence(evidence) if e.line == "S7/75"]
    assert (kept["S7/75"]["sixth"], float(kept["S7/75"]["seventh"])) == ("", pytest.approx(judged))


def test_people_were_watched_up_to_a_delay_of_one_and_a_half_seconds():
    assert ranges("adaptive") == ((0.0, 0.225), (1.0, 1.5))  # nobody was watched in between
    assert ranges("pursuit") == ((0.0, 0.225),)
    assert ranges("oracle") == ()  # of which nothing was published
