"""Validation of client messages, and the queue of those for the simulation."""

import json

import pytest
from helpers.console.simulated_phone import CALIBRATION as CALIBRATE

from dva_sim.console.web.access import Role
from dva_sim.console.web.actions import Bucket, asked_of, check_role, id_of, read
from dva_sim.console.web.simulation import OutgoingLines
from dva_sim.console.wire.actions import ACTIONS
from dva_sim.console.wire.kinds import BadMessage
from dva_sim.console.wire.limits import MAX_ACTIONS, MAX_BATCHES
from dva_sim.serving.pipes import Lines

LABELS = {"robot-1": 0, "robot-2": 3}


def test_robots_are_known_by_index_or_label():
    asked = asked_of("take", {"robots": ["robot-2", 0, 0]}, LABELS)
    assert asked == {"do": "take", "robots": [3, 0]}


def test_an_emergency_is_for_all_unless_it_says_otherwise():
    assert asked_of("emergency", {}, LABELS) == {"do": "emergency", "robots": "all"}
    assert asked_of("emergency", {"robots": [3]}, LABELS)["robots"] == [3]


@pytest.mark.parametrize(
    "given",
    [
        {"n": 1, "speed": 1.01, "turn": 0, "held": True},
        {"n": 1, "speed": 0, "turn": float("nan"), "held": True},
        {"n": 1.5, "speed": 0, "turn": 0, "held": True},
        {"n": 2**60, "speed": 0, "turn": 0, "held": True},
        {"n": 1, "speed": 0, "turn": 0, "held": "yes"},
        {"n": 1, "speed": 0, "turn": 0},
    ],
)
def test_input_beyond_its_limits_never_reaches_the_simulation(given):
    with pytest.raises(BadMessage):
        asked_of("input", given, LABELS, silent=True)


@pytest.mark.parametrize(
    "text", ["", "{", "[1]", "1", "null", '{"a": NaN}', '{"a": Infinity}', "[" * 9000, b"\xff\xfe"]
)
def test_what_is_no_json_object_is_refused(text):
    with pytest.raises(BadMessage):
        read(text)


def test_ids_are_short_words():
    assert id_of("a-1.b:c_D") == "a-1.b:c_D"
    for value in (None, "", "a b", "x" * 65, 7, "a\n"):
        with pytest.raises(BadMessage):
            id_of(value)


def test_a_client_may_say_a_burst_and_then_so_many_a_second():
    bucket = Bucket(10.0, 20)
    assert [bucket.takes(100.0) for _ in range(21)].count(True) == 20
    assert bucket.takes(100.5)
    assert [bucket.takes(100.5) for _ in range(9)].count(True) == 3  # the refused one cost, too


def waiting(lines):
    found = []
    while (data := lines.next()) is not None:
        assert data.endswith(b"\n")
        found.append(json.loads(data))
    return found


def test_of_inputs_the_newest_waits_and_the_urgent_goes_first():
    lines = OutgoingLines()
    for n in range(100):
        lines.put({"do": "input", "client": "c1", "n": n})
    lines.put({"do": "link", "client": "c1"})
    lines.put({"do": "input", "client": "c2", "n": 7})
    lines.put({"do": "emergency", "client": "c3"})
    found = [(line["do"], line.get("n")) for line in waiting(lines)]
    assert found == [("emergency", None), ("link", None), ("input", 99), ("input", 7)]


@pytest.mark.parametrize("what", ["input", "samples"])
def test_input_and_samples_of_a_page_that_is_gone_are_forgotten(what):
    lines = OutgoingLines()
    lines.put({"do": what, "client": "c1", "n": 1})
    lines.put({"do": "gone", "client": "c1"})
    assert [line["do"] for line in waiting(lines)] == ["gone"]


def test_actions_that_find_no_room_are_refused_but_an_emergency_still_does():
    lines = OutgoingLines()
    assert all(lines.put({"do": "link", "client": "c1", "n": n}) for n in range(MAX_ACTIONS))
    assert not lines.put({"do": "link", "client": "c1"})
    assert lines.put({"do": "emergency", "client": "c1"})
    assert lines.refused == 1


def test_every_action_of_the_contract_is_known():
    words = {"take", "release", "start", "stop", "emergency", "link", "pattern", "pace"}
    assert words | {"confirm", "refute", "decline"} <= set(ACTIONS)


def test_lines_come_whole_out_of_any_pieces():
    lines, found = Lines(), []
    for byte in b'{"a":1}\n{"b":2}\n\n{"c"':
        found += lines.feed(bytes([byte]))
    assert found == [b'{"a":1}', b'{"b":2}', b""]
    assert lines.feed(b":3}\n") == [b'{"c":3}']


REGISTER = {"server": "127.0.0.1", "port": 5600, "label": "my phone", "type": "Robot"}
SAMPLES = {"n": 4, "at": [1.0, 2.5], "xyz": [[0, 1, 2], [0, 1, 2]], "hand": True, "orientation": 0}
REPORT = {"kind": "fire", "x_m": 1.0, "y_m": 2.0, "severity": "high"}


@pytest.mark.parametrize(
    ("name", "given"),
    [
        ("phone_register", REGISTER),
        ("phone_devices", {}),
        ("phone_permission", {"device": "02:00:00:01:00:01", "level": "both"}),
        ("phone_calibrate", CALIBRATE),
        ("phone_calibrate", CALIBRATE | {"reference_mps2": None, "ios": True}),
        ("samples", SAMPLES),
        ("guard_join", {"guard": "guard-1"}),
        ("guard_answer", {"accept": False, "reason": "I am hurt"}),
        ("guard_say", {"what": "contained"}),
        ("guard_place", {"x_m": -3.5, "y_m": 2}),
        ("guard_report", REPORT),
    ],
)
def test_what_phones_and_guards_ask_for_is_known(name, given):
    assert asked_of(name, given, LABELS, silent=True) == {"do": name, **given}


