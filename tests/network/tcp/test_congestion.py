import pytest

from dva_sim.network.tcp.congestion import Cubic, HyStart, RateReduction, Reno
from dva_sim.network.tcp.parameters import TcpOptions

OPTIONS = TcpOptions()


def test_slow_start_adds_a_segment_for_each_delivered():
    window = Reno(OPTIONS)
    for _ in range(30):
        window.grow(1, 0.0, 0.1)
    assert window.window == 40.0


def test_reno_halves_and_then_adds_one_segment_per_round_trip():
    window = Reno(OPTIONS)
    window.window = 20.0
    window.window = window.reduce(0.0)
    assert window.window == 10.0
    for _ in range(10):
        window.grow(1, 0.0, 0.1)
    assert window.window == pytest.approx(11.0, abs=0.06)


def test_no_loss_brings_the_threshold_below_two_segments():
    for kind in (Reno, Cubic):
        window = kind(OPTIONS)
        window.window = 2.0
        assert window.reduce(0.0) == 2.0


def test_cubic_keeps_seven_tenths_in_whole_segments():
    window = Cubic(OPTIONS)
    for before, after in ((22.0, 15.0), (15.0, 10.0), (10.0, 7.0), (3.0, 2.0)):
        window.window = before
        assert window.reduce(0.0) == after


def lossless_growth(peak, seconds, rtt=0.1):
    """Windows at the end of each round trip after a loss at `peak` segments."""
    window = Cubic(OPTIONS)
    window.window = float(peak)
    window.window = window.reduce(0.0)
    history = []
    for step in range(round(seconds / rtt)):
        for part in range(int(window.window)):
            window.grow(1, (step + part / int(window.window)) * rtt, rtt)
        history.append(((step + 1) * rtt, window.window))
    return history


def test_cubic_follows_the_curve_of_the_rfc():
    # K = cbrt(W_max (1 - beta) / C); W(t) = C (t - K)^3 + W_max: RFC 9438, figures 1 and 2
    k = (200 * 0.3 / 0.4) ** (1 / 3)
    for time, window in lossless_growth(200, 8.0):
        curve = 0.4 * (time - k) ** 3 + 200
        assert window == pytest.approx(curve, abs=3.0)


def test_a_small_cubic_window_grows_at_least_as_reno_of_the_same_backoff_would():
    # alpha = 3 (1 - 0.7) / (1 + 0.7) = 0.53 segments per round trip: RFC 9438, section 4.3
    time, window = lossless_growth(10, 2.0, rtt=0.01)[-1]
    assert window == pytest.approx(7 + 0.53 * time / 0.01, rel=0.2)


def test_a_second_loss_below_the_first_remembers_less_than_the_window():
    # fast convergence, RFC 9438, section 4.7: 80 (1 + 0.7) / 2 = 68
    window = Cubic(OPTIONS)
    window.window = 100.0
    window.reduce(0.0)
    window.window = 80.0
    window.window = window.reduce(1.0)
    window.grow(1, 1.0, 0.0)
    assert window.curve(1e-9 + window._inflection) == 68.0


def test_time_in_which_the_window_is_not_used_does_not_count():
    used, rested, rested_twice = Cubic(OPTIONS), Cubic(OPTIONS), Cubic(OPTIONS)
    for window in (used, rested, rested_twice):
        window.window = 50.0
        window.window = window.reduce(0.0)
        window.grow(1, 0.0, 0.1)
    rested_twice.rests(2.0)
    for window in (rested, rested_twice):
        window.rests(4.0)
    for window in (used, rested, rested_twice):
        for step in range(20):
            window.grow(1, 4.0 + step / 100, 0.1)
    assert used.window > rested.window == rested_twice.window


def test_idle_time_halves_the_window_per_timeout_but_not_below_the_initial_one():
    window = Reno(OPTIONS)
    window.window = 80.0
    window.after_idle(0.65, 0.3)
    assert window.window == 20.0
    window.after_idle(10.0, 0.3)
    assert window.window == 10.0
    window.window = 4.0
    window.after_idle(10.0, 0.3)
    assert window.window == 4.0


@pytest.mark.parametrize(("shortest", "grown", "ends"), [(0.1, 0.111, False), (0.1, 0.113, True)])
def test_hystart_ends_slow_start_when_eight_round_trips_are_an_eighth_longer(shortest, grown, ends):
    hystart = HyStart()
    hystart.ends(10.0, grown, shortest, 0, 20)
    verdicts = [hystart.ends(16.0, grown, shortest, 0, 20) for _ in range(9)]
    assert verdicts == [False] * 8 + [ends]


def test_hystart_forgives_one_short_round_trip_among_the_long():
    hystart = HyStart()
    hystart.ends(10.0, 0.3, 0.1, 0, 20)
    samples = [0.3] * 5 + [0.1] + [0.3] * 5
    assert not any(hystart.ends(16.0, sample, 0.1, 0, 20) for sample in samples)


def test_hystart_restarts_with_each_round_and_not_below_sixteen_segments():
    hystart = HyStart()
    for _ in range(7):
        hystart.ends(16.0, 0.3, 0.1, 0, 20)
    assert not hystart.ends(16.0, 0.3, 0.1, 21, 40)
    assert not any(hystart.ends(16.0, 0.3, 0.1, 22, 40) for _ in range(8))
    assert hystart.ends(16.0, 0.3, 0.1, 22, 40)
    assert not any(HyStart().ends(15.0, 0.3, 0.1, 0, 20) for _ in range(20))


def test_rate_reduction_sends_seven_for_ten_delivered_and_arrives_at_the_threshold():
    # RFC 6937: 20 in flight, threshold 14
    reduction, in_flight = RateReduction(14.0, 20), 19
    for _ in range(18):
        in_flight -= 1
        allowed = reduction.allows(1, in_flight, False)
        reduction.sent += allowed
        in_flight += allowed
    assert in_flight == 14
    assert reduction.sent == pytest.approx(0.7 * 18, abs=1.0)


def test_rate_reduction_repeats_at_least_one_segment_at_once():
    assert RateReduction(7.0, 10).allows(1, 8, False) == 1


def test_below_the_threshold_no_more_leaves_than_was_delivered_unless_the_edge_moves():
    reduction = RateReduction(7.0, 10)
    reduction.sent = 3
    assert reduction.allows(4, 2, False) == 4
    assert reduction.allows(1, 2, True) == 3
