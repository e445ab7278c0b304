"""The samples and the specification, read as someone writing another implementation would."""

import csv
import re
from contextlib import suppress
from typing import get_args

import pytest
from helpers.messages.message_oracle import BODY_ELEMENTS, SCHEMA
from helpers.paths import ROOT, TESTS
from lxml import etree

from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode, encode
from dva_sim.protocol.errors import ProtocolError

PROTOCOL = ROOT / "protocol"
VALID = sorted((PROTOCOL / "samples" / "valid").glob("*.xml"))
INVALID = sorted((PROTOCOL / "samples" / "invalid").glob("*.xml"))
FAULTS = (PROTOCOL / "samples/invalid.csv").read_text(encoding="utf-8")
ROWS = list(csv.DictReader(FAULTS.splitlines()))
FOUND_BY = {row["sample"]: row["found by"] for row in ROWS}

NEW = {
    "1.4": {
        *("get-grant", "get-sensor-info-device", "handover-request"),
        *("permission-request-ask", "permission-request-force", "permission-request-no"),
        *("reply-holder", "reply-sensor-list", "reply-session-floor"),
        *("robot-holder", "robot-holder-nobody", "robot-holder-refusing"),
    },
    "1.5": {
        *("acknowledge", "add-note", "assign", "assign-contain", "assign-operator"),
        *("audit-record", "audit-record-policy", "dispatch-status", "escalate", "event-status"),
        *("event-status-pending", "false-alarm", "get-dispatch", "get-event-list"),
        *("get-event-list-above", "get-proposal", "reply-dispatch-status", "reply-event-list"),
        *("reply-event-status", "reply-proposal", "reply-proposal-nobody", "revoke"),
        *("set-dispatch", "take-off"),
    },
    "1.6": {"get-grant-of-a-reader", "get-grant-of-the-holder"},
    "1.7": {
        *("release-emergency", "reply-emergency-release"),
        *("robot-emergency", "robot-emergency-button", "robot-emergency-released"),
    },
    "1.8": {"get-request-log", "get-request-log-above", "reply-request-log"},
    "1.9": {
        *("event-report-passed-on", "hand-over", "hand-over-to-a-known-address"),
        *("peer-status", "peer-status-of-no-region", "replicate"),
        *("give-back", "give-back-between-dvas", "reply-request-log-with-replies"),
        *("audit-record-mode", "audit-record-note", "audit-record-operator"),
    },
}
OLD = {
    version: etree.XMLSchema(file=str(TESTS / "data" / f"dva-{version}.xsd"))
    for version in ("1.3", "1.4", "1.5", "1.6", "1.7", "1.8")
}


@pytest.mark.parametrize("version", OLD)
def test_an_older_peer_understands_all_samples_but_those_of_what_was_added_since(version):
    added = set().union(*(NEW[newer] for newer in NEW if newer > version))
    refused = {path.stem for path in VALID if not OLD[version].validate(etree.parse(path))}
    assert refused == added


def test_nothing_that_is_marked_invalid_was_accepted_before():
    for path in INVALID:
        with suppress(etree.XMLSyntaxError):
            tree = etree.parse(path)
            judged = [schema.validate(tree) for schema in OLD.values()]
            assert judged == [SCHEMA.validate(tree)] * len(OLD), path.name


def test_a_valid_sample_is_accepted_and_survives_a_round_trip():
    for path in VALID:
        data = path.read_bytes()
        SCHEMA.assertValid(etree.fromstring(data))
        assert decode(encode(decode(data))) == decode(data), path.name


def test_there_is_a_valid_sample_of_every_body_and_content():
    bodies = [decode(path.read_bytes()).body for path in VALID]
    contents = {type(body.content) for body in bodies if isinstance(body, m.Reply)}
    assert {type(body) for body in bodies} == set(get_args(m.Body))
    assert contents == {type(None), *get_args(m.Content)}


def test_every_invalid_sample_is_explained():
    assert [path.name for path in INVALID] == sorted(FOUND_BY)
    assert [row["sample"] for row in ROWS if not row["fault"]] == []


def test_there_is_an_invalid_sample_of_every_message_and_it_is_of_that_message():
    named = {row["sample"]: row["message"] for row in ROWS}
    assert set(named.values()) >= BODY_ELEMENTS
    misspelt = {"cancel-mission-misspelt.xml"}
    for path in INVALID:
        if path.name not in misspelt:
            text = path.read_bytes().replace(b"\0", b"")
            assert f"<{named[path.name]}>".encode() in text, path.name


def who_finds(data):
    """The first of XML, schema and rule that refuses."""
    try:
        tree = etree.fromstring(data)
    except etree.XMLSyntaxError:
        return "XML"
    return "rule" if SCHEMA.validate(tree) else "schema"


def test_an_invalid_sample_is_refused_for_the_reason_given():
    for path in INVALID:
        data = path.read_bytes()
        assert who_finds(data) == FOUND_BY[path.name], path.name
        with pytest.raises(ProtocolError) as refused:
            decode(data)
        assert refused.value.code == m.BAD_MESSAGE


def test_the_command_printed_in_the_dissertation_decodes_right():
    data = (PROTOCOL / "samples/valid/set-teleop.xml").read_bytes()
    assert decode(data) == m.Message(
        destination="70:1A:04:F9:81:D6",
        message_id=124,
        source="56:2B:04:E4:56:D8",
        timestamp="12:30:56",
        session=1425,
        body=m.SetTeleOp(speed=0.5, turn_rate=0.56),
    )


def test_the_registration_printed_in_the_dissertation_is_accepted_once_mended():
    mended = (PROTOCOL / "samples/valid/registration.xml").read_text()
    body = m.Registration("Tablet BQ Curie 2", "TeleOp", "192.168.1.48")
    assert decode(mended.encode()).body == body
    as_printed = mended.replace('encoding="UTF-8" standalone="yes"?>', 'encoding="UTF-8"?')
    assert as_printed != mended
    with pytest.raises(ProtocolError, match="XML declaration"):
        decode(as_printed.encode())


def test_the_message_in_the_specification_is_the_sample():
    printed = re.search(r"```xml\n(.*?)```", (PROTOCOL / "README.md").read_text(), re.DOTALL)
    assert printed[1] == (PROTOCOL / "samples/valid/set-teleop.xml").read_text()


def test_the_reply_codes_of_the_specification_are_those_of_the_program():
    rows = re.findall(
        r"^\| (\d+) \| `(\w+)` \|", (PROTOCOL / "README.md").read_text(), re.MULTILINE
    )
    assert {int(code): name.lower().replace("_", " ") for code, name in rows} == m.CODE_NAMES
