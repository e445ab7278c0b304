"""The quick way through decode takes only what the schema allows, and reads it the same."""

import re
from random import Random

import pytest
from helpers.messages.damaged_messages import NUMBERS, STRINGS, VALUE, mutated
from helpers.messages.message_oracle import judged, says
from helpers.messages.message_strategies import BODIES, ROBOT, TABLET, message, with_header
from helpers.paths import ROOT
from helpers.processes.search_settings import LONGER, search
from hypothesis import given
from hypothesis import strategies as st

from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import MAX_SESSION, MAX_TICK, MAX_UINT32, decode, encode, read_canonical
from dva_sim.protocol.errors import ProtocolError
from dva_sim.protocol.schema import read_validated

STATUS = m.RobotStatus("Teleoperation", m.Position(38.66, -9.2), 1.57, 0.5, -0.25, 86320)
KNOWN = [
    message(m.SetTeleOp(0.5, 0.56, 86320)),
    message(m.SetTeleOp(-0.5, 1e-05)),
    message(m.Reply(124, m.BUSY, "driving already")),
    message(m.Heartbeat(), session=None),
    message(STATUS),
    message(m.PersonStatus("walking", m.Position(38.66, -9.2))),
    message(m.RobotHolder(TABLET, "tablet", 12.5, m.STALE)),
    message(m.RobotHolder(None, None, 0.0)),
    message(m.Registration("robot-1", "Robot", "192.168.1.20:5555")),
]
SEEDS = [encode(one) for one in KNOWN]
SAMPLES = sorted((ROOT / "protocol" / "samples" / "valid").glob("*.xml"))
known_bodies = st.one_of(*(BODIES[kind] for kind in {type(one.body): None for one in KNOWN}))


def name(one):
    return type(one.body).__name__


def agrees(data):
    """True if the fast reader accepts the bytes; fails where the full reader disagrees."""
    quick = read_canonical(data)
    if quick is not None:
        validated = read_validated(data)
        assert repr(quick) == repr(validated), data
        tree = judged(data)
        assert tree is not None, data
        assert says(tree, quick), data
    return quick is not None


@pytest.mark.parametrize("sent", KNOWN, ids=name)
def test_the_messages_of_a_drive_are_read_without_the_parser(sent):
    assert read_canonical(encode(sent)) == sent


@pytest.mark.parametrize(
    "sent",
    [
        message(m.SetTeleOp(99.99999999999999, -99.99999999999999, MAX_TICK), MAX_SESSION),
        message(m.SetTeleOp(5e-324, -2.2250738585072014e-308, 0), 0),
        message(m.SetTeleOp(0.00012345678901234567, 0.0)),
        m.Message(ROBOT, MAX_UINT32, TABLET, "23:59:59.123456789", 1, m.Reply(MAX_UINT32, 999, "")),
        message(m.Reply(0, m.BAD_MESSAGE, "~ \"'!" * 42)),
        message(m.RobotStatus("Idle", m.Position(89.9, -179.9), -999999.9, 0.0, 0.0, 0)),
        message(m.RobotHolder(None, "n" * 64, 999_999.9, 999)),
        message(m.Registration("~" * 64, "x", "255.255.255.255:65534")),
    ],
)
def test_what_a_drive_can_say_at_its_bounds_is_read_without_the_parser(sent):
    data = encode(sent)
    assert agrees(data)
    assert repr(read_canonical(data)) == repr(sent)


def test_minus_zero_of_another_make_is_read_without_the_parser():
    data = encode(message(m.SetTeleOp(0.5, 0.0))).replace(b">0.0<", b">-0.0<")
    assert agrees(data)
    assert repr(read_canonical(data).body) == repr(m.SetTeleOp(0.5, -0.0))


@search(40)
@given(known_bodies.flatmap(with_header))
def test_both_ways_read_the_same(sent):
    data = encode(sent)
    agrees(data)
    assert repr(decode(data)) == repr(sent)


@pytest.mark.system
@search(60)
@given(known_bodies.flatmap(with_header), st.integers(0, 2**32))
def test_a_damaged_message_is_read_the_same_or_left_to_the_parser(sent, seed):
    agrees(mutated(encode(sent), Random(seed)))


