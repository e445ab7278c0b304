"""Whatever a peer sends: a value, or one line that says what is wrong with it."""

import copy
import json

import pytest
from helpers.ros.ros_machine import fixture
from hypothesis import given
from hypothesis import strategies as st

from dva_sim.network.realtime import LiveClock
from dva_sim.ros import mjpeg
from dva_sim.ros.client import RosbridgeClient, Subscribed
from dva_sim.ros.mjpeg import MjpegReader
from dva_sim.ros.peers import RosPeer
from dva_sim.ros.profile import RosProfile
from dva_sim.ros.readings import BadReading, RosReader
from dva_sim.ros.websocket import WebSocketUrl

READER = RosReader(RosProfile())
TAKES = {
    "odometry-ros2": READER.odometry,
    "tf": lambda message: READER.transform(message, None),
    "battery": READER.charge,
    "scan": READER.scan,
    "picture": READER.picture,
}
NUMBERS = st.one_of(st.floats(), st.integers(), st.sampled_from([10**400, -(10**400), 1e308]))
SCALARS = st.one_of(st.none(), st.booleans(), NUMBERS, st.text(max_size=8))
ANYTHING = st.recursive(
    SCALARS,
    lambda inner: st.one_of(
        st.lists(inner, max_size=4), st.dictionaries(st.text(max_size=8), inner, max_size=4)
    ),
    max_leaves=8,
)


def places_in(value, path=()):
    """The paths to everything in a message."""
    yield path
    inner = value.items() if isinstance(value, dict) else ()
    inner = enumerate(value) if isinstance(value, list) else inner
    for key, each in inner:
        yield from places_in(each, (*path, key))


@st.composite
def damaged(draw, message):
    """A message with anything in the place of one of its parts."""
    message = copy.deepcopy(message)
    path = draw(st.sampled_from(sorted(places_in(message), key=str)))
    value = draw(ANYTHING)
    if not path:
        return value
    place = message
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return message


@pytest.mark.parametrize("name", TAKES)
@given(st.data())
def test_a_damaged_message_is_read_or_refused_in_one_line(name, data):
    message = data.draw(damaged(fixture(name)["msg"]))
    refused = ""
    try:
        TAKES[name](message)
    except BadReading as error:
        refused = str(error)
    assert "\n" not in refused
    assert len(refused) < 300


class Deaf:
    """A connection that keeps what is sent."""

    def __init__(self):
        self.sent, self.waiting = [], 0

    def send(self, data):
        self.sent.append(json.loads(data))

    def close(self, *_, **__):
        pass


class Host:
    """A server with one topic and no robots."""

    time = 0.0

    def now(self):
        self.time += 1.0
        return self.time

    def type_of(self, topic):
        return "rosgraph_msgs/Clock" if topic == "/clock" else None

    def command(self, *_):
        return "no"

    def call(self, _, __, ___, answer):
        answer(True, {})

    def subscribed(self, *_):
        pass

    changed = tell = subscribed


OPERATIONS = [
    {"op": "subscribe", "topic": "/clock", "type": "rosgraph_msgs/Clock", "throttle_rate": 5},
    {"op": "publish", "topic": "/a", "msg": {"linear": {"x": 0.1}, "angular": {"z": 0.1}}},
    {"op": "advertise", "topic": "/a/cmd_vel", "type": "geometry_msgs/Twist"},
    {"op": "call_service", "service": "/a", "args": {}, "id": "1"},
    {"op": "unsubscribe", "topic": "/clock"},
]


@given(st.sampled_from(OPERATIONS).flatmap(damaged))
def test_a_damaged_operation_is_done_or_refused_in_one_line(operation):
    connection = Deaf()
    RosPeer("a client", connection, Host()).take(json.dumps(operation).encode())
    for entry in connection.sent:
        assert entry["op"] in ("status", "service_response")
        assert "\n" not in str(entry.get("msg", ""))


@pytest.mark.parametrize("id_text", ["NaN", "1e999", "[[]]", "{}", '"' + "x" * 300 + '"', "true"])
def test_a_call_whose_id_is_none_is_refused(id_text):
    connection = Deaf()
    text = f'{{"op": "call_service", "service": "/a", "id": {id_text}}}'
    RosPeer("a client", connection, Host()).take(text.encode())
    assert [entry["msg"] for entry in connection.sent] == [
        "call_service has no id, or a longer one than 256"
    ]


@given(st.binary(max_size=60))
def test_bytes_that_are_nothing_are_refused(data):
    connection = Deaf()
    RosPeer("a client", connection, Host()).take(data)
    assert all(entry["op"] == "status" for entry in connection.sent)


@given(damaged(fixture("odometry-ros2")), st.binary(max_size=40))
def test_a_client_of_a_bridge_that_says_anything_goes_on(message, data):
    refused = []
    client = RosbridgeClient(
        LiveClock(),
        WebSocketUrl("ws://127.0.0.1:1", "--ros"),
        {"/robot_1/odom": Subscribed("nav_msgs/Odometry", lambda _: None, 100_000)},
        {},
        on_change=lambda _: None,
        on_bad=lambda *reasons: refused.append(reasons),
    )
    client._take(json.dumps(message).encode())
    client._take(data)
    assert all("\n" not in str(entry) for entry in refused)


@given(st.lists(st.binary(max_size=40), max_size=5), st.integers(0, 30))
def test_a_stream_of_pictures_that_is_none_is_read_without_an_error(pieces, length):
    taken = []
    reader = MjpegReader(LiveClock(), "", "", lambda picture, _: taken.append(picture))
    head = f"\r\n--x\r\nContent-Length: {length}\r\nX-Frame-Time-Ms: 7\r\n\r\n".encode()
    for piece in [*pieces, head, bytes(length)]:
        reader._data += piece
        while reader._picture():
            pass
    assert all(len(picture) < 10_000_000 for picture in taken)


@pytest.mark.parametrize(
    "url",
    ["http://[", "http://127.0.0.1:99999/", "http://camera.example/x", "ftp://127.0.0.1/", "", "x"],
)
def test_a_place_of_pictures_that_is_none_is_never_looked_for(url, monkeypatch):
    monkeypatch.setattr(mjpeg, "Dialling", None)
    MjpegReader(LiveClock(), url, "secret", lambda *_: None).close()


def test_a_topic_of_control_characters_does_not_act_where_the_refusal_is_shown():
    connection = Deaf()
    RosPeer("a client", connection, Host()).take(b'{"op": "publish", "topic": "a\\u001b[31m"}')
    assert [entry["msg"] for entry in connection.sent] == [
        r"'a\x1b[31m': no Twist with linear.x and angular.z"
    ]
