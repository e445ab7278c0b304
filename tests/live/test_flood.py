"""A stranger floods the DVA of a live run: the rules about its robots are judged all the same."""

import re
from pathlib import Path

import pytest
import zmq
from helpers.processes.command_line import call

from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import encode
from dva_sim.simulation.full.stage import DVA
from dva_sim.simulation.full.verdicts import RULES

pytestmark = [
    pytest.mark.system,
    pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="no list of processes"),
]

SILENCE = 10.0  # after which no more replies are awaited [s]
LABEL = "a stranger".ljust(60, "x")


def flood(address: str, count: int, body: m.Body) -> int:
    """Send messages of as many strangers, and return the number of replies."""
    strangers = [f"AA:BB:CC:00:{number >> 8:02X}:{number & 255:02X}" for number in range(count)]
    data = [encode(m.Message(DVA, 1, source, "12:00:00", 0, body)) for source in strangers]
    with zmq.Context() as context, context.socket(zmq.DEALER) as dealer:
        dealer.set_hwm(0)
        dealer.linger = 0
        dealer.connect(f"tcp://{address}")
        for number, message in enumerate(data):
            dealer.send_multipart([number.to_bytes(8, "big"), b"", message])
        replies = 0
        while replies < count and dealer.poll(1000 * SILENCE):
            dealer.recv_multipart()
            replies += 1
        return replies


def states(lines: list[str]) -> dict[str, str]:
    found = [re.search(r"(S\d) (held|broken|not judged): ", line) for line in lines]
    return {match[1]: match[2] for match in found if match}


def test_a_flood_of_registrations_leaves_all_rules_judged(programs, tmp_path):
    run = programs.start(
        *("live", "drive-to-event", "--operators", "scripted", "--for", "20"),
        *("--record", tmp_path / "run.mcap"),
    )
    run.wait_to_say("mode Teleoperation")
    address = run.output.partition("DVA: ")[2].split()[0]
    assert flood(address, 1500, m.Registration(LABEL, "Sensor", "127.0.0.1:9999")) == 1500
    assert run.ends() == 0, run.complained
    assert states(run.output.splitlines()) == dict.fromkeys(RULES, "held")
    checked = call("check", tmp_path / "run.mcap")
    assert checked.returncode == 0
    assert states(checked.stdout.splitlines()) == dict.fromkeys(RULES, "held")
