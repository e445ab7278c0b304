import pytest

from dva_sim.console.asking.seats import MAX_SEATS, RELOADED, Seats
from dva_sim.console.wire.limits import SILENT_AFTER

LATER = RELOADED + 0.1  # [s]


def test_a_client_keeps_its_seat_and_the_lowest_free_one_is_given():
    seats = Seats()
    assert [seats.sit(client) for client in ("a", "b", "a", "c")] == [0, 1, 0, 2]
    assert seats.stand_up("b") == 1
    assert seats.stand_up("b") is None
    assert seats.sit("d") == 1
    for number in range(MAX_SEATS):
        seats.sit(f"more {number}")
    assert seats.sit("one too many") is None


@pytest.mark.parametrize(
    ("pages", "later", "manned"),
    [
        ({"a": "drive"}, LATER, {0}),
        ({"phone": ""}, LATER, set()),
        ({"a": "drive", "b": "drive"}, LATER, {0, 2}),
        ({"seated": "drive"}, LATER, {1}),
        ({"seated": "drive", "a": "drive"}, LATER, {0, 1}),
        ({}, RELOADED - 0.1, {0, 1}),
        ({}, LATER, set()),
    ],
)
def test_a_seat_is_manned_while_somebody_is_there(pages, later, manned):
    seats = Seats()
    seats.sit("a")
    seats.sit("seated")
    seats.stand_up("a")
    seats.note_open({"a": "drive", "seated": "drive"}, 0.0)
    seats.note_open(pages, 10.0)
    assert seats.manned([0, 1, 2], 10.0 + later) == manned


def test_who_holds_on_and_says_nothing_is_told_of_once():
    seats = Seats()
    assert not seats.heard("nobody", 0.0, True)
    seats.sit("a")
    seats.heard("a", 1.0, True)
    assert seats.silent(1.0 + 0.9 * SILENT_AFTER) == []
    assert seats.silent(1.1 + SILENT_AFTER) == ["a"]
    assert seats.silent(9.0) == []
    seats.heard("a", 10.0, False)
    assert seats.silent(20.0) == []
