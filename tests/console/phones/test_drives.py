"""A real phone registers, is given a robot and tilts it, by the messages of any operator."""

import re

import pytest
from helpers.console.simulated_phone import CALIBRATION, HeldPhone, PhonePage
from helpers.wording import unnamed

from dva_sim.agents.robot.controller import Mode


@pytest.fixture
def page(monkeypatch):
    return PhonePage(monkeypatch)


@pytest.fixture
def driving(page):
    page.drives_by_tilt()
    return page


def kinds(page, to):
    """Kinds of the messages from a phone to one receiver, in order, without repeats."""
    reports = [
        data
        for source, there, data in page.heard
        if source.startswith("02:00:00:06") and there == to
    ]
    names = [name for data in reports if (name := _kind(data))]
    return [name for n, name in enumerate(names) if n == 0 or names[n - 1] != name]


def _kind(data):
    found = re.search(
        rb"<(RegMsg|GetDeviceList|PermissionRequest|GetSensorInfo|StartTeleOp|SetTeleOp|StopTeleOp|EmergencyMsg)",
        bytes(data),
    )
    return found and found[1].decode()


def test_a_phone_drives_by_tilt(driving):
    robot = driving.robot()
    assert robot.controller.mode is Mode.TELEOPERATION
    assert robot.body.speed == pytest.approx(0.25, abs=0.03)
    phone = driving.phone()
    assert phone["registered"]
    assert phone["calibrated"]
    assert phone["device"] == robot.device.id_tag
    assert phone["level"] == "teleoperation"
    assert phone["speed_mps"] == pytest.approx(0.25, abs=0.02)
    assert phone["sensor_hz"] == pytest.approx(60.0, rel=0.05)
    assert phone["samples_lost"] == 0
    assert driving.seat()["phase"] == "driving"


def test_after_a_stop_it_shows_the_speed_of_a_robot_that_stands(driving):
    driving.held.tilt(10.3, 10.0)
    driving.let(1.0)
    assert driving.phone()["speed_mps"] > 0.2
    assert driving.phone()["radius_deg"] > 5
    assert driving.do("stop")[0]
    driving.let(1.0)
    assert (driving.phone()["speed_mps"], driving.phone()["radius_deg"]) == (0.0, 0)
    assert driving.phone()["reading"][0] > 4.0  # it is tilted still


def drive_of(page):
    return page.seat()["drives"][0]


def test_the_dissertations_app_asks_and_waits_unless_the_console_chooses(page):
    page.drives_by_tilt(pipeline="dissertation", then=2.0)
    assert drive_of(page)["pattern"] == "req-rep"
    assert page.robot().body.speed == pytest.approx(0.25, abs=0.05)
    assert drive_of(page)["answered"] == drive_of(page)["sent"] > 0
    assert page.do("pattern", robot=0, name="pub-sub")[0]
    assert page.do("start")[0]
    page.held.tilt(15.0)
    page.let(2.0)
    assert drive_of(page)["pattern"] == "pub-sub"
    assert drive_of(page)["answered"] == 0 < drive_of(page)["sent"]


def test_a_scenario_of_that_phone_is_driven_so_by_a_phone_without_a_calibration(monkeypatch):
    page = PhonePage(monkeypatch, phone={"profile": "dissertation"})
    assert page.world.scene()["phone"]["pipeline"] == "dissertation"
    page.register()
    page.permit()
    assert page.phone()["pipeline"] == "dissertation"
    assert drive_of(page)["pattern"] == "req-rep"
    assert page.do("release")[0]
    assert page.world.driven.pattern_of(page.robot().device.id_tag) == "latest-wins"


def test_a_steady_tilt_that_is_sent_once_is_no_lost_link_and_the_robots_end_ends_the_drive(page):
    page.drives_by_tilt(pipeline="dissertation", then=20.0)
    assert page.robot().body.speed == pytest.approx(0.0, abs=0.01)
    assert (page.seat()["alert"], drive_of(page)["silent_s"]) == ("", 0)
    page.let(20.0)  # the robot gives up after 30 s
    assert page.robot().controller.mode is Mode.IDLE
    assert "the robot has ended the drive" in page.seat()["alert"]
    assert page.seat()["phase"] == "held"
    assert page.do("start")[0]


def test_it_turns_left_for_a_phone_whose_left_edge_goes_down(driving):
    driving.held.tilt(5.0, 10.0)
    driving.let(1.5)
    assert driving.robot().body.turn_rate > 0.1
    driving.held.tilt(5.0, -10.0)
    driving.let(2.0)
    assert driving.robot().body.turn_rate < -0.1
    assert driving.phone()["radius_deg"] < 0


