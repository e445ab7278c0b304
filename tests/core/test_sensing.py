"""Sensors of robots, and the DVA's use of their readings."""

import pytest
from helpers.dva.dispatch_office import (
    DETECTOR,
    DVA,
    GUARD,
    OPERATOR,
    OTHER_ROBOT,
    ROBOT,
    Office,
    east,
)
from helpers.wording import counted

from dva_sim.core import events
from dva_sim.core.assignments import Rules
from dva_sim.core.events import State
from dva_sim.core.reports import NO_NEWS, REACH
from dva_sim.core.sensing import RENEW, VALUES_IN_A_ROW, Sensing, SensorAlarm
from dva_sim.core.sessions import Send
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import encode
from dva_sim.protocol.schema import MAX_BYTES

ALARMS = {"smoke": SensorAlarm("fire", 0.3), "gas": SensorAlarm("gas_leak", 0.002)}
CARRIED = m.SensorInfo("http://robot/camera", (m.Sensor("smoke", "1/m"), m.Sensor("water", "m")))
ASK = Send(ROBOT, m.GetSensorInfo())
SMOKY = (0.5,) * VALUES_IN_A_ROW


@pytest.fixture
def office() -> Office:
    """The DVA heeds smoke and gas; the robot stands at 10 m."""
    return Office(sensing=Sensing(ALARMS, 2.0))


def learn(office: Office, robot: str = ROBOT, now: float = 0.0) -> list[Send]:
    """The robot says what it has; what the DVA says then."""
    office.core.sessions.permissions.own = DVA
    return office.core.delivered(Send(robot, m.GetSensorInfo()), now, CARRIED)


def listed(office: Office, device: str | None = None) -> m.SensorList:
    content = office.say(OPERATOR, m.GetSensorInfo(device))[0].content
    assert isinstance(content, m.SensorList)
    return content


# --- which sensors there are -------------------------------------------------------------------


def test_nobody_is_asked_until_somebody_wants_to_know():
    office = Office()
    assert office.sent == []
    reply, sends = office.say(OPERATOR, m.GetSensorInfo())
    assert (reply.code, sends) == (m.BUSY, [ASK])
    assert office.say(OPERATOR, m.GetSensorInfo())[1] == []  # it is asked once
    learn(office)
    assert listed(office) == m.SensorList(
        (m.DeviceSensors(ROBOT, CARRIED.camera_url, CARRIED.sensors),)
    )
    assert office.register(OTHER_ROBOT, "Robot", 20) == [Send(OTHER_ROBOT, m.GetSensorInfo())]


def test_one_robot_or_all_are_listed(office):
    office.register(OTHER_ROBOT, "Robot", 20)
    for robot in (ROBOT, OTHER_ROBOT):
        learn(office, robot)
    assert [line.device for line in listed(office).devices] == [ROBOT, OTHER_ROBOT]
    assert [line.device for line in listed(office, OTHER_ROBOT).devices] == [OTHER_ROBOT]


@pytest.mark.parametrize("device", [GUARD, "02:00:00:09:00:09"])
def test_there_are_no_sensors_of_what_is_no_robot(office, device):
    assert office.say(OPERATOR, m.GetSensorInfo(device))[0].code == m.UNKNOWN_DEVICE


def test_a_robot_that_does_not_answer_holds_up_nobody_but_is_asked_again_by_name():
    office = Office()
    sends = office.say(OPERATOR, m.GetSensorInfo())[1]
    office.no(sends)
    assert listed(office).devices == ()
    assert office.say(OPERATOR, m.GetSensorInfo(ROBOT))[1] == [ASK]


def test_a_robot_that_restarts_is_asked_again(office):
    learn(office)
    office.number = 0
    assert ASK in office.register(ROBOT, "Robot")


def test_a_list_of_any_sensors_fits_into_a_message(office):
    many = m.SensorInfo("x" * 256, tuple(m.Sensor("&" * 64, "\U0001f525" * 30) for _ in range(16)))
    robots = [f"02:00:00:01:01:{number:02X}" for number in range(70)]
    for number, robot in enumerate(robots):
        office.register(robot, "Robot")
        content = many if number % 9 == 8 else m.SensorInfo("u", ())
        office.core.delivered(Send(robot, m.GetSensorInfo()), 0.0, content)
    learn(office)
    for device in (None, robots[8]):
        reply = office.say(OPERATOR, m.GetSensorInfo(device))[0]
        data = encode(m.Message(OPERATOR, 1, DVA, "12:00:00", 0, reply))
        assert 4000 < len(data) <= MAX_BYTES


