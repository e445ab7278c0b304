import pytest

from dva_sim.console.run.lag import LIMIT, RECOVERY_S, LagRule


def test_lag_holds_once_and_lets_go_after_it_was_good_for_a_while():
    rule = LagRule()
    assert not rule.measured(0.0, LIMIT)
    assert rule.measured(1.0, LIMIT + 0.01)
    assert not rule.measured(1.1, 2.0)
    assert rule.held
    assert rule.held_for == pytest.approx(0.1)
    rule.measured(1.1 + 0.9 * RECOVERY_S, 0.0)
    assert rule.held
    rule.measured(1.1 + RECOVERY_S, 0.0)
    assert not rule.held
    assert rule.held_for == 0.0
    assert rule.measured(5.0, 1.0)
