"""Command sending by the phone's app."""

import math

import numpy as np
import pytest

from dva_sim.agents.device import AgentDevice, command_topic
from dva_sim.agents.operator.command_sender import CommandSender
from dva_sim.agents.population import Population, draw_person
from dva_sim.agents.tilt import Phone, PhoneProfile
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.config import validate
from dva_sim.kernel.recorder import DriveLog, Recorder
from dva_sim.kernel.streams import Streams
from dva_sim.network.link import ConstantRate, Link, LinkConfig
from dva_sim.network.messaging import Request
from dva_sim.network.patterns import Pattern, PubSub, ReqRep
from dva_sim.network.virtual_network import VirtualNetwork
from dva_sim.protocol.codec import decode
from dva_sim.protocol.exchange import Outbox
from dva_sim.protocol.messages import BAD_MESSAGE, OK, Reply, SetTeleOp
from dva_sim.worlds.geo import GeoFrame

PHONE, ROBOT = "02:00:00:03:00:01", "02:00:00:01:00:01"


def small_network() -> VirtualNetwork:
    line = Link(LinkConfig(), ConstantRate(1e9), Streams(1), "line")
    return VirtualNetwork(Clock(), lambda a, b: (line, line))


def small_phone(profile: PhoneProfile) -> Phone:
    return Phone(profile, draw_person(Population(), 1, 0), np.random.default_rng(1))


def small_sender(
    network: VirtualNetwork,
    pattern: Pattern,
    seen: list[int | None],
    refusals: list[str] | None = None,
    phone: Phone | None = None,
    recorder: Recorder | None = None,
) -> CommandSender:
    device = AgentDevice(
        id_tag=PHONE,
        label="operator-1",
        device_type="TeleOp",
        address="",
        dva="",
        network=network,
        recorder=recorder or Recorder(),
        frame=GeoFrame(38.66, -9.2),
        timeout=9.0,
        attempts=3,
    )
    return CommandSender(
        device,
        pattern=pattern,
        drive=DriveLog(ROBOT, PHONE, 1, ordered=0.0),
        session=7,
        phone=phone or small_phone(PhoneProfile()),
        rate_hz=10.0,
        timeout=9.0,
        attempts=3,
        window=8,
        seen_tick=lambda: seen[-1],
        on_lost=lambda why: None,
        on_refused=lambda why: refusals.append(why) if refusals is not None else None,
    )


def test_no_command_leaves_the_phone_before_the_first_picture():
    """Without a tick the robot could not bound the age of what waits for a connection."""
    network, seen = small_network(), list[int | None]([None])
    got: list[bytes] = []
    network.subscribe(ROBOT, PHONE, command_topic(ROBOT), got.append)
    network.clock.run(1.0)

    sender = small_sender(network, PubSub(), seen)
    sender.start()
    network.clock.run(3.0)
    assert (got, sender.drive.sent) == ([], 0)

    seen.append(4321)
    network.clock.run(4.05)
    sender.stop()
    network.clock.run(6.0)
    bodies = [decode(data).body for data in got]
    assert len(bodies) == sender.drive.sent == 11
    assert all(isinstance(b, SetTeleOp) and b.seen_tick == 4321 for b in bodies)


class Broken(PubSub):
    """Fails with every second command."""

    count = 0

    def offer(self, command) -> None:  # type: ignore[no-untyped-def]
        self.count += 1
        if self.count % 2:
            raise ValueError("odd")
        super().offer(command)


def test_what_a_pattern_of_a_user_gets_wrong_is_counted_and_the_others_go():
    network = small_network()
    sender = small_sender(network, Broken(), [1])
    sender.start()
    network.clock.run(0.95)
    assert (sender.failures, sender.drive.sent) == (5, 5)
    assert sender.first_failure == "ValueError: odd"


def test_a_shipped_pattern_that_fails_ends_the_run(monkeypatch):
    """Its errors are ours: nobody should have to look for them in a counter."""
    monkeypatch.setattr(PubSub, "offer", lambda pattern, command: 1 / 0)
    sender = small_sender(small_network(), PubSub(), [1])
    with pytest.raises(ZeroDivisionError):
        sender.start()


def test_once_a_drive_is_over_its_pattern_sends_nothing():
    network, kept = small_network(), PubSub()
    sender = small_sender(network, kept, [1])
    sender.start()
    network.clock.run(0.35)
    sender.stop()
    sent, last = sender.drive.sent, sender.drive.commands[-1]
    kept.line.publish(last)  # type: ignore[arg-type]
    assert sender.drive.sent == sent == 4


@pytest.mark.parametrize("off", [0, 1])
def test_a_reply_counts_only_if_it_answers_the_command(off):
    network, reported = small_network(), list[str]()
    says = Outbox(ROBOT)

    def answer(request: Request) -> None:
        number = decode(request.data).message_id
        request.answer(says.encode(PHONE, Reply(number + off, OK, ""), network.clock.now, 7))

    network.serve(ROBOT, answer)
    sender = small_sender(network, ReqRep(), [1], reported)
    sender.start()
    network.clock.run(1.0)
    assert sender.drive.refused[BAD_MESSAGE] == off * sender.drive.sent
    assert ["no answer" in line for line in reported[:1]] == [True] * off


class Ages(Recorder):
    """Keeps the ages of the samples behind each command [s]."""

    def __init__(self) -> None:
        super().__init__()
        self.ages: list[float] = []

    def command_issued(self, source, message_id, issued) -> None:  # type: ignore[no-untyped-def]
        self.ages.append(issued.sample_age)
        super().command_issued(source, message_id, issued)


def sent_while(pattern: Pattern, **settings: object) -> tuple[list[float], list[float]]:
    """Send times and ages of commands [s], from an app as printed and a robot that takes 1 s."""
    data = {"filter": "median20-copy", "send": "on_change", "values_at": "sample", **settings}
    network, says, recorder = small_network(), Outbox(ROBOT), Ages()
    phone = small_phone(validate(PhoneProfile, data))

    def answer(request: Request) -> None:
        reply = Reply(decode(request.data).message_id, OK, "")
        data = says.encode(PHONE, reply, network.clock.now, 7)
        network.clock.call_after(1.0, request.answer, data)

    network.serve(ROBOT, answer)
    sender = small_sender(network, pattern, [1], phone=phone, recorder=recorder)
    sender.start()

    def ask() -> None:
        phone.ask(network.clock.now, 0.25 + 0.2 * math.sin(network.clock.now), 0.0)

    network.clock.every(0.2, ask)
    network.clock.run(20.0)
    return [time for time, *_ in sender.drive.commands], recorder.ages


@pytest.mark.parametrize(
    ("while_open", "period"),
    [("take", 1.0), ("drop", 1.0 + 17.5 / 34.0), ("queue", 1.0)],
)
def test_an_app_that_sends_within_its_callback_sends_after_the_reply(while_open, period):
    """Dropped samples restart after the reply; queued ones have the next 20 ready."""
    times, ages = sent_while(ReqRep(), while_open=while_open)
    assert np.median(np.diff(times)) == pytest.approx(period, abs=0.06)
    assert (max(ages) > 4.0) == (while_open == "queue")


@pytest.mark.parametrize("while_open", ["drop", "queue"])
def test_published_commands_hold_up_no_sample(while_open):
    times, _ = sent_while(PubSub(), while_open=while_open)
    usual, _ = sent_while(PubSub(), while_open="take")
    assert times == usual
    assert len(times) > 20