def test_a_damaged_sample_is_read_the_same_or_left_to_the_parser():
    for path in SAMPLES:
        data, rng = encode(decode(path.read_bytes())), Random(20140901)
        for _ in range(60):
            agrees(mutated(data, rng))
        for number in range(len(data)):
            agrees(data[:number] + data[number + 1 :])


@pytest.mark.parametrize("data", SEEDS, ids=map(name, KNOWN))
def test_every_odd_value_in_every_place_is_read_the_same_or_left_to_the_parser(data):
    for found in VALUE.finditer(data):
        for value in NUMBERS + STRINGS:
            agrees(data[: found.start(1)] + value.encode() + data[found.end(1) :])


@pytest.mark.parametrize("data", SEEDS, ids=map(name, KNOWN))
def test_every_flipped_bit_is_read_the_same_or_left_to_the_parser(data):
    for index in range(len(data)):
        for bit in range(8):
            damaged = bytearray(data)
            damaged[index] ^= 1 << bit
            agrees(bytes(damaged))


@pytest.mark.parametrize(
    "element", ["Speed", "TurnRate", "Latitude", "Longitude", "Heading", "HeldFor"]
)
@given(value=st.floats(allow_nan=False, allow_infinity=False) | st.decimals(-2000, 2000, places=15))
@search(30)
def test_any_number_is_read_the_same_or_left_to_the_parser(element, value):
    text = repr(value) if isinstance(value, float) else f"{value:f}"
    pattern = f"(<{element}>)[^<]*".encode()
    data = SEEDS[6] if element == "HeldFor" else SEEDS[4]
    agrees(re.sub(pattern, rb"\g<1>" + text.encode(), data))


@pytest.mark.parametrize("data", SEEDS, ids=map(name, KNOWN))
def test_what_follows_or_precedes_a_message_is_never_overlooked(data):
    for at in range(len(data)):
        assert not agrees(data + data[at:])
        assert not agrees(data[: at + 1] + data)


@pytest.mark.soak
def test_damaged_messages_are_read_the_same_or_left_to_the_parser():
    rng = Random(20140901)
    accepted = sampled = 0
    for number in range(250_000 * LONGER):
        data = mutated(rng.choice(SEEDS), rng)
        accepted += agrees(data)
        if number % 50 == 0:
            sampled += whole_way_agrees_with_the_specification(data)
    assert accepted > 12_500 * LONGER  # heavier damage would say little
    assert sampled > 250 * LONGER


def whole_way_agrees_with_the_specification(data):
    """True if the bytes are a message; fails where parser and specification differ."""
    tree = judged(data)
    try:
        read = read_validated(data)
    except ProtocolError:
        assert tree is None, data
        return False
    assert tree is not None, data
    assert says(tree, read), data
    return True


def test_the_bounds_are_those_of_the_schema():
    """One more than the largest number is refused by the schema, not only by the pattern."""
    for element, largest in (("MessageID", MAX_UINT32), ("SessionID", MAX_SESSION)):
        assert_bound(SEEDS[0], element, largest)
    assert_bound(SEEDS[0], "SeenTick", MAX_TICK)
    assert_bound(SEEDS[2], "Answers", MAX_UINT32)
    assert_bound(SEEDS[4], "Tick", MAX_TICK)


def assert_bound(data, element, largest):
    def with_value(value):
        return re.sub(f"(<{element}>)[0-9]+".encode(), rb"\g<1>%d" % value, data)

    assert read_canonical(with_value(largest)) is not None
    assert judged(with_value(largest)) is not None
    assert read_canonical(with_value(largest + 1)) is None
    assert judged(with_value(largest + 1)) is None


def test_what_is_valid_in_another_form_is_left_to_the_parser():
    data = SEEDS[0]
    for other in (
        data + b"\n",
        data.replace(b">0.5<", b">0.50 <"),
        data.replace(b">124<", b">0124<"),
        data.replace(b'standalone="yes"', b'standalone="no"'),
        data.replace(b"</msg>", b"</msg >"),
    ):
        assert read_canonical(other) is None
        assert decode(other) == KNOWN[0]
