"""A run that goes on, as Foxglove gets it: the messages of its recording, with their schemas."""

import json

import jsonschema
import pytest
from helpers.foxglove.viewer import Viewer
from helpers.processes.patience import becomes
from helpers.wording import unnamed

from dva_sim.console.run.recorder import ConsoleRecorder, keep_run
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.errors import ConfigError
from dva_sim.live import foxglove_server
from dva_sim.live.foxglove_server import LAYOUT, FoxgloveServer
from dva_sim.live.recorded_lines import lines_of_part
from dva_sim.live.recording import Keeper, LiveRecorder
from dva_sim.live.running_channels import RunningChannels
from dva_sim.recordings import channels
from dva_sim.recordings.messages import SCHEMAS, XML
from dva_sim.recordings.writing import every_message
from dva_sim.serving.listening import listen
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
    keep_run(played, recorder)
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


@pytest.fixture
def server(run):
    pytest.importorskip("foxglove", reason="needs Foxglove's SDK: pip install 'dva-sim[foxglove]'")
    server = FoxgloveServer(run[0], SEED, 0)
    yield server
    server.close()


@pytest.mark.system
def test_a_viewer_gets_channels_schemas_and_messages_and_time(run, server):
    viewer, lines = Viewer(server.url), run[1]
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
    viewer = Viewer(server.url)
    assert becomes(lambda: viewer.info)
    bad = [b"no json", b"[]", b'["told", 1]', b'["at", "x", 7]', b'["frame", 1, 2, 3]', b"null"]
    server.keep(b"\n".join(bad) + b"\n" + b"".join(run[1][:50]))
    assert server.failures == len(bad)
    assert becomes(lambda: viewer.of("/scene"))
    viewer.leave()


@pytest.mark.system
def test_a_port_that_is_taken_and_a_missing_sdk_are_told_in_one_line(run, monkeypatch):
    pytest.importorskip("foxglove", reason="needs Foxglove's SDK: pip install 'dva-sim[foxglove]'")
    with listen("127.0.0.1", 0) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(ConfigError) as refused:
            FoxgloveServer(run[0], SEED, port)
    assert unnamed(refused.value, port, "--foxglove") == []
    monkeypatch.setitem(__import__("sys").modules, "foxglove", None)
    with pytest.raises(ConfigError) as refused:
        FoxgloveServer(run[0], SEED, 0)
    assert str(refused.value) == foxglove_server.MISSING
