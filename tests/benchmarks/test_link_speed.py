"""How many packets a second an emulated link takes before it is 5 ms late.

Datagrams of 200 bytes cross it at a steady rate, one way; the rate grows until the 99th percentile
of the forwarder's lateness is above the bound, or the kernel drops what it does not read in time.
"""

import sys

from benchmarks.goals import goal
from helpers.network.emulated_link import need_link

from dva_sim.network.emulator.process import LinkProcess
from dva_sim.network.emulator.report import LinkReport
from dva_sim.network.link import LinkConfig

RATES_HZ = (1000, 3000, 10_000, 20_000, 30_000, 40_000, 60_000, 90_000, 130_000)
SENT_S, SIZE = 2.0, 200
LEAST_HZ = 10_000.0
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


def test_packets_a_second_until_the_emulated_link_is_late():
    need_link()
    held = 0
    for rate in RATES_HZ:
        report = crossed(rate)
        passed = report.up.passed_packets / SENT_S
        print(
            f"\n  {rate} packets/s: {passed:.0f} passed, late by {1e3 * report.late_p50_s:.2f} ms "
            f"(p50), {1e3 * report.late_p99_s:.2f} ms (p99), {report.overrun_packets} overrun",
            end="",
        )
        if report.is_disturbed:
            break
        held = rate
    goal("packets a second of an emulated link in time", held, least=LEAST_HZ)
