"""Laws of the delay against what is known of each; bands are four standard errors."""

import math
from functools import partial
from itertools import accumulate
from typing import Any

import numpy as np
import pytest
from helpers.network import links
from helpers.network.links import GAMMA, NORMAL, SHIFTED
from numpy.typing import NDArray
from scipy import stats

from dva_sim.kernel.streams import Streams
from dva_sim.network.link import LinkConfig
from dva_sim.network.link.time_noise import SlowNoise, normal_quantile

N = 10_000
SLOW = {"correlation_s": 3.0}
EMPIRICAL = {"law": "empirical", "delays_s": [0.01, 0.02, 0.02, 0.10]}


link = partial(links.link, rate_bps=links.FAST)


def delays(law: Any, every: float = 0.01, count: int = N, **config: Any) -> NDArray[np.float64]:
    """Delays of packets sent at a steady rate over a link with reordering."""
    line = link(**{"delay_s": 0.1, "delay_law": law, "reorder": True, **config})
    times = np.arange(count) * round(every * 1000) / 1000  # the same number for the same time
    return np.array([line.carry(now, 100) for now in times.tolist()], dtype=float) - times


@pytest.mark.parametrize(
    ("law", "known"),
    [
        (NORMAL, stats.norm(0.1, 0.02)),
        (GAMMA, stats.gamma((0.06 / 0.03) ** 2, loc=0.04, scale=0.03**2 / 0.06)),
        (SHIFTED, stats.expon(loc=0.04, scale=0.06)),
    ],
)
def test_delays_follow_their_law(law, known):
    found = delays(law)
    mean, sd = known.mean(), known.std()
    excess = float(known.stats(moments="k"))
    assert found.mean() == pytest.approx(mean, abs=4 * sd / N**0.5)
    assert found.std() == pytest.approx(sd, abs=4 * sd * ((excess + 2) / (4 * N)) ** 0.5)
    assert stats.kstest(found, known.cdf).pvalue > 0.001


def test_an_empirical_law_draws_its_numbers_as_often_as_they_are_given():
    found = delays(EMPIRICAL, delay_s=0.005)
    values, counts = np.unique(found.round(6), return_counts=True)
    assert values == pytest.approx([0.015, 0.025, 0.105])
    assert stats.chisquare(counts, [N / 4, N / 2, N / 4]).pvalue > 0.001


def test_an_empirical_law_may_come_from_a_file_in_milliseconds(tmp_path):
    path = tmp_path / "delays.txt"
    path.write_text("# three of them\n10\n\n20.5\n 30\n")
    found = delays({"law": "empirical", "file": str(path)}, count=500, delay_s=0)
    assert set(found.round(6)) == {0.01, 0.0205, 0.03}


@pytest.mark.parametrize("law", [NORMAL, GAMMA, SHIFTED, EMPIRICAL])
def test_a_link_says_its_mean_delay_and_its_spread(law):
    mean, sd = LinkConfig(delay_s=0.1, delay_law=law).moments()
    found = delays(law)
    assert found.mean() == pytest.approx(mean, abs=4 * sd / N**0.5)
    assert found.std() == pytest.approx(sd, rel=0.05)
    assert link(delay_s=0.1, delay_law=law).delay == mean


def test_a_normal_law_with_a_correlation_time_forgets_exponentially():
    n, time = 20_000, 1.0
    found = delays(NORMAL | {"correlation_s": time}, every=0.1, count=n)
    step = np.exp(-0.1 / time)
    error = 0.02 * ((1 + step) / (1 - step) / n) ** 0.5
    assert found.mean() == pytest.approx(0.1, abs=4 * error)
    found = found - found.mean()
    for lag in (1, 5, 10, 20):
        kept = step ** (2 * lag)
        correlation = (found[lag:] @ found[:-lag]) / (found @ found)
        spread = (1 + step**2) * (1 - kept) / (1 - step**2) - 2 * lag * kept
        assert correlation == pytest.approx(step**lag, abs=4 * (spread / n) ** 0.5)


