"""What one hop of a message costs, against building and validating trees at both ends."""

import timeit
from dataclasses import replace
from pathlib import Path

import pytest
from benchmarks.goals import goal
from lxml import etree

from dva_sim.protocol.codec import decode, encode
from dva_sim.protocol.messages import (
    Heartbeat,
    Message,
    Position,
    Reply,
    RobotStatus,
    SetTeleOp,
    StopTeleOp,
)

SCHEMA = etree.XMLSchema(file=str(Path(__file__).parents[2] / "protocol" / "dva.xsd"))
COMMAND = Message(
    "70:1A:04:F9:81:D6", 124, "56:2B:04:E4:56:D8", "12:30:56", 1425, SetTeleOp(0.5, 0.56, 86320)
)


def hop():
    return decode(encode(COMMAND))


def hop_in_another_form():
    """As from a client that writes an allowed form which is not ours: the parser has to look."""
    return decode(encode(COMMAND) + b"\n")


def hop_with_trees():
    """Validate when sent and when received, with everything built as it comes to mind."""
    root = etree.Element("msg")
    simple = etree.SubElement(root, "SimpleMsg")
    header = {
        "DestinationID": COMMAND.destination,
        "MessageID": COMMAND.message_id,
        "SourceID": COMMAND.source,
        "Timestamp": COMMAND.timestamp,
        "SessionID": COMMAND.session,
    }
    for name, value in header.items():
        etree.SubElement(simple, name).text = str(value)
    command = etree.SubElement(etree.SubElement(simple, "TeleOp"), "SetTeleOp")
    body = {"Speed": 0.5, "TurnRate": 0.56, "SeenTick": 86320}
    for name, value in body.items():
        etree.SubElement(command, name).text = repr(value)
    SCHEMA.assertValid(root)
    data = etree.tostring(root, xml_declaration=True, encoding="UTF-8", standalone=True)
    received = etree.fromstring(data)
    SCHEMA.assertValid(received)
    text = received.findtext
    return Message(
        text("SimpleMsg/DestinationID"),
        int(text("SimpleMsg/MessageID")),
        text("SimpleMsg/SourceID"),
        text("SimpleMsg/Timestamp"),
        int(text("SimpleMsg/SessionID")),
        SetTeleOp(
            float(text("SimpleMsg/TeleOp/SetTeleOp/Speed")),
            float(text("SimpleMsg/TeleOp/SetTeleOp/TurnRate")),
            int(text("SimpleMsg/TeleOp/SetTeleOp/SeenTick")),
        ),
    )


def best(function):
    """Fastest of several rounds [s per call]."""
    return min(timeit.repeat(function, number=500, repeat=9)) / 500


def test_a_hop_against_trees_on_both_sides(benchmark):
    assert hop() == hop_in_another_form() == hop_with_trees() == COMMAND
    ours, parsed, trees = best(hop), best(hop_in_another_form), best(hop_with_trees)
    ratios = {
        "trees_over_ours": round(trees / ours, 2),
        "trees_over_other_form": round(trees / parsed, 2),
    }
    benchmark.extra_info.update(ratios)
    print(
        f"\nprotocol hop: {ours * 1e6:.1f} us; in another form {parsed * 1e6:.1f} us; "
        f"with trees {trees * 1e6:.1f} us, {ratios['trees_over_ours']} times ours"
    )
    goal("trees over ours", ratios["trees_over_ours"], least=4)
    benchmark(hop)


KINDS = {
    "SetTeleOp": COMMAND.body,
    "Reply": Reply(124, 0, ""),
    "RobotStatus": RobotStatus("Teleoperation", Position(38.66, -9.2), 1.57, 0.5, 0.1, 86320),
    "Heartbeat": Heartbeat(),
    "StopTeleOp": StopTeleOp(),
}


@pytest.mark.parametrize("kind", KINDS)
def test_ways_to_write_and_read_one_kind(benchmark, kind):
    """Both halves of a hop; the last kind is one that the parser reads."""
    body = KINDS[kind]
    sent = replace(COMMAND, body=body, session=None if kind == "Heartbeat" else 1425)
    data = encode(sent)
    assert decode(data) == sent
    written, read = best(lambda: encode(sent)), best(lambda: decode(data))
    benchmark.extra_info.update(encode_us=round(written * 1e6, 2), decode_us=round(read * 1e6, 2))
    print(f"\n{kind}: encode {written * 1e6:.1f} us, decode {read * 1e6:.1f} us")
    benchmark(lambda: decode(encode(sent)))
