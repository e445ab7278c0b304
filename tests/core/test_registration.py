"""Registration: arrivals, restarts, silence, and the device list."""

import math

import pytest
from helpers.dva.dispatch_office import ADDRESS, DETECTOR, DVA, GUARD, OPERATOR, ROBOT, Office
from helpers.wording import counted

from dva_sim.core.registry import Registry
from dva_sim.core.sessions import Send
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import encode
from dva_sim.protocol.schema import MAX_BYTES

STRANGER = "02:00:00:09:00:09"
AGAIN = m.Registration("operator", "TeleOp", ADDRESS)


@pytest.fixture
def office() -> Office:
    return Office()


def granted(office: Office) -> int:
    content = office.say(OPERATOR, m.PermissionRequest(ROBOT, "teleoperation"))[0].content
    assert isinstance(content, m.Permission)
    return content.session


def listed(office: Office) -> list[str]:
    content = office.say(OPERATOR, m.GetDeviceList(), 0.0)[0].content
    assert isinstance(content, m.DeviceList)
    return [device.id_tag for device in content.devices]


def test_who_is_dismissed_is_forgotten_and_what_it_held_is_free(office):
    over = m.PermissionRevocation(ROBOT, OPERATOR, granted(office))
    assert office.core.dismiss(STRANGER, 1.0) == []
    assert office.core.dismiss(OPERATOR, 1.0) == [Send(ROBOT, over), Send(OPERATOR, over)]
    assert OPERATOR not in office.core.registry.entries
    assert not office.core.sessions.is_held(ROBOT)


@pytest.mark.parametrize(("now", "code"), [(9.99, m.BUSY), (10.0, m.OK)])
def test_an_address_is_another_devices_until_nothing_was_heard_there_for_ten_seconds(
    office, now, code
):
    assert office.say(GUARD, m.Registration("guard", "Guard", "10.0.0.2"), now)[0].code == code


@pytest.mark.invariant("S11")
def test_who_is_not_registered_is_refused_and_counted(office):
    reply, sends = office.say(STRANGER, m.GetDeviceList())
    assert (reply.code, sends) == (m.NOT_REGISTERED, [])
    office.beat(STRANGER, now=1.0)
    assert office.core.refused == 2
    assert STRANGER not in office.core.registry.entries


def test_the_device_list_shows_robots_then_operators_then_guards_and_no_detectors(office):
    assert listed(office) == [ROBOT, OPERATOR, GUARD]


def test_who_is_silent_is_not_on_the_device_list_until_it_is_heard_again(office):
    office.beat(OPERATOR, GUARD, now=8.0)
    office.core.tick(11.0)
    assert listed(office) == [OPERATOR, GUARD]
    office.status(ROBOT, 10, now=12.0)
    assert listed(office) == [ROBOT, OPERATOR, GUARD]


def test_a_list_of_any_devices_fits_into_a_message(office):
    for number in range(200):
        name = ("&" if number % 2 else "\U0001f525") * 64
        office.say(
            f"02:00:00:01:01:{number:02X}", m.Registration(name, "Robot", "255.255.255.255:65534")
        )
    reply = office.say(OPERATOR, m.GetDeviceList())[0]
    data = encode(m.Message(OPERATOR, 1, DVA, "12:00:00", 0, reply))
    assert 5000 < len(data) <= MAX_BYTES


def test_a_device_is_silent_only_after_its_timeout_has_passed(office):
    office.fire(12)
    office.core.tick(10.0)
    assert office.event().operator == OPERATOR
    office.say(GUARD, m.GetDeviceList(), 10.0)
    office.core.tick(10.1)
    assert office.event().responder == GUARD


@pytest.mark.parametrize("heard", [0.0, 0.1, 1 / 3, 1e6 + 0.7])
def test_silence_comes_at_the_moment_it_was_announced_for_and_not_before(heard):
    registry = Registry()
    registry.register(ROBOT, m.Registration("robot", "Robot", ADDRESS), heard)
    due = registry.next_silence()
    assert heard + 10 < due < heard + 10.001
    assert registry.fallen_silent(heard + 10) == []
    assert [e.device.id_tag for e in registry.fallen_silent(due)] == [ROBOT]
    assert registry.next_silence() == math.inf


