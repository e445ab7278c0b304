"""Whatever ends a phone's drive ends it at once and for good, and nothing it says does harm."""

import json
import math
from contextlib import suppress

import pytest
from helpers.console.simulated_phone import PhonePage
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dva_sim.agents.robot.controller import Mode
from dva_sim.console.phones.phone_input import samples_of
from dva_sim.console.wire.actions import ACTIONS
from dva_sim.console.wire.kinds import BadMessage


@pytest.fixture
def page(monkeypatch):
    return PhonePage(monkeypatch)


@pytest.fixture
def driving(page):
    page.drives_by_tilt()
    assert page.robot().body.speed > 0.2
    return page


def send_nonsense(page):
    page.held.put_away()
    page.world.clock.every(0.03, lambda: page.held.say([1.0], [[math.nan, 0.0, 9.8]]))


def send_the_past(page):
    page.held.put_away()
    page.world.clock.every(0.03, lambda: page.held.say([1e3], [[0.0, -3.0, 9.0]]))


@pytest.mark.parametrize(
    ("end", "within", "why"),
    [
        (lambda page: page.held.put_away(), 0.5, "silent for 0.3 s"),
        (lambda page: setattr(page.held, "hand", False), 0.1, "thumb was lifted"),
        (lambda page: setattr(page.held, "orientation", 90), 0.1, "screen has turned"),
        (send_nonsense, 0.5, "silent"),
        (send_the_past, 0.5, "silent"),
        (lambda page: page.actions.take({"client": "p1", "do": "gone"}), 0.05, "hidden"),
        (lambda page: page.do("stop"), 0.1, ""),
        (lambda page: page.do("emergency"), 0.1, ""),
        (lambda page: page.do("emergency", client="another", robots="all"), 0.3, "emergency"),
        (lambda page: page.do("release"), 0.1, ""),
        (lambda page: page.world.clock.on_late(0.3), 0.05, "behind real time"),
    ],
)
def test_what_ends_a_drive_ends_it_at_once_and_for_good(driving, end, within, why):
    log = driving.world.recorder.drives[-1]
    then = driving.world.clock.now
    end(driving)
    driving.let(2.5)
    assert log.ended - then < within
    driving.held.hand, driving.held.on = True, True
    driving.let(2.0)
    assert driving.robot().controller.mode is Mode.IDLE
    assert driving.robot().body.speed == pytest.approx(0.0, abs=1e-3)
    assert why in driving.seat()["alert"]


def test_who_was_stopped_starts_again_by_a_new_start_only(driving):
    driving.held.hand = False
    driving.let(2.5)
    driving.held.hand = True
    driving.let(1.0)
    assert driving.robot().controller.mode is Mode.IDLE
    assert driving.do("start")[0]
    driving.let(3.0)
    assert driving.robot().body.speed > 0.2


def test_an_emergency_goes_out_before_session_and_calibration(page):
    page.do("take", robots=[0], client="c1")
    page.do("start", client="c1")
    page.client = "c1"
    page.want(0.5)
    page.let(3.0)
    assert page.robot().body.speed > 0.2
    assert page.register("p1")["ok"]
    done, text = page.do("emergency", robots=["robot-1"], client="p1")
    assert done
    assert "robot-1 has stopped" in text
    page.let(2.0)
    assert page.robot().controller.mode is Mode.IDLE
    sent = [x for x in page.heard if x[0].startswith("02:00:00:06") and b"<EmergencyMsg" in x[2]]
    assert sent


def test_a_robot_that_refuses_an_emergency_has_not_stopped(page):
    assert page.register(kind="Robot", label="no robot")["ok"]
    page.let(3.0)
    done, text = page.do("emergency", robots="all")
    assert not done
    assert "no robot has not stopped" in text


def test_an_emergency_names_a_robot_or_is_for_ones_own(page):
    assert page.register()["ok"]
    done, text = page.do("emergency")
    assert not done
    assert "No robot was named." in text


def test_without_registration_there_are_neither_lists_nor_permissions(page):
    wish = {"device": page.robot().device.id_tag, "level": "both"}
    for what, about in (("phone_devices", {}), ("phone_permission", wish)):
        answer = page.ask(what, **about)
        assert not answer["ok"]
        assert "Register this phone" in answer["text"]


