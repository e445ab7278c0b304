import math
from functools import partial

import numpy as np
import pytest
from helpers.messages.message_oracle import SCHEMA
from helpers.messages.message_strategies import ROBOT, TABLET, message, messages
from helpers.processes.search_settings import search
from hypothesis import given
from lxml import etree

from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode, encode, timestamp
from dva_sim.protocol.errors import ProtocolError
from dva_sim.protocol.schema import MAX_BYTES


@search(40)
@given(messages)
def test_what_is_encoded_is_valid_and_decodes_to_the_same_message(sent):
    data = encode(sent)
    SCHEMA.assertValid(etree.fromstring(data))
    assert decode(data) == sent


@pytest.mark.parametrize(
    ("element", "low", "high", "build"),
    [
        ("Speed", -100.0, 100.0, lambda x: m.SetTeleOp(x, 0.0)),
        ("TurnRate", -100.0, 100.0, lambda x: m.SetTeleOp(0.0, x)),
        ("Latitude", -90.0, 90.0, lambda x: m.GoTo((m.Position(x, 0.0),))),
        ("Longitude", -180.0, 180.0, lambda x: m.GoTo((m.Position(0.0, x),))),
        ("Heading", -1e6, 1e6, lambda x: m.RobotStatus("Idle", m.Position(0, 0), x, 0, 0, 0)),
        ("Frequency", 0.0, 1000.0, lambda x: m.DevSub("smoke", x)),
        ("BidWithin", 0.0, 1e6, lambda x: m.TaskAnnouncement(1, "fire", m.Position(0, 0), 0, x)),
        ("ArrivalIn", 0.0, 1e6, lambda x: m.TaskBid(1, x)),
        ("Value", -1e8, 1e8, lambda x: m.SensorValue("heat_flux", (x,), "kW/m2", 1)),
        ("Severity", 0.0, 1.0, lambda x: report(x, 0.5)),
        ("Confidence", 0.0, 1.0, lambda x: report(0.5, x)),
        ("MessageID", 1, 2**32 - 1, lambda n: m.Message(ROBOT, n, TABLET, "12:00:00", 0, STOP)),
        ("SessionID", 0, 2**64 - 1, lambda n: message(STOP, n)),
        ("Answers", 0, 2**32 - 1, lambda n: m.Reply(n, m.OK, "")),
        ("Code", 0, 999, lambda n: m.Reply(1, n, "")),
        ("EventID", 1, 2**32 - 1, lambda n: m.OrderProgress(n, "done")),
        ("Session", 1, 2**64 - 1, lambda n: m.PermissionGrant(TABLET, "both", n)),
        ("SeenTick", 0, 2**53 - 1, lambda n: m.SetTeleOp(0.0, 0.0, n)),
        ("Laps", 0, 1000, lambda n: m.Patrol((HERE,), n)),
        ("MissionID", 0, 2**32 - 1, lambda n: m.MissionStatus(n, "done", 0, "")),
        ("Session", 1, 2**64 - 1, lambda n: m.Reply(1, 4, "", m.SessionFloor(n))),
        ("WaypointsLeft", 0, 64, lambda n: m.MissionStatus(7, "under_way", n, "")),
    ],
)
def test_codec_and_schema_agree_on_the_bounds_of_numbers(element, low, high, build):
    def sent(number):
        what = build(number)
        return what if isinstance(what, m.Message) else message(what)

    for bound, way in ((low, -1), (high, 1)):
        outside = bound + way if isinstance(bound, int) else math.nextafter(bound, way * math.inf)
        assert decode(encode(sent(bound))) == sent(bound)
        with pytest.raises(ProtocolError, match="must be within"):
            encode(sent(outside))
        with pytest.raises(ProtocolError, match=element):
            decode(replace_text(encode(sent(low)), element, repr(outside)))


STOP = m.StopTeleOp()
SENSOR = m.Sensor("smoke", "1/m")
HERE = m.Position(38.661254, -9.204932)


def report(severity, confidence):
    return m.EventReport(None, "fire", m.Position(0, 0), severity, confidence, "detected")


def replace_text(data, element, text):
    tree = etree.fromstring(data)
    tree.find(f".//{element}").text = text
    return etree.tostring(tree)