def test_a_device_falls_silent_once(office):
    assert len(office.core.registry.fallen_silent(20.0)) == 4
    assert office.core.registry.fallen_silent(30.0) == []


def test_a_device_stays_what_it_is(office):
    changed = m.Registration("detector", "TeleOp", ADDRESS)
    assert office.say(DETECTOR, changed)[0].code == m.NOT_PERMITTED
    assert office.core.registry.entries[DETECTOR].device.device_type == "Sensor"


def test_who_claims_anothers_identity_as_another_type_ends_nothing_of_it(office):
    session = granted(office)
    office.number = 0
    stolen = m.Registration("evil", "Guard", "10.0.0.66")
    assert office.say(OPERATOR, stolen)[1] == []
    assert office.core.sessions.permissions.grants[ROBOT].session == session
    assert office.core.registry.entries[OPERATOR].device.address == ADDRESS


def test_a_changed_address_is_known_from_then_on(office):
    office.say(OPERATOR, m.Registration("operator", "TeleOp", "10.0.0.7:6000"), 10.1)
    assert office.core.registry.entries[OPERATOR].device.address == "10.0.0.7:6000"
    assert len(office.core.registry.entries) == 4


@pytest.mark.invariant("S10")
def test_a_full_registry_refuses_strangers_and_renews_who_is_known(office):
    office.core.registry.most = 4
    assert office.say(STRANGER, AGAIN)[0].code == m.BUSY
    assert office.say(OPERATOR, AGAIN)[0].code == m.OK


def test_a_renewed_registration_changes_nothing_and_a_new_life_ends_what_was_held(office):
    session = granted(office)
    assert office.say(OPERATOR, AGAIN)[1] == []
    assert office.core.sessions.permissions.grants[ROBOT].session == session
    office.number = 0  # restarted, it counts its messages from 1 again
    over = m.PermissionRevocation(ROBOT, OPERATOR, session)
    assert office.say(OPERATOR, AGAIN)[1] == [Send(ROBOT, over), Send(OPERATOR, over)]


@pytest.mark.invariant("S1", "S2")
def test_a_robot_that_restarts_has_no_holder_any_longer(office):
    held = office.say(OPERATOR, m.PermissionRequest(ROBOT, "teleoperation"))[0].content
    office.number = 0
    sends = office.register(ROBOT, "Robot")
    over = m.PermissionRevocation(ROBOT, OPERATOR, held.session)
    assert {send.to for send in sends if send.body == over} == {ROBOT, OPERATOR}
    assert ROBOT not in office.core.sessions.permissions.grants


def test_a_new_life_knows_nothing_of_its_order(office):
    office.ok(office.fire(12))
    assert office.working == {OPERATOR: 1, ROBOT: 1}
    office.number = 0
    office.say(OPERATOR, AGAIN, 5.0)
    assert office.working == {}
    assert [send.to for send in office.tick(6.0)] == [OPERATOR]


def test_a_copy_of_an_old_registration_ends_nothing(office):
    granted(office)
    first = m.Message(DVA, office.number + 1, OPERATOR, "12:00:01", 0, AGAIN)
    later = m.Message(DVA, office.number + 9, OPERATOR, "12:00:11", 0, AGAIN)
    for message in (first, later, first, later):
        assert office.core.handle(message, 1.0)[1] == []
    assert office.core.sessions.permissions.grants[ROBOT].holder == OPERATOR


def test_what_is_not_for_the_dva_is_refused(office):
    assert office.say(OPERATOR, m.StartTeleOp())[0].code == m.NOT_SUPPORTED


# --- two under one id -------------------------------------------------------------------------

ELSEWHERE = m.Registration("robot", "Robot", "10.0.0.66:5600")


