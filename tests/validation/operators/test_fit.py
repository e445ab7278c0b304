"""The fit's rule, on losses that are known: which set is taken, and how wide the bands are."""

import importlib.util
import math
import sys

import numpy as np
import pytest

from dva_sim.kernel import resources

BEST = {"margin": 0.5, "motor_noise": 0.05, "hand_lag_s": 0.12}


@pytest.fixture(scope="module")
def fit():
    path = resources.find("operators", "experiments/validation").with_name("fit_operators.py")
    spec = importlib.util.spec_from_file_location("fit_operators", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def bowl(traits):
    return sum(math.log(traits[name] / value) ** 2 for name, value in BEST.items())


def noisy(own, shared):
    """Quadratic loss with noise, some shared by all sets in a group of persons."""

    def loss(traits, seed):
        group = np.random.default_rng(seed).normal()
        alone = np.random.default_rng([seed, *(round(1e6 * v) for v in traits.values())]).normal()
        return bowl(traits) + shared * group + own * alone, {}

    return loss


def rows(finalists):
    """Finalists by their margin, and their losses group by group."""
    return [
        {"stage": "again", **BEST, "margin": margin, "seed": seed, "loss": loss}
        for margin, losses in finalists.items()
        for seed, loss in enumerate(losses)
    ]


def test_the_experiment_is_played_sixty_times(fit):
    tried = fit.search(noisy(0.0, 0.0))
    assert [[row["stage"] for row in tried].count(s) for s in ("wide", "near", "again")] == [
        16,
        8,
        36,
    ]
    again = [row["seed"] for row in tried if row["stage"] == "again"]
    assert again == 6 * [fit.SEED + 1 + n for n in range(6)]  # the same persons for each


def test_without_noise_the_best_of_all_that_was_tried_is_taken_and_nothing_is_as_good(fit):
    tried = fit.search(noisy(0.0, 0.0))
    best = min((row for row in tried), key=lambda row: row["loss"])
    assert fit.medians_of(tried) == {name: best[name] for name in fit.FREE}
    assert fit.bands_of(tried) == {name: (best[name], best[name]) for name in fit.FREE}


def test_a_loss_that_was_small_by_chance_in_the_search_decides_nothing(fit):
    lucky = {"stage": "near", **BEST, "margin": 0.9, "seed": 1, "loss": -9.0}
    assert fit.medians_of([lucky, *rows({0.9: [3, 3.1], 0.5: [1, 1.2]})])["margin"] == 0.5


def test_who_is_worse_by_less_than_two_standard_errors_widens_the_band(fit):
    """Differences of 0 to 2: mean 1, standard error 0.58; of 1.9 to 2.1: 2, and 0.06."""
    tried = rows({0.5: [1, 5, 9], 0.6: [1, 6, 11], 0.7: [2.9, 7, 11.1]})
    assert fit.bands_of(tried)["margin"] == (0.5, 0.6)


def test_noise_that_all_share_widens_no_band(fit):
    calm, shared = (fit.bands_of(fit.search(noisy(0.0, noise))) for noise in (0.0, 3.0))
    for name in fit.FREE:
        assert shared[name] == pytest.approx(calm[name])


def test_noise_of_their_own_widens_bands(fit):
    bands = fit.bands_of(fit.search(noisy(0.5, 0.0)))
    assert all(high > low for low, high in bands.values())
