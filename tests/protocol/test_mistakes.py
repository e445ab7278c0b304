"""Every refusal has a place in the file, and the codec alone decides what is refused."""

import pytest
from helpers.paths import ROOT
from helpers.wording import unnamed

from dva_sim.protocol.codec import decode
from dva_sim.protocol.errors import ProtocolError
from dva_sim.protocol.mistakes import check_message, form_of

SAMPLES = ROOT / "protocol" / "samples"
GOOD = (SAMPLES / "valid" / "set-teleop.xml").read_bytes()


def places(data):
    return [(problem.line, problem.column) for problem in check_message(data)]


def changed(old, new):
    assert GOOD.count(old) >= 1
    return GOOD.replace(old, new, 1)


def is_inside(data, problem):
    lines = data.decode("utf-8", "replace").replace("\r\n", "\n").replace("\r", "\n").split("\n")
    return (
        1 <= problem.line <= len(lines) and 1 <= problem.column <= len(lines[problem.line - 1]) + 1
    )


def test_valid_samples_are_valid():
    for path in SAMPLES.glob("valid/*.xml"):
        assert check_message(path.read_bytes()) == [], path.name


def test_invalid_samples_are_refused_with_a_place_and_what_would_be_right():
    for path in SAMPLES.glob("invalid/*.xml"):
        data = path.read_bytes()
        problems = check_message(data)
        assert problems, path.name
        assert all(is_inside(data, problem) for problem in problems)
        assert all("see protocol/" not in problem.text for problem in problems)
        assert all(";" in p.text or "well-formed" in p.text for p in problems)


# The sample ends its header on line 8; <Speed> is on line 11, <TurnRate> on line 12.
@pytest.mark.parametrize(
    ("data", "place", "text"),
    [
        (changed(b"<Speed>0.5<", b"<Speed>fast<"), (11, 9), "should be a number from -100 to 100"),
        (changed(b"0.56", b"1e3"), (12, 9), "TurnRate '1e3' is not valid"),
        (changed(b"<Speed>0.5</Speed>", b""), (12, 9), "TurnRate does not belong here"),
        (changed(b"<Speed>", b"  5 <Speed>"), (11, 11), "text should not stand in SetTeleOp"),
        (changed(b"</SetTeleOp>", b"</SetTeleOp> \xc3\xa9x"), (13, 20), "text should not stand in"),
        (GOOD[: GOOD.index(b"</TeleOp>")], (14, 5), "Premature end of data in tag TeleOp"),
        (changed(b"</Speed>", b"</Sped>"), (11, 21), "Opening and ending tag mismatch"),
        (changed(b'?>', b"?"), (1, 54), "the XML declaration is broken"),
        (changed(b"1.0", b"1.1"), (1, 7), 'should go on with version="1.0"'),
        (changed(b"UTF-8", b"UTF-16"), (1, 21), "the XML declaration is broken"),
        (changed(b"<Speed>", b"<Speed unit='m'>"), (11, 9), "an attribute is not allowed"),
        (changed(b"0.56", b"0.<!-- -->56"), (12, 21), "a comment is not allowed"),
        (changed(b"0.56", b"<![CDATA[0]]>"), (12, 19), "a CDATA section is not allowed"),
        (changed(b"0.56", b"0.\xff"), (12, 21), "byte 0xFF is not text"),
        (changed(b"0.56", b"0.\x00"), (12, 21), "a zero byte"),
        (changed(b"<msg>", b"so <msg>"), (2, 1), "no element begins here"),
        (b"\xef\xbb\xbf" + GOOD, (1, 1), "byte order mark; should be UTF-8 without one"),
        (GOOD.decode().encode("utf-16"), (1, 1), "byte order mark; should be UTF-8 without one"),
        (changed(b"0.5<", b"so<").ljust(8192), (11, 9), "should be a number from -100 to 100"),
        (b"", (1, 1), "is empty"),
        (b" \n ", (1, 1), "is empty"),
        (b" " * 8192 + GOOD, (1, 8193), "at most 8192 bytes"),
    ],
)  # fmt: skip
def test_the_place_is_exact(data, place, text):
    (problem,) = check_message(data)
    assert (problem.line, problem.column) == place
    assert text in problem.text


@pytest.mark.parametrize("ending", [b"\r\n", b"\r"])
def test_lines_may_end_in_any_way(ending):
    data = changed(b"<Speed>0.5<", b"<Speed>fast<").replace(b"\n", ending)
    assert places(data) == [(11, 9)]


def test_all_that_the_schema_refuses_is_told():
    data = GOOD.replace(b"0.56", b"much").replace(b"0.5", b"fast").replace(b"1425", b"-1")
    assert places(data) == [(8, 5), (11, 9), (12, 9)]


def test_an_expected_element_is_named():
    (problem,) = check_message(GOOD.replace(b"    <SessionID>1425</SessionID>\n", b""))
    assert not unnamed(problem.text, "TeleOp", "SessionID")


def test_the_verdict_is_that_of_the_codec_whatever_is_damaged():
    for index in range(len(GOOD)):
        for byte in (0, 32, 33, 38, 60, 62, 195):
            data = GOOD[:index] + bytes([byte]) + GOOD[index + 1 :]
            problems = check_message(data)
            try:
                decode(data)
            except ProtocolError:
                assert problems
                assert all(is_inside(data, problem) for problem in problems)
            else:
                assert not problems


@pytest.mark.parametrize("name", ["ಀ৸", "a-b", "1", "a.b", "_", "é"])
def test_names_of_other_signs_are_told_at_their_place(name):
    assert places(f"<msg>\n<{name}/></msg>".encode()) in ([(2, 1)], [(2, 2)])


def test_forms_are_those_of_the_schema():
    assert form_of("SourceID") == "of the form [0-9A-F]{2}(:[0-9A-F]{2}){5}"
    assert not unnamed(form_of("MessageID"), " 1 ", "4294967295", "digits 0 to 9")
    assert not unnamed(form_of("Mode"), "Idle", "Mission", "Teleoperation")
    assert form_of("TeleOp") is None
    assert form_of("nobody") is None
