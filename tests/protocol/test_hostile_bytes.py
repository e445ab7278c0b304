"""Whatever the bytes, decode gives a message or a ProtocolError, and works as before after it.

What it gives is compared with an independent reading of the specification: the tree, validated
separately, and its text.
"""

import itertools
import re
from concurrent.futures import ThreadPoolExecutor
from random import Random

import pytest
from helpers.messages.damaged_messages import LEAF, mutated
from helpers.messages.message_oracle import decode_or_refuse
from helpers.messages.message_strategies import message
from helpers.paths import ROOT
from helpers.processes.memory import needs_proc, resident_bytes
from helpers.processes.search_settings import LONGER, search
from hypothesis import example, given
from hypothesis import strategies as st

from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode, encode
from dva_sim.protocol.errors import ProtocolError
from dva_sim.protocol.schema import MAX_BYTES

GOOD = encode(message(m.SetTeleOp(0.5, 0.56, 86320)))
REPLY = encode(message(m.Reply(124, m.BUSY, "é & <ü>", m.SensorInfo("http://10.0.0.1/?a=b"))))
SAMPLES = ROOT / "protocol" / "samples" / "valid"
ALL = {path.stem: encode(decode(path.read_bytes())) for path in sorted(SAMPLES.glob("*.xml"))}
PLAIN = "plain elements"


def with_every_bit_flipped(data):
    for index in range(len(data)):
        for bit in range(8):
            damaged = bytearray(data)
            damaged[index] ^= 1 << bit
            yield bytes(damaged)


def refused(old, new, data=GOOD):
    assert old in data
    with pytest.raises(ProtocolError) as caught:
        decode(data.replace(old, new))
    return caught.value.reason


@pytest.mark.system
def test_a_message_cut_off_anywhere_is_refused():
    for data in ALL.values():
        for end in range(len(data)):
            with pytest.raises(ProtocolError):
                decode(data[:end])


@pytest.mark.parametrize("data", [GOOD, REPLY], ids=["command", "reply"])
def test_a_flipped_bit_gives_what_the_bytes_say_or_a_refusal(data):
    for damaged in with_every_bit_flipped(data):
        decode_or_refuse(damaged)


@pytest.mark.soak
def test_a_flipped_bit_in_any_kind_gives_what_the_bytes_say_or_a_refusal():
    for data in ALL.values():
        for damaged in with_every_bit_flipped(data):
            decode_or_refuse(damaged)


@pytest.mark.system
def test_exchanged_dropped_and_doubled_elements_give_what_the_bytes_say_or_a_refusal():
    for data in ALL.values():
        found = list(LEAF.finditer(data))
        for (a, b), (c, d) in itertools.combinations([one.span() for one in found], 2):
            exchanged = data[:a] + data[c:d] + data[b:c] + data[a:b] + data[d:]
            assert exchanged == data or decode_or_refuse(exchanged) != decode(data)
        for one in found:
            for instead in (b"", one[0] * 2):
                decode_or_refuse(data[: one.start()] + instead + data[one.end() :])


def test_the_fields_of_a_command_stand_in_one_order_once():
    speed, turn_rate = b"<Speed>0.5</Speed>", b"<TurnRate>0.56</TurnRate>"
    for instead in (turn_rate + speed, speed, turn_rate, speed * 2 + turn_rate, b""):
        refused(speed + turn_rate, instead)


@search()
@given(st.binary(max_size=300))
@example(b"")
@example(b"<")
@example(b"<?xml")
@example(b" \n ")
@example(b"<msg>\xff</msg>")
@example(b"<msg>&#xD800;</msg>")
@example(b"<msg>\x01</msg>")
def test_any_bytes_are_refused(data):
    assert decode_or_refuse(data) is None


@search()
@given(st.integers(55, len(REPLY)), st.integers(0, 12), st.binary(max_size=12))
def test_any_bytes_in_a_message_give_what_they_say_or_a_refusal(at, width, inserted):
    decode_or_refuse(REPLY[:at] + inserted + REPLY[at + width :])