def test_the_usual_task_of_an_order_is_left_out_and_understood_when_it_is_said():
    order = m.Order(7, "fire", m.Position(0, 0), None)
    data = encode(message(order))
    assert order.task == "confirm"
    assert b"Task" not in data
    text = data.replace(b"</Order>", b"<Task>confirm</Task></Order>")
    assert decode(text) == decode(data) == message(order)


@pytest.mark.parametrize("device", [None, ROBOT])
@pytest.mark.parametrize("task", ["contain", "stand_by"])
def test_another_task_is_the_last_element_of_an_order(device, task):
    order = m.Order(7, "fire", m.Position(0, 0), device, task)
    assert f"<Task>{task}</Task></Order>".encode() in encode(message(order))
    assert decode(encode(message(order))).body == order


@pytest.mark.parametrize("speed", [math.nan, math.inf, -math.inf, 1e300, "fast", None])
def test_a_speed_that_is_no_bounded_number_is_not_encoded(speed):
    with pytest.raises(ProtocolError):
        encode(message(m.SetTeleOp(speed, 0.0)))


@pytest.mark.parametrize(
    "body",
    [
        m.Registration("", "TeleOp", "192.168.1.48"),
        m.Registration("x" * 65, "TeleOp", "192.168.1.48"),
        m.Registration("two\nlines", "TeleOp", "192.168.1.48"),
        m.Registration("\ud800", "TeleOp", "192.168.1.48"),
        m.Registration("\ufffe", "TeleOp", "192.168.1.48"),
        m.Registration("tablet", "TeleOp", "192.168.1.256"),
        m.Registration("tablet", "TeleOp", "192.168.1.48\n"),
        m.GoTo(()),
        m.GoTo((m.Position(0.0, 0.0),) * 65),
        m.Patrol((), 1),
        m.Patrol((m.Position(0.0, 0.0),) * 65, 1),
        m.Patrol((m.Position(0.0, 0.0),), 1.5),
        m.Inspect(0, "fire", m.Position(0.0, 0.0)),
        m.Inspect(7, "burglary", m.Position(0.0, 0.0)),
        m.MissionStatus(7, "lost", 0, ""),
        m.MissionStatus(7, "failed", 0, "two\nlines"),
        m.SensorValue("lidar", (), "m", 0),
        m.SensorValue("lidar", (1.0,) * 361, "m", 0),
        m.PermissionRequest(ROBOT.lower(), "both"),
        m.PermissionRequest(ROBOT, "everything"),
        m.PermissionRequest(ROBOT, "both", (), "now"),
        m.RobotHolder(ROBOT, None, -1.0),
        m.RobotHolder(None, "", 1.0),
        m.HandoverRequest(ROBOT, TABLET, None),
        m.GetGrant("nobody"),
        m.GetGrant(None, "all"),
        m.GetSensorInfo(ROBOT.lower()),
        m.Reply(1, m.BUSY, "", m.Holder(TABLET, "tablet", 1e6 + 1)),
        m.Reply(1, m.OK, "", m.SensorList((m.DeviceSensors(ROBOT, None, (SENSOR,) * 17),))),
        m.Reply(1, m.OK, "", m.SensorList((m.DeviceSensors(ROBOT, None),) * 65)),
        m.OrderProgress(7.5, "done"),
        m.Order(7, "fire", m.Position(0, 0), None, "run"),
        m.Order(7, "fire", m.Position(0, 0), None, None),
        m.Relocation(m.Position(90.5, 0.0)),
        m.Reply(1, m.OK, "", m.SensorInfo("http://a b")),
        m.Reply(1, m.OK, "", "content"),
        "body",
    ],
)
def test_a_value_the_schema_cannot_hold_is_not_encoded(body):
    with pytest.raises(ProtocolError) as refused:
        encode(message(body))
    assert refused.value.code == m.BAD_MESSAGE


def test_a_heartbeat_has_no_session_and_everything_else_has_one():
    with pytest.raises(ProtocolError, match="heartbeat"):
        encode(message(m.Heartbeat(), session=0))
    with pytest.raises(ProtocolError, match="heartbeat"):
        encode(message(m.Emergency(), session=None))


def test_a_device_list_longer_than_a_message_is_not_encoded():
    device = m.Device(ROBOT, "ü" * 64, "Robot", "192.168.1.20")
    fits = m.Reply(1, m.OK, "", m.DeviceList((device,) * 20))
    assert decode(encode(message(fits))).body == fits
    with pytest.raises(ProtocolError, match=str(MAX_BYTES)):
        encode(message(m.Reply(1, m.OK, "", m.DeviceList((device,) * 64))))


