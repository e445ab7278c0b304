"""Number of robots per person, against cases with a known answer."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dva_sim.experiments.analysis.fan_out import Need, need_of, settled_per_person
from dva_sim.experiments.results.results import Results
from dva_sim.kernel.errors import ConfigError
from dva_sim.validation.dispatch import exact


def test_one_robot_alone_is_served_at_once_by_either_theory():
    need = Need(neglect=50.0, interaction=10.0)
    assert need.rate_without_waiting(1) == pytest.approx(1 / 60)
    assert need.rate_with_waiting(1) == pytest.approx(1 / 60)


def test_the_fan_out_is_how_many_interactions_fit_into_a_cycle():
    need = Need(neglect=50.0, interaction=10.0)
    assert need.fan_out == pytest.approx(6.0)
    assert [need.rate_without_waiting(n) for n in (3, 6, 9)] == pytest.approx([0.05, 0.1, 0.1])


def test_two_machines_and_one_repairman_are_as_in_the_books():
    """P(idle) = 1 / (1 + 2r + 2r^2) with r = interaction / neglect: 1 / 5 for r = 1."""
    need = Need(neglect=20.0, interaction=20.0)
    assert need.rate_with_waiting(2) == pytest.approx((1 - 1 / 5) / 20.0)


def test_with_very_many_robots_the_operator_is_never_idle():
    assert Need(50.0, 10.0).rate_with_waiting(100) == pytest.approx(0.1)


def test_a_queue_with_a_finite_source_is_that_of_queueing_theory():
    rate = exact.finite_source(6, 1, 30.0, 10.0)["utilisation"] / 10.0
    assert Need(30.0, 10.0).rate_with_waiting(6) == pytest.approx(rate)


class Kept(Results):
    """Results whose tables are at hand."""

    def table(self, name: str) -> Any:
        """Table of events or runs, as from `Results`."""
        events = {
            "part": ["hall"] * 5,
            "robot.count": [1, 1, 1, 1, 2],
            "is_reference": [False] * 5,
            "person": [0, 0, 0, 1, 0],
            "trial": [0] * 5,
            "outcome": ["confirmed", "refuted", "open", "confirmed", "confirmed"],
            "t_arrived_s": [150.0, 280.0, np.nan, 250.0, 300.0],
            "t_closed_s": [160.0, 300.0, np.nan, 255.0, 310.0],
        }
        runs = {
            "part": ["hall"] * 3,
            "robot.count": [1, 1, 2],
            "is_reference": [False] * 3,
            "person": [0, 1, 0],
            "trial": [0] * 3,
            "simulated_s": [400.0, 400.0, 400.0],
        }
        return {n: np.array(v) for n, v in {"events": events, "runs": runs}[name].items()}


def test_what_is_closed_before_the_warm_up_is_over_does_not_count():
    results, where = Kept(Path(), {}), {"robot.count": 1}
    assert settled_per_person(results, "hall", where, 100.0) == pytest.approx([2 / 300, 1 / 300])
    assert settled_per_person(results, "hall", where, 200.0) == pytest.approx([1 / 200, 1 / 200])


def test_interaction_is_from_the_first_sight_to_the_judgement_and_all_else_is_neglect():
    need = need_of(Kept(Path(), {}), "hall", {"robot.count": 1}, 100.0)
    assert need.interaction == pytest.approx((10.0 + 20.0 + 5.0) / 3)
    assert need.neglect + need.interaction == pytest.approx(200.0)


def test_where_nothing_was_settled_nothing_is_known():
    with pytest.raises(ConfigError, match="no settled event"):
        need_of(Kept(Path(), {}), "hall", {"robot.count": 9}, 0.0)
