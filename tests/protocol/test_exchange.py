"""Replies that were given are kept for who asks again, and no more of them than fit."""

import pytest

from dva_sim.protocol.exchange import ReplyCache, key_of

KEYS = [key_of(None, b"request %d" % number) for number in range(100)]


def kept(cache: ReplyCache) -> list[int]:
    return [number for number, key in enumerate(KEYS) if cache.get(key) is not None]


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