def test_a_message_of_8192_bytes_is_encoded_and_one_of_8193_is_not():
    def listing(*lengths):
        devices = tuple(m.Device(ROBOT, "r" * n, "Robot", "192.168.1.20") for n in lengths)
        return message(m.Reply(1, m.OK, "", m.DeviceList(devices)))

    full = listing(*[22] * 46, *[21] * 4)
    assert len(encode(full)) == 8192
    assert decode(encode(full)) == full
    with pytest.raises(ProtocolError, match="8193 bytes"):
        encode(listing(*[22] * 47, *[21] * 3))


def test_a_whole_turn_of_a_lidar_fits_into_a_message_in_millimetres():
    """360 values of up to 99.999 m, with the longest names that a sensor usually has."""
    turn = tuple(round(10.0 + 0.25 * i + 0.001, 3) for i in range(360))
    assert max(turn) < 100.0
    sent = message(m.SensorValue("lidar", turn, "m", 2**53 - 1), session=0)
    assert len(encode(sent)) < MAX_BYTES
    assert decode(encode(sent)) == sent


def test_one_value_is_said_as_it_was_in_version_1_2():
    data = encode(message(m.SensorValue("heat_flux", (1.25,), "kW/m2", 86320)))
    assert b"<Value>1.25</Value><Unit>kW/m2</Unit>" in data


def test_markup_in_a_label_arrives_as_it_was():
    label = "<Tablet> & \"co\" ]]> = 'x' <!-- ? -->"
    sent = message(m.Registration(label, "TeleOp", "10.0.0.1"), session=0)
    assert decode(encode(sent)) == sent


def test_numbers_of_numpy_are_numbers():
    sent = m.SetTeleOp(np.float64(0.5), np.float32(-0.25), np.int64(86320))
    assert decode(encode(message(sent))).body == m.SetTeleOp(0.5, -0.25, 86320)


@pytest.mark.parametrize("low", [-0.0, np.float64(-0.0), np.float32(-0.0)])
def test_minus_zero_is_written_as_zero(low):
    at = m.Position(low, low)
    bodies = [
        m.SetTeleOp(low, low),
        m.RobotStatus("Idle", at, low, low, low, 1),
        m.SensorValue("temperature", (low, 1.0), "degC", 1),
        m.DevSub("temperature", low),
    ]
    for body in bodies:
        data = encode(message(body))
        assert b"-0.0" not in data
        assert b">0.0<" in data


def test_the_turn_rate_printed_in_the_dissertation_is_valid_though_above_the_robots_limit():
    assert decode(encode(message(m.SetTeleOp(0.5, 0.56)))).body == m.SetTeleOp(0.5, 0.56)


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0, "00:00:00"),
        (45_056, "12:30:56"),
        (45_056.999, "12:30:56"),
        (86_399.9, "23:59:59"),
        (86_400, "00:00:00"),
        (86_461.5, "00:01:01"),
        (-1, "23:59:59"),
    ],
)
def test_a_timestamp_has_whole_seconds_and_wraps_at_midnight(seconds, text):
    assert timestamp(seconds) == text


def test_every_reply_code_has_a_name_of_its_own():
    codes = [value for name, value in vars(m).items() if name.isupper() and isinstance(value, int)]
    assert sorted(codes) == sorted(m.CODE_NAMES)
    assert len(set(m.CODE_NAMES.values())) == len(codes) == 13


def test_a_schema_in_the_working_folder_does_not_replace_the_programs(tmp_path, monkeypatch):
    from dva_sim.protocol.limits import schema_file

    (tmp_path / "protocol").mkdir()
    (tmp_path / "protocol" / "dva.xsd").write_text("<anything/>")
    monkeypatch.chdir(tmp_path)
    assert tmp_path not in schema_file().parents


@pytest.mark.parametrize(
    "kind", [m.DeviceList, m.EventList, m.SensorList, partial(m.RequestLog, 0)]
)
def test_a_list_of_nothing_is_a_list(kind):
    said = message(m.Reply(1, m.OK, "", kind(())))
    assert decode(encode(said)) == said
