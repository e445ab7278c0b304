import math

import numpy as np
import pytest

from dva_sim.kernel.errors import ConfigError
from dva_sim.simulation.measures import shifts
from dva_sim.simulation.timed import build, simulate_timed
from dva_sim.simulation.timed.bounds import response_bounds, share_of_the_way

GUARD = {"name": "guard", "mobilisation": 5, "look": 10, "after": "return"}


def play(seed=1, **changes):
    """A guard, an alarm a minute; 5 s to get there and 10 s to look."""
    scenario = {
        "model": "timed",
        "responders": [GUARD],
        "demand": [{"between": 60}],
        "warm_up_s": 600,
        "horizon_s": 3000,
    }
    return simulate_timed(build(scenario | changes), seed)


def run_of(recording, follow=600.0):
    return shifts.tables(recording, follow)["runs"][0]


def test_the_cohort_leaves_out_the_warm_up_and_what_cannot_be_followed():
    # Alarms at 60, 120, ... 3000 s; from 600 to 2400 s there are 31.
    rows = shifts.tables(play())["events"]
    assert [row["t_detected_s"] for row in rows] == [60.0 * k for k in range(10, 41)]
    assert {row["watched_s"] for row in rows} == {600.0}


def test_an_alarm_that_finds_the_guard_free_takes_what_the_guard_takes():
    row = run_of(play())
    assert row["response_mean_s"] == pytest.approx(5)
    assert row["response_p90_s"] == pytest.approx(5)
    assert row["confirmation_mean_s"] == pytest.approx(15)
    assert (row["on_scene_share"], row["confirmed_share"], row["open_share"]) == (1, 1, 0)
    assert row["use_of_guards"] == pytest.approx(15 / 60, abs=0.001)
    assert row["load"] == row["use_of_guards"]
    assert row["follow_s"] == 600


def test_who_is_escalated_counts_the_whole_follow_up_in_the_mean_and_is_in_the_shares():
    # Two at once, a single guard, nobody may wait: one is reached, one is escalated.
    two = [{"name": name, "between": 60} for name in ("a", "b")]
    row = run_of(play(demand=two, dispatch={"escalate_after_s": 0}))
    assert row["escalated_share"] == pytest.approx(0.5)
    assert row["on_scene_share"] == pytest.approx(0.5)
    assert row["response_mean_s"] == pytest.approx((5 + 600) / 2)
    assert row["response_p50_s"] == pytest.approx(5)
    assert math.isnan(row["response_p90_s"])


def test_false_alarms_are_cleared_and_compete_with_confirmation():
    row = run_of(play(demand=[{"between": 60, "false_share": 0.4}]))
    assert row["confirmed_share"] + row["refuted_share"] == pytest.approx(1)
    assert row["confirmed_share"] == pytest.approx(row["true_share"])
    assert row["confirmed_of_true_share"] == pytest.approx(1)
    assert row["confirmation_mean_s"] == pytest.approx(15)


def test_with_containment_it_is_measured_until_somebody_has_dealt_with_it():
    guard = GUARD | {"act": 20}
    row = run_of(play(responders=[guard], dispatch={"containment": True}))
    assert row["contained_share"] == pytest.approx(1)
    assert row["containment_mean_s"] == pytest.approx(5 + 10 + 20)
    assert "contained_share" not in run_of(play())


def test_a_run_too_short_to_follow_anything_is_refused():
    with pytest.raises(ConfigError, match="600 s"):
        shifts.tables(play(horizon_s=1200))


def test_a_run_that_drains_is_followed_to_the_end_of_its_last_event():
    row = run_of(play(horizon_s=1210, drain=True))
    assert row["events"] == 11
    assert row["response_mean_s"] == pytest.approx(5)


def test_the_bound_is_the_best_unit_from_its_base_with_the_random_numbers_of_the_event():
    # The slow one is 10 m away at 1 m/s, the fast one 30 m at 5 m/s: 10 s against 6 s.
    slow = {"name": "slow", "base": [0, 0], "speed_mps": 1}
    fast = {"name": "fast", "base": [40, 0], "speed_mps": 5}
    recording = play(
        area={"width_m": 50, "height_m": 50},
        zones={"spot": [10, 0, 10, 0]},
        responders=[slow, fast],
        demand=[{"between": 60, "zones": {"spot": 1}}],
    )
    np.testing.assert_allclose(response_bounds(recording), 6.0, atol=1e-6)


def test_nobody_who_sets_out_from_a_base_is_sooner_than_the_bound():
    law = {"law": "exponential", "mean_s": 25}
    team = [
        {"name": n, "base": [x, 10], "mobilisation": law, "after": "return"}
        for n, x in (("a", 5), ("b", 45))
    ]
    area = {"width_m": 50, "height_m": 20}
    row = run_of(play(area=area, responders=team, demand=[{"between": law}]))
    assert row["events"] > 50
    # Who is called at the very moment of coming back is out already, and needs no time.
    assert row["beats_bound_share"] < 0.5
    quiet = play(area=area, responders=team, demand=[{"between": {**law, "mean_s": 900}}])
    assert run_of(quiet)["beats_bound_share"] == 0


def test_the_share_of_the_way_is_zero_at_the_floor_and_one_at_the_bound():
    floor, bound = np.array([50.0, 70.0, 60.0, 62.0]), np.array([20.0, 30.0, 22.0, 28.0])
    half = 0.5 * (floor + bound)
    found = share_of_the_way(floor, np.stack([floor, half, bound], axis=1), bound)
    np.testing.assert_allclose(found.mean, [0, 0.5, 1])


def test_the_share_of_the_way_weighs_shifts_by_what_could_be_gained():
    # Half of 40 s and nothing of 10 s: 20 of 50 s, not the mean of 1/2 and 0.
    found = share_of_the_way(
        np.array([60.0, 30.0]), np.array([[40.0], [30.0]]), np.array([20.0, 20.0])
    )
    assert found.mean[0] == pytest.approx(0.4)
    assert found.low[0] < 0.4 < found.high[0]


def test_a_zone_that_waits_twice_as_long_has_a_ratio_of_two():
    events = {
        "zone": np.array(["near"] * 3 + ["far"] * 3 + ["once"]),
        "response_s": np.array([10.0] * 3 + [20.0] * 3 + [90.0]),
        "closing_s": np.full(7, np.nan),
        "watched_s": np.full(7, 600.0),
    }
    assert shifts.zone_ratio(events, 600) == pytest.approx(2.0)
