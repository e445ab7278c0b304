"""Bands without loss, prediction intervals of single runs under loss."""

import numpy as np
import pytest

from dva_sim.network.pattern_runs import Condition
from dva_sim.validation.network.reference import SocketRun
from dva_sim.validation.network.verdicts import (
    BY_NAME,
    ComparedCell,
    ConditionGroup,
    judge,
    share_inside,
    values_of,
)


def cell(kind, name, measured, predicted, condition=None, realtime=True, late=0.2, applied=100):
    condition = condition or Condition("pub", 10)
    values = {"emu_late_p99_ms": late, "n_applied": applied}
    run = SocketRun(condition, "reference", "A", 1, True, realtime, values)
    group = ConditionGroup(condition, kind, (run,))
    return ComparedCell(group, BY_NAME[name], np.atleast_1d(measured), np.atleast_1d(predicted))


@pytest.mark.parametrize(
    ("measured", "predicted", "word"),
    [(100.0, 106.9, "inside"), (100.0, 107.1, "outside"), (100.0, 93.1, "inside")],
)
def test_without_loss_times_lie_within_5_percent_and_2_ms(measured, predicted, word):
    assert judge(cell("lossless", "age_p50", measured, predicted)).word == word


def test_without_loss_rates_lie_within_5_percent_and_0_05_per_second():
    assert judge(cell("lossless", "applied_hz", 10.0, 10.54)).word == "inside"
    assert judge(cell("lossless", "applied_hz", 10.0, 10.56)).word == "outside"


def test_a_tail_has_10_ms_more_where_the_link_had_no_priority():
    assert judge(cell("lossless", "age_p95", 100.0, 116.0)).word == "outside"
    assert judge(cell("lossless", "age_p95", 100.0, 116.0, realtime=False)).word == "inside"
    assert judge(cell("lossless", "age_p50", 100.0, 116.0, realtime=False)).word == "outside"


def test_no_tail_is_judged_where_the_link_itself_was_late():
    verdict = judge(cell("lossless", "age_p95", 100.0, 500.0, late=5.1))
    assert verdict.word == "shown only"
    assert "late" in verdict.why
    assert judge(cell("lossless", "age_p50", 100.0, 500.0, late=5.1)).word == "outside"


def test_an_overload_has_10_percent_and_15_with_bounded_buffers():
    bounded = Condition("pub", 50, rate_kbit=64, sndbuf=4096)
    assert judge(cell("overload", "age_p50", 1000.0, 1120.0)).word == "outside"
    assert judge(cell("overload", "age_p50", 1000.0, 1120.0, bounded)).word == "inside"


def test_what_has_no_band_is_shown_only():
    assert judge(cell("lossless", "queue", 1.0, 5.0)).word == "shown only"


LOSSY = Condition("pub", 10, loss=0.05)


def test_a_single_run_lies_in_the_models_interval_made_a_little_wider():
    """Of 1 to 200 the interval is 5 to 195; with 2 % and 2 ms it ends at 200.9."""
    runs = np.arange(1.0, 201.0)
    assert judge(cell("single", "age_p50", 200.8, runs, LOSSY)).word == "inside"
    assert judge(cell("single", "age_p50", 201.0, runs, LOSSY)).word == "outside"
    assert judge(cell("single", "timeouts", 199.5, runs, LOSSY)).word == "outside"


def test_a_run_with_few_commands_is_not_judged():
    verdict = judge(cell("single", "age_p50", 500.0, [1.0, 2.0], LOSSY, applied=19))
    assert verdict.why == "fewer than 20 commands applied"


def test_no_single_median_is_judged_where_one_loss_can_end_control():
    livelock = Condition("req", 10, timeout_ms=500, attempts=3, delay_ms=100, loss=0.05)
    assert judge(cell("single", "age_p50", 500.0, [1.0, 2.0], livelock)).word == "shown only"
    assert judge(cell("single", "applied_hz", 500.0, [1.0, 2.0], livelock)).word == "outside"


def test_the_share_inside_counts_what_is_judged():
    verdicts = [
        judge(cell("lossless", name, 100.0, predicted))
        for name, predicted in (("age_p50", 100.0), ("age_p95", 200.0), ("queue", 9.0))
    ]
    assert share_inside(verdicts) == (1, 2)


def test_the_queue_is_littles_law():
    """18 commands a second that are 2 s old on average: 36 are under way."""
    row = {"n_sent": 200, "n_distinct": 180, "applied_hz": 18.0, "age_mean": 2000.0}
    found = values_of(row)
    assert found["queue"] == pytest.approx(36.0)
    assert found["delivered"] == pytest.approx(0.9)
