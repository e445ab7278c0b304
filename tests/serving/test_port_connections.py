"""Eviction of connections: those without a token first, higher roles last."""

import pytest

from dva_sim.serving.port_connections import IDLE, NEWCOMERS, SILENT, PortConnections

NOBODY, LOOK, DRIVE, SUPERVISE = 0, 1, 3, 5  # ranks


def entered(places, now, cut, name):
    """A connection that notes its name when it is cut."""
    place = places.enter(now)
    place.drop = lambda: cut.append(name)
    return place


def test_when_all_places_are_taken_the_oldest_silent_connection_makes_room():
    places, cut = PortConnections(most=3, most_served=2), []
    first = entered(places, 0.0, cut, "first")
    for now in (1.0, 2.0):
        entered(places, now, cut, f"at {now}")
    assert first.begin(LOOK, 3.0)
    entered(places, 4.0, cut, "newcomer")
    assert cut == ["at 1.0"]
    assert len(places.connections) == 3


def test_when_all_places_are_taken_each_newcomer_has_its_turn_before_it_makes_room():
    places, cut = PortConnections(most=50, most_served=40), []
    for n in range(50):
        assert places.wait(0.0) == 0.0
        entered(places, 0.0, cut, n)
    assert places.wait(0.0) == 50 / NEWCOMERS
    assert places.wait(0.04) == pytest.approx(50 / NEWCOMERS - 0.04)
    assert places.wait(50 / NEWCOMERS) == 0.0
    entered(places, 50 / NEWCOMERS, cut, "newcomer")
    assert cut == [0]


def test_requests_without_a_token_keep_no_place_from_a_newcomer():
    places, cut = PortConnections(most=2, most_served=1), []
    stubborn = entered(places, 0.0, cut, "stubborn")
    entered(places, 0.5, cut, "silent")
    stubborn.begin(NOBODY, 0.9)
    assert places.wait(1.0) == 0.0
    entered(places, 1.0, cut, "newcomer")
    assert cut == ["stubborn"]


def test_an_idle_page_makes_room_at_once():
    places, cut = PortConnections(most=1, most_served=0), []
    page = entered(places, 0.0, cut, "page")
    page.begin(LOOK, 0.0)
    page.end(0.0)
    assert places.wait(0.0) == 0.0


def test_connections_in_the_middle_of_a_handshake_do_not_outlive_a_newcomer():
    places, cut = PortConnections(most=2, most_served=1), []
    stalled = entered(places, 0.0, cut, "stalled")
    stalled.since = 1.0  # when its handshake began
    entered(places, 2.0, cut, "newcomer")
    entered(places, 3.0, cut, "next")
    assert cut == ["stalled"]


def test_idle_connections_with_a_token_leave_places_for_newcomers():
    places, cut = PortConnections(most=6, most_served=3), []
    for n in range(6):
        idle = entered(places, float(n), cut, f"idle {n}")
        idle.begin(LOOK, float(n))
        idle.end(float(n))
    first = entered(places, 10.0, cut, "first newcomer")
    entered(places, 10.1, cut, "second newcomer")
    assert cut == ["idle 0", "idle 1"]
    assert first.begin(DRIVE, 10.2)


def test_a_connection_that_cannot_be_cut_keeps_no_other():
    places, cut = PortConnections(most=9, most_served=1), []
    broken = places.enter(0.0)
    broken.drop = lambda: 1 / 0
    entered(places, 0.0, cut, "silent")
    places.sweep(SILENT + 1.0)
    assert cut == ["silent"]
    assert len(places.connections) == 0


def test_a_request_with_a_token_is_never_cut_for_a_newcomer():
    places, cut = PortConnections(most=2, most_served=1), []
    page = entered(places, 0.0, cut, "page")
    assert page.begin(LOOK, 0.0)
    for now in range(100):
        entered(places, float(now), cut, "stranger")
    assert set(cut) == {"stranger"}
    assert places.dropped["for a newcomer"] == 99


def test_silence_is_cut_after_seconds_and_idleness_with_a_token_later():
    places, cut = PortConnections(), []
    entered(places, 0.0, cut, "silent")
    idle = entered(places, 0.0, cut, "idle")
    idle.begin(DRIVE, 0.0)
    slow = entered(places, 0.0, cut, "refused and slow")
    slow.begin(NOBODY, 0.0)
    places.sweep(SILENT)
    assert cut == []
    idle.end(SILENT)
    places.sweep(SILENT + 0.1)
    assert cut == ["silent", "refused and slow"]
    places.sweep(SILENT + IDLE + 0.1)
    assert cut[2:] == ["idle"]


def test_beyond_the_limit_a_lower_role_yields_and_the_same_role_is_refused():
    places, cut = PortConnections(most=10, most_served=2), []
    lookers = [entered(places, float(n), cut, f"looker {n}") for n in range(3)]
    assert [place.begin(LOOK, 5.0 + n) for n, place in enumerate(lookers)] == [
        True,
        True,
        False,
    ]
    lookers[2].end(9.0)
    supervisor = entered(places, 9.0, cut, "supervisor")
    assert supervisor.begin(SUPERVISE, 9.0)
    assert cut == ["looker 0"]


def test_what_is_outside_the_limits_is_served_however_many_are():
    places, cut = PortConnections(most=10, most_served=1), []
    assert entered(places, 0.0, cut, "page").begin(SUPERVISE, 0.0)
    assert not entered(places, 0.0, cut, "page").begin(SUPERVISE, 0.0)
    assert entered(places, 0.0, cut, "stop").begin(DRIVE, 0.0, is_limited=False)
    assert cut == []


def test_more_stops_in_progress_than_there_are_places_let_a_newcomer_in_still():
    places, cut = PortConnections(most=3, most_served=1), []
    for n in range(3):
        assert entered(places, float(n), cut, n).begin(DRIVE, float(n), is_limited=False)
    entered(places, 9.0, cut, "newcomer")
    assert cut == [0]


def test_a_place_that_is_left_counts_no_more():
    places, cut = PortConnections(most=5, most_served=1), []
    page = entered(places, 0.0, cut, "page")
    assert page.begin(LOOK, 0.0)
    page.leave()
    page.leave()
    page.end(1.0)
    assert entered(places, 1.0, cut, "next").begin(LOOK, 1.0)
    assert cut == []
