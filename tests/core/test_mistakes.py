"""Mistakes in policies, in instances of the oracle, and in the place of the memory."""

from pathlib import Path

import numpy as np
from helpers.mistakes import check_mistake, each_mistake, mistakes, of_file

from dva_sim.core.dispatch import Instance, OraclePolicy, load_policy, solve
from dva_sim.core.store import Store

MINE = """
from dataclasses import dataclass
from dva_sim.core.dispatch import Policy

class Mine(Policy):
    def __init__(self, pace: float = 1.0) -> None:
        self.pace = 2 / pace
    def advise(self, situation, rng): ...

class Nothing(Policy): pass
class Other: pass
"""


def policy(name, options):
    Path("mine.py").write_text(MINE)
    load_policy(name, options)


def policy_of_file(name):
    load_policy(f"{name}:A")


def instance(*rows):
    return Instance(*(np.array(row, dtype=float) for row in rows))


def oracle(*devices):
    OraclePolicy(solve(instance([0, 1], [[100], [5]], [[200], [10]])), devices)


def store(name):
    Store(Path(name))


MISTAKES = [
    *mistakes(
        policy,
        ("min_ate", {}, "policy 'min_ate' 'min_eta'?"),
        ("oracle", {}, "policy 'oracle' future"),
        ("min_eta", {"pace": 1}, "policy 'min_eta' 'pace'"),
        ("preemptive", {"gain": 1}, "'gain' 'gain_s'?"),
        ("preemptive", {"margin": 0}, "'margin' 0; number above"),
        ("preemptive", {"margin": True}, "'margin' True; number above 0"),
        ("priority_eta", {"ageing_per_s": "x"}, "'ageing_per_s' 'x'; number"),
        ("coverage", {"gain_s": float("nan")}, "'gain_s' nan; number above 0"),
        ("batch_optimal", {"objective": "cost"}, "'objective' 'cost'; distance eta"),
        ("hazard_team", {"dangerous": "fire"}, "'dangerous' 'fire'; list fire, flood"),
        ("hazard_team", {"dangerous": ["ice"]}, "'dangerous' ['ice']; list"),
        ("hazard_team", {"dangerous": [["fire"]]}, "'dangerous' list"),
        ("mine.py", {}, "policy 'mine.py' class mine.py:Mine"),
        ("none.py:Mine", {}, "policy 'none.py:Mine': 'none.py' not found"),
        ("mine.py:Yours", {}, "policy 'mine.py:Yours': class 'Yours'"),
        ("mine.py:Other", {}, "'mine.py:Other' policy; Policy"),
        ("mine.py:dataclass", {}, "'mine.py:dataclass' policy"),
        ("mine.py:Nothing", {}, "'mine.py:Nothing' advise(situation, rng)"),
        ("mine.py:Mine", {"speed": 1}, "'mine.py:Mine' 'speed'; pace"),
        ("mine.py:Mine", {"pace": 0}, "'mine.py:Mine' ZeroDivisionError"),
    ),
    *mistakes(
        of_file(policy_of_file, "bad.py"),
        ("x = 1\nclass A(:\n", "bad.py:2: Python"),
        ("\nimport no_such_thing\n", "bad.py:2: ModuleNotFoundError:"),
        ("def f():\n  1 / 0\nf()\n", "bad.py:2: ZeroDivisionError:"),
        ("raise SystemExit\n", "bad.py:1: SystemExit"),
        ("x = '\0'\n", "bad.py Python null"),
    ),
    *mistakes(instance, ([5, 4], [[1], [1]], [[2], [2]], "release"), error=ValueError),
    *mistakes(OraclePolicy, ("future",)),
    *mistakes(oracle, ("a", "b", "1 units; 2")),
    *mistakes(store, (".", ".: database"), ("nowhere/state.sqlite", "nowhere/state.sqlite: open")),
]


@each_mistake(MISTAKES)
def test_a_mistake_ends_in_one_line_with_its_names(tmp_path, act, error, names):
    check_mistake(tmp_path, act, error, names)
