"""A session beside TCP flows on one line: shapes that every run of it must have."""

from typing import Any

import numpy as np
import pytest

from dva_sim.kernel.config import validate
from dva_sim.network.transports import Contest, ContestConfig, play

PLAIN: dict[str, Any] = {"kind": "datagrams", "header_bytes": 12}
KINDS: dict[str, dict[str, Any]] = {
    "udp": {"kind": "udp"},
    "rtnp": PLAIN | {"priority": True},
    "trinomial": PLAIN | {"increase": 0.2, "decrease": 0.125},
    "irtp": PLAIN | {"increase": 1.0, "decrease": 0.5, "repeats_crucial": True},
    "btp": PLAIN | {"increase": 1.0, "decrease": 0.2, "tolerance_s": 0.02},
    "tcp": {"kind": "tcp"},
    "zeromq": {"kind": "zeromq"},
}


def contest(kind: str, seed: int = 1, **more: Any) -> Contest:
    """Ten seconds, after five, of a session of that kind on 1 Mbit/s."""
    data = {"transport": KINDS[kind], "warm_up_s": 5, "measure_s": 10} | more
    return play(validate(ContestConfig, data), seed)


def delays(of: Contest) -> np.ndarray:
    """From making to arriving of the commands that count [s]."""
    made, arrived = np.array(of.commands.made), np.array(of.commands.arrived)
    return (arrived - made)[(made >= of.since) & (made < of.until)]


@pytest.mark.parametrize("kind", KINDS)
def test_alone_on_the_line_every_transport_brings_every_command_after_delay_and_serialisation(kind):
    late = delays(contest(kind))
    assert len(late) in (199, 200, 201)
    # 428 B at least and 475 B at most, with all headers, on 1 Mbit/s and 20 ms
    assert late.min() >= 0.02 + 428 * 8e-6 - 1e-6
    assert late.max() <= 0.02 + 475 * 8e-6 + 1e-6


@pytest.mark.parametrize("kind", KINDS)
def test_the_same_seed_gives_the_same_fates(kind):
    crowd = {"bulk": {"up": 1, "down": 1}, "measure_s": 5}
    assert contest(kind, 7, **crowd) == contest(kind, 7, **crowd)


def test_another_seed_gives_others():
    crowd = {"bulk": {"up": 1}}
    assert contest("udp", 1, **crowd).commands != contest("udp", 2, **crowd).commands


@pytest.mark.parametrize("kind", KINDS)
def test_nobody_puts_more_on_the_line_than_it_carries(kind):
    of = contest(kind, bulk={"up": 2, "down": 2})
    for way in ("up", "down"):
        rate = 8 * (of.session_bytes[way] + sum(of.bulk_bytes[way])) / 10
        queue = 8 * 25_000 / 10  # what was taken into the queue and leaves it later
        assert 0.9e6 < rate <= 1e6 + queue


def test_a_tcp_flow_alone_fills_the_line_and_its_queue():
    of = contest("udp", bulk={"up": 1}, measure_s=30, commands={"rate_hz": 1})
    assert of.bulk_bytes["up"][0] * 8 / 30 > 0.95e6
    assert np.percentile(delays(of), 95) > 0.15  # of at most 25 kB at 1 Mbit/s, 200 ms


def test_tcp_flows_alone_share_the_line_alike():
    of = contest("udp", bulk={"up": 3}, warm_up_s=20, measure_s=60, commands={"rate_hz": 1})
    shares = np.array(of.bulk_bytes["up"]) / sum(of.bulk_bytes["up"])
    assert shares == pytest.approx([1 / 3] * 3, abs=0.1)


def test_udp_takes_what_it_wants_and_laws_of_rate_give_way():
    greedy = {"pictures": {"rate_hz": 20, "bytes": 6000}, "bulk": {"down": 2}, "measure_s": 30}
    udp = contest("udp", **greedy).session_bytes["down"]
    for kind in ("trinomial", "irtp", "btp"):
        assert contest(kind, **greedy).session_bytes["down"] < 0.75 * udp


def test_priority_at_the_hosts_ends_the_wait_and_in_the_network_does_not():
    crowd = {"bulk": {"up": 2}}
    line = {"place": "hosts"}
    at_hosts = np.median(delays(contest("rtnp", bottleneck=line, **crowd)))
    in_network = np.median(delays(contest("rtnp", **crowd)))
    assert at_hosts < 0.02 + (1500 + 440) * 8e-6 + 1e-6
    assert in_network > 0.1


def test_all_crucial_commands_of_irtp_arrive_where_udp_loses_some():
    rough = {
        "bottleneck": {"loss": 0.1},
        "commands": {"crucial_every": 2},
        "measure_s": 40,
    }
    lost = {}
    for kind in ("udp", "irtp"):
        of = contest(kind, **rough)
        made = np.array(of.commands.made)
        crucial = np.array(of.commands.crucial) & (made >= of.since) & (made < of.until)
        lost[kind] = float(np.mean(~np.isfinite(np.array(of.commands.arrived)[crucial])))
    assert lost["irtp"] == 0.0
    assert lost["udp"] == pytest.approx(0.1, abs=0.05)  # 400 of them


def test_every_nth_command_is_crucial():
    crucial = contest("udp", commands={"crucial_every": 3}).commands.crucial
    assert crucial[:7] == [False, False, True, False, False, True, False]