@pytest.mark.parametrize(
    ("name", "given", "word"),
    [
        ("fly", {}, "no such action"),
        (None, {}, "no such action"),
        (["take"], {}, "no such action"),
        ("take", {}, "robots is missing"),
        ("take", {"robots": [1]}, "robot of this run"),
        ("take", {"robots": [True]}, "robot of this run"),
        ("take", {"robots": ["<script>"]}, "robot of this run"),
        ("take", {"robots": [[]]}, "robot of this run"),
        ("take", {"robots": "robot-1"}, "list of robots"),
        ("take", {"robots": [0] * 65}, "list of robots"),
        ("take", [], "arguments should be an object"),
        ("start", {"now": 1}, "no such argument"),
        ("link", {"delay_s": -1}, "delay_s should be a number from 0 to 5"),
        ("link", {"delay_s": float("nan")}, "should be a number"),
        ("link", {"loss": "0.1"}, "should be a number"),
        ("link", {"loss": True}, "should be a number"),
        ("link", {"rate_bps": 10**400}, "should be a number"),
        ("pattern", {"robot": 0, "name": "../../x y"}, "should be a name"),
        ("pattern", {"robot": 0}, "name is missing"),
        ("pace", {"paused": 1}, "true or false"),
        ("input", {"n": 1, "speed": 0, "turn": 0, "held": True}, "no such action"),
        ("phone_register", REGISTER | {"server": "x" * 65}, "server should be a text"),
        ("phone_register", REGISTER | {"port": 0}, "port should be a whole number"),
        ("phone_register", REGISTER | {"label": ""}, "label should be a text"),
        ("phone_register", REGISTER | {"label": "a\nb"}, "in one line"),
        ("phone_register", REGISTER | {"type": "Guard"}, "type should be one of"),
        ("phone_permission", {"device": "a b", "level": "both"}, "device should be a name"),
        ("phone_permission", {"device": "a", "level": "all"}, "level should be one of"),
        ("phone_calibrate", CALIBRATE | {"reference_mps2": [0, 1]}, "list of 3 to 3"),
        ("phone_calibrate", CALIBRATE | {"reference_mps2": [0, 1, float("nan")]}, "a number"),
        ("phone_calibrate", CALIBRATE | {"speed_step_mps2": 0}, "speed_step_mps2 should be"),
        ("phone_calibrate", CALIBRATE | {"max_delay_s": 5.1}, "max_delay_s should be"),
        ("phone_calibrate", CALIBRATE | {"mapping": "wild"}, "mapping should be one of"),
        ("samples", SAMPLES | {"at": [2.5, 1.0]}, "at should rise"),
        ("samples", SAMPLES | {"at": [1.0]}, "equally long"),
        ("samples", SAMPLES | {"at": [1.0] * 65}, "list of 1 to 64"),
        ("samples", SAMPLES | {"xyz": [[0, 1, 2], [0, 1, None]]}, "should be a number"),
        ("samples", SAMPLES | {"orientation": 45}, "orientation should be one of"),
        ("samples", SAMPLES | {"orientation": False}, "orientation should be one of"),
        ("guard_answer", {"accept": True, "reason": "x" * 201}, "reason should be a text"),
        ("guard_say", {"what": "gone home"}, "what should be one of"),
        ("guard_place", {"x_m": 1e9, "y_m": 0}, "x_m should be a number"),
        ("guard_report", REPORT | {"kind": "war"}, "kind should be one of"),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_line(name, given, word):
    with pytest.raises(BadMessage, match=word) as error:
        asked_of(name, given, LABELS, silent=name == "samples")
    assert "\n" not in str(error.value)


def test_samples_wait_in_their_order_and_the_oldest_of_too_many_are_lost():
    lines = OutgoingLines()
    for n in range(MAX_BATCHES + 3):
        lines.put({"do": "samples", "client": "c1", "n": n})
    lines.put({"do": "samples", "client": "c2", "n": 70})
    lines.put({"do": "stop", "client": "c1"})
    found = [(line["do"], line["client"], line.get("n")) for line in waiting(lines)]
    assert found[:3] == [("stop", "c1", None), ("samples", "c1", 3), ("samples", "c2", 70)]
    assert [n for what, client, n in found if client == "c1" and what == "samples"] == [
        *range(3, MAX_BATCHES + 3)
    ]


def test_a_phone_may_do_what_a_phone_does_and_who_looks_nothing():
    for name in ("start", "stop", "samples", "guard_say", "phone_register"):
        check_role(Role.PHONE, name)
        with pytest.raises(BadMessage, match="view-only"):
            check_role(Role.LOOK, name)
    for name, action in ACTIONS.items():
        check_role(action.role, name)
        if action.role <= Role.PHONE:
            continue
        with pytest.raises(BadMessage, match="may not"):
            check_role(Role.PHONE, name)


def test_who_drives_sends_nobody_and_only_a_supervisor_takes_a_robot_from_its_holder():
    for name in (name for name, one in ACTIONS.items() if one.role > Role.DRIVE):
        with pytest.raises(BadMessage, match=f"may not {name.replace('_', ' ')}; an address "):
            check_role(Role.DRIVE, name)
        check_role(Role.SUPERVISE, name)
    check_role(Role.DISPATCH, "event_assign")
    with pytest.raises(BadMessage, match="take over"):
        check_role(Role.DISPATCH, "take_over")
