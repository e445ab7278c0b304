"""Delay estimates of a person, from its own actions and from what it sees."""

import numpy as np
import pytest

from dva_sim.agents.operator.delay_estimation import DelayEstimate


def learn(
    guess: DelayEstimate, delay: float, seconds: float, frame: float, size: float = 0.5
) -> float:
    """Estimate after a new command every second, each seen `delay` [s] later."""
    asked = np.random.default_rng(1).uniform(0.0, size, round(seconds) + 1)
    for now in np.arange(0.0, seconds, frame).tolist():
        then = now - delay
        guess.see(now, float(asked[int(then)]) if then >= 0 else 0.0, 0.0)
        guess.intend(now, float(asked[int(now)]), 0.0)
    return guess.value


@pytest.mark.parametrize("delay", [0.2, 0.6, 1.5, 4.0, 10.0])
def test_the_delay_is_learnt_to_a_tenth_of_a_second(delay):
    assert learn(DelayEstimate(0.0, 0.6), delay, 60.0, 0.1) == pytest.approx(delay, abs=0.11)


@pytest.mark.parametrize("delay", [0.05, 0.21, 0.6])
def test_a_finer_resolution_learns_it_to_a_hundredth(delay):
    guess = DelayEstimate(0.0, 0.3, step=0.01)
    assert learn(guess, delay, 10.0, 0.01) == pytest.approx(delay, abs=0.015)


def test_channels_in_other_units_are_weighed_by_their_scale():
    """A cursor that moves by millimetres a second tells as much as a robot by metres."""
    coarse = DelayEstimate(0.0, 0.3, step=0.01)
    assert learn(coarse, 0.8, 10.0, 0.01, size=1e-4) == pytest.approx(0.3, abs=0.015)
    fine = DelayEstimate(0.0, 0.3, step=0.01, scale=(1e-4, 1e-4))
    assert learn(fine, 0.8, 10.0, 0.01, size=1e-4) == pytest.approx(0.8, abs=0.015)


def test_while_nothing_changes_the_guess_is_what_was_learnt_before():
    guess = DelayEstimate(0.0, 1.7)
    for now in np.arange(0.0, 20.0, 0.1).tolist():
        guess.intend(now, 0.0, 0.0)
        guess.see(now, 0.0, 0.0)
    assert guess.value == pytest.approx(1.7)


def test_a_delay_that_changes_is_learnt_again_within_half_a_minute():
    guess = DelayEstimate(0.0, 0.6)
    asked = np.random.default_rng(2).uniform(0.0, 0.5, 200)
    values = []
    for now in np.arange(0.0, 120.0, 0.1).tolist():
        then = now - (0.5 if now < 60.0 else 2.0)
        guess.see(now, float(asked[int(then)]) if then >= 0 else 0.0, 0.0)
        guess.intend(now, float(asked[int(now)]), 0.0)
        values.append(guess.value)
    assert values[590] == pytest.approx(0.5, abs=0.11)
    assert all(value == pytest.approx(2.0, abs=0.11) for value in values[900:])


def learns_a_jump_after(frames_per_second: float, seed: int) -> float:
    """Time until a delay that rose from 1 to 3 s is estimated within 0.35 s [s].

    New speeds and turn rates are asked for every two seconds on average.
    """
    rng = np.random.default_rng(seed)
    changes = np.cumsum(rng.exponential(2.0, 400))
    asked = rng.uniform((0.0, -0.5), (0.5, 0.5), (401, 2)).tolist()
    guess, next_look = DelayEstimate(0.0, 0.6), 0.0
    for now in (np.arange(0, 6000) / 20.0).tolist():
        guess.intend(now, *asked[int(np.searchsorted(changes, now))])
        then = now - (1.0 if now < 100.0 else 3.0)
        if now > next_look - 1e-9:
            shown = asked[int(np.searchsorted(changes, then))] if then >= 0.0 else (0.0, 0.0)
            guess.see(now, *shown)
            next_look += 1.0 / frames_per_second
        if now >= 100.0 and abs(guess.value - 3.0) < 0.35:
            return now - 100.0
    return float("inf")


@pytest.mark.parametrize(("frames_per_second", "most"), [(10, 7), (5, 7), (1, 9), (0.5, 14)])
def test_how_fast_a_delay_is_learnt_hardly_depends_on_how_many_frames_there_are(
    frames_per_second, most
):
    """Two looks at the least are needed, whatever they count."""
    took = [learns_a_jump_after(frames_per_second, seed) for seed in range(9)]
    assert 2.0 < float(np.median(took)) < most


def test_a_break_stands_for_nothing_seen():
    """After 4 s in which nobody looked, one wrong picture is one wrong picture."""
    values = []
    for rests in (True, False):
        guess = DelayEstimate(0.0, 0.6)
        learn(guess, 0.6, 20.0, 0.1)
        guess.intend(20.0, 0.5, 1.0)
        if rests:
            guess.rest()
        guess.intend(22.5, 0.0, 0.0)
        guess.see(24.0, 0.5, 1.0)
        values.append(guess.value)
    assert values[0] == pytest.approx(0.6, abs=0.11)
    assert values[1] > 1.4
