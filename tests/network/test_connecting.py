"""Depth of simulated connections: messages where that is exact, segments elsewhere."""

import pytest
from helpers.network.links import link

from dva_sim.network.connections import Connector, Load, ZeromqConfig, is_calm
from dva_sim.network.link import LinkConfig
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full import simulate
from dva_sim.simulation.full.run import compute_load

LOAD = Load(rate_bps=1e6, burst=20_000)


def test_delay_alone_is_no_reason_for_segments():
    assert is_calm(link(delay_s=0.5), LOAD)


@pytest.mark.parametrize(
    "config",
    [
        {"loss": 0.001},
        {"delay_s": 0.1, "jitter_s": 0.01},
        {"outages": [{"from_s": 10, "for_s": 1}]},
        {"rate_bps": 1.2e6},
        {"queue_bytes": 30_000},
    ],
    ids=["loss", "jitter", "an outage", "used up by more than four fifths", "a short queue"],
)
def test_what_may_lose_delay_by_chance_or_pile_up_takes_segments(config):
    assert not is_calm(link(**config), LOAD)
    connector = Connector(load=LOAD)
    assert connector.depth(link(), link()) == "message"
    assert connector.depth(link(), link(**config)) == "segment"
    assert connector.depth(link(**config), link()) == "segment"


@pytest.mark.parametrize(
    "options",
    [
        {"high_water_mark": 10},
        {"send_buffer_bytes": 4096},
        {"receive_buffer_bytes": 4096},
        {"conflate": "publisher"},
    ],
)
def test_a_bound_that_is_set_takes_segments(options):
    connector = Connector(zeromq=ZeromqConfig(**options))
    assert connector.depth(link(), link()) == "segment"


def test_what_is_chosen_by_hand_is_taken():
    for depth in ("message", "segment"):
        connector = Connector(depth=depth)  # type: ignore[arg-type]
        assert connector.depth(link(loss=0.1), link()) == depth
        assert connector.depth(link(), link()) == depth
    assert Connector("datagrams", "segment").depth(link(), link()) == "datagram"


def test_the_usual_pictures_and_commands_use_a_twelfth_of_the_usual_link():
    """10 pictures of 12,000 bytes and 30 messages a second, on 20 Mbit/s."""
    load = compute_load(scenarios.build({}))
    assert load.rate_bps == 8 * (10 * (12_000 + 9 * 52) + 30 * 1000)
    assert load.rate_bps / LinkConfig().rate_bps < 1 / 12
    assert load.burst == 22_468


@pytest.mark.parametrize(
    ("changes", "depth"),
    [
        ({}, "message"),
        ({"network_depth": "segment"}, "segment"),
        ({"link.loss": 0.05}, "segment"),
        ({"link.loss": 0.05, "network_depth": "message"}, "message"),
        ({"transport": "datagrams"}, "datagram"),
    ],
)
def test_a_run_says_what_it_used(changes, depth):
    scenario = scenarios.build(scenarios.load("drive-to-event"), {"horizon_s": 8, **changes})
    assert simulate(scenario, 1).depth == depth
