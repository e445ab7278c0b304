"""Help across a partition: who is lent for nothing comes back when both hear each other again."""

from helpers.dva.dispatch_office import DETECTOR, GUARD, OTHER_GUARD, east
from helpers.dva.two_offices import EAST, WEST, Street

from dva_sim.core.events import State
from dva_sim.core.sessions import Send
from dva_sim.protocol import messages as m


def lent():
    """A street whose eastern guard is sent to an event in the west."""
    street = Street()
    street.register(WEST, DETECTOR, "Sensor")
    street.guard(EAST, GUARD, 90)
    street.fire(WEST, DETECTOR, 10)
    street.tick(6, GUARD, DETECTOR)
    return street


def lent_and_parted():
    """A street whose western DVA has sent somebody of its own, too, when the eastern was silent."""
    street = lent()
    assert street.cores[WEST].events.open[1].responder == EAST
    street.parted = True
    street.guard(WEST, OTHER_GUARD, 20)
    street.tick(12, GUARD, OTHER_GUARD, DETECTOR)
    assert street.cores[WEST].events.open[1].responder == OTHER_GUARD
    assert street.cores[EAST].help.copies
    return street


def test_who_was_lent_is_called_back_when_the_dvas_hear_each_other_again():
    street = lent_and_parted()
    street.parted = False
    street.tick(1, GUARD, OTHER_GUARD, DETECTOR)
    assert not street.cores[EAST].help.copies
    assert street.told(GUARD, m.OrderProgress) == [m.OrderProgress(1_000_001, "done")]
    assert street.cores[WEST].events.open[1].state is State.ASSIGNED


def test_nobody_is_called_back_while_they_do_not_hear_each_other():
    street = lent_and_parted()
    street.tick(20, GUARD, OTHER_GUARD, DETECTOR)
    assert street.cores[EAST].help.copies


def test_what_a_helper_found_behind_a_partition_is_told_before_it_takes_a_new_order():
    street = lent()
    street.parted = True
    street.guard(EAST, GUARD, 10)
    finding = m.EventReport(1_000_001, "fire", east(10), 0.5, 0.9, "confirmed")
    for body in (finding, m.OrderProgress(1_000_001, "done")):
        assert street.say(EAST, GUARD, body).code == m.OK
    street.tick(12, GUARD, DETECTOR)
    assert street.cores[WEST].events.open[1].state is State.PENDING

    order = m.Order(1, "fire", east(10), None)
    assert street.say(EAST, WEST, order).code == m.BUSY
    street.parted = False
    street.tick(1, GUARD, DETECTOR)
    assert street.cores[WEST].events.closed[1].state is State.CONFIRMED
    assert not street.cores[EAST].help.on_the_way
    assert not street.cores[EAST].help.unheard
    assert street.say(EAST, WEST, order).code == m.OK


def test_help_that_is_over_before_its_order_is_answered_is_called_off():
    street = lent_and_parted()
    street.parted = False
    street.deliver(WEST, [Send(EAST, m.Order(1, "fire", east(10), None))])
    assert not street.cores[EAST].help.copies
    assert street.told(GUARD, m.OrderProgress) == [m.OrderProgress(1_000_001, "done")]