def test_slow_changes_do_not_repeat_themselves():
    n = 4096
    found = delays(NORMAL | {"correlation_s": 0.05}, every=0.064, count=n)
    found = found - found.mean()
    spectrum = np.abs(np.fft.rfft(found, 2 * n)) ** 2
    correlations = np.fft.irfft(spectrum)[8 : n // 4] / (found @ found)  # 0.5 s to a minute
    assert np.abs(correlations).max() < 6 / n**0.5


@pytest.mark.system
def test_correlation_leaves_the_law_of_each_delay_as_it_is():
    found = delays(GAMMA | {"correlation_s": 0.5}, every=5.0, count=1500)  # ten of them apart
    known = stats.gamma((0.06 / 0.03) ** 2, loc=0.04, scale=0.03**2 / 0.06)
    assert stats.kstest(found, known.cdf).pvalue > 0.001


def test_without_correlation_neighbours_are_independent():
    found = delays(NORMAL)
    assert abs(np.corrcoef(found[1:], found[:-1])[0, 1]) < 4 / N**0.5


def test_packets_of_one_millisecond_share_slow_changes_and_not_their_own_random_numbers():
    line = link(delay_s=0.1, delay_law=NORMAL | {"correlation_s": 1.0})
    assert len({round(line.carry(0.5, 100) or 0, 6) for _ in range(5)}) == 1
    line = link(delay_s=0.1, delay_law=NORMAL, reorder=True)
    found = np.array([line.carry(0.5, 40) for _ in range(2000)]) - 0.6
    assert found.mean() == pytest.approx(0, abs=4 * 0.02 / 2000**0.5)
    assert found.std() == pytest.approx(0.02, abs=4 * 0.02 / 4000**0.5)
    assert abs(np.corrcoef(found[1:], found[:-1])[0, 1]) < 4 / 2000**0.5


@pytest.mark.parametrize(
    "law",
    [NORMAL, GAMMA, SHIFTED, EMPIRICAL, NORMAL | SLOW, GAMMA | SLOW],
)
def test_who_sends_seldom_meets_the_weather_of_who_sends_often(law):
    often = delays(law, every=0.01, count=3000)
    seldom = delays(law, every=0.07, count=400)
    assert seldom == pytest.approx(often[: 7 * 400 : 7], abs=1e-9)


def test_a_delay_law_has_other_random_numbers_in_each_direction_and_for_each_seed():
    firsts = [
        link(direction, seed, delay_s=0.1, delay_law=GAMMA).carry(0.0, 100)
        for direction, seed in (("up", 1), ("down", 1), ("up", 2), ("up", 1))
    ]
    assert len(set(firsts)) == 3
    assert firsts[0] == firsts[3]


def test_packets_overtake_only_where_they_may():
    for reorder in (False, True):
        line = link(delay_s=0.1, delay_law=GAMMA, reorder=reorder)
        arrivals = [line.carry(n * 0.005, 100) for n in range(500)]
        assert (arrivals == sorted(arrivals)) is not reorder


def test_jitter_may_overtake_too():
    line = link(delay_s=0.1, jitter_s=0.05, reorder=True)
    arrivals = np.array([line.carry(n * 0.01, 100) for n in range(N)])
    found = arrivals - 0.01 * np.arange(N)
    assert stats.kstest(found, stats.uniform(0.05, 0.1).cdf).pvalue > 0.001
    assert (np.diff(arrivals) < 0).mean() == pytest.approx(0.405, abs=0.01)  # (1 - 0.1)^2 / 2


def test_a_constant_law_is_what_is_meant_without_one():
    line = link(delay_s=0.1, delay_law="constant", rate_bps=8e6)
    assert line.carry(1.0, 1000) == pytest.approx(1.101)
    assert line.is_ideal()
    assert LinkConfig(delay_s=0.1, delay_law="constant").moments() == (0.1, 0.0)


def test_each_direction_may_have_its_own_delay():
    config = {
        "delay_s": 0.1,
        "up": {"delay_s": 0.3, "delay_law": NORMAL},
        "down": {"jitter_s": 0.1},
    }
    assert link("up", **config).delay == 0.3
    assert link("down", **config).delay == 0.1
    assert link("up", **config).carry(0.0, 100) != pytest.approx(0.3, abs=1e-6)


def test_slow_numbers_are_an_ornstein_uhlenbeck_process_at_each_millisecond():
    """Also where a block of them ends: x' = k x + sqrt(1 - k^2) n with k = exp(-1 ms / 3 s)."""
    normal, keep = Streams(1).fresh("slow"), math.exp(-0.001 / 3.0)
    noise, count = SlowNoise(Streams(1), "slow", 3.0), 20_000
    start, fresh = normal.standard_normal(), normal.standard_normal(count)
    steps = accumulate(fresh, lambda x, n: keep * x + math.sqrt(1 - keep**2) * n, initial=start)
    found = [noise.draw((slot + 0.5) / 1000) for slot in range(count)]
    assert found == pytest.approx(stats.norm.cdf(list(steps)[1:]))


@pytest.mark.parametrize("edge", [0.0, 1.0])
def test_the_quantiles_at_the_edges_are_finite(edge):
    assert normal_quantile(edge) == pytest.approx((edge - 0.5) * 14.07, abs=0.01)
