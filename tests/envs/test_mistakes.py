"""Actions that are none, and environments that cannot be made."""

from contextlib import closing
from functools import cache

import pytest

pytest.importorskip("gymnasium", reason="needs Gymnasium: pip install -e '.[rl]'")

import numpy as np
from helpers.mistakes import check_mistake, each_mistake, mistakes

from dva_sim.core.dispatch import load_policy
from dva_sim.envs import DispatchEnv, DriveEnv, play

pytestmark = pytest.mark.system


def dispatched(action):
    with closing(DispatchEnv("small-shift")) as env:
        env.reset(seed=1)
        situation = env.situation
        try:
            env.step(action)
        finally:
            assert env.situation is situation


@cache
def drive():
    env = DriveEnv()
    env.reset(seed=1)
    return env


def driven(action):
    drive().step(action)


def advised(policy):
    with closing(DispatchEnv("small-shift")) as env:
        play(env, load_policy(policy), seed=1)


NO_TASKS = [-1, 10**6, 1.5, 1.0, True, "1", None, np.nan, [1], [0, 1]]
NO_SPEEDS = [
    *[(np.nan, 0.0), (0.1, np.inf), (-0.1, 0.0), (1.5, 0.0), (0.5, -1.1)],
    *[(0.5,), (0.5, 0.0, 0.0), ((0.5, 0.0),), 0.5, None, "ab", ("a", "b"), {}],
]
MISTAKES = [
    *mistakes(dispatched, *((each, "whole number 0 not") for each in NO_TASKS), error=ValueError),
    *mistakes(driven, *((each, "two finite 0 1") for each in NO_SPEEDS), error=ValueError),
    *mistakes(advised, ("auction", "auctions=True"), error=ValueError),
    *mistakes(
        lambda arguments: DispatchEnv(**arguments),
        ({"scenario": "drive-to-event"}, "timed"),
        ({"scenario": "no-such-shift"}, "'no-such-shift'"),
        ({"changes": {"intensty": 2}}, "'intensty' 'intensity'"),
        ({"tasks": 0}, "tasks"),
    ),
    *mistakes(
        lambda arguments: DriveEnv(**arguments).reset(seed=1),
        ({"scenario": "busy-shift"}, "full"),
        ({"changes": {"robot.count": 0}}, "robot"),
        ({"dt": 0}, "dt"),
    ),
]


@each_mistake(MISTAKES)
def test_a_mistake_ends_in_one_line_with_its_names(tmp_path, act, error, names):
    check_mistake(tmp_path, act, error, names)