@search(150)
@given(st.sampled_from(list(ALL.values())), st.integers(0, 2**32))
def test_a_damaged_message_gives_what_it_says_or_a_refusal(data, seed):
    decode_or_refuse(mutated(data, Random(seed)))


@pytest.mark.parametrize(
    "doctype",
    [
        b"<!DOCTYPE msg>",
        b'<!DOCTYPE msg [<!ENTITY half "0.5">]>',
        b'<!DOCTYPE msg SYSTEM "file:///etc/passwd">',
        b'<!DOCTYPE msg [<!ENTITY half SYSTEM "file:///etc/hostname">]>',
        b'<!DOCTYPE msg [<!ENTITY % more SYSTEM "http://127.0.0.1:9/x.dtd"> %more;]>',
        b'<!DOCTYPE msg [<!ATTLIST Speed unit CDATA "knots">]>',
        b'<!DOCTYPE msg [<!ENTITY a "aaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>',
    ],
)
def test_a_doctype_is_refused_with_or_without_its_entities(doctype):
    for data in (GOOD, GOOD.replace(b">0.5<", b">&half;<")):
        assert PLAIN in refused(b"<msg>", doctype + b"<msg>", data)


def test_a_value_is_never_half_hidden_by_markup():
    for value in (b"0.<!-- -->56", b"<!-- 0.5 -->0.56", b"<![CDATA[0.56]]>", b"0.<?stop?>56"):
        assert PLAIN in refused(b"0.56", value), value


NO_NUMBERS = [
    *(b"nan", b"NaN", b"INF", b"-INF", b"inf", b"1e999", b"-1e999", b"1_0.5", b"0x1p3", b"+0.5"),
    *(b".5", b"5.", b"1,5", b"0.5 0.5", b"", b" ", b"&half;", b"<Speed>0.5</Speed>"),
    *(b"9" * 5000, b"0." + b"0" * 5000, "٠.٥".encode(), "０.５".encode(), "\u00a00.5".encode()),
]


NO_INTEGERS = [b"9" * 5000, b"0" * 5000 + b"1", b"-0", b"+1", b"1.0", b"1e3", b"1_0", b"0x1"]


def test_what_is_no_plain_finite_number_is_no_turn_rate_and_no_plain_integer_no_message_id():
    for value in NO_NUMBERS:
        refused(b"0.56", value)
    for value in (*NO_INTEGERS, "١".encode()):
        assert "MessageID" in refused(b">124<", b">" + value + b"<")


def test_space_around_a_number_means_nothing_and_inside_a_string_is_refused():
    assert decode(GOOD.replace(b"0.56", b" 0.56\n")) == decode(GOOD)
    assert "Timestamp" in refused(b"12:30:56", b" 12:30:56")
    assert "SourceID" in refused(b"56:2B:04:E4:56:D8", b"56:2B:04:E4:56:D8\n")


def test_a_character_reference_is_the_character():
    assert decode(GOOD.replace(b"0.56", b"&#48;&#46;&#x35;6")) == decode(GOOD)


@pytest.mark.parametrize(
    "text",
    [b"\xe9", b"\xc3", b"\xa9", b"\xc0\xaf", b"\xed\xa0\x80", b"\xf4\x90\x80\x80", b"\xff\xfe"],
    ids=["latin-1", "cut", "continuation", "overlong", "surrogate", "too-large", "mark"],
)
def test_text_that_is_not_utf_8_is_refused(text):
    refused("é".encode(), text, REPLY)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-32"])
@pytest.mark.parametrize("declared", ["UTF-8", "UTF-16", None])
def test_utf_16_and_utf_32_are_refused_whatever_they_declare(encoding, declared):
    text = GOOD.decode()
    start = f'<?xml version="1.0" encoding="{declared}"?>' if declared else ""
    data = (start + text[text.index("<msg>") :]).encode(encoding)
    with pytest.raises(ProtocolError):
        decode(data)


