import pytest

from dva_sim.kernel.clock import Clock
from dva_sim.network.tcp.retransmission_timer import Timer, next_on_grid


def rung(*deadlines, tick=0.0):
    clock, rings = Clock(), []
    timer = Timer(clock, lambda: rings.append(round(clock.now, 6)), tick)
    for deadline in deadlines:
        timer.set(deadline)
    clock.run(10.0)
    return rings


def test_it_rings_once_at_its_deadline():
    assert rung(0.3) == [0.3]


@pytest.mark.parametrize("deadlines", [(0.3, 0.5), (0.5, 0.3), (0.3, 0.5, 0.3), (0.1, 0.9, 0.4)])
def test_only_the_last_deadline_counts(deadlines):
    assert rung(*deadlines) == [deadlines[-1]]


def test_stopped_it_does_not_ring():
    clock, rings = Clock(), []
    timer = Timer(clock, lambda: rings.append(clock.now))
    timer.set(0.3)
    timer.stop()
    clock.run(1.0)
    assert rings == []


@pytest.mark.parametrize(
    ("wait", "grid"),
    [(0.04, 0.004), (0.25, 0.004), (0.3, 0.032), (2.0, 0.032), (3.0, 0.256), (20.0, 2.048)],
)
def test_the_longer_the_wait_the_coarser_the_wheel_at_250_ticks_a_second(wait, grid):
    for now in (0.0011, 0.77, 1.2345):
        ring = next_on_grid(now, wait, 0.004)
        assert now + wait <= ring <= now + wait + grid + 0.004
        assert ring / grid == pytest.approx(round(ring / grid))


def test_on_a_wheel_a_timeout_of_309_ms_ends_on_the_next_multiple_of_32_ms():
    assert rung(0.309, tick=0.004) == [0.32]
