"""Help between DVAs."""

from helpers.dva.dispatch_office import DETECTOR, GUARD, OTHER_GUARD, east
from helpers.dva.two_offices import EAST, WEST, Street

from dva_sim.core.events import State
from dva_sim.core.regions.help import Lent
from dva_sim.protocol import messages as m


def street_with_a_guard_in_the_east():
    street = Street()
    street.register(WEST, DETECTOR, "Sensor")
    street.guard(EAST, GUARD, 90)
    return street


def test_a_dva_that_has_had_nobody_free_for_five_seconds_gets_help():
    street = street_with_a_guard_in_the_east()
    street.fire(WEST, DETECTOR, 10)
    street.tick(4, GUARD, DETECTOR)
    assert street.told(GUARD, m.Order) == []
    street.tick(2, GUARD, DETECTOR)
    assert street.told(EAST, m.Order) == [m.Order(1, "fire", east(10), None)]
    assert street.told(GUARD, m.Order) == [m.Order(1_000_001, "fire", east(10), None)]
    assert street.cores[WEST].events.open[1].responder == EAST


def test_a_dva_with_somebody_free_asks_for_no_help():
    street = street_with_a_guard_in_the_east()
    street.guard(WEST, OTHER_GUARD, 0)
    street.fire(WEST, DETECTOR, 10)
    street.tick(8, GUARD, OTHER_GUARD, DETECTOR)
    assert street.told(EAST, m.Order) == []


def test_a_dva_that_has_nobody_free_either_is_busy_and_is_asked_again_later():
    street = street_with_a_guard_in_the_east()
    street.fire(EAST, WEST, 80)
    street.fire(WEST, DETECTOR, 10)
    street.tick(8, GUARD, DETECTOR)
    assert len(street.told(EAST, m.Order)) == 1
    assert street.cores[WEST].events.open[1].state is State.PENDING
    street.tick(10, GUARD, DETECTOR)
    assert len(street.told(EAST, m.Order)) == 2
    assert street.cores[WEST].events.open[1].attempts == 0


def lent():
    """A street whose eastern guard is on the way to an event in the west."""
    street = street_with_a_guard_in_the_east()
    street.fire(WEST, DETECTOR, 10)
    street.tick(6, GUARD, DETECTOR)
    return street


def test_the_finding_of_who_was_lent_is_that_of_the_helper_and_all_are_free_again():
    street = lent()
    street.say(EAST, GUARD, m.OrderProgress(1_000_001, "departed"))
    street.say(EAST, GUARD, m.OrderProgress(1_000_001, "arrived"))
    assert street.cores[WEST].events.open[1].state is State.ON_SCENE
    finding = m.EventReport(1_000_001, "fire", east(10), 0.5, 0.9, "confirmed")
    street.say(EAST, GUARD, finding)
    street.say(EAST, GUARD, m.OrderProgress(1_000_001, "done"))
    event = street.cores[WEST].events.closed[1]
    assert event.state is State.CONFIRMED
    assert [*event.times] == ["detected", "assigned", "departed", "arrived", "confirmed", "closed"]
    assert not street.cores[WEST].orders.engaged
    assert not street.cores[EAST].orders.engaged
    assert not street.cores[EAST].help.copies


def test_who_takes_an_event_over_is_helped_by_those_who_are_on_the_way_already():
    street = lent()
    third = "02:00:00:00:00:03"
    street.register(EAST, third, "DVA")
    assert street.say(EAST, third, m.Order(1, "fire", east(10), None)).code == m.OK
    assert street.cores[EAST].help.copies == {1_000_001: Lent(third, 1)}
    assert len(street.told(GUARD, m.Order)) == 1


def asked_by_one_that_is_started_again():
    """A street whose western DVA has asked for help, and is started again without its events."""
    street = lent()
    street.cores[WEST] = street.new_core(WEST, life=1)
    street.register(WEST, EAST, "DVA")
    street.number = 0
    street.register(EAST, WEST, "DVA")
    return street


def test_help_that_was_asked_for_in_a_life_before_is_passed_on_as_an_event_to_who_asked():
    street = asked_by_one_that_is_started_again()
    street.tick(9, GUARD)
    assert list(street.cores[EAST].help.copies) == [1_000_001]
    street.tick(3, GUARD)
    assert not street.cores[EAST].help.copies
    (event,) = street.cores[WEST].events.open.values()
    assert (event.kind, event.position) == ("fire", east(10))
    assert street.cores[EAST].counters["event passed on"] == 1


def test_help_that_is_asked_for_again_after_a_restart_goes_on():
    street = asked_by_one_that_is_started_again()
    assert street.say(EAST, WEST, m.Order(1, "fire", east(10), None)).code == m.OK
    street.tick(12, GUARD)
    assert street.cores[EAST].help.copies == {1_000_001: Lent(WEST, 1)}


def test_help_that_is_needed_no_longer_comes_back():
    street = lent()
    street.cores[WEST].roles.appoint(DETECTOR, "dispatch")
    assert street.say(WEST, DETECTOR, m.FalseAlarm(1, "toast", None)).code == m.OK
    assert street.told(EAST, m.OrderProgress) == [m.OrderProgress(1, "done")]
    assert street.told(GUARD, m.OrderProgress) == [m.OrderProgress(1_000_001, "done")]
    assert not street.cores[EAST].help.copies
    assert GUARD not in street.cores[EAST].orders.engaged


def test_an_event_whose_helper_dies_is_open_to_others():
    street = lent()
    street.dead.add(EAST)
    street.tick(11, DETECTOR)
    event = street.cores[WEST].events.open[1]
    assert (event.state, event.responder) == (State.PENDING, None)


def test_a_helper_whose_guard_gives_up_says_so_and_is_not_asked_again():
    street = lent()
    street.say(EAST, GUARD, m.OrderProgress(1_000_001, "departed"))
    street.say(EAST, GUARD, m.OrderProgress(1_000_001, "failed"))
    street.tick(20, GUARD, DETECTOR)
    assert street.told(WEST, m.OrderProgress)[-1] == m.OrderProgress(1, "failed")
    assert len(street.told(EAST, m.Order)) == 1
    assert street.cores[WEST].events.open[1].state is State.PENDING
    assert not street.cores[EAST].help.copies


def test_a_dva_lends_nobody_to_a_stranger_or_to_contain():
    street = street_with_a_guard_in_the_east()
    order = m.Order(7, "fire", east(10), None, "contain")
    assert street.say(EAST, WEST, order).code == m.NOT_SUPPORTED
    street.register(EAST, DETECTOR, "Sensor")
    order = m.Order(7, "fire", east(10), None)
    assert street.say(EAST, DETECTOR, order).code == m.NOT_SUPPORTED
    assert street.told(GUARD, m.Order) == []
