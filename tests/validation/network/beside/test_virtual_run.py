"""Middleware in virtual time: what each transport makes of a link."""

from typing import Any

import pytest

from dva_sim.network.middleware import load_transport
from dva_sim.simulation.middleware import build
from dva_sim.validation.network.beside.carriers import IN_FLIGHT, MqttLeg, why_not
from dva_sim.validation.network.beside.virtual_run import PROGRAM_S, ProgramTimes, VirtualRun

TIMES = ProgramTimes(near=0.4, far=0.41, ending=0.1)
EVERY = (
    ("udp", {}),
    ("websocket", {}),
    ("mqtt", {}),
    ("mqtt", {"qos": 1}),
    ("mqtt", {"broker": "near"}),
    ("mqtt", {"qos": 1, "nodelay": True}),
    ("zenoh", {}),
    *(("zeromq", {"pattern": pattern}) for pattern in ("req-rep", "pub-sub", "conflate")),
)


def play(name, options, seed=1, times=TIMES, **keys: Any):
    scenario = {"model": "middleware", "transport": {"name": name, "options": options}}
    return VirtualRun(build(scenario | {"set_up_s": 2, "measure_s": 4} | keys), seed, times).play()


@pytest.mark.parametrize(("name", "options"), EVERY)
def test_on_a_near_link_every_transport_is_as_old_as_the_link(name, options):
    row = play(name, options, link={"delay_s": 0.01})
    assert row["command_rate_hz"] == 20
    assert row["command_age_p50_s"] == pytest.approx(0.01 + PROGRAM_S, abs=0.001)
    assert row["age_in_force_p50_s"] == pytest.approx(0.01 + PROGRAM_S + 0.025, abs=0.001)
    assert row["longest_gap_s"] == pytest.approx(0.05, abs=0.001)
    assert row["up_bytes"] > 5.5 * 20 * 362
    pictures = play(name, options, link={"delay_s": 0.01}, pictures={"rate_hz": 5, "bytes": 3000})
    assert pictures["down_bytes"] - row["down_bytes"] > 5.3 * 5 * 3000


def test_without_tcp_nodelay_commands_wait_for_a_round_trip():
    gathers, at_once = (
        play("mqtt", options, link={"delay_s": 0.15}) for options in ({}, {"nodelay": True})
    )
    assert at_once["command_age_p50_s"] == pytest.approx(0.1505, abs=0.002)
    assert gathers["command_age_p50_s"] > 0.2
    assert gathers["longest_gap_s"] > 3 * at_once["longest_gap_s"]
    assert gathers["up_bytes"] < at_once["up_bytes"]


def test_a_request_takes_a_round_trip_and_goes_with_the_newest_command():
    row = play("zeromq", {"pattern": "req-rep"}, link={"delay_s": 0.15})
    assert row["longest_gap_s"] == pytest.approx(0.301, abs=0.001)
    assert row["command_age_p50_s"] == pytest.approx(0.1505, abs=0.001)


def test_tcp_stays_out_longer_than_datagrams_and_a_request_goes_again():
    link = {"delay_s": 0.05, "outages": [{"from_s": 3, "for_s": 2}]}
    gaps = {name: play(name, {}, link=link)["longest_gap_s"] for name in ("udp", "websocket")}
    assert gaps["udp"] == pytest.approx(2.05, abs=0.06)
    assert gaps["websocket"] > 2.1
    again = play("zeromq", {"pattern": "req-rep", "timeout_s": 0.5}, link=link)
    assert 2.1 < again["longest_gap_s"] < 4
    assert again["command_rate_hz"] > 1


def test_on_a_narrow_link_datagrams_are_dropped_and_tcp_waits():
    link = {"delay_s": 0.05, "rate_bps": 48_000, "queue_packets": 10}
    udp, stream = (play(name, {}, link=link) for name in ("udp", "websocket"))
    assert udp["age_in_force_p95_s"] < 1
    assert stream["age_in_force_p95_s"] > 1.2
    assert udp["up_bytes"] == pytest.approx(6000 * 5.6, rel=0.1)


@pytest.mark.parametrize(("name", "options"), EVERY)
def test_where_no_packet_passes_nobody_is_connected(name, options):
    row = play(name, options, link={"outages": [{"from_s": 0, "for_s": 100}]})
    assert row["command_rate_hz"] == row["up_bytes"] == 0
    assert row["too_old_share"] == 1.0


def test_a_seed_and_times_are_a_run():
    link = {"delay_s": 0.05, "loss": 0.1}
    rows = [
        play("websocket", {}, seed, times, link=link)
        for seed, times in ((1, TIMES), (1, TIMES), (2, TIMES), (1, TIMES._replace(near=0.5)))
    ]
    assert rows[0] == rows[1]
    assert rows[0] != rows[2]
    assert rows[0] != rows[3]


def test_a_client_has_twenty_messages_in_flight_and_the_next_goes_when_one_is_acknowledged():
    sent = []

    class Out:
        def send(self, what, size):
            sent.append(what)

    leg = MqttLeg(Out(), 1)  # type: ignore[arg-type]
    for number in range(IN_FLIGHT + 2):
        leg.publish(number, 400)
    assert sent == list(range(IN_FLIGHT))
    leg.acknowledged()
    assert sent[-1] == IN_FLIGHT


@pytest.mark.parametrize(
    ("name", "options", "named"),
    [
        ("dds", {}, "DDS"),
        ("webrtc", {}, "WebRTC"),
        ("zenoh", {"carrier": "udp"}, "Zenoh"),
        ("zenoh", {"congestion": "block"}, "Zenoh"),
        ("mqtt", {"qos": 2}, "service 2"),
        ("mqtt", {"expiry_s": 1}, "expiring"),
        *((name, options, "") for name, options in EVERY),
    ],
)
def test_what_the_model_cannot_say_is_named(name, options, named):
    why = why_not(load_transport(name, options)())
    assert named in why if named else why == ""
