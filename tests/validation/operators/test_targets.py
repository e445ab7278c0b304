"""The files of targets and of the split: complete, consistent, and true to where they come from."""

import csv

from dva_sim.agents.operator.published import (
    lines_of,
    load_split,
    load_targets,
    ranges,
)
from dva_sim.kernel import resources

_COMPARISONS = ("first", "second", "third")
LINES = {line.id: line for line in lines_of(load_targets(), load_split())}


def test_the_shipped_split_assigns_every_check_once():
    kinds = load_split().kinds()
    assert kinds.keys() == load_targets().checks.keys()
    counts = {kind: list(kinds.values()).count(kind) for kind in set(kinds.values())}
    assert counts == {"exact": 11, "held-out": 14, "fitted": 23, "remembered": 2}


def test_no_publication_is_both_fitted_to_and_held_out():
    split = load_split()
    assert split.fit.keys().isdisjoint(split.held_out)
    assert len(split.fit) == 5


def test_what_each_comparison_found_is_kept_line_by_line():
    path = resources.find("operators", "experiments/validation").with_name("operators-history.csv")
    rows = {r["line"]: r for r in csv.DictReader(path.read_text(encoding="utf-8").splitlines())}
    early = [line for line in LINES.values() if line.kind != "beside" and line.check[0] == "S"]
    assert rows.keys() >= {line.id for line in early}
    held_out = [line for line in early if line.kind == "held-out"]
    passed = [sum(line.holds(float(rows[line.id][n])) for line in held_out) for n in _COMPARISONS]
    assert passed == [7, 9, 8]


def test_people_were_watched_up_to_a_delay_of_one_and_a_half_seconds():
    assert ranges("adaptive") == ((0.0, 0.225), (1.0, 1.5))  # nobody was watched in between
    assert ranges("pursuit") == ((0.0, 0.225),)
    assert ranges("oracle") == ()  # of which nothing was published
