"""Stored replies for repeated requests, and throttling of senders of invalid messages."""

import pytest

from dva_sim.protocol.exchange import (
    A_DAY,
    LOW_BITS,
    Hearing,
    Nuisances,
    Outbox,
    ReplyCache,
    is_absurd,
    key_of,
)
from dva_sim.protocol.messages import Heartbeat

KEYS = [key_of(None, b"request %d" % number) for number in range(100)]


def kept(cache: ReplyCache) -> list[int]:
    return [number for number, key in enumerate(KEYS) if cache.get(key) is not None]


@pytest.fixture
def heard() -> Nuisances:
    return Nuisances()


def test_the_last_64_replies_to_a_source_are_kept():
    cache = ReplyCache()
    for key in KEYS:
        cache.put(key, "a", b"reply")
    assert kept(cache) == list(range(36, 100))


@pytest.mark.invariant("S10")
def test_of_long_replies_fewer_are_kept_and_the_last_always():
    cache = ReplyCache(room=1000)
    for key in KEYS[:5]:
        cache.put(key, "a", bytes(300))
    assert kept(cache) == [2, 3, 4]
    cache.put(KEYS[5], "a", bytes(5000))
    assert kept(cache) == [5]
    cache.put(KEYS[6], "a", bytes(300))
    assert kept(cache) == [6]


@pytest.mark.invariant("S10")
def test_who_has_asked_longest_ago_is_forgotten_first():
    cache = ReplyCache(sources=2, room=1000)
    for key, source in zip(KEYS, "abac", strict=False):
        cache.put(key, source, bytes(400))
    assert kept(cache) == [0, 2, 3]


# --- who sends what is no message ------------------------------------------------------------


def test_a_program_that_errs_now_and_then_is_answered_for_ever(heard):
    for second in range(1000):
        for _ in range(9):
            heard.bad("clumsy", float(second))
        assert heard.hearing("clumsy", float(second)) is Hearing.ANSWERED


def test_a_flood_is_first_not_answered_and_then_not_read():
    heard, seen = Nuisances(), []
    for number in range(200):
        heard.bad("flood", number * 0.001)
        hearing = heard.hearing("flood", number * 0.001)
        if hearing not in seen:
            seen.append(hearing)
    assert seen == [Hearing.ANSWERED, Hearing.READ, Hearing.IGNORED]
    assert heard.hearing("another", 0.2) is Hearing.ANSWERED


def test_who_stops_is_read_again_ten_seconds_later_and_answered_soon_after(heard):
    for _ in range(100_000):
        heard.bad("flood", 1.0)
    assert heard.hearing("flood", 10.9) is Hearing.IGNORED
    assert heard.hearing("flood", 11.1) is Hearing.READ
    assert heard.hearing("flood", 19.1) is Hearing.ANSWERED


def test_a_good_message_halves_what_is_held_against_a_peer(heard):
    for _ in range(80):
        heard.bad("mixed", 0.0)
    heard.good("mixed", 0.0)
    assert heard.hearing("mixed", 1.9) is Hearing.READ  # of forty, ten a second are forgiven
    heard.good("mixed", 1.9)
    assert heard.hearing("mixed", 1.9) is Hearing.ANSWERED


def test_what_is_left_against_a_peer_after_a_good_message_still_counts(heard):
    for _ in range(3):
        heard.bad("mixed", 0.0)
    heard.good("mixed", 0.0)  # one and a half are left
    for _ in range(19):
        heard.bad("mixed", 0.0)
    assert heard.hearing("mixed", 0.0) is Hearing.READ


def test_no_more_peers_are_remembered_than_stated(heard):
    for peer in ("first", "second"):
        for _ in range(21):
            heard.bad(peer, 0.0)
    for number in range(Nuisances.PEERS - 1):
        heard.bad(number, 0.0)
    assert heard.hearing("second", 0.0) is Hearing.READ
    assert heard.hearing("first", 0.0) is Hearing.ANSWERED


# --- sessions ------------------------------------------------------------------------------

HIGHEST = 2**32 - 1  # count of sessions


@pytest.mark.parametrize(
    ("count", "known", "absurd"),
    [
        (1, 0, False),
        (HIGHEST - A_DAY, 0, False),
        (HIGHEST - A_DAY + 1, 0, True),  # a forged one must not leave the DVA without room
        (1_000 + A_DAY, 1_000, False),
        (1_001 + A_DAY, 1_000, True),
        (1, 1_000, False),
    ],
)
def test_a_session_is_absurd_that_no_dva_can_have_reached_within_a_day(count, known, absurd):
    for low in (0, HIGHEST):
        newest = known << LOW_BITS | low if known else 0
        assert is_absurd(count << LOW_BITS | low, newest) is absurd


def test_in_virtual_time_a_run_begins_at_noon():
    outbox = Outbox("02:00:00:01:00:01")
    stamps = [outbox.message("", Heartbeat(), now).timestamp for now in (0.0, 59.99, 43_200.0)]
    assert stamps == ["12:00:00", "12:00:59", "00:00:00"]
    outbox.set_clock(-90.0)  # by somebody who finds it fast
    outbox.set_clock(-30.0)
    assert outbox.message("", Heartbeat(), 0.0).timestamp == "11:58:00"