@pytest.mark.parametrize("start", [b"", b"+/v8-", b'<?xml version="1.0" encoding="UTF-7"?>'])
def test_utf_7_is_refused_with_or_without_its_mark(start):
    text = GOOD[GOOD.index(b"<msg>") :].decode()
    shifted = "".join(f"+{'ADw' if c == '<' else 'AD4'}-" if c in "<>" else c for c in text)
    assert shifted.encode().decode("utf-7") == text
    with pytest.raises(ProtocolError):
        decode(start + shifted.encode())


def test_another_root_is_refused_and_so_are_the_inner_parts_of_a_message():
    for root in (b"Msg", b"MSG", b"message", b"SimpleMsg", b"HBMsg", b"m", b"msg2", "mśg".encode()):
        data = GOOD.replace(b"<msg>", b"<" + root + b">").replace(b"</msg>", b"</" + root + b">")
        assert decode_or_refuse(data) is None, root
    for name in (b"SimpleMsg", b"TeleOp", b"SetTeleOp"):
        inner = GOOD[GOOD.index(b"<" + name + b">") : GOOD.index(b"</" + name + b">")]
        assert decode_or_refuse(inner + b"</" + name + b">") is None, name


def test_two_messages_are_none():
    plain = GOOD[GOOD.index(b"<msg>") :]
    for data in (plain * 2, GOOD + plain, GOOD + b"x"):
        assert decode_or_refuse(data) is None


@pytest.mark.parametrize(
    "declaration",
    [
        b'<?xml version="1.0" encoding="ISO-8859-1"?>',
        b'<?xml version="1.0" encoding="UTF-7"?>',
        b'<?xml version="1.0" encoding="UTF-8?>',
        b'<?xml version="1.0" encoding="UTF-8"?',
        b'<?xml version="1.1" encoding="UTF-8"?>',
        b'<?xml encoding="UTF-8"?>',
        b"<?xml?>",
    ],
)
def test_a_declaration_of_anything_but_xml_in_utf_8_is_refused(declaration):
    assert "declaration" in refused(GOOD[: GOOD.index(b"<msg>")], declaration)


def test_other_ways_to_declare_utf_8_are_accepted():
    for declaration in (
        *(b"", b"\n", b'<?xml version="1.0"?>', b"<?xml version='1.0' encoding='utf-8' ?>\n"),
        b'<?xml version = "1.0"  encoding = "UTF-8" standalone="no"?>\r\n',
    ):
        assert decode(GOOD.replace(GOOD[: GOOD.index(b"<msg>")], declaration)) == decode(GOOD)


def test_a_byte_order_mark_is_refused():
    with pytest.raises(ProtocolError, match="byte order mark"):
        decode(b"\xef\xbb\xbf" + GOOD)


@pytest.mark.parametrize(
    "root",
    [
        b'<msg xmlns="http://example.org">',
        b'<msg xmlns:x="http://example.org">',
        b'<msg xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:nil="true">',
        b"<msg id='1'>",
        b'<msg\nid\n=\n"1">',
        b'<msg id="a>b">',
    ],
)
def test_attributes_and_namespaces_are_refused(root):
    assert PLAIN in refused(b"<msg>", root)


def test_a_schema_named_in_the_message_is_never_opened(tmp_path):
    other = tmp_path / "other.xsd"
    other.write_text("<not a schema")
    location = f'xsi:noNamespaceSchemaLocation="{other}"'.encode()
    root = b'<msg xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" ' + location + b">"
    assert PLAIN in refused(b"<msg>", root)


def test_a_prefix_that_was_never_declared_is_refused():
    for name in (b"msg>", b"SimpleMsg>", b"TeleOp>", b"Speed>"):
        data = GOOD.replace(b"<" + name, b"<x:" + name)
        assert PLAIN in refused(b"</" + name, b"</x:" + name, data), name


def test_space_in_tags_and_short_empty_elements_mean_nothing():
    stop = encode(message(m.StopTeleOp()))
    for empty in (b"<StopTeleOp/>", b"<StopTeleOp />", b"<StopTeleOp\n></StopTeleOp >"):
        assert decode(stop.replace(b"<StopTeleOp></StopTeleOp>", empty)) == decode(stop)


