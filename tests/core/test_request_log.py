"""The log of requests: the newest, in numbers, without what would let a reader act as others."""

from base64 import b64decode
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dva_sim.core.request_log import (
    KEPT_FOR,
    MAX_LOGGED,
    KeptRequest,
    KeptRequests,
    without_sessions,
)
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode, encode

DVA, ROOM = "02:00:00:00:00:01", "02:00:00:07:00:01"
SESSION = 17 << 32 | 0xDEAD_BEEF


def filled(
    count: int, data: bytes = b"<msg>", reply: m.Reply | None = None, answer: bytes = b""
) -> KeptRequests:
    """Return a log that was asked for at 0 s, with one request a second."""
    log = KeptRequests()
    log.above(0, 0.0)
    for second in range(1, count + 1):
        log.keep(
            KeptRequest(
                number=log.count(),
                arrived=second,
                size=len(data),
                data=data,
                reply=reply,
                answer=answer,
            )
        )
    return log


def numbers(log: KeptRequests, above: int) -> list[int]:
    return [entry.request_number for entry in log.above(above, 300.0).requests]


def test_requests_are_wanted_for_60_s_after_each_question():
    log = KeptRequests()
    assert not log.is_wanted(0.0)
    log.above(0, 5.0)
    assert log.is_wanted(5.0 + KEPT_FOR - 0.1)
    assert not log.is_wanted(5.0 + KEPT_FOR)


def test_the_newest_256_are_kept_and_missing_numbers_tell_what_is_lost():
    log = filled(MAX_LOGGED + 4)
    assert numbers(log, 0)[0] == 5
    assert log.newest == 260


def test_all_can_be_read_in_steps_of_what_fits():
    log = filled(80, b"x" * 700)
    found = list[int]()
    while step := numbers(log, found[-1] if found else 0):
        found += step
    assert found == list(range(1, 81))


@given(
    size=st.integers(0, 4096),
    text=st.text("&<é \U0001f600", max_size=256),
    answer=st.integers(0, 8192),
)
def test_each_answer_fits_into_a_message(size, text, answer):
    log = filled(20, b"y" * size, m.Reply(1, m.BUSY, text), b"z" * answer)
    said = m.Message(ROOM, 1, DVA, "12:30:56", 0, m.Reply(1, m.OK, "", log.above(0, 300.0)))
    assert decode(encode(said)) == said


def test_an_entry_tells_age_size_answer_and_how_long_it_took():
    log = KeptRequests()
    reply = m.Reply(9, m.NOT_REGISTERED, "who are you?")
    log.keep(
        KeptRequest(number=3, arrived=2.0, size=9000, data=b"abc", service_time=0.25, reply=reply)
    )
    (entry,) = log.above(0, 4.5).requests
    assert b64decode(entry.request) == b"abc"
    told = entry.ago, entry.size, entry.service_time, entry.code, entry.text
    assert told == (2.5, 9000, 0.25, m.NOT_REGISTERED, "who are you?")
    assert entry.reply is None


def test_an_answer_is_shown_without_the_random_half_of_the_session_that_it_grants():
    permission = m.Permission("02:00:00:01:00:01", "teleoperation", SESSION)
    reply = m.Reply(9, m.OK, "", permission)
    said = encode(m.Message(ROOM, 1, DVA, "12:30:56", 0, reply))
    (entry,) = filled(1, reply=reply, answer=said).above(0, 300.0).requests
    shown = decode(b64decode(entry.reply or "")).body
    assert isinstance(shown, m.Reply)
    assert shown.content == replace(permission, session=17 << 32)


def test_beside_a_long_request_as_much_of_its_answer_is_shown_as_fits():
    (entry,) = filled(1, b"y" * 4096, answer=b"z" * 4096).above(0, 300.0).requests
    assert 900 < len(entry.reply or "") < 1300


@pytest.mark.parametrize(
    "body", [m.StopTeleOp(), m.PermissionRevocation("02:00:00:01:00:01", ROOM, SESSION)]
)
def test_a_session_is_shown_without_its_random_half_in_a_message_as_valid_as_before(body):
    said = m.Message(DVA, 1, ROOM, "12:30:56", SESSION, body)
    shown = decode(without_sessions(encode(said)))
    assert shown.session == 17 << 32
    assert getattr(shown.body, "session", 17 << 32) == 17 << 32


@pytest.mark.parametrize(
    ("data", "shown"),
    [
        (b"<SessionID>73014444591", b"<SessionID>73014444032"),
        (b"<SessionID >73014444591<", b"<SessionID >73014444032<"),
        (b"<SessionID> 12<", b"<SessionID> 00<"),
        (b"<SessionID></SessionID>", b"<SessionID></SessionID>"),
        (b"<Session>&#49;2<", b"<Session>&#00;0<"),
        (b"\xff<msg>", b"\xff<msg>"),
    ],
)
def test_what_is_no_message_shows_no_session_either(data, shown):
    assert without_sessions(data) == shown