def test_a_page_that_is_gone_for_good_leaves_the_dva_and_its_robot(driving):
    driving.held.put_away()
    goodbye = {"id": "bye-release-p1", "client": "p1", "do": "release"}
    driving.actions.take(goodbye)
    driving.let(3.0)
    assert driving.robot().controller.mode is Mode.IDLE
    assert driving.register("p2", label="next")["ok"]
    assert driving.permit(client="p2")["ok"]
    driving.let(30.0)
    listed = {d["label"] for d in driving.ask("phone_devices", client="p2")["devices"]}
    assert "phone p1" not in listed
    assert "next" in listed
    assert driving.seat()["phone"] is None


def test_who_registers_again_has_one_device_and_its_drive_is_over(driving):
    old = driving.phone()["id"]
    assert driving.register(label="renamed")["ok"]
    driving.let(2.0)
    assert driving.robot().controller.mode is Mode.IDLE
    assert driving.phone()["id"] != old
    assert driving.permit()["ok"]


@pytest.mark.system
def test_ids_are_given_out_again_and_nothing_grows_without_end(page):
    devices = len(page.world.run.stage.devices)
    for n in range(20):
        assert page.register(f"x{n % 3}", label=f"{n}")["ok"]
    page.let(125.0)
    assert len(page.world.run.stage.devices) <= devices + 3
    assert len(page.world.seating.persons) == 4  # the console's, and three phones


@pytest.mark.parametrize("label", ["", "x" * 65, "\x00", "line\nbreak", 7, None, ["a"]])
def test_a_label_that_is_none_is_refused_in_words(page, label):
    answer = page.register(label=label)
    assert not answer["ok"]
    assert answer["text"]
    assert not page.phone()["registered"] if page.lines_of("seat") else True


@pytest.mark.parametrize("label", ["<script>alert(1)</script>", "a & b", "телефон ☎", '"'])
def test_a_label_is_data(page, label):
    assert page.register(label=label)["ok"]
    assert page.phone()["label"] == label
    assert label in {d["label"] for d in page.ask("phone_devices")["devices"]}


NUMBERS = st.one_of(
    st.floats(), st.integers(), st.sampled_from([10**400, -(10**400), 1e308, True, None, "1", [1]])
)
MESSAGES = st.fixed_dictionaries(
    {},
    optional={
        "n": NUMBERS,
        "at": st.one_of(NUMBERS, st.lists(NUMBERS, max_size=70)),
        "xyz": st.one_of(NUMBERS, st.lists(st.lists(NUMBERS, max_size=4), max_size=70)),
        "hand": NUMBERS,
        "orientation": st.one_of(NUMBERS, st.sampled_from([0, 90, 180, 270])),
    },
)
TIMES = st.lists(st.floats(0, 1e13), min_size=1, max_size=8, unique=True).map(sorted)
TRIPLES = st.tuples(*[st.floats(-400, 400)] * 3).map(list)
SOUND = TIMES.flatmap(
    lambda at: st.fixed_dictionaries(
        {
            "n": st.integers(0, 2**53),
            "at": st.just(at),
            "xyz": st.lists(TRIPLES, min_size=len(at), max_size=len(at)),
            "hand": st.booleans(),
            "orientation": st.sampled_from([0, 90, 180, 270]),
        }
    )
)


@given(MESSAGES)
def test_any_message_is_samples_or_nothing(message):
    with suppress(BadMessage):
        reported = samples_of(ACTIONS["samples"].read(message))
        assert len(reported.at) == len(reported.xyz) <= 64
        assert all(math.isfinite(x) for one in reported.xyz for x in one)


@given(st.dictionaries(st.sampled_from(["reference_mps2", "speed_step_mps2", "pipeline"]), NUMBERS))
def test_any_calibration_is_one_or_refused(message):
    with pytest.raises(BadMessage):
        ACTIONS["phone_calibrate"].read(message)


@pytest.mark.system
@settings(max_examples=10, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.lists(st.one_of(SOUND, MESSAGES), min_size=1, max_size=12))
def test_no_stream_of_samples_breaks_the_world_or_leaves_its_limits(stream):
    with pytest.MonkeyPatch.context() as patch:
        page = PhonePage(patch)
        page.drives_by_tilt().put_away()
        for message in stream:
            page.actions.take({**message, "do": "samples", "client": "p1"})
            page.let(0.1)
            json.dumps(page.phone(), allow_nan=False)
        assert 0.0 <= page.robot().set_point.speed <= 0.5
        assert abs(page.robot().set_point.turn_rate) <= math.pi / 6 + 1e-9
        page.let(2.0)
        assert page.robot().body.speed == pytest.approx(0.0, abs=1e-3)
