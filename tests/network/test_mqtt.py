"""MQTT as a whole transport: what its broker refuses, and what a lost broker does to a robot."""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import closing

import pytest
from helpers.network.scripted_session import ROBOT, Scene
from helpers.network.transports import DVA, NO_MQTT, PHONE, TABLET, Asker, Listener, MqttWorld, echo
from helpers.network.transports import ROBOT as PLAIN
from helpers.processes.patience import PATIENCE_S
from helpers.wording import unnamed

from dva_sim.agents.operator.scripted import Ask, Pause, Script, ScriptedOperator
from dva_sim.kernel.recorder import Recorder
from dva_sim.network.mqtt import MOST_WANTED, open_broker
from dva_sim.network.mqtt_broker import new_client
from dva_sim.network.real_network import NetworkError
from dva_sim.protocol import messages as m
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full import stage as stages
from dva_sim.simulation.full.stage import Stage, id_of

pytestmark = pytest.mark.system
if NO_MQTT:
    pytest.skip(NO_MQTT, allow_module_level=True)

STRANGER = "02:00:00:00:00:99"


@pytest.fixture
def world() -> Iterator[MqttWorld]:
    with closing(MqttWorld()) as made:
        yield made


class Outsider:
    """A client of another make, under any client id."""

    def __init__(self, world: MqttWorld, name: str) -> None:
        self.got: list[str] = []
        self._ready = threading.Event()
        self.client = new_client(name, nodelay=True)
        self.client.on_connect = lambda client, *_: client.subscribe("#", 1)
        self.client.on_subscribe = lambda *_: self._ready.set()
        self.client.on_message = lambda _, __, message: self.got.append(message.topic)
        self.client.connect("127.0.0.1", world.port)
        self.client.loop_start()
        assert self._ready.wait(PATIENCE_S)

    def publish(self, topic: str, data: bytes, retain: bool = False, **attributes: object) -> str:
        """Publish, and say what the broker made of it."""
        from paho.mqtt.packettypes import PacketTypes
        from paho.mqtt.properties import Properties

        codes: list[str] = []
        done = threading.Event()
        self.client.on_publish = lambda _, __, ___, code, *____: (
            codes.append(str(code)),
            done.set(),
        )
        properties = Properties(PacketTypes.PUBLISH)
        for name, value in attributes.items():
            setattr(properties, name, value)
        self.client.publish(topic, data, 1, retain, properties)
        assert done.wait(PATIENCE_S)
        return codes[0]

    def close(self) -> None:
        self.client.disconnect()
        self.client.loop_stop()


@pytest.mark.parametrize(
    "topic",
    [f"request/{PLAIN}/{PHONE}", f"reply/{PHONE}/{PLAIN}", f"news/{PHONE}/x|", f"gone/{PHONE}"],
)
def test_who_publishes_for_somebody_else_is_refused_by_the_broker(world, topic):
    """The broker knows a client by its client id, which nobody has to prove."""
    heard: list[bytes] = []
    world.serve(PLAIN, lambda request: heard.append(request.data))
    with closing(Outsider(world, TABLET + "x")) as outsider:
        assert outsider.publish(topic, b"forged") == "Not authorized"
        own = outsider.publish(f"request/{PLAIN}/{TABLET}x", b"own", ResponseTopic="elsewhere")
    assert own == "Success"
    world.run_until(lambda: world.network.counters["requests of another form"])
    assert heard == []  # its reply would have gone where the sender may not read


def test_a_client_reads_publications_and_nothing_that_is_for_others(world):
    world.serve(PLAIN, echo)
    with closing(Outsider(world, STRANGER)) as outsider:
        listener, asker = Listener(world, "news|"), Asker(world.network)
        listener.await_a_mark()
        asker.ask(b"for the robot alone")
        world.run_until(asker.all_over)
        listener.await_a_mark()
        world.run_until(lambda: outsider.got)
    assert {topic.partition("/")[0] for topic in outsider.got} == {"news"}


def test_a_request_that_somebody_has_left_at_the_broker_is_not_obeyed(world):
    """It would come again with every connection, however old it is."""
    heard: list[bytes] = []
    world.serve(PLAIN, lambda request: heard.append(request.data))
    reply_to = f"reply/{STRANGER}/{PLAIN}"
    with closing(Outsider(world, STRANGER)) as outsider:
        outsider.publish(f"request/{PLAIN}/{STRANGER}", b"old", True, ResponseTopic=reply_to)
    world.run_until(lambda: heard)
    world.leave(PLAIN)
    world.come_back(PLAIN)
    world.run_until(lambda: world.network.counters["kept messages, which are old"])
    assert heard == [b"old"]


