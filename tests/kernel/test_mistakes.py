"""Mistakes in keys, values, options and files: where each is, and what would be right."""

import itertools
import math
from functools import partial
from operator import call
from pathlib import Path

from helpers.mistakes import check_mistake, each_mistake, mistakes, of_file
from helpers.studies.small_study import STUDY

import dva_sim
from dva_sim.core.dispatch import load_policy
from dva_sim.experiments.study.file_kinds import open_study
from dva_sim.experiments.study.study import Study
from dva_sim.kernel import options, resources
from dva_sim.kernel.config import Config, validate
from dva_sim.kernel.retired import RETIRED
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.simulation.models import model_of
from dva_sim.simulation.scenario import Scenario


class Inner(Config):
    delay_s: float = 0.0


class Outer(Config):
    name: str
    inner: Inner = Inner()
    items: tuple[Inner, ...] = ()


class Pair(Config):
    one: int
    other: int
    size: tuple[int, int] = (1, 1)


def outer_of_file(name):
    document = load_yaml(name)
    validate(Outer, document.data, document.error)


ALIASES = "a: &a [1, 2, 3, 4, 5, 6, 7, 8, 9]\n" + "".join(
    f"{x}: &{x} [{', '.join([f'*{y}'] * 9)}]\n" for y, x in itertools.pairwise("abcdefgh")
)

KEYS = [
    *mistakes(
        partial(validate, Pair),
        ({}, "missing 'one' 'other'"),
        ({"one": 1, "other": 2, "size": [1]}, "size: 2 items"),
    ),
    *mistakes(
        partial(validate, Scenario),
        ({"robots": 3}, "'robots'; 'robot.count'?"),
        ({"robots": {}}, "'robots'; 'robot'?"),
        ({"command_rate_hz": 5}, "'command.rate_hz'?"),
        ({"fps": 5}, "'camera.rate_hz'?"),
        ({"latency_ms": 5}, "'link.delay_s'? seconds"),
        ({"link": {"delay_ms": 5}}, "'delay_s'? seconds"),
        ({"link": {"bandwidth": 5}}, "'rate_bps'? bits second"),
        ({"duration": 5}, "'horizon_s'?"),
        ({"filter": "none"}, "'phone.filter'?"),
        ({"policy": "random"}, "'dispatch.policy'?"),
        ({"count": 5}, "'robot.count', 'guard.count' 'bystander.count'?"),
        ({"zebra": 5}, "'zebra'; access, bystander, camera"),
        ({"link": {"delay_s": "500ms"}}, "delay_s: number, '500ms'; 0.5"),
        ({"link": {"loss": "5%"}}, "link.loss: number, '5%'; 0.05"),
        ({"link": {"rate_bps": "2 Mbit/s"}}, "Mbit/s'; 2000000"),
        ({"horizon_s": "1,5"}, "horizon_s: number, '1,5'; 1.5"),
        ({"horizon_s": "5 m"}, "horizon_s: number, '5"),
        ({"link": {"delay_s": math.nan}}, "link.delay_s: finite nan"),
        ({"link": {"delay_s": 500}}, "link.delay_s: most 30 seconds, 500"),
        ({"link": {"recorded": "a.log"}}, "'link.recorded'; 'delay_log'?"),
        ({"link": {"loss": 7}}, "link.loss: most 0.9 share 7"),
        ({"robot": {"charge": 0}}, "robot.charge: above 0, 0"),
        ({"horizon_s": None}, "horizon_s: number, null"),
        ({"robot": {"count": "3"}}, "robot.count: whole '3'"),
        ({"robot": {"count": 3.0}}, "whole point, 3.0"),
        ({"link": 5}, "link: mapping 5, link.delay_s"),
        ({"control": "coordinate"}, "direct, supervisory, 'coordinate'; 'coordinated'?"),
        ({"control": "x" * 500}, "'" + "x" * 59 + "..."),
        ({"link": {"delay_law": {"law": "gama"}}}, "'gama' 'gamma'?"),
        ({"link": {"delay_law": {}}}, "missing 'link.delay_law.law'"),
    ),
    *mistakes(
        partial(validate, Study),
        ({"question": "?", "parts": {"a": {"scenario": "x"}}, "participants": 4}, "'persons'?"),
        ({"question": "?", "parts": {"a": {"scenario": "x"}}, "trials": 4}, "'replications'?"),
    ),
    *mistakes(
        call,
        (lambda: options.number("x", 0, above=0), "'x' 0; number above 0"),
        (lambda: options.number("x", 2, least=0, most=1), "'x' 2; from 0 to 1"),
        (lambda: options.number("x", 1, least=0, below=1), "'x' 1; least 0, below 1"),
        (lambda: options.number("x", math.nan), "'x' nan; number"),
        (lambda: options.number("x", True, least=0), "'x' True; number least 0"),
        (lambda: options.whole_number("x", 1.0, 1, 9), "'x' 1.0; whole from 1 to 9"),
        (lambda: options.one_of("x", "c", ("b", "a")), "'x' 'c'; one a, b"),
        (lambda: options.some_of("x", "a", ("a",)), "'x' 'a'; list some"),
    ),
]

