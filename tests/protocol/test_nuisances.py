"""Who sends what is no message is listened to less and less, and not for ever."""

from dva_sim.protocol.exchange import Hearing, Nuisances


def test_a_program_that_errs_now_and_then_is_answered_for_ever():
    heard = Nuisances()
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


def test_who_stops_is_read_again_ten_seconds_later_and_answered_soon_after():
    heard = Nuisances()
    for _ in range(100_000):
        heard.bad("flood", 1.0)
    assert heard.hearing("flood", 10.9) is Hearing.IGNORED
    assert heard.hearing("flood", 11.1) is Hearing.READ
    assert heard.hearing("flood", 19.1) is Hearing.ANSWERED


def test_a_good_message_halves_what_is_held_against_a_peer():
    heard = Nuisances()
    for _ in range(40):
        heard.bad("mixed", 0.0)
    assert heard.hearing("mixed", 0.0) is Hearing.READ
    heard.good("mixed", 0.0)
    assert heard.hearing("mixed", 0.0) is Hearing.ANSWERED


def test_no_more_peers_are_remembered_than_stated():
    heard = Nuisances()
    for peer in range(5000):
        heard.bad(peer, 0.0)
    assert len(heard._counts) == Nuisances.PEERS
