"""Counts up to which more robots are shown to help."""

import itertools

import numpy as np
import pytest
from helpers.studies import synthetic_results

from dva_sim.experiments.analysis.run_grid import Factor, RunGrid
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.summary import useful_counts

COUNTS, SIDES = (1, 2, 4, 8), ("supervisory", "direct")
RISING, FLAT = (1.0, 2.0, 3.0, 3.0), (1.0, 1.0, 1.0, 1.0)


def view(rates, *, measure="settled_per_min", over="robot.count", noise=0.05):
    """View 8 persons, who settle some events a minute at each count, under either control."""
    rng = np.random.default_rng(2)
    rows = [
        {"part": "hall", "person": person, "trial": 0, "seed": person, "is_reference": False}
        | {"control": side, over: count, measure: rates[side][n] + rng.normal(0.0, noise)}
        for person, side, (n, count) in itertools.product(range(8), SIDES, enumerate(COUNTS))
    ]
    control, counted = Factor("control", SIDES), Factor(over, COUNTS)
    part = RunGrid(synthetic_results.columns(rows), "hall", [control, counted])
    return StudyView(part, measure, control, counted, SIDES, {})


FALLING = tuple(-rate for rate in RISING)


@pytest.mark.parametrize(
    ("rates", "settings", "expected"),
    [
        ((RISING, FLAT), {}, (4, 1)),
        ((FLAT, FLAT), {}, (1, 1)),
        ((RISING, RISING), {"noise": 5.0}, (1, 1)),
        ((FALLING, RISING), {"measure": "response_mean_s"}, (4, 1)),
        ((RISING, FLAT), {"over": "link.delay_s"}, None),
    ],
)
def test_the_last_count_that_is_shown_to_help_is_named_for_each_side(rates, settings, expected):
    found = useful_counts(view(dict(zip(SIDES, rates, strict=True)), **settings))
    assert found == (() if expected is None else tuple(zip(SIDES, expected, strict=True)))