def test_deep_nesting_is_refused():
    for tag in (b"<msg>", b"<TeleOp>", b"<a>"):
        depth = MAX_BYTES // (2 * len(tag) + 1)
        assert decode_or_refuse(tag * depth + tag.replace(b"<", b"</") * depth) is None


def test_a_message_has_at_most_8192_bytes():
    padded = GOOD.replace(b"<msg>", b"<msg>" + b" " * (MAX_BYTES - len(GOOD)))
    assert len(padded) == 8192
    assert decode(padded) == decode(GOOD)
    assert "8193 bytes" in refused(b"<msg>", b"<msg> ", padded)


def test_a_refusal_leaves_no_trace_in_the_next_message():
    for bad in (b"<msg>", GOOD[:-1], GOOD.replace(b"0.56", b"nan"), b"<a><b></a>"):
        with pytest.raises(ProtocolError):
            decode(bad)
        assert decode(GOOD).body == m.SetTeleOp(0.5, 0.56, 86320)


def test_threads_share_the_parser():
    bad = GOOD.replace(b"0.56", b"nan")
    with ThreadPoolExecutor(4) as pool:
        got = list(pool.map(decode_or_refuse, [GOOD, bad, REPLY] * 200))
    assert got == [decode(GOOD), None, decode(REPLY)] * 200


def with_new_blanks(number):
    """Allowed, and never the same twice."""
    rng = Random(number)
    return re.sub(b"(?<=>)(?=<)", lambda _: bytes(rng.choices(b" \n\t\r", k=50)), GOOD)


def new(number):
    return b"a%d" % number + b"x" * 1000


HOSTILE = {
    "names": lambda n: b"<msg><%b></%b></msg>" % (new(n), new(n)),
    "an end": lambda n: b"<msg></%b>" % new(n),
    "an entity": lambda n: GOOD.replace(b"0.56", b"&%b;" % new(n)),
    "a value": lambda n: GOOD.replace(b"0.56", new(n)),
    "blanks": with_new_blanks,
    "references": lambda n: (
        with_new_blanks(n).replace(b"\t<", b"&#9;\t<").replace(b" <", b"&#32; <")
    ),
}


def attack(messages):
    for data in messages:
        try:
            decode(data)
        except ProtocolError:
            continue


@pytest.mark.invariant("S10")
@needs_proc
@pytest.mark.parametrize("what", HOSTILE)
def test_what_was_never_seen_before_is_not_kept(what):
    """The parser keeps names and blanks for ever; 3,000 of these made 3 MB."""
    attack(map(HOSTILE[what], range(500)))
    before = resident_bytes()
    attack(map(HOSTILE[what], range(500, 3500)))
    assert resident_bytes() - before < 1.5e6


def test_blanks_between_elements_mean_nothing_and_are_no_value():
    assert decode_or_refuse(with_new_blanks(1)) == decode(GOOD)
    for value in (b"\n", b" ", b" \n ", b"\r\n"):
        for start in (b"<Speed>", b"<Text>", b"<CameraUrl>", b"<Timestamp>", b"<MessageID>"):
            for data in (GOOD, REPLY):
                before, found, rest = data.partition(start)
                if found:
                    decode_or_refuse(before + start + value + rest[rest.index(b"<") :])


@pytest.mark.soak
@needs_proc
def test_hostile_messages_leave_no_memory_behind():
    rng, seeds = Random(8192), list(ALL.values())
    attack(mutated(rng.choice(seeds), rng) for _ in range(50_000))
    count, grown = 80_000 * LONGER, []
    for _ in range(3):
        before = resident_bytes()
        attack(mutated(rng.choice(seeds), rng) for _ in range(count))
        grown.append(resident_bytes() - before)
    # No object of Python takes 16 bytes or less. What is kept grows each time, the allocator's
    # own ups and downs do not.
    least = min(grown)
    assert least < 16 * count, f"{least / count:.1f} bytes more per message"
