"""Times of simulated persons over delays and rates: dearer the longer, and without a jump."""

from itertools import pairwise

import numpy as np

from dva_sim.kernel import resources
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.simulation.task import build, play

PERSONS, TRIALS = 6, 6
STEP = 1.6  # largest ratio of the times at two neighbouring levels


def time_of(task, changes, persons=PERSONS):
    """Geometric mean of the times of all trials of all persons [s]."""
    document = load_yaml(resources.find(task, "experiments/scenarios/tasks"))
    fixed = {"trials": TRIALS, "practice": 2, "operator.population_seed": 7}
    logs = []
    for person in range(persons):
        scenario = build(document, {**fixed, **changes, "operator.person": person})
        logs += [np.log(row["movement_time_s"]) for row in play(scenario, 100 + person)]
    return float(np.exp(np.mean(logs)))


def test_a_longer_lag_costs_more_and_no_step_is_a_jump():
    times = [time_of("moving-target", {"link.up.delay_s": lag}) for lag in (0.1, 0.3, 0.5)]
    ratios = [after / before for before, after in pairwise(times)]
    assert min(ratios) > 1.0
    assert max(ratios) < STEP
    assert times[-1] > 1.5 * times[0]


def test_over_frame_rates_times_never_jump_and_come_back():
    rates = (5, 8, 12, 20, 30, 60)
    times = [time_of("frame-rate", {"frames.rate_hz": rate, "trials": 2}) for rate in rates]
    ratios = [slow / fast for slow, fast in pairwise(times)]
    assert min(ratios) > 0.9
    assert max(ratios) < STEP


def test_driving_slows_down_little_by_little_from_no_delay_to_waiting():
    few = {"trials": 1, "practice": 1, "task.leg_m": 4.0, "task.width_m": 1.5}
    delays = (0.0, 0.4, 0.8, 1.2)
    times = [time_of("corner", {**few, "link.down.delay_s": d}, persons=4) for d in delays]
    ratios = [after / before for before, after in pairwise(times)]
    assert min(ratios) > 1.0
    assert max(ratios) < 1.4
    assert times[-1] > 1.4 * times[0]
