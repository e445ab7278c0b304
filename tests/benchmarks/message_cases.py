"""Messages: through the network, beside what carries things elsewhere, and to bytes and back."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from typing import Any

Work = Callable[[], float]

MESSAGES, AT_ONCE = 1_000, 100


def published() -> Work:
    """A message to its one subscriber, over a link with delay and rate."""
    from dva_sim.kernel.clock import Clock
    from dva_sim.kernel.streams import Streams
    from dva_sim.network.connections import Connector
    from dva_sim.network.link import ConstantRate, Link, LinkConfig
    from dva_sim.network.virtual_network import VirtualNetwork

    settings = LinkConfig(delay_s=0.01, rate_bps=1e9, queue_bytes=10_000_000)
    streams = Streams(1)
    out, back = (
        Link(settings, ConstantRate(settings.rate_bps), streams, name) for name in ("a", "b")
    )
    links = lambda a, b: (out, back) if b == "robot" else (back, out)  # noqa: E731
    net, taken = VirtualNetwork(Clock(), links, connector=Connector(depth="message")), list[int]()
    net.subscribe("robot", "phone", "t|", taken.append)
    net.clock.run(1.0)
    return in_blocks(net.clock, lambda number: net.publish("phone", "t|", number, 500))


def called() -> Work:
    """A bare function at a later moment: the kernel's part of a message."""
    from dva_sim.kernel.clock import Clock

    clock, taken = Clock(), list[int]()
    return in_blocks(clock, lambda number: clock.call_after(0.01, taken.append, number))


def in_blocks(clock: Any, send: Callable[[int], object]) -> Work:
    def work() -> float:
        for _ in range(MESSAGES // AT_ONCE):
            for number in range(AT_ONCE):
                send(number)
            clock.run(clock.now + 0.1)
        return MESSAGES

    return work


def stored() -> Work:
    """A put and a get of a `simpy.Store`, between two processes."""
    import simpy

    def work() -> float:
        env = simpy.Environment()
        shelf = simpy.Store(env)

        def producer() -> Any:
            for number in range(MESSAGES):
                yield shelf.put(number)

        def consumer() -> Any:
            for _ in range(MESSAGES):
                yield shelf.get()

        env.process(producer())
        env.process(consumer())
        env.run()
        return MESSAGES

    return work


def hop(kind: str, canonical: bool = True) -> Work:
    """Encoded by one, validated and read by another: our form, or another allowed one."""
    from dva_sim.protocol import codec
    from dva_sim.protocol import messages as m

    bodies: dict[str, Any] = {
        "SetTeleOp": m.SetTeleOp(0.5, 0.56, 86320),
        "RobotStatus": m.RobotStatus("Idle", m.Position(38.66, -9.2), 1.57, 0.5, 0.1, 86320),
        "Heartbeat": m.Heartbeat(),
    }
    session = None if kind == "Heartbeat" else 1425
    to, rest = "70:1A:04:F9:81:D6", ("56:2B:04:E4:56:D8", "12:30:56", session, bodies[kind])
    tail = b"" if canonical else b"\n"
    numbers = count(1)  # no message is like one before

    def work() -> float:
        for _ in range(MESSAGES):
            message = m.Message(to, next(numbers), *rest)
            assert codec.decode(codec.encode(message) + tail) is not None
        return MESSAGES

    return work
