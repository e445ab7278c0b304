"""How the phone's app sends commands."""

from __future__ import annotations

import numpy as np

from dva_sim.agents.operator.command_sender import PublishedCommands, topic_of
from dva_sim.agents.operator.person import Population, draw_person
from dva_sim.agents.tilt import Phone, PhoneProfile
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.recorder import DriveLog, Recorder
from dva_sim.kernel.streams import Streams
from dva_sim.network.link import ConstantRate, Link, LinkConfig
from dva_sim.network.virtual import VirtualNetwork
from dva_sim.protocol.codec import decode
from dva_sim.protocol.exchange import Outbox
from dva_sim.protocol.messages import SetTeleOp

PHONE, ROBOT = "02:00:00:03:00:01", "02:00:00:01:00:01"


def test_no_command_leaves_the_phone_before_the_first_picture() -> None:
    """Without a tick the robot could not bound the age of what waits for a connection."""
    line = Link(LinkConfig(), ConstantRate(1e9), Streams(1), "line")
    network = VirtualNetwork(Clock(), lambda a, b: (line, line))
    got: list[bytes] = []
    network.subscribe(ROBOT, PHONE, topic_of(ROBOT), got.append)
    network.clock.run(1.0)

    seen: list[int | None] = [None]
    drive = DriveLog(ROBOT, PHONE, 1, ordered=0.0)
    phone = Phone(PhoneProfile(), draw_person(Population(), 1, 0), np.random.default_rng(1))
    sender = PublishedCommands(
        network, Outbox(PHONE), drive, 7, phone, 10.0, Recorder(), lambda: seen[-1]
    )
    sender.start()
    network.clock.run(3.0)
    assert (got, drive.sent) == ([], 0)

    seen.append(4321)
    network.clock.run(4.05)
    sender.stop()
    network.clock.run(6.0)
    bodies = [decode(data).body for data in got]
    assert len(bodies) == drive.sent == 11
    assert all(isinstance(b, SetTeleOp) and b.seen_tick == 4321 for b in bodies)
