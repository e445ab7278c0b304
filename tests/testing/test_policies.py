"""Promises of policies: kept by the shipped ones, missed by the bad ones here."""

import random
import time
from itertools import count

import numpy as np
import pytest
from helpers.paths import ROOT
from helpers.processes.search_settings import LONGER
from helpers.wording import unnamed

from dva_sim.cli import checks
from dva_sim.core.dispatch import (
    POLICIES,
    Announcement,
    Assignment,
    Instance,
    MinEta,
    OraclePolicy,
    Policy,
    Relocation,
    solve,
)
from dva_sim.testing import policies
from dva_sim.testing.policies import check_policy
from dva_sim.testing.promises import tried

EXAMPLES = [f"{path.name}:{path.stem.title()}" for path in (ROOT / "agents/policies").glob("*.py")]


@pytest.mark.parametrize("name", [*sorted(POLICIES.keys() - {"oracle"}), *EXAMPLES])
def test_every_policy_that_is_shipped_keeps_its_promises(fewer, name):
    count = min(41 * LONGER, 200)
    outcome = tried(check_policy, name, count=count, slow=60.0)
    assert (outcome.broken, outcome.warnings, outcome.tries) == ((), (), count)


def test_the_oracle_keeps_them_too(fewer):
    ways = np.array([[10.0, 20.0], [30.0, 5.0], [9.0, 9.0]])
    plan = solve(Instance(np.array([0.0, 10.0, 20.0]), ways, 2 * ways))
    devices = "02:00:00:01:00:00", "02:00:00:01:00:01"
    assert not tried(check_policy, lambda: OraclePolicy(plan, devices), slow=60.0).broken


def policy(advise, **flags):
    return lambda: type("Bad", (Policy,), {"advise": advise, **flags})()


def all_to_first(self, situation, rng):
    here = situation.tasks and situation.responders
    return [Assignment(task, 0) for task in range(len(situation.tasks))] if here else []


def to_first_task(self, situation, rng):
    here = len(situation.tasks) and len(situation.responders)
    return [Assignment(0, who) for who in range(len(situation.responders))] if here else []


def by_own_numbers(self, situation, rng):
    able = np.argwhere(np.isfinite(situation.eta)).tolist()
    return [Assignment(*random.choice(able))] if able else []


def every_robot_goes(self, situation, rng):
    """Sends each robot to the task with its own index, regardless of its driver."""
    robots = [who for who, what in enumerate(situation.responders) if what.kind == "robot"]
    pairs = zip(range(len(situation.tasks)), robots, strict=False)
    return [Assignment(task, who) for task, who in pairs if situation.eta[task, who] < np.inf]


def writes_into_eta(self, situation, rng):
    situation.eta[:] = 0
    return []


def changes_behind_the_back(self, situation, rng):
    situation.eta.setflags(write=True)
    situation.eta[:] += 1
    return []


def announces_all(self, situation, rng):
    return [Announcement(place) for place in range(len(situation.tasks))]


def moves_all(self, situation, rng):
    stations = situation.cover and situation.cover.stations
    return [Relocation(who, 0) for who in range(len(situation.responders))] if stations else []


@pytest.mark.parametrize(
    ("make", "expected"),
    [
        (policy(lambda *_: None), "returns no sequence of advice: a NoneType in situation 1 "),
        (policy(lambda *_: (x for x in ())), "returns no sequence of advice: a generator"),
        (policy(lambda *_: ["go"]), "gives something that is no advice: a str in situation 1"),
        (policy(lambda *_: [Assignment(0, -1)]), "names a responder that is not there: -1 of "),
        (policy(lambda *_: [Assignment(9999, 0)]), "names a task that is not there: 9999 of "),
        (policy(lambda *_: [Assignment(0.0, 0)]), "names a task that is not there: 0.0 of "),
        (policy(lambda *_: [Assignment(True, 0)]), "names a task that is not there: True of "),
        (policy(all_to_first), "uses a responder twice: responder 0 in situation "),
        (policy(to_first_task), "uses a task twice: task 0 in situation "),
        (policy(to_first_task), "sends somebody who would never arrive: responder "),
        (policy(by_own_numbers), "advises differently with the same history and random seed: in"),
        (policy(writes_into_eta), "raises: ValueError: assignment destination is read-only (test_"),
        (policy(changes_behind_the_back), "changes the situation: in situation 1 "),
        (policy(to_first_task, preempts=True), "gives a task that somebody is under way to: task"),
        (policy(lambda *_: [Announcement(0)]), "announces a task without `auctions = True`: in"),
        (policy(announces_all, auctions=True), "announces a task that is not to be announced: ta"),
        (policy(lambda *_: [Relocation(0, 0)]), "relocates somebody without `relocates = True`: "),
        (policy(moves_all, relocates=True), "relocates somebody who would never arrive: respond"),
        (policy(moves_all, relocates=True, preempts=True), "relocates somebody who is under way"),
    ],
)  # fmt: skip
def test_a_broken_promise_is_told_in_a_plain_line(fewer, make, expected):
    outcome = tried(check_policy, make, count=41)
    assert any(line.startswith(expected) for line in outcome.broken), outcome.broken


def test_robots_beyond_the_operators_are_a_warning(fewer):
    outcome = tried(check_policy, policy(every_robot_goes), count=21)
    assert outcome.broken == ()
    assert outcome.warnings[0].startswith(policies.TOO_MANY_ROBOTS)


def test_a_slow_decision_is_a_warning(monkeypatch):
    seconds = count()
    monkeypatch.setattr(time, "perf_counter", lambda: float(next(seconds)))
    outcome = tried(check_policy, MinEta, count=19, slow=0.5)
    assert outcome.broken == ()
    (warning,) = outcome.warnings
    assert not unnamed(warning, "slow", "1 s", "situation 9 ", "0.5 s")


def test_options_are_checked_with_the_policy(capsys):
    assert checks.check(["policy", "preemptive"], ["margin=0"]) == 1
    assert not unnamed(capsys.readouterr().out, "option 'margin' is 0;", "above 0")


def test_a_file_called_policy_is_named_with_its_folder(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "policy").write_text("<msg/>")
    assert checks.check(["./policy"]) == 1
    assert "./policy: message: invalid" in capsys.readouterr().out
