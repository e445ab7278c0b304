"""A DVA leaves who is silent, hears who is back, and keeps nothing open for who is gone."""

import math
from pathlib import Path

import pytest
import zmq
from helpers.dva.dispatch_office import Office
from helpers.network.transports import DVA, PHONE, ROBOT, SocketWorld, World, small_device
from helpers.processes.memory import needs_proc, resident_bytes

from dva_sim.agents import device as agents_device
from dva_sim.agents.device import HEARTBEAT, AgentDevice
from dva_sim.network import sockets
from dva_sim.network.realtime import LiveClock
from dva_sim.protocol import messages as m
from dva_sim.protocol.exchange import Outbox
from dva_sim.simulation.full import dva_server
from dva_sim.simulation.full.dva_server import DvaAgent

pytestmark = [pytest.mark.contract, pytest.mark.invariant("S10")]
SILENT, FORGOTTEN, BEAT = 0.4, 0.8, 0.05  # [s]


class Site:
    """A DVA that can be made quick to forget, and devices whose heartbeats can be stopped."""

    def __init__(self, world: World, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(dva_server, "TICK", BEAT)
        self.world = world
        core = Office().new_core()
        self.registry = core.registry
        self.be_patient()
        self.dva = DvaAgent(small_device(world, DVA), core)
        self.dva.leave_after = 0.0
        self.dva.start()
        self.entries = core.registry.entries
        self.beating: set[str] = set()

    def be_patient(self) -> None:
        """Nobody falls silent, however slow this machine is."""
        self.registry.silent_after = self.registry.forget_after = math.inf

    def be_quick(self) -> None:
        self.registry.silent_after, self.registry.forget_after = SILENT, FORGOTTEN

    def device(self, id_tag: str) -> AgentDevice:
        device = small_device(self.world, id_tag)
        if isinstance(self.world, SocketWorld):
            device.address = f"127.0.0.1:{self.world.port(id_tag)}"
        device.serve(lambda message: m.Reply(message.message_id, m.OK, ""))
        self.world.clock.every(BEAT, lambda: self._beat(device))
        return device

    def _beat(self, device: AgentDevice) -> None:
        if device.id_tag in self.beating:
            device.publish(HEARTBEAT, m.Heartbeat())

    def hears(self, id_tag: str) -> None:
        """Wait until heartbeats come in."""
        before = self.dva.beats[id_tag]
        self.world.run_until(lambda: self.dva.beats[id_tag] > before + 2)

    def is_silent(self, id_tag: str) -> bool:
        return self.entries[id_tag].silent


def site_with(
    id_tag: str, world: World, monkeypatch: pytest.MonkeyPatch
) -> tuple[Site, AgentDevice]:
    """A site whose DVA knows one device."""
    site = Site(world, monkeypatch)
    device = site.device(id_tag)
    device.ask(DVA, m.Registration(device.label, device.device_type, device.address))
    world.run_until(lambda: id_tag in site.entries)
    return site, device


def test_who_falls_silent_is_left_and_heard_again_from_its_next_word_on(world, monkeypatch):
    site, phone = site_with(PHONE, world, monkeypatch)
    site.beating.add(PHONE)
    site.hears(PHONE)
    site.beating.clear()
    site.be_quick()
    site.world.run_until(lambda: site.is_silent(PHONE))
    heard = site.dva.beats[PHONE]
    site.beating.add(PHONE)
    world.run_for(4 * BEAT)
    assert site.is_silent(PHONE)
    assert site.dva.beats[PHONE] == heard  # nobody listens
    site.be_patient()
    phone.ask(DVA, m.GetDeviceList())
    site.hears(PHONE)
    assert not site.is_silent(PHONE)


def test_who_is_forgotten_learns_that_and_registers_again(world, monkeypatch):
    site, phone = site_with(PHONE, world, monkeypatch)
    site.be_quick()
    world.run_until(lambda: PHONE not in site.entries)
    site.be_patient()
    codes: list[int] = []
    phone.ask(DVA, m.GetDeviceList(), lambda reply: codes.append(reply.code))
    world.run_until(lambda: PHONE in site.entries)
    phone.ask(DVA, m.GetDeviceList(), lambda reply: codes.append(reply.code))
    world.run_until(lambda: len(codes) == 2)
    assert codes == [m.NOT_REGISTERED, m.OK]


def test_what_a_device_was_asked_before_it_was_forgotten_has_failed(world, monkeypatch):
    site, _ = site_with(ROBOT, world, monkeypatch)
    world.leave(ROBOT)
    failed: list[bool] = []
    site.dva.device.ask(ROBOT, m.GetSensorInfo(), on_failure=lambda: failed.append(True))
    site.be_quick()
    world.run_until(lambda: ROBOT not in site.entries)
    assert failed == [True]
    assert not site.dva.device._requesters


@pytest.mark.parametrize("is_kept", [False, True])
def test_a_connection_that_is_not_used_is_closed_until_the_next_request(
    is_kept, world, monkeypatch
):
    monkeypatch.setattr(agents_device, "UNUSED_FOR", 4 * BEAT)
    site, phone = site_with(PHONE, world, monkeypatch)
    phone.introduce(ROBOT, site.device(ROBOT).address)
    if is_kept:  # so that an emergency never waits for a connection
        phone.connect(ROBOT)
    phone.register()
    codes: list[int] = []
    for asked in (1, 2):
        phone.ask(ROBOT, m.GetSensorInfo(), lambda reply: codes.append(reply.code))
        world.run_until(lambda number=asked: len(codes) == number)
        world.run_for(12 * BEAT)
        assert (phone._requesters[ROBOT, False]._wire is not None) == is_kept
    assert codes == [m.OK, m.OK]


@pytest.mark.invariant("S2")
@pytest.mark.parametrize(
    ("answers", "is_over"),
    [
        (m.OK, True),
        (m.UNKNOWN_DEVICE, True),  # whoever knows nothing of a session obeys nobody in it
        (m.BAD_MESSAGE, False),
    ],
)
def test_a_robot_that_could_not_read_that_its_session_is_over_is_told_again(
    answers, is_over, world, monkeypatch
):
    site, robot = site_with(ROBOT, world, monkeypatch)
    codes = [answers]
    told: list[int] = []

    def reply(message: m.Message) -> m.Reply:
        code = codes.pop() if codes and isinstance(message.body, m.PermissionRevocation) else m.OK
        if isinstance(message.body, m.PermissionRevocation):
            told.append(code)
        return m.Reply(message.message_id, code, "")

    robot.serve(reply)
    site.dva.core.sessions.tell_robot(m.PermissionRevocation(ROBOT, PHONE, 5))
    world.run_until(lambda: not site.dva.core.sessions.has_unacknowledged(ROBOT))
    assert told == ([answers] if is_over else [answers, m.OK])


FILES = Path("/proc/self/fd")


@pytest.mark.skipif(not FILES.exists(), reason="no list of open files")
def test_waves_of_devices_that_vanish_leave_no_file_open(monkeypatch):
    world = SocketWorld()
    try:
        site = Site(world, monkeypatch)
        levels = [_after_a_wave(site, wave) for wave in range(3)]
    finally:
        world.close()
    assert max(levels[1:]) <= levels[0]


@needs_proc
def test_the_memory_of_connections_that_are_closed_goes_back(monkeypatch):
    monkeypatch.setattr(sockets, "GIVE_BACK", 0.1)
    network = sockets.SocketNetwork(LiveClock())
    try:
        network.introduce(ROBOT, "127.0.0.1:9")
        sockets.give_back_memory()
        before = resident_bytes()
        heard = [network.subscribe(DVA, ROBOT, f"{n}|", print) for n in range(300)]
        network.clock.run(network.clock.now + 0.1)
        taken = resident_bytes() - before
        for subscription in heard:
            subscription.close()
        heard.clear()
        network.clock.run(network.clock.now + 300 * sockets.LOOK_ASIDE / sockets.CLOSED_AT_ONCE)
        network.clock.run(network.clock.now + 1.0)
        kept = resident_bytes() - before
    finally:
        network.close()
    assert taken > 5e6
    assert kept < taken / 2


def files() -> int:
    """Number of files open in this process."""
    return len(list(FILES.iterdir()))


def _after_a_wave(site: Site, wave: int, count: int = 25) -> int:
    """Number of open files after all devices of a wave are forgotten."""
    world = site.world
    site.be_patient()
    with zmq.Context() as outside, outside.socket(zmq.DEALER) as asker:
        asker.linger = 0
        asker.connect(f"tcp://{world.network.address(DVA)}")  # type: ignore[attr-defined]
        before = files()
        voices = []
        for number in range(count):
            publisher = outside.socket(zmq.PUB)
            voice = Outbox(f"0A:00:00:00:{wave:02X}:{number:02X}")
            publisher.linger = 0
            port = publisher.bind_to_random_port("tcp://127.0.0.1")
            kind = ("Robot", "Guard", "TeleOp")[number % 3]
            body = m.Registration("passes by", kind, f"127.0.0.1:{port - 1}")
            asker.send_multipart([b"", voice.encode(DVA, body, 0.0)])
            voices.append((publisher, voice))
        world.run_until(lambda: len(site.entries) == count)
        world.run_until(lambda: _all_beat(site, voices))
        assert files() > before + 4 * count
        for publisher, _ in voices:
            publisher.close()
    site.be_quick()
    world.run_until(lambda: not site.entries)
    assert not site.dva.beats
    world.run_for(0.2)  # sockets are closed in the background
    world.run_until(lambda: files() <= before)
    return files()


def _all_beat(site: Site, voices: list[tuple[zmq.Socket[bytes], Outbox]]) -> bool:
    for publisher, voice in voices:
        publisher.send_multipart([HEARTBEAT.encode(), voice.encode(DVA, m.Heartbeat(), 0.0)])
    return all(site.dva.beats[voice.source] for _, voice in voices)
