"""What one hop of a command costs, against building and validating trees at both ends."""

import timeit
from pathlib import Path

from lxml import etree

from dva_sim.protocol.codec import decode, encode
from dva_sim.protocol.messages import Message, SetTeleOp

SCHEMA = etree.XMLSchema(file=str(Path(__file__).parents[2] / "protocol" / "dva.xsd"))
COMMAND = Message(
    "70:1A:04:F9:81:D6", 124, "56:2B:04:E4:56:D8", "12:30:56", 1425, SetTeleOp(0.5, 0.56, 86320)
)


def hop():
    return decode(encode(COMMAND))


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
    assert hop() == hop_with_trees() == COMMAND
    ours, trees = best(hop), best(hop_with_trees)
    ratio = round(trees / ours, 2)
    benchmark.extra_info["trees_over_ours"] = ratio
    print(
        f"\nprotocol hop: {ours * 1e6:.1f} us; with trees {trees * 1e6:.1f} us, {ratio} times ours"
    )
    benchmark(hop)
