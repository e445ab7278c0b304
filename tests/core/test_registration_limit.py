"""Registrations of one peer: limited at once and per second, whatever other peers do."""

import pytest

from dva_sim.core.registry import BURST, MAX_PEERS, RATE, RegistrationLimit


@pytest.mark.parametrize(
    ("later", "more"), [(0.0, 0), (1.0, 500), (2.0, 1000), (4.0, BURST), (3600.0, BURST)]
)
def test_a_fleet_comes_back_at_once_and_a_flood_is_held_to_its_rate(later, more):
    limit = RegistrationLimit()
    assert (BURST, RATE) == (2000, 500.0)
    assert sum(limit.takes("fleet", 10.0) for _ in range(5000)) == BURST
    assert sum(limit.takes("fleet", 10.0 + later) for _ in range(5000)) == more


def test_a_flood_takes_no_room_of_others():
    limit = RegistrationLimit()
    for _ in range(5000):
        limit.takes("10.0.0.9 ", 1.0)
    assert not limit.takes("10.0.0.9 ", 1.0)
    assert limit.takes("10.0.0.1 ", 1.0)
    assert limit.takes("10.0.0.9 02:00:00:01:00:01", 1.0)  # with a key


def test_memory_is_bounded_and_the_peer_quiet_for_longest_is_forgotten():
    limit = RegistrationLimit()
    for peer in ("first", "second"):
        while limit.takes(peer, 1.0):
            pass
    for number in range(MAX_PEERS - 1):
        limit.takes(str(number), 1.0)
    assert not limit.takes("second", 1.0)
    assert limit.takes("first", 1.0)
