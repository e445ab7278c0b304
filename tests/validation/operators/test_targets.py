"""The files of targets and of the split: complete, consistent, and true to where they come from."""

import csv

import pytest

from dva_sim.agents.operator.published import (
    SplitFile,
    TargetFile,
    lines_of,
    load_split,
    load_targets,
    ranges,
)
from dva_sim.kernel import resources
from dva_sim.kernel.config import validate
from dva_sim.kernel.errors import ConfigError

_COMPARISONS = ("first", "second", "third")
LINES = {line.id: line for line in lines_of(load_targets(), load_split())}


def targets(tag="V", **line):
    check = {"metric": "m", "tag": tag, "source": "s", "lines": {"one": {"what": "w", **line}}}
    return {"tags": {"V": "seen", "M": "memory"}, "support": {}, "checks": {"T": check}}


def split(**groups):
    rest = {"exact": {}, "fit": {}, "held_out": {}, "memory": {}}
    rule = {"exact": 1.0, "held_out": 0.8}
    return validate(SplitFile, {"rule": rule, "strategy": "pursuit", **rest, **groups})


def test_the_shipped_split_assigns_every_check_once():
    kinds = load_split().kinds()
    assert kinds.keys() == load_targets().checks.keys()
    counts = {kind: list(kinds.values()).count(kind) for kind in set(kinds.values())}
    assert counts == {"exact": 11, "held-out": 14, "fitted": 23, "remembered": 2}


def test_no_publication_is_both_fitted_to_and_held_out():
    split = load_split()
    assert split.fit.keys().isdisjoint(split.held_out)
    assert len(split.fit) == 5


def test_a_check_assigned_twice_is_refused():
    with pytest.raises(ConfigError, match="'T'"):
        split(fit={"a": ("T",)}, held_out={"b": ("T",)}).kinds()


def test_a_check_that_is_not_assigned_is_refused():
    with pytest.raises(ConfigError, match="T"):
        lines_of(validate(TargetFile, targets(low=1)), split())


def test_what_is_known_from_memory_cannot_be_held_out():
    with pytest.raises(ConfigError, match=r"T .*held-out"):
        lines_of(validate(TargetFile, targets("V,M", low=1)), split(held_out={"a": ("T",)}))


@pytest.mark.parametrize(
    "band",
    [{}, {"above": 1}, {"low": 2, "high": 1}, {"beside": True}]
    + [{"beside": True, "target": 1, limit: 1} for limit in ("low", "above")],
)
def test_a_line_that_everything_or_nothing_passes_is_refused(band):
    with pytest.raises(ConfigError):
        validate(TargetFile, targets(**band))


def test_a_tag_without_a_meaning_is_refused():
    with pytest.raises(ConfigError, match=r"'X' of T .*V, M"):
        validate(TargetFile, targets("X", low=1))


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
