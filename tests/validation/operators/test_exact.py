"""The exact checks pass, and the loops under them find what theory says."""

import math
from collections import deque

import pytest

from dva_sim.agents.operator.published import load_split, load_targets, target_lines
from dva_sim.validation.operators import app_filters, control_loops
from dva_sim.validation.operators.exact import MODEL_CHECKS

pytestmark = pytest.mark.system

LINES = target_lines(load_targets(), load_split())
QUICK = [check for check in MODEL_CHECKS if check != "S16b"]


SLOW = pytest.param("S16b", marks=pytest.mark.soak)  # nine in ten helpers are quick


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.soak)])
@pytest.mark.parametrize("check", [*QUICK, SLOW])
def test_a_check_simulates_all_its_lines_and_passes_them_if_it_is_exact(check, seed):
    values = MODEL_CHECKS[check](seed)
    lines = {line.name: line for line in LINES if line.check == check}
    assert values.keys() == lines.keys()
    exact = {name: line for name, line in lines.items() if line.kind == "exact"}
    assert [name for name, line in exact.items() if not line.holds(values[name])] == []


def test_a_delayed_integrator_is_stable_below_half_pi():
    assert control_loops.critical(control_loops.integrator, 1.0, 2.2) == pytest.approx(
        math.pi / 2, rel=1e-3
    )


def linear_pursuit(speed_delay):
    """Pure pursuit for small errors: heading' = -2 v/L (y/L + heading), y' = v heading."""
    dt, speed = 1.0 / control_loops.STEPS, speed_delay
    y, heading, errors = 1e-3, 0.0, []
    frames = deque([(y, heading)] * control_loops.STEPS, maxlen=control_loops.STEPS)
    for _ in range(control_loops.DELAYS * control_loops.STEPS):
        seen_y, seen_heading = frames[0]
        turn = -2.0 * speed * (seen_y + seen_heading)
        y += speed * (heading + 0.5 * turn * dt) * dt
        heading += turn * dt
        frames.append((y, heading))
        errors.append(y)
    return errors


def test_linear_and_true_pursuit_become_unstable_at_the_same_speed(monkeypatch):
    monkeypatch.setattr(control_loops, "BISECTIONS", 6)
    loops = linear_pursuit, control_loops.pure_pursuit
    linear, true = (control_loops.critical(loop, 0.51, 0.53) for loop in loops)
    assert linear == pytest.approx(0.5205, rel=5e-3)
    assert true == pytest.approx(linear, rel=1e-3)


def test_a_loop_that_is_stable_at_both_ends_has_no_critical_value():
    with pytest.raises(ValueError, match=r"0\.5 .* 1$"):
        control_loops.critical(control_loops.integrator, 0.5, 1.0)


def test_a_smith_predictor_answers_nothing_before_the_delay_and_then_as_if_there_were_none():
    places = control_loops.smith_response(4.0, 0.5, 1.0)
    assert max(places[: control_loops.SMITH_STEPS]) == 0.0
    assert places[-1] == pytest.approx(1 - math.exp(-2.0), abs=2e-3)


def test_three_stale_slots_of_twenty_make_a_command_one_and_a_half_samples_older():
    ages = app_filters.ages()
    assert ages["stale"] - ages["clean"] == pytest.approx(1.5 / 34, rel=1e-6)