# --- reading them ------------------------------------------------------------------------------


def test_the_dva_lets_itself_be_permitted_and_then_subscribes_to_what_it_heeds(office):
    (grant,) = learn(office)
    assert isinstance(grant.body, m.PermissionGrant)
    assert (grant.body.holder, grant.body.level, grant.body.sensors) == (DVA, "sensors", ("smoke",))
    wish = Send(ROBOT, m.DevSub("smoke", 2.0), grant.session)
    assert office.ok([grant]) == [wish]
    assert office.tick(RENEW - 1.0) == []
    assert office.tick(RENEW) == [wish]


def test_a_robot_that_no_longer_knows_the_dva_is_told_its_permission_again(office):
    (grant,) = learn(office)
    wishes = office.ok([grant])
    office.no(wishes, 1.0)
    sends = office.tick(RENEW)
    assert [type(send.body) for send in sends] == [m.PermissionGrant]
    assert sends[0].to == ROBOT


def test_a_robot_that_was_gone_is_asked_and_permitted_again(office):
    (grant,) = learn(office)
    office.ok([grant])
    office.silence(ROBOT, 11.0)
    assert office.core.sessions.permissions.observers == {}
    assert office.tick(40.0, alive=False) == []
    assert office.register(ROBOT, "Robot", 10, now=41.0) == [ASK]
    (again,) = learn(office, now=41.0)
    assert isinstance(again.body, m.PermissionGrant)


@pytest.mark.invariant("S10")
def test_of_a_robot_that_is_gone_nothing_is_kept(office):
    office.silence(ROBOT, 11.0)
    office.no([ASK], 27.0)
    learn(office, now=28.0)
    fresh = Sensing(ALARMS, 2.0)
    assert office.core.sensing == fresh


def test_a_dva_that_heeds_nothing_reads_nothing():
    office = Office()
    office.say(OPERATOR, m.GetSensorInfo())
    assert learn(office) == []
    assert office.shows(ROBOT, "smoke", *SMOKY) == []
    assert office.core.events.total == 0


# --- what it means -----------------------------------------------------------------------------


def test_much_smoke_at_a_robot_is_a_fire_there_and_somebody_is_sent(office):
    sends = office.shows(ROBOT, "smoke", *SMOKY, now=3.0)
    event = office.event()
    assert (event.kind, event.position, event.sources) == ("fire", east(10), {ROBOT: 0.6})
    assert event.state is State.ASSIGNED
    assert [type(send.body) for send in sends] == [m.Order]
    assert counted(office.core.counters, "raised", "sensor") == 1


@pytest.mark.parametrize("values", [(0.5, 0.5), (0.5, 0.5, 0.1, 0.5, 0.5), (0.29,) * 50])
def test_noise_is_no_fire(office, values):
    office.shows(ROBOT, "smoke", *values)
    assert office.core.events.total == 0


def test_what_a_sensor_goes_on_showing_is_said_once(office):
    office.shows(ROBOT, "smoke", *SMOKY * 20)
    assert (office.core.events.total, office.event().reports) == (1, 1)


def test_gas_is_a_leak_and_another_event_than_smoke(office):
    office.shows(ROBOT, "smoke", *SMOKY)
    office.shows(ROBOT, "gas", *(0.01,) * VALUES_IN_A_ROW)
    assert [event.kind for event in office.core.events.open.values()] == ["fire", "gas_leak"]


@pytest.mark.parametrize("sensor", ["water", "temperature"])
def test_what_it_does_not_heed_means_nothing(office, sensor):
    office.shows(ROBOT, sensor, *(99.0,) * 9)
    assert office.core.events.total == 0


