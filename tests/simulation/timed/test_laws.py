"""Laws of chance: their moments are those of their draws, and draws keep their place."""

import math

import numpy as np
import pytest
from pydantic import TypeAdapter

from dva_sim.kernel.streams import Streams
from dva_sim.simulation.timed.distributions import Law
from dva_sim.simulation.timed.draws import BLOCK, times

ADAPTER: TypeAdapter[Law] = TypeAdapter(Law)

LAWS = [
    ({"law": "constant", "mean_s": 7}, 7, 49),
    ({"law": "exponential", "mean_s": 7}, 7, 98),
    ({"law": "uniform", "low_s": 2, "high_s": 8}, 5, 28),
    ({"law": "erlang", "mean_s": 6, "phases": 3}, 6, 48),
    ({"law": "hyperexponential", "mean_s": 2, "squared_cv": 4}, 2, 20),
    ({"law": "lognormal", "median_s": 4, "spread": 0.5}, 4 * math.exp(1 / 8), 16 * math.exp(1 / 2)),
    ({"law": "lognormal", "mean_s": 10, "spread": 0.5}, 10, 100 * math.exp(1 / 4)),
    ({"law": "gamma", "mean_s": 6, "shape": 0.5}, 6, 108),
    ({"law": "weibull", "mean_s": 3, "shape": 1}, 3, 18),
]  # fmt: skip


@pytest.mark.parametrize(("config", "mean", "second"), LAWS)
def test_a_law_knows_its_first_two_moments(config, mean, second):
    law = ADAPTER.validate_python(config)
    assert law.mean == pytest.approx(mean)
    assert law.second == pytest.approx(second)
    assert law.variance == pytest.approx(second - mean**2, abs=1e-9)


@pytest.mark.parametrize(("config", "mean", "second"), LAWS)
def test_a_hundred_thousand_draws_have_these_moments_within_five_errors(config, mean, second):
    law = ADAPTER.validate_python(config)
    draws = law.sample(np.random.default_rng(1), 100_000)
    for values, expected in ((draws, mean), (draws**2, second)):
        error = values.std() / math.sqrt(len(values))
        assert abs(values.mean() - expected) <= 5 * error + 1e-9


@pytest.mark.parametrize("config", [law for law, _, _ in LAWS])
def test_twice_the_scale_gives_twice_each_draw(config):
    double = {k: 2 * v if k.endswith("_s") else v for k, v in config.items()}
    one, two = (
        ADAPTER.validate_python(c).sample(np.random.default_rng(5), 100) for c in (config, double)
    )
    assert two == pytest.approx(2 * one, rel=1e-12)


def test_a_bare_number_is_a_constant_of_so_many_seconds():
    assert ADAPTER.validate_python(12.5).mean == 12.5


def test_draw_1000_is_the_same_whether_or_not_others_were_asked_for_before():
    law = ADAPTER.validate_python({"law": "exponential", "mean_s": 1})
    asked = times(Streams(3), "a", law)
    everything = [asked[k] for k in range(20 * BLOCK)]
    assert times(Streams(3), "a", law)[1000] == everything[1000]
    assert asked[0] == everything[0]  # long forgotten, and made again
    assert times(Streams(3), "b", law)[1000] != everything[1000]
    assert len(set(everything)) == len(everything)