@pytest.mark.invariant("S2")
def test_who_is_heard_at_its_address_keeps_its_id_whoever_claims_it(office):
    session = granted(office)
    office.number = 0  # as if it had restarted
    for second in range(0, 60, 2):
        office.status(ROBOT, 10, now=float(second))
        office.beat(OPERATOR, now=float(second))
        office.number = 0
        reply, sends = office.say(ROBOT, ELSEWHERE, second + 1.0)
        assert (reply.code, sends) == (m.BUSY, [])
        assert reply.text.startswith(f"robot is heard at {ADDRESS} under this id;")
        office.core.tick(second + 1.5)
    assert office.core.registry.entries[ROBOT].device.address == ADDRESS
    assert office.core.sessions.permissions.grants[ROBOT].session == session
    assert counted(office.core.counters, "id in use") == 30


def test_who_is_back_at_another_address_is_there_after_the_silence_at_the_old_one(office):
    """Nobody who speaks in its name over other connections keeps it away for longer."""
    granted(office)
    office.status(ROBOT, 10, now=5.0)
    for now in (6.0, 10.0, 14.9):
        office.say(ROBOT, m.Registration("robot", "Robot", ADDRESS), now)
        assert office.say(ROBOT, ELSEWHERE, now)[0].code == m.BUSY
    reply, sends = office.say(ROBOT, ELSEWHERE, 15.1)
    assert reply.code == m.OK
    assert {send.to for send in sends} == {ROBOT, OPERATOR}  # that session is over
    again = office.say(OPERATOR, m.PermissionRequest(ROBOT, "both"), 16.0)[0].content
    assert isinstance(again, m.Permission)
    assert again.address == "10.0.0.66:5600"


def test_the_first_of_two_that_start_at_once_has_its_silence_to_be_heard(office):
    office.say(STRANGER, m.Registration("robot", "Robot", "10.0.0.1"), 0.0)
    assert office.say(STRANGER, m.Registration("robot", "Robot", "10.0.0.2"), 0.1)[0].code == m.BUSY
    office.beat(STRANGER, now=9.0)
    assert (
        office.say(STRANGER, m.Registration("robot", "Robot", "10.0.0.2"), 18.9)[0].code == m.BUSY
    )


def test_a_detector_that_publishes_nothing_keeps_its_id_by_registering(office):
    other = m.Registration("detector", "Sensor", "10.0.0.2")
    for second in range(0, 50, 10):
        office.say(DETECTOR, m.Registration("detector", "Sensor", ADDRESS), float(second))
        assert office.say(DETECTOR, other, second + 9.9)[0].code == m.BUSY


def labels(registry: Registry) -> list[str]:
    return [entry.device.label for entry in registry.entries.values()]


def test_two_devices_of_one_label_can_be_told_apart():
    registry = Registry()
    for id_tag, label in [(ROBOT, "r"), (GUARD, "R "), (OPERATOR, "r"), (STRANGER, "\u202er")]:
        registry.register(id_tag, m.Registration(label, "Robot", ADDRESS), 0.0)
    assert labels(registry) == ["r", f"R ({GUARD})", f"r ({OPERATOR})", "\\u202er"]

    registry.register(GUARD, m.Registration("R ", "Robot", ADDRESS), 1.0)  # renewed
    registry.register(STRANGER, m.Registration("s", "Robot", ADDRESS), 1.0)  # another name
    assert labels(registry) == ["r", f"R ({GUARD})", f"r ({OPERATOR})", "s"]


def test_a_label_goes_from_one_that_is_silent_to_a_newcomer():
    registry = Registry()
    registry.register(OPERATOR, AGAIN, 0.0)
    registry.fallen_silent(20.0)
    registry.register(STRANGER, AGAIN, 20.0)
    assert labels(registry) == [f"operator ({OPERATOR})", "operator"]
    registry.register(OPERATOR, AGAIN, 21.0)
    assert labels(registry) == [f"operator ({OPERATOR})", "operator"]
    registry.forget(STRANGER)
    registry.register(OPERATOR, AGAIN, 22.0)
    assert labels(registry) == ["operator"]