def test_smoke_at_the_place_of_an_event_confirms_it_and_who_was_sent_need_not_look(office):
    office.ok(office.fire(12))
    assert office.event().operator == OPERATOR
    sends = office.shows(ROBOT, "smoke", *SMOKY, now=5.0)
    assert office.event().state is State.CONFIRMED
    assert Send(OPERATOR, m.OrderProgress(1, "done")) in sends
    assert office.working == {}
    assert office.core.events.total == 1


def test_a_confirmed_event_that_is_to_be_contained_waits_for_a_guard_then():
    office = Office(sensing=Sensing(ALARMS), rules=Rules(containment=True))
    office.busy(GUARD)
    office.fire(12)
    office.idle(GUARD)
    sends = office.shows(ROBOT, "smoke", *SMOKY, now=5.0)
    assert office.event().state is State.CONFIRMED
    contain = m.Order(1, "fire", east(12), None, "contain")
    assert Send(GUARD, contain) in sends


def test_smoke_some_way_off_speaks_for_the_event_but_does_not_confirm_it(office):
    office.fire(10 + REACH - 1)
    before = office.event().confidence
    assert office.shows(ROBOT, "smoke", *SMOKY) == []
    event = office.event()
    assert (event.state, event.reports) == (State.ASSIGNED, 2)
    assert event.confidence > before
    assert office.core.events.total == 1


def test_beyond_its_reach_smoke_is_another_fire(office):
    office.fire(10 + REACH + 1)
    office.shows(ROBOT, "smoke", *SMOKY)
    assert office.core.events.total == 2


def test_a_robot_alone_confirms_nothing_of_its_own_but_a_second_one_does(office):
    office.shows(ROBOT, "smoke", *SMOKY, 0.0, *SMOKY)
    assert office.event().state is State.ASSIGNED
    office.register(OTHER_ROBOT, "Robot", 12)
    office.shows(OTHER_ROBOT, "smoke", *SMOKY)
    assert office.event().state is State.CONFIRMED
    assert office.core.events.total == 1


def test_what_people_have_found_is_no_news_for_a_while(office):
    office.fire(12)
    office.finds(OPERATOR, "confirmed", 5.0)
    office.shows(ROBOT, "smoke", *SMOKY, 0.0, now=10.0)
    assert office.core.events.total == 1
    office.shows(ROBOT, "smoke", *SMOKY, now=5.0 + NO_NEWS)
    assert office.core.events.total == 2


def test_what_was_refuted_is_news_again(office):
    office.fire(12)
    office.finds(OPERATOR, "refuted", 5.0)
    office.shows(ROBOT, "smoke", *SMOKY, now=10.0)
    assert office.core.events.total == 2


# --- one event, whoever tells of it ------------------------------------------------------------


def test_a_detector_says_better_where_it_is_and_nobody_has_set_out(office):
    office.busy(GUARD, OPERATOR)
    office.shows(ROBOT, "smoke", *SMOKY)
    office.fire(25)
    event = office.event()
    assert (event.position, event.state, office.core.events.total) == (east(25), State.PENDING, 1)
    assert set(event.sources) == {ROBOT, DETECTOR}


@pytest.mark.invariant("S6")
def test_who_is_on_the_way_to_where_it_was_felt_is_sent_to_where_it_is(office):
    office.ok(office.shows(ROBOT, "smoke", *SMOKY))
    sends = office.fire(25, now=2.0)
    felt, seen = office.event(1), office.event(2)
    assert (felt.state, seen.state) == (State.EXPIRED, State.ASSIGNED)
    assert Send(OPERATOR, m.OrderProgress(1, "done")) in sends
    assert [s.body.event_id for s in sends if isinstance(s.body, m.Order)] == [2]
    assert sum(office.core.events.counts.values()) == office.core.events.total == 2


def test_smoke_at_a_robot_whose_place_is_not_known_means_nothing(office):
    office.register(OTHER_ROBOT, "Robot")
    assert office.shows(OTHER_ROBOT, "smoke", *SMOKY) == []
    assert office.core.events.total == 0


def test_when_no_more_events_fit_that_is_counted(office, monkeypatch):
    monkeypatch.setattr(events, "MAX_OPEN", 0)
    assert office.shows(ROBOT, "smoke", *SMOKY) == []
    assert office.core.refused == 1