def test_a_subscriber_that_ends_without_a_word_is_no_longer_wanted(world):
    outsider = Outsider(world, STRANGER)
    outsider.client.will_set(f"gone/{STRANGER}", b"")
    outsider.client.reconnect()
    outsider.publish(f"wants/{PHONE}/{STRANGER}", b"frame|\n", True)
    world.run_until(lambda: world.network.ready(PHONE, "frame|", 10))
    outsider.client.socket().shutdown(2)
    world.run_until(lambda: not world.network.ready(PHONE, "frame|", 10))
    outsider.close()


def test_who_takes_the_client_id_of_a_device_is_noticed(world):
    """Nothing keeps a client of this machine from it; SECURITY.md says what follows."""
    with closing(Outsider(world, PHONE)):
        world.run_until(lambda: world.reports)
    assert unnamed(world.reports[0], PHONE) == []


def test_when_the_broker_is_back_everything_goes_on(world):
    world.serve(DVA, echo)
    listener = Listener(world, "news|")
    listener.await_a_mark()
    os.kill(world.broker.pid, signal.SIGKILL)
    world.run_until(lambda: world.reports)
    world.broker.close()
    world.broker = open_broker("127.0.0.1", world.port)
    world.run_until(lambda: len(world.reports) == 2)
    listener.await_a_mark()
    asker = Asker(world.network, timeout=1.0, peer=DVA, attempts=30)
    asker.ask(b"are you there?")
    world.run_until(asker.all_over)
    assert asker.replies() == [b"re: are you there?"]
    assert [unnamed(line, f"127.0.0.1:{world.port}") for line in world.reports] == [[], []]


# --- a robot that is driven ---------------------------------------------------------------


def drives(_: ScriptedOperator) -> Script:
    """Ask for the robot, and drive on for ever."""
    reply = yield Ask(stages.DVA, m.PermissionRequest(ROBOT, "teleoperation", (), None))
    while reply is None or not isinstance(reply.content, m.Permission):
        yield Pause(0.1)
        reply = yield Ask(stages.DVA, m.PermissionRequest(ROBOT, "teleoperation", (), None))
    session, reply = reply.content.session, None
    while reply is None or reply.code != m.OK:
        reply = yield Ask(ROBOT, m.StartTeleOp(), session)
    while True:
        yield Ask(ROBOT, m.SetTeleOp(0.4, 0.3), session)
        yield Pause(0.02)


@pytest.mark.invariant("S1")
def test_a_driven_robot_stands_when_its_broker_is_killed():
    scenario = scenarios.build(
        scenarios.load("drive-to-event"), {"events": [{"kind": "fire", "at_s": 5000}]}
    )
    with closing(MqttWorld(nodes=())) as world:
        network = world.network
        join = lambda kind, number: network.join(id_of(kind, number))  # noqa: E731
        scene = Scene(Stage(scenario, 1, network, Recorder(), join))
        scene.enters(1, drives)

        def speed() -> float:
            scene.field.world.advance_to(world.clock.now)
            return abs(scene.robot.body.speed)

        scene.until(lambda: speed() > 0.2)
        os.kill(world.broker.pid, signal.SIGKILL)
        scene.until(lambda: speed() < 0.01)
        scene.until(lambda: world.reports)
        world.run_for(2.0)
        assert speed() < 0.01
    assert len(world.reports) == 1
    assert unnamed(world.reports[0], f"127.0.0.1:{world.port}") == []


def test_a_port_that_is_taken_is_told_with_the_reason(world):
    with pytest.raises(NetworkError) as refused:
        open_broker("127.0.0.1", world.port)
    assert unnamed(str(refused.value), f"127.0.0.1:{world.port}") == []


@pytest.mark.invariant("S10")
def test_what_clients_want_of_a_device_is_bounded(world):
    wanted = b"x" * (2 * MOST_WANTED // 3) + b"|\n"
    outsiders = [Outsider(world, f"0A:00:00:00:00:0{number}") for number in range(3)]
    for number, outsider in enumerate(outsiders):
        outsider.publish(f"wants/{PHONE}/0A:00:00:00:00:0{number}", wanted, True)
    Listener(world, "news|").await_a_mark()
    for outsider in outsiders:
        outsider.close()
    known = world.network.node(PHONE)._wanted
    assert sum(len(topic) for wants in known.values() for topic in wants) <= MOST_WANTED
    assert not world.network.ready(PHONE, "frame|", 10)
