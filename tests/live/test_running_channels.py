"""A run that goes on, as Foxglove gets it: the messages of its recording, with their schemas."""

import asyncio
import json
import time

import jsonschema
import pytest
from helpers.foxglove.viewer import Viewer
from helpers.network.port_visitors import DeafClient, is_closed
from helpers.processes.patience import becomes
from helpers.wording import unnamed

from dva_sim.console.run.recorder import ConsoleRecorder
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.errors import ConfigError
from dva_sim.live.foxglove_server import LAYOUT, FoxgloveServer
from dva_sim.live.foxglove_viewer import FoxgloveViewer, ViewedChannel
from dva_sim.live.kept_facts import keep_run
from dva_sim.live.recorded_lines import lines_of_part
from dva_sim.live.recording import Keeper, LiveRecorder
from dva_sim.live.running_channels import RunningChannels
from dva_sim.recordings import channels
from dva_sim.recordings.messages import SCHEMAS, XML
from dva_sim.recordings.writing import every_message, schema_of_channel
from dva_sim.serving.listening import listen
from dva_sim.serving.open_port import open_port
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full.run import Run, Watched

SEED, LASTS = 1, 45.0


class Lines:
    """Takes what a recorder offers."""

    def __init__(self):
        self.all = []

    def offer(self, data):
        self.all.append(data)
        return True


@pytest.fixture(scope="module")
def run():
    """A drive with a fire, in virtual time: its scenario, and the lines of a recording."""
    scenario = scenarios.build(scenarios.load("drive-to-event"), {})
    recorder, lines = ConsoleRecorder(), Lines()
    played = Run(scenario, SEED, watched=Watched(Clock(), recorder))
    recorder.kept = LiveRecorder(played.clock, lines)
    recorder.kept.is_own = lambda _: True
    keep_run(played, recorder.kept)
    for second in range(int(LASTS)):
        played.clock.run(float(second))
        recorder.kept._second = -1  # the room for lines is one of real time
        recorder.tidy()
    return scenario, lines.all


@pytest.fixture(scope="module")
def running(run):
    scenario, lines = run
    running = RunningChannels(scenario, SEED)
    return [message for line in lines for message in running.take(json.loads(line))]


def of(messages, topic):
    return [message for message in messages if message.topic == topic]


def test_every_message_is_as_its_schema_says(running):
    validators = {name: jsonschema.Draft7Validator(schema) for name, schema in SCHEMAS.items()}
    for message in running:
        if message.schema != XML:
            validators[message.schema].validate(json.loads(json.dumps(message.content)))
    for topic in ("/tf", "/scene", "/hazards", "/story", "/events", "/latencies", "/facts"):
        assert topic == "/facts" or of(running, topic), topic


def test_what_is_shown_now_is_what_the_recording_will_hold(run, running, tmp_path):
    scenario, lines = run
    keeper = Keeper(tmp_path / "run.mcap", scenario, SEED)
    keeper.keep(b"".join(lines))
    keeper.close()
    kept = list(every_message(lines_of_part(keeper.path).playback()))
    for topic in ("/story", "/robot-1/activity"):
        assert of(running, topic) == sorted(of(kept, topic), key=lambda message: message.time)
    # A track is known only at its end to be straight: live there may be more poses, none else.
    live = {message.time: message for message in of(running, "/robot-1/pose")}
    recorded = of(kept, "/robot-1/pose")
    assert len(recorded) > 50
    assert sum(live.get(message.time) == message for message in recorded) > 0.9 * len(recorded)
    reports = [message for message in kept if message.schema == XML]
    assert len(reports) > 100
    assert sorted(reports, key=str) == sorted((m for m in running if m.schema == XML), key=str)
    hazards = {(m.time, m.content["number"]): m for m in of(kept, channels.HAZARDS)}
    assert all(m.schema == "dva_sim.Hazard" for m in hazards.values())
    assert {m.content["kind"] for m in of(running, channels.HAZARDS)} == {"fire"}


