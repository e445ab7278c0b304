"""Learning how often commands get through, from the times when moves take effect."""

import numpy as np
import pytest

from dva_sim.agents.habits import AimingHabits, DelayHabits
from dva_sim.agents.operator.delay_estimation import PeriodEstimate, Timing

DELAY = 1.0  # [s]


def learnt(period, lasts, moves=12, rest=6.0):
    """Estimate after some moves, if a command gets through once per period [s]."""
    estimate, step, offset = PeriodEstimate(DelayHabits()), 0.05, 0.37
    for n in range(round(moves * (lasts + rest + offset) / step)):
        now = n * step
        asked = float(now % (lasts + rest + offset) < lasts)
        sent = period * np.floor((now - DELAY) / period) if period else now - DELAY
        applied = float(sent >= 0.0 and sent % (lasts + rest + offset) < lasts)
        estimate.see(now, applied, 0.0, DELAY)
        estimate.intend(now, asked, 0.0)
    return estimate.value


def test_where_every_command_gets_through_there_is_no_period():
    assert learnt(0.0, lasts=1.0) < 0.25


@pytest.mark.parametrize("period", [1.0, 2.0])
def test_the_period_is_learnt_from_moves_that_last_longer(period):
    assert 0.4 * period < learnt(period, lasts=2.0 * period) < 1.6 * period


def test_a_move_that_was_lost_makes_the_next_ones_longer():
    assert learnt(2.0, lasts=0.5) > 0.5


def test_a_time_is_misjudged_by_a_share_of_it():
    habits = AimingHabits(misjudges=0.2)
    timing = Timing(habits, np.random.default_rng(1))
    logs = np.log([timing.at(10.0 * n) for n in range(2000)])
    assert logs.std() == pytest.approx(0.2, rel=0.1)
    assert timing.at(20_000.0) == pytest.approx(timing.at(20_000.001), rel=0.1)
