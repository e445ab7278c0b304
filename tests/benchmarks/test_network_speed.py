"""What a stream of TCP segments costs in the virtual network, against real time."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import pytest
from benchmarks.goals import goal

from dva_sim.kernel.clock import Clock
from dva_sim.kernel.streams import Streams
from dva_sim.network.connections import Connector
from dva_sim.network.link import ConstantRate, Link, LinkConfig
from dva_sim.network.messaging import Request, Requester
from dva_sim.network.virtual_network import VirtualNetwork

LEAST_SPEED = 500.0  # simulated seconds per second of CPU, 10 commands a second


def network(depth: str, **config: Any) -> VirtualNetwork:
    settings, streams = LinkConfig(**config), Streams(1)
    out, back = (
        Link(settings, ConstantRate(settings.rate_bps), streams, name) for name in ("a", "b")
    )
    connector = Connector(depth=depth)  # type: ignore[arg-type]
    return VirtualNetwork(
        Clock(), lambda a, b: (out, back) if b == "robot" else (back, out), connector=connector
    )


def commands(pattern: str, seconds: float, **config: float) -> Callable[[], float]:
    """10 commands a second over segments; returns the CPU time of the stream [s]."""

    def run() -> float:
        net, taken = network("segment", **config), list[Any]()
        clock = net.clock
        if pattern == "req-rep":
            asker = Requester(net, "phone", "robot", timeout=9.0)
            net.serve("robot", lambda request: (taken.append(1), answer(request)))
            clock.every(0.1, lambda: asker.request(b"x" * 400, lambda _: None))
        else:
            net.subscribe("robot", "phone", "t|", taken.append)
            clock.every(0.1, lambda: net.publish("phone", "t|", 0, 400))
        clock.run(10.0)
        began = time.process_time()
        clock.run(10.0 + seconds)
        spent = time.process_time() - began
        assert len(taken) > 5 * seconds
        return spent

    return run


def answer(request: Request) -> None:
    request.answer(b"x" * 200)


@pytest.mark.parametrize("pattern", ["pub-sub", "req-rep"])
@pytest.mark.parametrize("loss", [0.0, 0.05])
def test_segments_of_a_command_stream_against_real_time(benchmark, pattern, loss):
    seconds = 300.0
    run = commands(pattern, seconds, delay_s=0.03, loss=loss)
    speed = seconds / min(run() for _ in range(3))
    benchmark.extra_info.update(simulated_s_per_cpu_s=round(speed))
    print(f"\n{pattern}, loss {loss:g}: {speed:.0f} simulated seconds per second of CPU")
    goal("simulated seconds per second", speed, least=LEAST_SPEED)
    benchmark.pedantic(run, rounds=1)
