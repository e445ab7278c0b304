"""The document of the comparison, and the tables it names."""

import csv
from importlib import resources as packages

import pytest

from dva_sim.kernel.errors import ConfigError
from dva_sim.validation.network.real_side.measuring import shortened
from dva_sim.validation.network.reference import (
    NUMBERS,
    BlockConfig,
    SourceConfig,
    conditions_of,
    load_plan,
    load_runs,
    read_runs,
)
from dva_sim.validation.network.verdicts import grouped


def test_the_design_has_what_the_reference_lacks():
    """At least 11 lossy conditions of six seeds, 30 in all, none of them in the reference."""
    plan = load_plan()
    own = {c: b.seeds for b in plan.own.blocks for c in conditions_of(b)}
    assert len(own) >= 30
    assert sum(seeds >= 6 for c, seeds in own.items() if c.loss > 0) >= 11
    known = {run.condition for run in load_runs({"reference": plan.reference})}
    assert not known & own.keys()


def test_the_reference_has_739_runs_and_29_pooled_conditions_under_loss():
    runs = load_runs({"reference": load_plan().reference})
    assert len(runs) == 739
    kinds = [group.kind for group in grouped(runs) if not group.left_out]
    assert kinds.count("pooled") == 29
    assert len(kinds) >= 150


def test_every_link_meets_every_pair_of_programs():
    block = BlockConfig(
        group="x",
        settings={"dur_s": 9},
        links={"near": {"delay_ms": 10}, "far": {"delay_ms": 200}},
        programs={"p": {"pattern": "pub", "hz": 10}, "d": {"pattern": "dealer", "hz": 20}},
    )
    found = [(c.pattern, c.delay_ms, c.dur_s) for c in conditions_of(block)]
    both = ("pub-sub", "pipelined")
    assert found == [(pattern, delay, 9) for delay in (10, 200) for pattern in both]
    assert [(c.pattern, c.delay_ms) for c in shortened(block)] == [
        ("pub-sub", 10),
        ("pipelined", 200),
    ]


def test_a_value_that_is_no_number_is_told_with_its_line(tmp_path):
    reference = packages.files("dva_sim").parent / "experiments/validation/network-reference.csv"
    with reference.open() as file:
        rows = list(csv.DictReader(file))[:3]
    rows[1]["age_p50"] = "soon"
    path = tmp_path / "some.csv"
    with path.open("w") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    assert "age_p50" in NUMBERS
    with pytest.raises(ConfigError, match=r"some\.csv:3"):
        read_runs("own", SourceConfig(file=str(path), made_with={}))
