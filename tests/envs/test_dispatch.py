"""Deciding through Gymnasium: the same shifts as by a policy, and nothing that is not allowed."""

import threading

import pytest

gymnasium = pytest.importorskip("gymnasium", reason="needs Gymnasium: pip install -e '.[rl]'")

import numpy as np
from gymnasium.utils.env_checker import check_env

from dva_sim.core.dispatch import known_policies, load_policy
from dva_sim.envs import DispatchEnv, play
from dva_sim.simulation.models import model_for
from dva_sim.simulation.timed import simulate_timed

pytestmark = pytest.mark.system
POLICIES = [name for name in known_policies() if name != "oracle"]


def made(name: str, scenario: str = "busy-shift", **changes: object) -> DispatchEnv:
    policy = load_policy(name)
    flags = {flag: getattr(policy, flag) for flag in ("preempts", "auctions", "relocates")}
    return DispatchEnv(scenario, changes=changes, **flags)


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_gymnasium_has_nothing_to_object_to():
    check_env(gymnasium.make("dva_sim/Dispatch-v0", scenario="small-shift").unwrapped)


@pytest.mark.parametrize("name", POLICIES)
def test_a_policy_decides_the_same_through_the_environment(name):
    env = made(name, intensity=6.9)
    info = play(env, load_policy(name), seed=7)
    recording = simulate_timed(env.scenario, 7, load_policy(name))
    assert repr(info["measures"]) == repr(model_for(env.scenario).rows(recording)["runs"][0])
    env.close()


def test_the_return_is_the_sum_of_all_response_times():
    """Every alarm is answered, and all of the time is measured."""
    env = made("min_eta", "small-shift")
    info = play(env, load_policy("min_eta"), seed=7)
    recording = simulate_timed(env.scenario, 7, load_policy("min_eta"))
    events = model_for(env.scenario).rows(recording)["events"]
    waited = sum(row["response_s"] for row in events)
    assert -60.0 * info["return"] == pytest.approx(waited)


def test_the_same_seed_and_actions_are_the_same_shift():
    runs = []
    for _ in range(2):
        env, rng, seen = made("coverage", "small-shift"), np.random.default_rng(3), []
        observations, info = env.reset(seed=5)
        over = False
        while not over:
            action = int(rng.choice(np.flatnonzero(info["action_mask"])))
            observations, reward, over, _, info = env.step(action)
            seen.append((action, reward, {k: v.tolist() for k, v in observations.items()}))
        env.close()
        runs.append(seen)
    assert runs[0] == runs[1]
    assert len(runs[0]) > 8


def test_an_action_that_is_not_allowed_ends_the_decision():
    env = made("min_eta", "small-shift")
    _, info = env.reset(seed=1)
    barred = int(np.flatnonzero(info["action_mask"] == 0)[0])
    before = env.situation
    _, _, _, _, info = env.step(barred)
    assert info["refused"]
    assert env.situation is not before
    env.close()


def test_the_masks_for_sb3_contrib_are_those_of_step():
    env = made("coverage", "small-shift")
    with pytest.raises(RuntimeError, match="reset"):
        env.action_masks()
    _, info = env.reset(seed=5)
    over, steps = False, 0
    while not over:
        masks = env.action_masks()
        assert masks.dtype == np.bool_
        assert masks.shape == (env.action_space.n,)
        assert masks.tolist() == info["action_mask"].astype(bool).tolist()
        _, _, over, _, info = env.step(np.flatnonzero(masks)[-1])
        assert not info["refused"]
        steps += 1
    assert steps > 4
    env.close()


def test_a_shift_that_is_left_ends_with_its_environment():
    env = made("min_eta")
    env.reset(seed=1)
    threads = threading.active_count()
    env.reset(seed=2)
    assert threading.active_count() == threads
    env.close()
    assert threading.active_count() == threads - 1
    with pytest.raises(RuntimeError, match="reset"):
        env.step(0)


def test_the_learnt_policy_lets_events_wait_less_than_min_eta_on_shifts_it_has_not_seen():
    env = made("min_eta", intensity=6.9)
    learnt = load_policy("docs/examples/linear.py:Linear")
    unseen = range(30_000, 30_004)
    ours, theirs = (
        [play(env, policy, seed)["return"] for seed in unseen]
        for policy in (learnt, load_policy("min_eta"))
    )
    env.close()
    assert np.mean(ours) > np.mean(theirs)