def test_delays_are_those_of_the_link(running):
    values = {"command": [], "picture": []}
    for message in of(running, channels.LATENCIES):
        values[message.content["what"]].append(message.content["delay_s"])
    assert all(len(delays) > 20 for delays in values.values())
    assert all(0.0 < delay < 5.0 for delays in values.values() for delay in delays)


def test_events_are_told_as_they_change(running):
    states = [message.content["state"] for message in of(running, channels.EVENTS)]
    assert states[0] == "pending"
    assert len(states) == len(set(states)) or len(states) > 1
    assert of(running, channels.EVENTS)[-1].content["times_s"]


def test_every_topic_of_the_layout_is_one_that_is_served(running):
    layout = json.loads(LAYOUT.read_text())
    served = {message.topic for message in running} | {"/facts", "/robot-1/image"}
    panels = layout["configById"]
    asked = [path["value"] for path in panels["Plot!latencies"]["paths"]]
    asked += [panel.get("topicPath", panel.get("topicToRender", "")) for panel in panels.values()]
    asked += [panels["Image!robot1"]["imageMode"]["imageTopic"]]
    asked += [topic for topic in panels["3D!site"]["topics"] if "/fields" not in topic]
    topics = {topic.partition("{")[0].partition(".")[0] for topic in asked if topic}
    assert topics <= served
    placed = json.dumps(layout["layout"])
    assert unnamed(placed, *panels) == []


# --- the server, by its own wire ---------------------------------------------------------


def url_of(server):
    return server.where.split()[1]


@pytest.fixture
def server(run):
    server = FoxgloveServer(run[0], SEED, open_port("127.0.0.1", 0, "--foxglove"))
    yield server
    server.close()


@pytest.mark.system
def test_a_viewer_gets_channels_schemas_and_messages_and_time(run, server):
    viewer, lines = Viewer(url_of(server)), run[1]
    assert becomes(lambda: viewer.info)
    assert viewer.info["name"] == "dva-sim"
    server.keep(b"".join(lines[:50]))
    assert becomes(lambda: {"/tf", "/story", "/scene"} <= viewer.channels.keys())
    scene = viewer.channels["/scene"]
    assert (scene["schemaName"], scene["encoding"]) == ("foxglove.SceneUpdate", "json")
    assert json.loads(scene["schema"]) == SCHEMAS["foxglove.SceneUpdate"]
    # What stands on the site comes to whoever subscribes late.
    assert becomes(lambda: any(e["entities"] for e in viewer.of("/scene")))
    server.keep(b"".join(lines[50:400]))
    assert becomes(lambda: len(viewer.of("/tf")) > 10)
    wanted = viewer.of("/robot-1/pose")
    assert wanted[-1]["frame_id"] == "map"
    assert viewer.times == sorted(viewer.times)
    assert viewer.times
    viewer.leave()
    server.keep(b"".join(lines[400:800]))


@pytest.mark.system
def test_lines_that_make_no_sense_are_counted_and_the_next_ones_shown(run, server):
    viewer = Viewer(url_of(server))
    assert becomes(lambda: viewer.info)
    bad = [b"no json", b"[]", b'["told", 1]', b'["at", "x", 7]', b'["frame", 1, 2, 3]', b"null"]
    server.keep(b"\n".join(bad) + b"\n" + b"".join(run[1][:50]))
    assert server.failures == len(bad)
    assert becomes(lambda: viewer.of("/scene"))
    viewer.leave()


@pytest.mark.system
@pytest.mark.parametrize(
    ("headers", "token", "status"),
    [
        ({}, True, 101),
        ({"Origin": "https://app.foxglove.dev"}, True, 101),
        ({"Origin": "file://"}, True, 101),
        ({"Origin": "https://evil.example"}, True, 403),
        ({"Origin": "null"}, True, 403),
        ({"Host": "evil.example"}, True, 421),
        ({"Origin": "http://evil.example", "Host": "evil.example"}, True, 421),
        ({}, False, 401),
        ({"Sec-WebSocket-Protocol": "chat"}, True, 400),
    ],
    ids=str,
)
def test_a_viewer_needs_the_token_a_name_of_this_machine_and_no_foreign_page(
    server, headers, token, status
):
    url = url_of(server) if token else url_of(server).partition("?")[0]
    more = {"Sec-WebSocket-Protocol": "foxglove.sdk.v1"} | headers
    assert answered(DeafClient(url, **more)) == status


