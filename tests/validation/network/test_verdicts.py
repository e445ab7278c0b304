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


LOSSY = Condition("pub", 10, loss=0.05)
LIVELOCK = Condition("req", 10, timeout_ms=500, attempts=3, delay_ms=100, loss=0.05)
BOUNDED = Condition("pub", 50, rate_kbit=64, sndbuf=4096)
RUNS = np.arange(1.0, 201.0)  # their interval is 5 to 195


@pytest.mark.parametrize(
    ("kind", "name", "measured", "predicted", "more", "word"),
    [
        # Without loss times lie within 5 % and 2 ms, rates within 5 % and 0.05 per second.
        ("lossless", "age_p50", 100.0, 106.9, {}, "inside"),
        ("lossless", "age_p50", 100.0, 107.1, {}, "outside"),
        ("lossless", "age_p50", 100.0, 93.1, {}, "inside"),
        ("lossless", "applied_hz", 10.0, 10.54, {}, "inside"),
        ("lossless", "applied_hz", 10.0, 10.56, {}, "outside"),
        # A tail has 10 ms more where the link had no priority, and no judge where it was late.
        ("lossless", "age_p95", 100.0, 116.0, {}, "outside"),
        ("lossless", "age_p95", 100.0, 116.0, {"realtime": False}, "inside"),
        ("lossless", "age_p50", 100.0, 116.0, {"realtime": False}, "outside"),
        ("lossless", "age_p95", 100.0, 500.0, {"late": 5.1}, "shown only"),
        ("lossless", "age_p50", 100.0, 500.0, {"late": 5.1}, "outside"),
        # An overload has 10 %, and 15 % with bounded buffers.
        ("overload", "age_p50", 1000.0, 1120.0, {}, "outside"),
        ("overload", "age_p50", 1000.0, 1120.0, {"condition": BOUNDED}, "inside"),
        ("lossless", "queue", 1.0, 5.0, {}, "shown only"),  # what has no band
        # A single run lies in the model's interval, made wider by 2 % and 2 ms.
        ("single", "age_p50", 200.8, RUNS, {"condition": LOSSY}, "inside"),
        ("single", "age_p50", 201.0, RUNS, {"condition": LOSSY}, "outside"),
        ("single", "timeouts", 199.5, RUNS, {"condition": LOSSY}, "outside"),
        ("single", "age_p50", 500.0, RUNS, {"condition": LOSSY, "applied": 19}, "shown only"),
        # No single median is judged where one loss can end control.
        ("single", "age_p50", 500.0, RUNS, {"condition": LIVELOCK}, "shown only"),
        ("single", "applied_hz", 500.0, RUNS, {"condition": LIVELOCK}, "outside"),
    ],
)
def test_a_value_is_judged_by_its_kind_and_condition(kind, name, measured, predicted, more, word):
    assert judge(cell(kind, name, measured, predicted, **more)).word == word


def test_why_nothing_is_judged_is_said():
    assert "late" in judge(cell("lossless", "age_p95", 100.0, 500.0, late=5.1)).why
    assert "20 commands" in judge(cell("single", "age_p50", 500.0, RUNS, LOSSY, applied=19)).why


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
