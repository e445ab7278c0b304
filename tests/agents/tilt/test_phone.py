"""The phone as a whole: from what is wanted to what is sent, and when."""

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from dva_sim.agents.population import Person, Population, median_person
from dva_sim.agents.tilt import Phone, PhoneProfile, TiltCommand

QUIET: dict[str, Any] = {
    "accelerometer": "perfect",
    "sample_jitter": 0.0,
    "tremor_deg": 0.0,
    "reference_error_mps2": 0.0,
}


def holder(hand_lag: float = 0.0, motor_noise: float = 0.0) -> Person:
    person = median_person(Population())
    return replace(person, hand_lag=hand_lag, perceptual_delay=0.2, motor_noise=motor_noise)


def phone(hand_lag: float = 0.0, **settings: Any) -> Phone:
    return Phone(PhoneProfile(**{**QUIET, **settings}), holder(hand_lag), np.random.default_rng(1))


def noisy(seed: int = 1, own: int = 7, **settings: Any) -> Phone:
    rng, mine = np.random.default_rng(seed), np.random.default_rng(own)
    app = Phone(PhoneProfile(**settings), holder(0.15, 0.05), rng, mine)
    app.pick_up(0.0)
    return app


def command(app: Phone, now: float) -> TiltCommand:
    sent = app.look(now)
    assert sent is not None
    return sent


def test_full_tilt_is_half_a_metre_and_pi_sixths_and_backwards_is_zero():
    app = phone(filter="none")
    app.ask(0.0, 5.0, math.radians(80))
    full = command(app, 1.0)
    assert (full.speed, full.turn_rate) == pytest.approx((0.5, math.pi / 6))
    app.ask(1.0, -1.0, -math.radians(80))
    back = command(app, 2.0)
    assert (back.speed, back.turn_rate) == pytest.approx((0.0, -math.pi / 6))


def test_without_noise_what_is_wanted_is_what_is_sent_through_every_angle():
    for reference in [(0.0, 0.0, 9.8), (3.0, 0.0, 9.33), (-2.0, 1.0, 9.5)]:
        app = phone(filter="none", reference_mps2=reference)
        for now, (speed, turn) in enumerate([(0.1, 0.0), (0.3, 0.4), (0.5, -0.5)]):
            app.ask(float(now), speed, turn)
            sent = command(app, now + 0.9)
            assert (sent.speed, sent.turn_rate) == pytest.approx((speed, turn))


def test_an_unchanged_value_is_sent_again_only_by_an_app_that_keeps_alive():
    for send, again in (("on_change", False), ("keep_alive", True)):
        app = phone(filter="none", send=send)
        app.ask(0.0, 0.3, 0.0)
        assert app.look(0.5) is not None
        assert (app.look(1.0) is not None) == again


def test_a_batch_is_looked_at_after_20_samples_or_the_longest_delay():
    for filter_ in ("median20-copy", "median"):
        short = phone(filter=filter_, send="on_change", max_delay_s=0.5)
        long = phone(filter=filter_, send="on_change", max_delay_s=2.0)
        assert short.next_look(0.0, 10.0) == 0.5
        assert long.next_look(0.0, 10.0) == pytest.approx(20 / 34, abs=2e-6)


def test_a_batch_is_complete_when_its_app_looks_by_a_clock_in_whole_microseconds():
    app = phone(filter="median20-copy", send="on_change", max_delay_s=2.0)
    now = 0.0
    for batch in range(1, 200):
        now = round(app.next_look(now, 10.0), 6)
        app.look(now)
        assert app.values == batch


def test_time_goes_on_between_two_looks_where_batches_end_by_samples_and_by_time_in_turn():
    app = noisy(filter="median20-copy", send="on_change", max_delay_s=0.6)
    looks = [0.0]
    for _ in range(1000):
        looks.append(round(app.next_look(looks[-1], 10.0), 6))
        app.look(looks[-1])
    assert min(later - sooner for sooner, later in pairwise(looks)) >= 0.9e-6
    assert app.samples < 20 * app.values  # some batches ended by time


def test_an_app_that_keeps_alive_resends_the_value_of_a_batch_until_the_next_is_complete():
    app = phone(filter="median20-copy", max_delay_s=0.5)
    app.ask(0.0, 0.3, 0.0)
    sent = [command(app, tick / 10) for tick in range(1, 11)]
    assert [round(c.speed, 2) for c in sent] == [0.0] * 4 + [0.3] * 6
    ages = [c.sample_age for c in sent[4:9]]
    assert ages == pytest.approx([9.5 / 34 + hold for hold in (0.0, 0.1, 0.2, 0.3, 0.4)])


@pytest.mark.parametrize(
    ("settings", "age"),
    [
        ({"filter": "none"}, 0.5 / 34),
        ({"filter": "median", "filter_options": {"window": 5}}, 2.5 / 34),
        ({"filter": "one_pole", "filter_options": {"time_constant_s": 0.2}}, 0.2),
        ({"filter": "median20-copy", "max_delay_s": 0.5}, 9.5 / 34 + 0.25),
        ({"filter": "median20-copy", "max_delay_s": 1.0}, 9.5 / 34 + 10 / 34),
        ({"ideal": True}, 0.0),
    ],
)
def test_the_age_of_a_command_counts_the_wait_for_a_sample_the_filter_and_its_hold_once(
    settings, age
):
    app = phone(**settings)
    ages = [command(app, 5.0 + 0.0137 * look).sample_age for look in range(4000)]
    assert np.mean(ages) == pytest.approx(age, abs=0.002)