@pytest.mark.system
def test_the_wire_is_that_of_foxgloves_own_server(run, server):
    import foxglove

    name, encoding, text = schema_of_channel("foxglove.Log")
    context = foxglove.Context()
    theirs = foxglove.start_server(host="127.0.0.1", port=0, context=context)
    schema = foxglove.Schema(name=name, encoding=encoding, data=text)
    channel = foxglove.Channel("/story", schema=schema, message_encoding="json", context=context)
    entries = []
    for url, log in (
        (f"ws://127.0.0.1:{theirs.port}", lambda: channel.log({"a": 1}, log_time=10)),
        (url_of(server), lambda: server.keep(b'["told", 1.0, "dva", "begins", "event"]\n')),
    ):
        viewer = Viewer(url)
        assert becomes(lambda viewer=viewer: viewer.info)
        log()
        assert becomes(lambda viewer=viewer: "/story" in viewer.channels)
        assert becomes(lambda viewer=viewer, log=log: log() or viewer.came.get("/story"))
        entries.append((viewer.channels["/story"] | {"id": 1}, viewer.info.keys() - {"metadata"}))
        viewer.leave()
    theirs.stop()
    assert entries[0] == entries[1]


@pytest.mark.system
def test_a_viewer_that_is_stopped_loses_its_place_and_its_subscriptions(run, server):
    server.keep(b"".join(run[1][:50]))
    frozen = DeafClient(url_of(server), **{"Sec-WebSocket-Protocol": "foxglove.websocket.v1"})
    assert becomes(lambda: frozen.is_answered)
    frozen.say({"op": "subscribe", "subscriptions": [{"id": 9, "channelId": 1}]})
    assert becomes(lambda: len(subscribed(server)) == 1)
    silent_since = time.monotonic()
    assert becomes(lambda: not subscribed(server))
    assert time.monotonic() - silent_since < 15.0  # 20 s are TCP's own limit
    assert is_closed(frozen.sock)
    frozen.sock.close()


def subscribed(server):
    return [channel for channel in server._channels.values() if channel.viewers]


def answered(client):
    assert becomes(lambda: client.is_answered)
    status = int(client.sock.recv(12).split()[1])
    client.sock.close()
    return status


def test_what_a_viewer_does_not_read_is_dropped_oldest_first():
    viewer = FoxgloveViewer("run")
    channel = ViewedChannel(1, "/tf", "foxglove.FrameTransforms", "json")
    wish = {"op": "subscribe", "subscriptions": [{"id": 7, "channelId": 1}]}
    assert viewer.take(json.dumps(wish), {1: channel}) == {"/tf"}
    for number in range(20):
        viewer.show(channel, number, bytes(1_000_000))
    asyncio.run(viewer.next())  # the server's info
    times = [int.from_bytes(asyncio.run(viewer.next())[5:13], "little") for _ in range(7)]
    assert times == list(range(13, 20))


@pytest.mark.parametrize(
    "text",
    [
        *("", "[]", "{}", "[" * 50_000, '{"op": "advertise"}', '{"op": "subscribe"}'),
        '{"op": "subscribe", "subscriptions": [{"id": "x"}]}',
        '{"op": "unsubscribe", "subscriptionIds": 1}',
    ],
    ids=lambda text: text[:40],
)
def test_a_request_that_makes_no_sense_is_left_out(text):
    assert FoxgloveViewer("run").take(text, {}) == set()


@pytest.mark.system
def test_a_port_that_is_taken_is_told_in_one_line():
    with listen("127.0.0.1", 0) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(ConfigError) as refused:
            open_port("127.0.0.1", port, "--foxglove")
    assert unnamed(refused.value, port, "--foxglove") == []
