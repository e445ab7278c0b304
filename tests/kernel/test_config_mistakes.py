"""Mistakes in a configuration, in words: the key that was meant, and the value as it should be."""

import math

import pytest
from helpers.wording import unnamed

from dva_sim.experiments.study.study import Study
from dva_sim.kernel.config import validate
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.quantities import as_number
from dva_sim.simulation.scenario import Scenario


def complaint(data, model=Scenario):
    with pytest.raises(ConfigError) as caught:
        validate(model, data)
    return caught.value.problem


@pytest.mark.parametrize(
    ("data", "names"),
    [
        ({"robots": 3}, "'robots'; 'robot.count'?"),
        ({"robots": {}}, "'robots'; 'robot'?"),
        ({"command_rate_hz": 5}, "'command.rate_hz'?"),
        ({"fps": 5}, "'camera.rate_hz'?"),
        ({"latency_ms": 5}, "'link.delay_s'? seconds"),
        ({"link": {"delay_ms": 5}}, "'delay_s'? seconds"),
        ({"link": {"bandwidth": 5}}, "'rate_bps'? bits second"),
        ({"duration": 5}, "'horizon_s'?"),
        ({"filter": "none"}, "'phone.filter'?"),
        ({"policy": "random"}, "'dispatch.policy'?"),
        ({"count": 5}, "'robot.count', 'guard.count' 'bystander.count'?"),
        ({"zebra": 5}, "'zebra'; access, bystander, camera"),
    ],
    ids=str,
)
def test_an_unknown_key_is_told_with_the_one_that_was_meant(data, names):
    assert unnamed(complaint(data), *names.split()) == []


@pytest.mark.parametrize(
    ("data", "names"),
    [
        ({"link": {"delay_s": "500ms"}}, "delay_s: number, '500ms'; 0.5"),
        ({"link": {"loss": "5%"}}, "link.loss: number, '5%'; 0.05"),
        ({"link": {"rate_bps": "2 Mbit/s"}}, "Mbit/s'; 2000000"),
        ({"horizon_s": "1,5"}, "horizon_s: number, '1,5'; 1.5"),
        ({"horizon_s": "5 m"}, "horizon_s: number, '5"),
        ({"link": {"delay_s": math.nan}}, "link.delay_s: finite nan"),
        ({"link": {"delay_s": 500}}, "link.delay_s: most 30 seconds, 500"),
        ({"link": {"recorded": "a.log"}}, "'link.recorded'; 'delay_log'?"),
        ({"link": {"loss": 7}}, "link.loss: most 0.9 share 7"),
        ({"robot": {"charge": 0}}, "robot.charge: above 0, 0"),
        ({"horizon_s": None}, "horizon_s: number, null"),
        ({"robot": {"count": "3"}}, "robot.count: whole '3'"),
        ({"robot": {"count": 3.0}}, "whole point, 3.0"),
        ({"link": 5}, "link: mapping 5, link.delay_s"),
        ({"control": "coordinate"}, "direct, supervisory, 'coordinate'; 'coordinated'?"),
        ({"control": "x" * 500}, "'" + "x" * 59 + "..."),
        ({"link": {"delay_law": {"law": "gama"}}}, "'gama' 'gamma'?"),
        ({"link": {"delay_law": {}}}, "missing 'link.delay_law.law'"),
    ],
    ids=lambda value: str(value)[:50],
)
def test_a_value_that_does_not_fit_is_told_with_what_would_be_right(data, names):
    assert unnamed(complaint(data), *names.split()) == []


def test_keys_of_studies_have_other_names_too():
    data = {"question": "?", "parts": {"a": {"scenario": "x"}}}
    assert "'persons'?" in complaint({**data, "participants": 4}, Study)
    assert "'replications'?" in complaint({**data, "trials": 4}, Study)


def test_a_number_with_a_unit_is_read_only_where_the_unit_is_clear():
    assert as_number("delay_s", "500 ms") == "0.5"
    assert as_number("speed_mps", "3.6 km/h") == "1"
    assert as_number("queue_bytes", "2 kB") == "2000"
    assert as_number("delay_s", "500 m") == ""
    assert as_number("loss", "half") == ""
    assert as_number("loss", "") == ""