CHAINS: list[dict[str, Any]] = [
    {},
    {"filter": "one_pole"},
    {"filter": "median20-copy", "send": "on_change"},
    {"filter": "median20-inplace", "max_delay_s": 0.3},
    {"mapping": "differential"},
    {"mapping": "leaky", "filter": "median20-copy"},
]


@pytest.mark.parametrize("settings", CHAINS)
def test_when_the_app_looks_changes_no_number(settings):
    seldom, often = noisy(**settings), noisy(**settings)
    for app in (seldom, often):
        app.ask(0.0, 0.3, 0.2)
    for tick in range(1, 613):
        often.look(tick * 0.0163)
    at_last = seldom.look(10.0)
    again = often.look(10.0)
    assert seldom.shown == often.shown
    assert again is None or at_last == again


def test_two_runs_of_one_person_share_the_calibration_and_nothing_else():
    def still(seed: int, own: int) -> float:
        """Mean turn rate of who wants none [rad/s]."""
        app = noisy(seed, own, filter="none", reference_error_mps2=0.5)
        app.ask(0.0, 0.3, 0.0)
        return float(np.mean([command(app, 1 + tick / 10).turn_rate for tick in range(600)]))

    same, other_run, other_person = still(1, 7), still(2, 7), still(1, 8)
    assert same == still(1, 7)
    assert 0.0 < abs(same - other_run) < 0.02 < abs(same - other_person)


def test_a_new_drive_begins_at_rest_with_an_empty_filter():
    app = phone(filter="median", hand_lag=0.2, mapping="differential")
    app.ask(0.0, 0.5, 0.5)
    command(app, 5.0)
    app.pick_up(60.0)
    sent = command(app, 60.1)
    assert (sent.speed, sent.turn_rate) == pytest.approx((0.0, 0.0))
    assert sent.sample_age < 0.1


def test_a_hand_closes_63_percent_of_a_step_in_its_time_constant():
    app = phone(hand_lag=0.2, filter="none", sample_rate_hz=1000)
    app.ask(0.0, 0.0, 0.3)
    assert command(app, 0.2).turn_rate == pytest.approx(0.3 * (1 - math.exp(-1)), rel=0.02)


def test_whoever_steers_by_the_display_gets_there_and_does_not_swing():
    for mapping in ("differential", "leaky", "slew"):
        app = phone(hand_lag=0.15, mapping=mapping)
        app.ask(0.0, 0.3, 0.4)
        rates = [command(app, tick / 10).turn_rate for tick in range(1, 60)]
        assert rates[-1] == pytest.approx(0.4, rel=0.03)
        assert max(rates) < 0.4 * 1.1


def test_a_small_gain_asks_for_more_tilt_than_a_hand_has():
    reached = {}
    for gain in (0.1, 0.5, 1.0):
        app = phone(filter="none", mapping_options={"gain": gain})
        app.ask(0.0, 0.0, 0.5)
        reached[gain] = command(app, 1.0).turn_rate
    assert reached[1.0] == pytest.approx(0.5)
    assert reached[0.5] == pytest.approx(0.5, rel=0.01)
    assert reached[0.1] < 0.15


def test_a_large_gain_lets_more_noise_through():
    spread = {}
    for gain in (1.0, 4.0):
        app = noisy(mapping_options={"gain": gain})
        app.ask(0.0, 0.3, 0.0)
        spread[gain] = np.std([command(app, 1 + tick / 10).turn_rate for tick in range(600)])
    assert spread[4.0] == pytest.approx(4 * spread[1.0], rel=0.1)


BROKEN = """
from dva_sim.agents.tilt import Filter, Mapping
class NoNumber(Filter):
    def add(self, sample): pass
    def value(self): return float("nan"), 1.0
class Fails(Mapping):
    integrates = False
    def command(self, level, turn, dt): return 1 / 0
    def tilt_for(self, wanted, shown, within): return wanted
class Leaves(NoNumber):
    def value(self): raise SystemExit(3)
"""


@pytest.mark.parametrize(
    ("settings", "first"),
    [
        ({"filter": "own.py:NoNumber"}, "answers nan, 1.0"),
        ({"filter": "own.py:Leaves"}, "SystemExit: 3"),
        ({"mapping": "own.py:Fails"}, "ZeroDivisionError: division by zero"),
    ],
)
def test_what_a_users_class_cannot_say_is_to_stand_and_is_counted(
    settings, first, tmp_path, monkeypatch
):
    (tmp_path / "own.py").write_text(BROKEN)
    monkeypatch.chdir(tmp_path)
    app = phone(**settings)
    app.ask(0.0, 0.5, 0.5)
    sent = [command(app, tick / 10) for tick in range(1, 11)]
    assert {(c.speed, c.turn_rate) for c in sent} == {(0.0, 0.0)}
    assert (app.failures, app.first_failure) == (10, first)
    app.pick_up(2.0)
    assert app.failures == 0
