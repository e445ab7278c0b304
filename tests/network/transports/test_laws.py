"""The laws of rate, with their numbers visible; each is fed by hand."""

import math

import pytest

from dva_sim.network.transports.rate_control import Aimd, LeastRoundTrip, ThreeTerms

R = 0.1  # round trip [s]


@pytest.mark.parametrize(
    "law", [Aimd(1.0, 0.5), ThreeTerms(1.0, 0.0, 0.5), LeastRoundTrip(0.01, 2, 2, 1)]
)
def test_every_law_sends_nothing_by_itself_before_the_first_round_trip_and_then_one_in_each(law):
    assert law.gap == math.inf
    law.begin(R)
    assert law.gap == pytest.approx(R)


@pytest.mark.parametrize(
    "law", [Aimd(1.0, 0.5), ThreeTerms(1.0, 1.0, 0.5), LeastRoundTrip(0.01, 2, 2, 1)]
)
def test_no_law_speeds_up_while_its_gap_holds_nothing_back(law):
    law.begin(R)
    law.passed(R, held=False)
    assert law.gap == pytest.approx(R)


def test_aimd_adds_one_datagram_per_round_trip_and_gives_up_half():
    law = Aimd(increase=1.0, decrease=0.5)
    law.begin(R)
    rates = []
    for _ in range(3):
        law.passed(R, held=True)
        rates.append(1.0 / law.gap)
    assert rates == pytest.approx([20.0, 30.0, 40.0])
    law.lost()
    assert 1.0 / law.gap == pytest.approx(20.0)


def test_two_aimd_rates_that_meet_the_same_losses_become_equal():
    one, other = Aimd(1.0, 0.5), Aimd(1.0, 0.5)
    one.rate, other.rate = 10.0, 300.0
    for _ in range(200):
        for law in (one, other):
            law.passed(R, held=True)
        if one.rate + other.rate > 400.0:
            one.lost()
            other.lost()
    assert one.rate == pytest.approx(other.rate, rel=0.02)


def test_three_terms_are_a_constant_a_line_and_a_square_of_the_round_trips_since_the_loss():
    law = ThreeTerms(linear=0.5, square=0.25, decrease=0.25)
    law.begin(R)
    rates = []
    for _ in range(4):
        law.passed(R, held=True)
        rates.append(1.0 / law.gap)
    assert rates == pytest.approx([10 + (0.5 * n + 0.25 * n * n) / R for n in (1, 2, 3, 4)])


def test_after_a_loss_the_three_terms_begin_again_from_what_is_left():
    law = ThreeTerms(linear=0.5, square=0.25, decrease=0.25)
    law.begin(R)
    for _ in range(4):
        law.passed(R, held=True)  # to 70 per second
    law.lost()
    assert 1.0 / law.gap == pytest.approx(0.75 * 70)
    law.passed(R, held=True)
    assert 1.0 / law.gap == pytest.approx(0.75 * 70 + (0.5 + 0.25) / R)


def test_without_its_square_the_three_terms_are_aimd():
    trinomial, aimd = ThreeTerms(1.0, 0.0, 0.5), Aimd(1.0, 0.5)
    for law in (trinomial, aimd):
        law.begin(R)
        for step in range(12):
            law.passed(R, held=True)
            if step % 5 == 4:
                law.lost()
    assert trinomial.gap == pytest.approx(aimd.gap)


@pytest.mark.parametrize("decrease", [0.125, 0.5])
def test_with_the_stated_linear_term_the_saw_tooth_sends_what_tcps_square_root_law_allows(decrease):
    law = ThreeTerms(linear=3 * decrease / (2 - decrease), square=0.0, decrease=decrease)
    law.begin(R)
    law.rate = 400.0  # so high that a step of one round trip is small beside it
    top, sent, losses = 1000.0, 0.0, 0
    while losses < 20:
        sent += law.rate * R * (losses >= 10)
        law.passed(R, held=True)
        if law.rate > top:
            law.lost()
            losses += 1
    share_lost = 10 / sent
    mean = sent / 10 / ((decrease * top * R) / law.linear)  # per round trip
    assert mean == pytest.approx(math.sqrt(1.5 / share_lost), rel=0.05)


def test_the_least_round_trip_law_narrows_its_gap_while_nothing_queues():
    law = LeastRoundTrip(tolerance=0.01, widen=2.0, narrow=1.25, longest=1.0)
    law.begin(R)
    law.passed(R + 0.009, held=True)
    assert law.gap == pytest.approx(R / 1.25)


def test_the_least_round_trip_law_widens_its_gap_when_something_queues_whether_held_back_or_not():
    law = LeastRoundTrip(tolerance=0.01, widen=2.0, narrow=1.25, longest=1.0)
    law.begin(R)
    law.passed(R + 0.011, held=False)
    assert law.gap == pytest.approx(2.0 * R)


def test_a_shorter_round_trip_is_the_new_least():
    law = LeastRoundTrip(tolerance=0.01, widen=2.0, narrow=1.25, longest=1.0)
    law.begin(R)
    law.passed(0.5 * R, held=False)
    law.passed(R, held=False)  # twice the least one now
    assert law.gap == pytest.approx(2.0 * R)


def test_the_gap_of_the_least_round_trip_law_has_an_end():
    law = LeastRoundTrip(tolerance=0.01, widen=2.0, narrow=1.25, longest=0.35)
    law.begin(R)
    for _ in range(5):
        law.lost()
    assert law.gap == 0.35
