"""Mistakes in a configuration, in words: the key that was meant, and the value as it should be."""

import math

import pytest

from dva_sim.experiments.study.study import Study
from dva_sim.kernel.config import validate
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.units import as_number
from dva_sim.simulation.scenario import Scenario


def complaint(data, model=Scenario):
    with pytest.raises(ConfigError) as caught:
        validate(model, data)
    return caught.value.problem


@pytest.mark.parametrize(
    ("data", "told"),
    [
        ({"robots": 3}, "unknown key 'robots'; did you mean 'robot.count'?"),
        ({"robots": {}}, "unknown key 'robots'; did you mean 'robot'?"),
        ({"command_rate_hz": 5}, "did you mean 'command.rate_hz'?"),
        ({"fps": 5}, "did you mean 'camera.rate_hz'?"),
        ({"latency_ms": 5}, "did you mean 'link.delay_s'? (in seconds)"),
        ({"link": {"delay_ms": 5}}, "did you mean 'delay_s'? (in seconds)"),
        ({"link": {"bandwidth": 5}}, "did you mean 'rate_bps'? (in bits per second)"),
        ({"duration": 5}, "did you mean 'horizon_s'?"),
        ({"filter": "none"}, "did you mean 'phone.filter'?"),
        ({"policy": "random"}, "did you mean 'dispatch.policy'?"),
        ({"count": 5}, "did you mean 'robot.count', 'guard.count' or 'bystander.count'?"),
        ({"zebra": 5}, "unknown key 'zebra'; known here: access, bystander, camera"),
    ],
    ids=str,
)
def test_an_unknown_key_is_told_with_the_one_that_was_meant(data, told):
    assert told in complaint(data)


@pytest.mark.parametrize(
    ("data", "told"),
    [
        ({"link": {"delay_s": "500ms"}}, "delay_s: should be a number, not '500ms'; write 0.5"),
        ({"link": {"loss": "5%"}}, "link.loss: should be a number, not '5%'; write 0.05"),
        ({"link": {"rate_bps": "2 Mbit/s"}}, "not '2 Mbit/s'; write 2000000"),
        ({"horizon_s": "1,5"}, "horizon_s: should be a number, not '1,5'; write 1.5"),
        ({"horizon_s": "5 m"}, "horizon_s: should be a number, not '5 m'"),
        ({"link": {"delay_s": math.nan}}, "link.delay_s: should be a finite number, not nan"),
        ({"link": {"loss": 7}}, "link.loss: should be at most 0.9, not 7"),
        ({"robot": {"charge": 0}}, "robot.charge: should be above 0, not 0"),
        ({"horizon_s": None}, "horizon_s: should be a number, not null"),
        ({"robot": {"count": "3"}}, "robot.count: should be a whole number, not '3'"),
        ({"robot": {"count": 3.0}}, "should be a whole number, without a point, not 3.0"),
        ({"link": 5}, "link: should be a mapping of keys to values, not 5, such as link.delay_s"),
        ({"control": "coordinate"}, "not 'coordinate'; did you mean 'coordinated'?"),
        ({"control": "x" * 500}, "not '" + "x" * 59 + "..."),
        ({"link": {"delay_law": {"law": "gama"}}}, "law 'gama' is unknown; did you mean 'gamma'?"),
        ({"link": {"delay_law": {}}}, "missing key 'link.delay_law.law'"),
    ],
    ids=lambda value: str(value)[:50],
)
def test_a_value_that_does_not_fit_is_told_with_what_would_be_right(data, told):
    assert told in complaint(data)


def test_keys_of_studies_have_other_names_too():
    data = {"question": "?", "parts": {"a": {"scenario": "x"}}}
    assert "did you mean 'persons'?" in complaint({**data, "participants": 4}, Study)
    assert "did you mean 'replications'?" in complaint({**data, "trials": 4}, Study)


def test_a_number_with_a_unit_is_read_only_where_the_unit_is_clear():
    assert as_number("delay_s", "500 ms") == "0.5"
    assert as_number("speed_mps", "3.6 km/h") == "1"
    assert as_number("queue_bytes", "2 kB") == "2000"
    assert as_number("delay_s", "500 m") == ""
    assert as_number("loss", "half") == ""
    assert as_number("loss", "") == ""