def test_the_messages_come_in_the_order_of_the_document(driving):
    dva = driving.world.run.dva.device.id_tag
    robot = driving.robot().device.id_tag
    assert driving.ask("phone_devices")["ok"]
    assert driving.do("stop")[0]
    driving.let(1.0)
    at_dva = kinds(driving, dva)
    assert [n for n in at_dva if n != "RegMsg"] == ["PermissionRequest", "GetDeviceList"]
    assert at_dva[0] == "RegMsg"
    messages = kinds(driving, robot)
    assert messages == ["GetSensorInfo", "StartTeleOp", "SetTeleOp", "StopTeleOp"]


def test_the_device_list_names_the_phone_and_the_robots(page):
    known = page.register(label="a phone")["phone"]
    assert known["label"] == "a phone"
    found = {one["label"]: one for one in page.ask("phone_devices")["devices"]}
    assert found["a phone"]["id"] == known["id"]
    assert found["a phone"]["type"] == "TeleOp"
    assert found["robot-1"]["type"] == "Robot"


def test_a_remote_control_drives_too_and_is_listed_as_what_it_is(page):
    assert page.register(kind="Remote Control", label="rc")["ok"]
    assert page.permit()["ok"]
    listed = {d["label"]: d["type"] for d in page.ask("phone_devices")["devices"]}
    assert listed["rc"] == "Remote Control"


def test_who_registers_as_a_robot_may_not_drive_and_is_told_so(page):
    assert page.register(kind="Robot", label="no robot")["ok"]
    answer = page.permit()
    assert not answer["ok"]
    assert unnamed(answer["text"], "teleoperation", "robot-1") == []
    page.let(30.0)
    assert page.phone()["registered"]


@pytest.mark.parametrize("address", ["192.168.0.2:5556", "10.0.0.1:5555", "example.org:5555"])
def test_at_another_address_nobody_answers_and_the_address_is_named(page, address):
    answer = page.register(address=address)
    assert not answer["ok"]
    assert address in answer["text"]
    assert not page.phone()["registered"]
    assert page.register()["ok"]


def test_the_second_who_asks_for_a_robot_is_told_who_holds_it(driving):
    assert driving.register(client="p2", label="second")["ok"]
    answer = driving.permit(client="p2")
    assert not answer["ok"]
    assert "phone p1" in answer["text"]
    assert driving.permit(1, client="p2")["ok"]


def test_one_phone_holds_one_robot(driving):
    assert driving.permit(1)["ok"]
    driving.let(3.0)
    assert driving.robot(0).controller.mode is Mode.IDLE
    assert driving.phone()["device"] == driving.robot(1).device.id_tag
    assert [drive["i"] for drive in driving.seat()["drives"]] == [1]


def test_a_permission_for_missions_does_not_drive(page):
    assert page.register()["ok"]
    assert page.permit(level="missions")["ok"]
    done, text = page.do("start")
    assert not done
    assert "permission is for missions" in text
    assert page.permit(level="both")["ok"]
    assert page.do("start")[0]


def test_a_phone_of_ios_and_a_turned_screen_tilt_the_same_way(page):
    assert page.register()["ok"]
    assert page.permit()["ok"]
    assert page.calibrate(ios=True, reference_mps2=[0.0, 0.0, -9.80665])["ok"]
    held = HeldPhone(page, ios=True, orientation=90)
    held.tilt(10.3, 5.0)
    page.let(1.0)
    assert page.phone()["reading"] == pytest.approx([5.0, 7.0], abs=0.4)
    assert page.do("start")[0]
    page.let(3.0)
    assert page.robot().body.speed > 0.2
    assert page.robot().body.turn_rate > 0.08


def test_readings_are_live_before_anybody_registers_or_calibrates(page):
    held = HeldPhone(page)
    held.tilt(20.6)
    page.let(1.0)
    phone = page.phone()
    assert not phone["registered"]
    assert not phone["calibrated"]
    assert phone["reading"][0] == pytest.approx(9.86, abs=0.3)
    held.tilt(30.0)
    page.let(1.0)
    assert page.phone()["reading"][0] > 13  # without limits
    assert page.phone()["speed_mps"] == 0.0  # nobody drives


@pytest.mark.parametrize("pipeline", ["default", "dissertation"])
@pytest.mark.parametrize("mapping", ["absolute", "differential", "leaky", "slew"])
def test_every_pipeline_and_mapping_drives(page, pipeline, mapping):
    # The document's app says nothing while nothing changes: the watchdog takes 3 s.
    page.drives_by_tilt(pipeline=pipeline, mapping=mapping, then=2.5)
    assert page.robot().body.speed == pytest.approx(0.25, abs=0.06)
    assert (page.phone()["pipeline"], page.phone()["mapping"]) == (pipeline, mapping)


def test_what_is_calibrated_in_a_drive_counts_from_the_next_one(driving):
    answer = driving.calibrate(speed_step_mps2=0.7)
    assert "next drive" in answer["text"]
    driving.let(1.0)
    assert driving.robot().body.speed == pytest.approx(0.25, abs=0.03)
    assert driving.do("stop")[0]
    driving.let(2.0)
    assert driving.do("start")[0]
    driving.let(3.0)
    assert driving.robot().body.speed == pytest.approx(0.125, abs=0.03)


