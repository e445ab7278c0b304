"""The law of rate, with its numbers visible; it is fed by hand."""

import math

import pytest

from dva_sim.network.transports.pace import Aimd

R = 0.1  # round trip [s]


def test_it_sends_nothing_by_itself_before_the_first_round_trip_and_then_one_in_each():
    law = Aimd(1.0, 0.5)
    assert law.gap == math.inf
    law.begin(R)
    assert law.gap == pytest.approx(R)


def test_it_does_not_speed_up_while_its_gap_holds_nothing_back():
    law = Aimd(1.0, 0.5)
    law.begin(R)
    law.passed(R, is_held=False)
    assert law.gap == pytest.approx(R)


def test_aimd_adds_one_datagram_per_round_trip_and_gives_up_half():
    law = Aimd(increase=1.0, decrease=0.5)
    law.begin(R)
    rates = []
    for _ in range(3):
        law.passed(R, is_held=True)
        rates.append(1.0 / law.gap)
    assert rates == pytest.approx([20.0, 30.0, 40.0])
    law.lost()
    assert 1.0 / law.gap == pytest.approx(20.0)


def test_two_aimd_rates_that_meet_the_same_losses_become_equal():
    one, other = Aimd(1.0, 0.5), Aimd(1.0, 0.5)
    for law in (one, other):
        law.begin(R)
    one.rate, other.rate = 10.0, 300.0
    for _ in range(200):
        for law in (one, other):
            law.passed(R, is_held=True)
        if one.rate + other.rate > 400.0:
            one.lost()
            other.lost()
    assert one.rate == pytest.approx(other.rate, rel=0.02)


@pytest.mark.parametrize("decrease", [0.125, 0.5])
def test_with_the_stated_increase_the_saw_tooth_sends_what_tcps_square_root_law_allows(decrease):
    law = Aimd(increase=3 * decrease / (2 - decrease), decrease=decrease)
    law.begin(R)
    law.rate = 400.0  # so high that a step of one round trip is small beside it
    top, sent, losses = 1000.0, 0.0, 0
    while losses < 20:
        sent += law.rate * R * (losses >= 10)
        law.passed(R, is_held=True)
        if law.rate > top:
            law.lost()
            losses += 1
    share_lost = 10 / sent
    mean = sent / 10 / ((decrease * top * R) / law.increase)  # per round trip
    assert mean == pytest.approx(math.sqrt(1.5 / share_lost), rel=0.05)


def test_queueing_within_the_tolerance_is_none_and_beyond_it_counts_as_a_loss():
    law = Aimd(1.0, 0.2, tolerance=0.01)
    law.begin(R)
    law.rate = 100.0
    law.passed(R + 0.009, is_held=False)
    assert law.rate == 100.0
    law.passed(R + 0.011, is_held=True)
    assert law.rate == pytest.approx(80.0)


def test_a_shorter_round_trip_is_the_new_least():
    law = Aimd(1.0, 0.2, tolerance=0.01)
    law.begin(R)
    law.rate = 100.0
    law.passed(0.5 * R, is_held=False)
    law.passed(R, is_held=False)  # twice the least one now
    assert law.rate == pytest.approx(80.0)


def test_one_datagram_in_each_round_trip_is_left_whatever_is_lost():
    law = Aimd(1.0, 0.5)
    law.begin(R)
    for _ in range(5):
        law.lost()
    assert law.gap == pytest.approx(R)
