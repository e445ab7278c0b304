"""Robots that the DVA sends round while nothing happens."""

import numpy as np
import pytest
from helpers.dva.dispatch_office import DVA, GUARD, OPERATOR, ROBOT, Office, crow, east

from dva_sim.core.dispatcher import REST, Patrols
from dva_sim.core.dva import Dva
from dva_sim.core.sessions import Permissions, Send, Sessions
from dva_sim.protocol import messages as m

BEAT = (east(20), east(40))


class PatrolOffice(Office):
    """Its robot has a beat, and there is no guard in the way."""

    def new_core(self) -> Dva:
        sessions = Sessions(Permissions(lambda: 7, own=DVA))
        beats = Patrols({"robot": BEAT})
        rng = np.random.default_rng(1)
        return Dva(self.policy, crow, self.rules, rng=rng, sessions=sessions, patrols=beats)


def sent_out(office: Office) -> int:
    """The robot goes its round: by which session."""
    office.tick(0.0)
    [grant] = office.tick(REST)
    assert isinstance(grant.body, m.PermissionGrant)
    assert (grant.body.holder, grant.body.level) == (DVA, "missions")
    assert office.ok([grant], REST) == [Send(ROBOT, m.Patrol(BEAT, 0), grant.session)]
    office.is_in("Mission", REST + 1.0)
    return grant.session


@pytest.fixture
def office() -> PatrolOffice:
    return PatrolOffice()


def test_a_robot_without_a_beat_stays_where_it_is():
    office = Office()
    assert [office.tick(float(t)) for t in range(0, 60, 5)] == [[]] * 12


def test_a_robot_sets_out_when_it_has_rested_and_not_before(office):
    assert [office.tick(t) for t in (0.0, 5.0, REST - 0.1)] == [[], [], []]
    sent_out(PatrolOffice())


def test_a_robot_under_way_is_left_alone(office):
    sent_out(office)
    assert [office.tick(REST + t) for t in (5.0, 15.0, 40.0)] == [[], [], []]


def test_a_patrolling_robot_is_sent_to_an_event_and_its_operator_gets_it(office):
    patrol = sent_out(office)
    office.silence(GUARD, 20.0)
    [order] = office.fire(12, now=21.0)
    assert order.to == OPERATOR
    assert isinstance(order.body, m.Order)
    assert order.body.device == ROBOT
    reply, sends = office.say(OPERATOR, m.PermissionRequest(ROBOT, "teleoperation"), 22.0)
    assert isinstance(reply.content, m.Permission)
    assert reply.content.session > patrol  # the higher session ends the patrol
    assert [send.to for send in sends] == [ROBOT]


def test_nobody_is_told_that_the_dva_itself_holds_a_robot_no_longer(office):
    office.tick(0.0)
    [grant] = office.tick(REST)
    assert {send.to for send in office.no([grant], REST)} == {ROBOT}


def test_a_robot_that_comes_to_stand_is_sent_home_and_then_round_again(office):
    session = sent_out(office)
    office.tick(15.0)
    for start in (20.0, 50.0):
        office.is_in("Idle", start)
        assert office.tick(start) == []
        assert office.tick(start + REST) == [Send(ROBOT, m.ReturnToBase(), session)]
        office.is_in("Mission", start + REST)
        assert office.tick(start + REST) == []
        office.is_in("Idle", start + REST)
        office.tick(start + REST)
        assert office.tick(start + 2.0 * REST) == [Send(ROBOT, m.Patrol(BEAT, 0), session)]
        office.is_in("Mission", start + 2.0 * REST)
        office.tick(start + 2.0 * REST)


def test_a_robot_that_comes_back_from_an_order_takes_up_its_round(office):
    sent_out(office)
    content = office.say(OPERATOR, m.PermissionRequest(ROBOT, "teleoperation"), 20.0)[0].content
    assert isinstance(content, m.Permission)
    office.is_in("Idle", 21.0)
    assert office.tick(21.0) == []
    assert office.tick(40.0) == []  # the operator still holds it
    office.say(OPERATOR, m.PermissionRevocation(ROBOT, OPERATOR, content.session), 41.0)
    office.tick(42.0)
    [grant] = office.tick(42.0 + REST)
    assert isinstance(grant.body, m.PermissionGrant)
    assert grant.body.session > content.session


def test_a_dva_that_closes_stops_its_patrols(office):
    session = sent_out(office)
    assert office.core.close() == [Send(ROBOT, m.PermissionRevocation(ROBOT, DVA, session))]