FILES = [
    *mistakes(
        of_file(outer_of_file, "bad.yaml"),
        ("name: a\ninner:\n  delay_ms: 3\n", "bad.yaml:3:3 'inner.delay_ms'; 'delay_s'?"),
        ("name: a\ninner: {delay_s: fast}\n", "bad.yaml:2:9 inner.delay_s"),
        ("inner: {}\n", "bad.yaml:1:1 missing 'name'"),
        ("name: a\nname: b\n", "bad.yaml:2:1 'name' twice"),
        ("name: [a\n", "bad.yaml:1:7 ] missing"),
        ("name: a\nitems: [{delay_s: 1}, {delay_s: x}]\n", "bad.yaml:2:24 items.1.delay_s"),
        ("- 1\n", "bad.yaml:1:1 mapping"),
        ("a: !!python/object/apply:os.system [x]\n", "1:4: !!python/object/apply:os.system"),
        ("question: !!python/name:os.system\n", "bad.yaml:1:11: !!python/name:os.system"),
        ("a: 1\nb: [2, !!python/tuple [3]]\n", "bad.yaml:2:8: !!python/tuple"),
        ("? !!python/tuple [1, 2]\n: 3\n", "bad.yaml:1:3: !!python/tuple"),
        ("!!python/object:x {a: 1}\n", "bad.yaml:1:1: !!python/object:x"),
        ("%TAG ! tag:yaml.org,2002:python/\n---\na: !name:x y\n", "3:4: !!python/name:x"),
        ("a: !mine x\n", "bad.yaml:1:4: !mine"),
        ("a: !!omap [b: 1]\n", "bad.yaml:1:4: !!omap"),
        ("a: !!set {b, c}\n", "bad.yaml:1:4: !!set"),
        ("a: !!binary aGk=\n", "bad.yaml:1:4: !!binary"),
        ("day: 2001-13-45\n", "bad.yaml read"),
        ("a: 1\nb: [1, 2\n", "bad.yaml:2: ]"),
        ("a: {b: 1\nc: 2\n", "bad.yaml:1: }"),
        ('a: 1\nb: "open\nc: 2\n', "bad.yaml:2: quote"),
        ("a: 1\n b: 2\n", "bad.yaml:2: colon"),
        ("a:\n\tb: 1\n", "bad.yaml:2: tab spaces"),
        ("a: *x\n", "bad.yaml:1: *x"),
        ("a: @x\n", "bad.yaml:1: @ quotes"),
        ("a: 1\nb\nc: 2\n", "bad.yaml:2: colon"),
        ('a: "\\q"\n', "bad.yaml:1: \\q single"),
        ("a:\n  - 1\n - 2\n", "bad.yaml:3: indented"),
        ("a: 1\n---\nb: 1\n", "bad.yaml:2: document"),
        ("[" * 1000, "bad.yaml deeply"),
        (ALIASES, "bad.yaml 20000"),
    ),
    *mistakes(
        partial(resources.find, folder="experiments"),
        ("req-rep-vs-pubsub", "'req-rep-vs-pub-sub'"),
    ),
]


def plug_in(text):
    Path("mine.py").write_text(text)
    load_policy("mine.py:Mine")


def study_key(key):
    outer, _, inner = key.partition(".")
    value = f"{{{inner}: 8}}" if inner else "[mine.py:Mine]"
    of_file(open_study, "mine.yaml")(f"{STUDY}{outer}: {value}\n")


RETIRED_NAMES = [
    *mistakes(
        plug_in,
        ("from dva_sim.errors import ConfigError\n", "dva_sim.errors dva_sim.kernel.errors"),
        *(
            (f"from dva_sim.{room} import {name}\n", f"{name} {instead}")
            for name, instead in RETIRED["name"].items()
            for room in ["recordings.reading" if name == "read_lapse" else "statistics"]
        ),
    ),
    *mistakes(study_key, *((key, f"{key} {instead}") for key, instead in RETIRED["key"].items())),
    *mistakes(
        lambda function, name: getattr(dva_sim, function)("x", **{name: 3}),
        *(
            (function, name, f"{name} {RETIRED['option'][f'--{name}']}")
            for function, name in (
                ("episode", "panels"),
                ("episode", "strip"),
                ("replay", "panels"),
                ("replay", "strip"),
                ("report", "figure"),
            )
        ),
    ),
    *mistakes(
        of_file(lambda name: model_of(load_yaml(name)), "mine.yaml"),
        ("model: mine.py:Mine\n", RETIRED["model"]["FILE:CLASS"]),
    ),
]


@each_mistake([*KEYS, *FILES, *RETIRED_NAMES])
def test_a_mistake_ends_in_one_line_with_its_names(tmp_path, act, error, names):
    check_mistake(tmp_path, act, error, names)
