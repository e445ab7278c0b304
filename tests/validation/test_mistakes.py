"""Mistakes in cases, plans, targets and tables of the evidence, and in calls that ask for it."""

from operator import call
from pathlib import Path

from helpers.dva.queue_case import load_case
from helpers.mistakes import check_mistake, each_mistake, mistakes, of_file

from dva_sim.agents.operator.published import SplitFile, TargetFile, target_lines
from dva_sim.cli.validation import validate
from dva_sim.kernel.config import validate as checked
from dva_sim.network.pattern_runs import Condition
from dva_sim.options.studies import ValidateOptions
from dva_sim.simulation.timed import build
from dva_sim.simulation.timed.distributions import Constant
from dva_sim.validation.dispatch import exact
from dva_sim.validation.dispatch.batch_measures import check_name
from dva_sim.validation.dispatch.cases import load_cases
from dva_sim.validation.network.beside.predictions import read_kept
from dva_sim.validation.network.prediction import predict
from dva_sim.validation.network.real_side.measuring import Table
from dva_sim.validation.network.reference import (
    NUMBERS,
    BlockConfig,
    SourceConfig,
    conditions_of,
    read_runs,
)

GUARDS = {"model": "timed", "responders": [{"name": "guard", "count": 2, "look": 3}]}
DEMAND = {"demand": [{"between": {"law": "exponential", "mean_s": 2.0}}]}


def case(changes):
    load_case(Path(), **changes)


def measure(name):
    check_name(name, build(GUARDS | DEMAND))


def block(link):
    conditions_of(BlockConfig(group="x", links={"a": link}, programs={"p": {"pattern": "pub"}}))


def runs_of(name):
    read_runs("own", SourceConfig(file=name, made_with={}))


def table(name):
    Table(Path(name), ("cell", "age"))


def mechanism(name):
    predict(Condition("pub", 50, loss=0.05, delay_ms=50, dur_s=12), 1, without=[name])


def targets(tag="V", **line):
    """A file of one target of one line."""
    check = {"metric": "m", "tag": tag, "source": "s", "lines": {"one": {"what": "w", **line}}}
    tags = {"V": "seen", "M": "memory"}
    return checked(TargetFile, {"tags": tags, "support": {}, "checks": {"T": check}})


def split_of(**groups):
    rest = {"exact": {}, "fit": {}, "not_fitted": {}, "memory": {}}
    rule = {"exact": 1.0, "not_fitted": 0.8}
    return checked(SplitFile, {"rule": rule, "strategy": "pursuit", **rest, **groups})


def evidence(what, **options):
    validate(ValidateOptions(what, **options))


MISTAKES = [
    *mistakes(
        case,
        ({"formula": "mm2"}, "mine.yaml:3:3: case 'queue' 'mm2' mmc"),
        ({"measures": "[stay]"}, "mine.yaml:3:3: case 'queue' 'stay'"),
        ({"measures": "[lost]"}, "mine.yaml:3:3: case 'queue' 'lost' utilisation"),
        ({"measures": "{wait_s: 3.5}"}, "mine.yaml:3:3: case 'queue' source"),
        ({"look": "3"}, "mine.yaml:3:3: mean_service_s exponential constant"),
        ({"look": "{law: exponential, mean_s: 5}"}, "mine.yaml:3:3: 1.25"),
        ({"parameters": "{rate: 1}"}, "mine.yaml:3:3: 'rate'; arrival_rate"),
        ({"parameters": "{arrival_rate: 0.1}"}, "mine.yaml:3:3: 'mean_service_s'"),
        ({"parameters": "{arrival_rate: $demand.flood.between}"}, "mine.yaml:3:3: 'flood'"),
    ),
    *mistakes(of_file(load_cases, "none.yaml"), ("cases: {}\n", "none.yaml cases 1")),
    *mistakes(load_cases, ("dispach", "'dispach' 'dispatch'")),
    *mistakes(
        measure,
        ("waiting", "measure 'waiting'"),
        ("wait_s@flood", "stream 'flood' fire"),
        ("workload/guard-3", "responder 'guard-3' guard-1, guard-2"),
        ("utilisation/robots", "group 'robots' operators, guard"),
        ("wait_beyond/long", "seconds"),
        ("share/guard-1", "stream ''"),
    ),
    *mistakes(
        call,
        (lambda: exact.mmc(3.0, 1, 3), "offered"),
        (lambda: exact.mg1(1.0, Constant(mean_s=1.0)), "offered"),
        (lambda: exact.priorities([1.0, 1.0], 1, 2), "offered"),
        (lambda: exact.hypercube([3.0], [[1, 2, 3]], 1), "offered"),
        (lambda: exact.hypercube([1.0], [[1, 1, 2]], 1), "units 1 to 3"),
        error=ValueError,
    ),
    *mistakes(
        call,
        (lambda: split_of(fit={"a": ("T",)}, not_fitted={"b": ("T",)}).kinds(), "'T'"),
        (lambda: target_lines(targets(low=1), split_of()), "T"),
        (
            lambda: target_lines(targets("V,M", low=1), split_of(not_fitted={"a": ("T",)})),
            "T not-fitted",
        ),
        (lambda: targets("X", low=1), "'X' T V, M"),
        (lambda: targets(), "lines.one"),
        (lambda: targets(above=1), "lines.one"),
        (lambda: targets(low=2, high=1), "lines.one"),
        (lambda: targets(beside=True), "lines.one"),
        (lambda: targets(beside=True, target=1, low=1), "lines.one"),
        (lambda: targets(beside=True, target=1, above=1), "lines.one"),
    ),
    *mistakes(block, ({"delay": 3}, "'delay' 'delay_ms'")),
    *mistakes(
        of_file(runs_of, "own.csv"),
        ("a,b\n1,2\n", "group, seed, n_sent"),
        (f"group,seed,{','.join(NUMBERS)}\n", "no runs"),
        ("", "no runs"),
    ),
    *mistakes(of_file(table, "own.csv"), ("cell,length\n", "own.csv columns")),
    *mistakes(table, (".", ". written")),
    *mistakes(of_file(read_kept, "mine.csv"), ("config,seeds\na1,x\n", "mine.csv")),
    *mistakes(mechanism, ("FRTO", "'FRTO' send buffer")),
    *mistakes(
        call,
        (lambda: evidence("robots"), "dispatch, operators network"),
        (lambda: evidence("operators", cases="mine.yaml"), "--cases dispatch"),
        (lambda: evidence("operators", strategy="telepathy"), "'telepathy'"),
        (lambda: evidence("dispatch", strategy="pursuit"), "--strategy operators"),
        (lambda: evidence("network", strategy="adaptive"), "--strategy operators"),
        (lambda: evidence("dispatch", ablate=True), "--ablate, --live, --measure --beside"),
        (lambda: evidence("dispatch", beside="middleware"), "--beside"),
        (lambda: evidence("network", beside="processing-time", quick=True), "middleware"),
        (lambda: evidence("network", beside=".", quick=True), "results"),
    ),
]


@each_mistake(MISTAKES)
def test_a_mistake_ends_in_one_line_with_its_names(tmp_path, act, error, names):
    check_mistake(tmp_path, act, error, names)
