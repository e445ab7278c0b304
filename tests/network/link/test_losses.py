"""Losses by chance and in bursts against what is known of them; bands are four standard errors."""

from functools import partial
from itertools import groupby, pairwise
from typing import Any

import numpy as np
import pytest
from helpers.network import links

link = partial(links.link, rate_bps=links.FAST)


def fates(count: int, every: float, **config: Any) -> list[bool]:
    """Losses among packets sent at a steady rate."""
    line = link(**config)
    return [line.carry(n * every, 100) is None for n in range(count)]


def runs(lost: list[bool], what: bool) -> list[int]:
    """Lengths of the runs of lost packets, or of others, without the first and last run."""
    found = [(key, len(list(group))) for key, group in groupby(lost)][1:-1]
    return [length for key, length in found if key is what]


def test_bursts_in_time_lose_the_share_asked_for_in_runs_as_long_as_asked_for():
    every, length, share, n = 0.01, 0.2, 0.1, 400_000
    lost = fates(n, every, loss=share, bursts={"mean_s": length})
    bursts = n * every * share / length
    # Two exponential lengths by turns: the share's spread follows from that of the lengths.
    assert np.mean(lost) == pytest.approx(share, abs=4 * share * (1 - share) * (2 / bursts) ** 0.5)
    # A burst that a packet meets is met by the next one with probability p:
    stays = share + (1 - share) * np.exp(-every / (length * (1 - share)))
    found, expected = runs(lost, True), 1 / (1 - stays)
    assert np.mean(found) == pytest.approx(expected, abs=4 * expected / len(found) ** 0.5)


def test_lengths_of_bursts_have_no_memory():
    found = np.array(runs(fates(400_000, 0.01, loss=0.1, bursts={"mean_s": 0.2}), True))
    stays = 1 - 1 / found.mean()
    for length in (5, 10, 20, 40):
        known = stays ** (length - 1)
        assert (found >= length).mean() == pytest.approx(
            known, abs=4 * (known * (1 - known) / len(found)) ** 0.5 + 0.01
        )


@pytest.mark.parametrize(("inside", "length"), [(1.0, 4.0), (1.0, 1.2), (0.5, 8.0)])
def test_bursts_of_packets_lose_the_share_asked_for(inside, length):
    n, share = 200_000, 0.05
    bursts = {"mean_packets": length, "loss": inside}
    lost = fates(n, 0.01, loss=share, bursts=bursts)
    in_burst = share / inside
    keeps = 1 - 1 / length - in_burst / (1 - in_burst) / length  # correlation of neighbours
    error = (share * (1 - share) / n * (1 + max(0.0, keeps)) / (1 - max(0.0, keeps))) ** 0.5
    assert np.mean(lost) == pytest.approx(share, abs=4 * error)
    if inside == 1.0:
        found = runs(lost, True)
        spread = (length * (length - 1)) ** 0.5  # geometric
        assert np.mean(found) == pytest.approx(length, abs=4 * spread / len(found) ** 0.5)


def test_bursts_of_packets_do_not_ask_how_often_one_sends():
    config = {"loss": 0.1, "bursts": {"mean_packets": 5}}
    assert fates(5000, 0.001, **config) == fates(5000, 1.0, **config)


def test_bursts_in_time_are_met_by_all_who_send_then():
    config = {"loss": 0.2, "bursts": {"mean_s": 0.5}}
    often, seldom = fates(7000, 0.01, **config), fates(1000, 0.07, **config)
    assert seldom == often[::7]
    assert 100 < sum(seldom) < 300


def test_a_burst_may_let_some_through():
    lost = fates(200_000, 0.01, loss=0.1, bursts={"mean_s": 1.0, "loss": 0.5})
    assert np.mean(lost) == pytest.approx(0.1, abs=0.015)
    # After a loss the burst most likely still holds: half of the next packets are lost, too.
    after = [b for a, b in pairwise(lost) if a]
    assert np.mean(after) == pytest.approx(0.5, abs=0.02)


def test_bursts_without_a_loss_are_none():
    assert link(loss=0, bursts={"mean_s": 1}).is_ideal()


def test_losses_of_one_millisecond_come_in_pairs_as_often_as_chance_has_them():
    line, p, n = link(loss=0.1), 0.1, 20_000
    pairs = [[line.carry(t * 0.01, 100) is None for _ in range(2)] for t in range(n)]
    assert np.mean(pairs) == pytest.approx(p, abs=4 * (p * (1 - p) / (2 * n)) ** 0.5)
    both = np.mean([a and b for a, b in pairs])
    assert both == pytest.approx(p * p, abs=4 * (p * p / n) ** 0.5)
