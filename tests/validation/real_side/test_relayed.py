"""Programs measured through the relay that takes the place of emulated packets."""

import dataclasses
import sys

import pytest

from dva_sim.network.emulator.needs import EmulatorError
from dva_sim.network.pattern_runs import Condition
from dva_sim.validation.network.real_side.measuring import measure

CONDITION = Condition("req", 20, timeout_ms=2500, attempts=3, delay_ms=50, dur_s=1, warm_s=0)


@pytest.mark.skipif(sys.platform != "linux", reason="programs are tied together as Linux does")
def test_programs_are_measured_through_the_relay():
    """Fifty milliseconds away and five of service; the first twenty round trips."""
    row = measure(CONDITION, 1, "proxy")
    assert float(row["age_p50"]) >= 55
    assert float(row["rtt_p50"]) >= 105
    assert float(row["t_conn_ms"]) < float(row["t_hs_ms"])


@pytest.mark.parametrize("asked", [{"loss": 0.01}, {"reorder": True}])
def test_a_relay_does_not_pretend_what_it_cannot_do(asked):
    with pytest.raises(EmulatorError, match="lose nor reorder"):
        measure(dataclasses.replace(CONDITION, **asked), 1, "proxy")  # type: ignore[arg-type]