@pytest.mark.parametrize(
    "other",
    [
        {"reference_mps2": [0.0, 0.0]},
        {"reference_mps2": [float("nan"), 0.0, 9.8]},
        {"speed_step_mps2": 0.0},
        {"max_delay_s": 6.0},
        {"pipeline": "mine.py:Mine"},
        {"filter": "../secret.py:Mine"},
        {"mapping": "cubic.py:Cubic"},
    ],
)
def test_a_calibration_that_makes_no_sense_is_refused_and_changes_nothing(page, other):
    answer = page.calibrate(**other)
    assert not answer["ok"]
    assert next(iter(other)) in answer["text"]
    phone = page.world.phones.by_client.get("p1")
    assert phone is None or not phone.settings.calibrated


def test_a_phone_can_be_steered_by_stick_and_by_tilt_again(driving):
    driving.held.tilt(0.0)
    driving.let(1.0)
    assert driving.robot().body.speed == pytest.approx(0.0, abs=0.03)
    driving.want(1.0)
    driving.let(2.0)
    assert driving.robot().body.speed == pytest.approx(0.5, abs=0.05)
    driving.wanted = {"speed": 0.0, "turn": 0.0, "held": False}
    driving.held.tilt(10.3)
    driving.let(2.0)
    assert driving.robot().body.speed == pytest.approx(0.25, abs=0.04)


@pytest.mark.system
def test_the_newest_sample_that_has_acted_is_told_and_how_long_it_took(driving):
    drive = driving.drive()
    assert 0 < drive["input"]["n"] <= driving.phone()["samples"]
    assert 0 < drive["loop_ms"] < 150
    assert drive["wanted"][0] == pytest.approx(0.25, abs=0.03)


def test_lost_samples_are_counted(driving):
    driving.held._count += 5
    driving.let(0.5)
    assert driving.phone()["samples_lost"] == 5


def test_the_scene_offers_what_a_phone_may_choose(page):
    scene = page.lines_of("scene")[0]
    assert scene["dva_address"] == "192.168.0.2:5555"
    assert set(scene["phone"]["pipelines"]) == {"default", "dissertation"}
    assert scene["phone"]["pipelines"]["dissertation"]["filter"] == "median20-copy"
    assert {"median", "one_pole"} <= set(scene["phone"]["filters"])
    assert scene["phone"]["mappings"] == ["absolute", "differential", "leaky", "slew"]
    assert CALIBRATION["mapping"] in scene["phone"]["mappings"]


def test_the_consoles_own_operator_tilts_a_phone_without_a_registration(monkeypatch):
    page = PhonePage(monkeypatch)
    assert page.do("take", robots=[0])[0]
    held = HeldPhone(page)
    held.tilt(0.0)
    page.let(1.0)
    assert page.calibrate()["ok"]
    assert page.do("start")[0]
    held.tilt(20.0)
    page.let(3.0)
    assert page.robot().body.speed > 0.2
    assert page.phone()["registered"] is False
    assert page.seat()["label"] == "console-1"
    held.put_away()
    page.let(2.0)
    assert page.robot().controller.mode is Mode.IDLE
    assert not page.world.recorder.violations


def test_who_sits_there_next_steers_without_that_phone(monkeypatch):
    page = PhonePage(monkeypatch)
    assert page.do("take", robots=[0])[0]
    held = HeldPhone(page)
    held.tilt(20.0)
    page.let(1.0)
    assert page.do("release")[0]
    page.let(2.0)
    assert page.do("take", robots=[0], client="c9")[0]
    page.let(2.0)
    assert page.do("start", client="c9")[0]
    page.let(3.0)
    assert page.robot().body.speed == pytest.approx(0.0, abs=0.01)


def answered(monkeypatch, **robot):
    """Times from a command to its reply [s], of a phone with the dissertation's pipeline."""
    page = PhonePage(monkeypatch, pattern="req-rep", **robot)
    page.drives_by_tilt(pipeline="dissertation", filter=None, then=0.0)
    for n in range(30):  # what does not change is not sent again
        page.held.tilt(8.0 + n % 2 * 4.0)
        page.let(1.0)
    return [trip for drive in page.world.recorder.drives for trip in drive.round_trips]


@pytest.mark.system
def test_with_the_dissertations_phone_and_pibot_a_reply_takes_seconds(monkeypatch):
    assert max(answered(monkeypatch, robot__profile="pibot", robot__processing_s=None)) > 1.0


def test_with_the_dissertations_phone_and_the_service_robot_it_stays_below_one(monkeypatch):
    trips = answered(monkeypatch, robot__profile="servrobot")
    assert len(trips) > 5
    assert max(trips) < 1.0
