"""Packet rate at which an emulated link becomes 5 ms late.

Datagrams of 200 bytes cross it at a steady rate, one way; the rate grows until the 99th percentile
of the forwarder's lateness is above the bound, or the kernel drops what it does not read in time.
Then the rate is sought in between, to a tenth. This figure alone, on a quiet machine:

    .venv/bin/pytest tests/benchmarks -k packets_in_time -p no:cacheprovider -s
"""

import sys
from pathlib import Path

import pytest
from benchmarks.goals import goal
from helpers.network.emulated_link import need_link

from dva_sim.network.emulator.process import LinkProcess
from dva_sim.network.emulator.report import LATE_S, LinkReport
from dva_sim.network.link import LinkConfig

RATES_HZ = (1000, 3000, 10_000, 20_000, 30_000, 40_000, 60_000, 90_000, 130_000)
SENT_S, SIZE = 2.0, 200
LEAST_HZ = 10_000.0
CLOSE = 1.1  # how far apart the last rate in time and the first late one may be
STEADY = """
import os, socket, sys, time
rate, lasts, size = map(float, sys.argv[1:])
plug = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
plug.connect((os.environ["DVA_LINK_FAR"], 5000))
payload, start, sent = b"." * (int(size) - 28), time.monotonic(), 0
while (now := time.monotonic() - start) < lasts:
    while sent < now * rate:
        try:
            plug.send(payload)
        except ConnectionRefusedError:  # nobody listens, which the far end says
            pass
        sent += 1
    time.sleep(0.0005)
"""


def crossed(rate: int) -> LinkReport:
    """Counts of a link that takes so many packets a second."""
    words = [sys.executable, "-c", STEADY, str(rate), str(SENT_S), str(SIZE)]
    with LinkProcess(LinkConfig(delay_s=0.02, rate_bps=1e9, queue_packets=10_000), 1) as link:
        link.begin()
        assert link.start("near", words).wait() == 0
        return link.report()


def is_late(rate: int) -> bool:
    """True if a link at this packet rate is late; prints its measurements."""
    report = crossed(rate)
    offered = report.up.offered_packets / SENT_S
    print(
        f"\n  {rate} packets/s: {offered:.0f} offered, late by {1e3 * report.late_p50_s:.2f} ms "
        f"(p50), {1e3 * report.late_p99_s:.2f} ms (p99), {report.overrun_packets} overrun",
        end="",
    )
    if not report.is_disturbed and offered < rate / CLOSE:
        pytest.skip(
            f"the sender reaches {offered:.0f} packets/s only, at which the link is in time"
        )
    return report.is_disturbed


def packets_in_time(_: Path) -> None:
    """The most packets a second that the link passes in time."""
    need_link()
    late = next((rate for rate in RATES_HZ if is_late(rate)), None)
    assert late is not None, f"the link is in time at {RATES_HZ[-1]} packets/s: try more"
    held = max((rate for rate in RATES_HZ if rate < late), default=0)
    while held and late > CLOSE * held:
        middle = round((held * late) ** 0.5)
        held, late = (held, middle) if is_late(middle) else (middle, late)
    print(f"\n  the link is {1e3 * LATE_S:g} ms late from {late} packets/s on", end="")
    goal("packets a second of an emulated link in time", held, least=LEAST_HZ)
