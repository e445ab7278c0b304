from dva_sim.console.asking.seats import MOST_SEATS, Seats
from dva_sim.console.wire.limits import SILENT_AFTER


def test_a_client_keeps_its_seat_and_the_lowest_free_one_is_given():
    seats = Seats()
    assert [seats.sit(client) for client in ("a", "b", "a", "c")] == [0, 1, 0, 2]
    assert seats.stand_up("b") == 1
    assert seats.stand_up("b") is None
    assert seats.sit("d") == 1
    for number in range(MOST_SEATS):
        seats.sit(f"more {number}")
    assert seats.sit("one too many") is None


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
