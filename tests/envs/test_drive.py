"""Driving through Gymnasium: by real permission, with pictures as late as the link has them."""

import pytest

gymnasium = pytest.importorskip("gymnasium", reason="needs Gymnasium: pip install -e '.[rl]'")

import numpy as np
from gymnasium.utils.env_checker import check_env

from dva_sim.envs import DriveEnv
from dva_sim.envs.drive import COLUMNS

pytestmark = pytest.mark.system


def cautious(seen: np.ndarray) -> np.ndarray:
    """A driver who is slower the older the picture, and turns to where the way leads."""
    at = dict(zip(COLUMNS, seen.tolist(), strict=True))
    calm, bearing = 1.3 + at["picture_age_s"], at["bearing_far_rad"]
    return np.array([max(0.0, 1.0 - abs(bearing)) / calm, 2.0 * bearing / calm], np.float32)


def driven(seed: int = 3, **changes: object) -> tuple[float, float, dict[str, object], list[float]]:
    env = DriveEnv(changes=changes)
    seen, _ = env.reset(seed=seed)
    total, ages, over = 0.0, [float(seen[COLUMNS.index("picture_age_s")])], False
    while not over:
        seen, reward, arrived, cut, info = env.step(np.clip(cautious(seen), [0, -1], 1))
        total, over = total + reward, arrived or cut
        ages.append(float(seen[COLUMNS.index("picture_age_s")]))
    return info["time_s"], total, info, ages


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_gymnasium_has_nothing_to_object_to():
    check_env(gymnasium.make("dva_sim/Drive-v0").unwrapped)


def test_a_driver_arrives_and_the_same_seed_is_the_same_drive():
    first, again = driven(), driven()
    assert first[2]["outcome"] == "arrived"
    assert first == again
    assert driven(seed=4) != first


def test_delay_makes_pictures_old_and_the_drive_long():
    near, far = driven(), driven(**{"link.delay_s": 0.5})
    assert min(near[3]) < 0.25 < 0.5 <= min(far[3])
    assert far[1] < near[1] < 0.0


def test_a_link_that_breaks_stops_the_robot_and_ends_the_drive():
    env = DriveEnv(changes={"link.outages": [{"from_s": 20, "for_s": 400}]})
    env.reset(seed=3)
    over = False
    while not over:
        _, _, lost, cut, info = env.step(np.array([0.1, 0.0], np.float32))
        over = lost or cut
    assert info["outcome"] == "lost"
    body = env.drive.run.field.robots[next(iter(env.drive.run.field.robots))].body
    assert body.speed == pytest.approx(0.0, abs=1e-6)


def test_an_action_that_rounding_puts_outside_its_limits_is_taken():
    env = DriveEnv()
    env.reset(seed=1)
    env.step(np.nextafter(np.array([1, -1], np.float32), np.float32(2)))
