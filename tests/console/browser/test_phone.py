"""The five screens of a phone, by an emulated sensor and touch: the whole story, and its ends."""

from collections.abc import Iterator

import pytest
from helpers.console.browser_phone import FORWARDS, HIDE, LEFT_FORWARDS, Hand
from helpers.console.changed_lines import HOSTILE, renamed, sockets_of
from helpers.console.console_program import PHONES, Addresses
from helpers.console.desk import NOTHING_YET
from helpers.processes.patience import becomes
from playwright.sync_api import expect

WORDS = *PHONES, *NOTHING_YET, "--set=guard.kind=person", "--set=request.timeout_s=0.5"
SCREEN = {"width": 360, "height": 740, "has_touch": True, "is_mobile": True}


DVA = "192.168.0.2", "5555"  # its modelled address
STATE = "fetch('/api/state').then((answer) => answer.json())"


@pytest.fixture
def running(console) -> Addresses:
    return console(*WORDS)


@pytest.fixture
def hand(running, visits) -> Iterator[Hand]:
    """A phone at its menu; it gives its robot back in the end."""
    one = Hand(visits(**SCREEN), running.phone)
    yield one
    print("alerts of the phone:", one.page.get_by_role("alert").all_inner_texts())
    one.leave()


def set_speed(hand: Hand) -> float:
    """Set point of the first robot, as published."""
    return float(hand.page.evaluate(STATE)["robots"][0]["set_speed_mps"])


def driving(hand: Hand) -> bool:
    return hand.page.get_by_role("button", name="Stop", exact=True).is_enabled()


def test_eight_taps_lead_from_the_scan_to_a_robot_that_moves(hand):
    page = hand.page
    hand.tap("Authentication", "link")
    hand.tap("Register")
    hand.tap("Get device list")
    expect(page.get_by_label("Device", exact=True)).to_be_enabled()
    hand.tap("Get Permission Level")
    hand.tap("Go on: Calibration", "link")
    hand.tap("Calibrate")
    expect(hand.status("Calibration")).to_have_text("Calibrated.")
    hand.tap("Continue: Teleoperation", "link")
    hand.swipe(-200)  # the eighth
    hand.tilt(FORWARDS)
    hand.speed("0.20")
    asked = [line["do"] for line in page.evaluate("window.sent") if "id" in line]
    steps = ("phone_register", "phone_devices", "phone_permission", "phone_calibrate", "start")
    assert asked == [*steps]


def test_tilting_drives_and_a_swipe_down_stops(hand):
    hand.drive()
    hand.tilt(LEFT_FORWARDS)
    expect(hand.status("Radius")).to_have_text("Radius: 15°")
    hand.speed("0.20")
    expect(hand.status("Link")).to_contain_text("ms")
    assert becomes(lambda: set_speed(hand) > 0.1)
    hand.swipe(200)
    hand.is_driving(False)
    assert becomes(lambda: set_speed(hand) == 0)
    assert len(hand.sent("stop")) == 1
    assert [80] in hand.page.evaluate("window.shaken")
    hand.swipe(-200)
    hand.is_driving()


def test_the_dissertations_app_names_its_pattern_and_tells_a_steady_tilt_from_a_lost_link(hand):
    hand.hold()
    hand.go("Calibration")
    hand.page.get_by_label("Pipeline").select_option("dissertation")
    hand.calibrate()
    hand.go("Teleoperation")
    expect(hand.status("Pattern")).to_have_text("REQ/REP")
    hand.start()
    hand.tilt(FORWARDS)
    hand.speed("0.20")
    expect(hand.status("Doing")).to_contain_text("This pipeline sends a steady tilt only once")
    expect(hand.status("Link")).to_contain_text("ms")
    hand.tap("Stop")
    hand.speed("0.00")


def test_a_turn_of_the_screen_ends_the_drive_without_a_red_box(hand):
    hand.drive()
    hand.page.evaluate("screen.orientation.dispatchEvent(new Event('change'))")
    hand.alert("The screen was rotated. The robot was stopped.")
    expect(hand.page.locator(".alerts .warning")).to_have_count(0)


def test_samples_are_raw_numbered_and_bear_the_phones_own_times(hand):
    hand.drive()
    assert becomes(lambda: len(hand.sent("samples")) > 40)
    lines = hand.sent("samples")
    times = [at for line in lines for at in line["at"]]
    assert times == sorted(set(times))
    counts = [line["n"] for line in lines]
    assert counts[0] == 0
    for line, after in zip(lines, counts[1:], strict=False):
        assert after == line["n"] + len(line["at"])
    assert all(len(line["at"]) == len(line["xyz"]) <= 64 for line in lines)
    assert lines[-1]["xyz"][-1] == [0, 6.9, 6.9]
    assert (lines[-1]["orientation"], lines[-1]["hand"]) == (0, True)
    asked = hand.sent("phone_calibrate")[0]
    assert asked["reference_mps2"] == pytest.approx([0, 6.9, 6.9])
    wanted = {"speed_step_mps2": 0.35, "turn_step_mps2": 0.12, "max_delay_s": 0.5, "ios": False}
    wanted |= {"pipeline": "default", "filter": None, "mapping": "absolute"}
    assert {name: asked[name] for name in wanted} == wanted


INTERRUPTIONS = (
    (HIDE, "hidden"),
    ("window.dispatchEvent(new Event('pagehide'))", "left"),
    ("screen.orientation.dispatchEvent(new Event('change'))", "rotated"),
    ("document.dispatchEvent(new Event('freeze'))", "left"),
    ("window.dispatchEvent(new Event('orientationchange'))", "rotated"),
    ("window.dispatchEvent(new Event('blur'))", "focus"),
)


def test_what_takes_the_phone_from_the_hand_ends_the_drive_for_good(hand):
    hand.drive()
    for count, (interruption, why) in enumerate(INTERRUPTIONS, start=1):
        hand.tilt(FORWARDS)
        assert becomes(lambda: set_speed(hand) > 0.1)
        hand.page.evaluate(interruption)
        hand.is_driving(False)
        hand.alert(why)
        assert len(hand.sent("gone")) == count, interruption
        hand.page.wait_for_timeout(400)  # samples go on, and drive nothing
        assert not driving(hand)
        assert set_speed(hand) == 0
        assert len(hand.sent("start")) == count, interruption
        hand.start()


def test_a_page_that_stands_still_for_a_moment_does_not_blame_the_sensor(hand):
    hand.drive()
    hand.page.evaluate(
        "{ const from = performance.now(); while (performance.now() < from + 450); }"
    )
    hand.tilt(FORWARDS)
    assert becomes(lambda: hand.sent("samples")[-1]["xyz"][-1] == [*FORWARDS])
    assert hand.sent("gone") == []


def test_a_sensor_that_falls_silent_ends_the_drive(hand):
    hand.drive()
    hand.page.evaluate(
        "window.addEventListener('devicemotion', (e) => e.stopImmediatePropagation(), true)"
    )
    for kind in ("accelerometer", "linear-acceleration", "gyroscope"):
        hand.debugger.send("Emulation.setSensorOverrideEnabled", {"enabled": False, "type": kind})
    hand.is_driving(False)
    assert not driving(hand)


def test_with_hold_to_drive_lifting_the_thumb_stops(hand):
    hand.hold()
    hand.calibrate()
    hand.page.get_by_label("Hold to drive").check()
    hand.go("Teleoperation")
    hand.is_driving(False)
    lift = hand.swipe(-200, hold=True)
    hand.is_driving()
    hand.tilt(FORWARDS)
    hand.speed("0.20")
    assert hand.sent("samples")[-1]["hand"] is True
    lift()
    hand.is_driving(False)
    hand.alert("You lifted your thumb")
    assert becomes(lambda: hand.sent("samples")[-1]["hand"] is False)


def test_leaving_the_screen_stops_and_a_reload_drives_no_further(hand):
    hand.drive()
    hand.tap("‹ Main", "link")
    assert becomes(lambda: hand.sent("gone"))
    hand.go("Teleoperation")
    hand.is_driving(False)
    hand.start()
    hand.page.reload()
    expect(hand.page.get_by_role("heading", name="Teleoperation")).to_be_visible()
    hand.is_driving(False)
    assert hand.sent("start") == []


def test_a_socket_that_is_cut_in_mid_drive_ends_it(hand):
    hand.drive()
    hand.tilt(FORWARDS)
    hand.speed("0.20")
    hand.page.evaluate("window.ends.forEach((socket) => socket.close())")
    assert becomes(lambda: [300, 100, 300] in hand.page.evaluate("window.shaken"))
    hand.alert("The link to the console was lost")
    hand.is_driving(False)
    assert not driving(hand)


def test_a_connection_that_hangs_is_lost_after_three_attempts_and_the_robot_is_kept(hand):
    """Simulates a tunnel: no data in either direction, and no socket reports a close."""
    hand.drive()
    hand.page.evaluate("window.hangs = true")
    hand.alert("link lost")
    expect(hand.status("Link")).to_have_text("link lost")
    assert [300, 100, 300] in hand.page.evaluate("window.shaken")
    hand.page.evaluate("window.hangs = false")
    hand.is_driving(False)
    assert not driving(hand)
    assert len(hand.sent("phone_register")) == len(hand.sent("start")) == 1


UNREACHED = """() => { window.stops = []; window.usual = window.fetch;
window.fetch = (url, about) => url === '/api/emergency'
  ? (window.stops.push(JSON.parse(about.body).id), Promise.reject(new TypeError('no network')))
  : window.usual(url, about); }"""


def test_an_emergency_stop_whose_request_reaches_nobody_goes_over_the_socket(hand):
    hand.drive()
    hand.page.evaluate(UNREACHED)
    hand.tap("Emergency stop")
    assert becomes(lambda: not driving(hand))
    assert becomes(lambda: len(hand.sent("emergency")) == 1)
    assert hand.page.evaluate("window.stops") == [hand.sent("emergency")[0]["id"]]
    expect(hand.page.get_by_text("not confirmed")).to_have_count(0)


def test_an_emergency_stop_is_asked_for_again_in_red_until_it_is_confirmed(hand):
    hand.drive()
    hand.page.evaluate(UNREACHED)
    hand.page.evaluate("window.hangs = true")
    hand.tap("Emergency stop")
    hand.alert("Emergency stop not confirmed")
    hand.alert("Attempt 4")
    stops = hand.page.evaluate("window.stops")
    assert len(stops) >= 3
    assert len(set(stops)) == 1  # it is done once
    hand.page.evaluate("() => { window.fetch = window.usual; }")
    expect(hand.page.get_by_text("not confirmed")).to_have_count(0)
    hand.page.evaluate("window.hangs = false")
    assert becomes(lambda: not driving(hand))


def test_each_step_opens_the_next_and_wrong_fields_are_marked(hand):
    hand.go("Authentication")
    page = hand.page
    for name in ("Get device list", "Get Permission Level"):
        expect(page.get_by_role("button", name=name)).to_be_disabled()
    page.get_by_label("Server IP").fill("")
    page.get_by_label("Port").fill("70000")
    page.get_by_label("Device label").fill("  ")
    hand.tap("Register")
    for field in ("Server IP", "Port", "Device label"):
        expect(page.get_by_label(field)).to_have_attribute("aria-invalid", "true")
    assert hand.sent("phone_register") == []
    page.get_by_label("Server IP").fill("10.9.8.7")
    page.get_by_label("Port").fill("5600")
    page.get_by_label("Device label").fill("my phone")
    hand.tap("Register")
    hand.alert("no DVA answers at 10.9.8.7:5600")
    expect(page.get_by_role("button", name="Get device list")).to_be_disabled()
    page.get_by_label("Server IP").fill(DVA[0])
    page.get_by_label("Port").fill(DVA[1])
    hand.tap("Register")
    expect(page.get_by_role("button", name="Get device list")).to_be_enabled()
    expect(page.get_by_role("button", name="Get Permission Level")).to_be_disabled()
    hand.tap("Get device list")
    entry = page.get_by_label("Device", exact=True).locator("option", has_text="robot-1")
    expect(entry).to_have_text("Robot = robot-1@192.168.1.2(02:00:00:01:00:01)")
    expect(page.get_by_role("button", name="Get Permission Level")).to_be_enabled()


def test_choices_stay_on_the_phone(hand):
    hand.register("BQ Curie 2")
    hand.go("Calibration")
    hand.page.get_by_label("Force").fill("0,5")
    hand.page.get_by_label("Mapping").select_option("leaky")
    hand.tap("Calibrate")
    hand.page.reload()
    expect(hand.page.get_by_label("Force")).to_have_value("0.5")
    expect(hand.page.get_by_label("Mapping")).to_have_value("leaky")
    kept = hand.page.evaluate("JSON.parse(localStorage.getItem('dva-sim-phone'))")
    assert (kept["label"], kept["server"], kept["port"]) == ("BQ Curie 2", *DVA)


def test_who_registers_as_a_robot_may_not_drive_and_is_told_so(hand):
    hand.go("Authentication")
    hand.page.get_by_label("Device type").select_option("Robot")
    hand.tap("Register")
    hand.take()
    hand.alert("may not have teleoperation of robot-1")
    hand.go("Teleoperation")
    hand.alert("permission")


def test_of_two_phones_the_second_is_told_who_drives(hand, running, visits):
    hand.drive("robot-2", "first phone")
    other = Hand(visits(**SCREEN), running.phone)
    other.register("second phone")
    other.take("robot-2")
    other.alert("robot-2: held by first phone")
    other.take("robot-3")
    expect(other.page.get_by_text("is in your hands")).to_be_visible()
    other.calibrate()
    other.go("Teleoperation")
    other.start()
    hand.tilt(FORWARDS)
    other.tilt(LEFT_FORWARDS)
    expect(hand.status("Radius")).to_have_text("Radius: 0°")
    expect(other.status("Radius")).to_have_text("Radius: 15°")
    with other.page.expect_request("**/api/emergency") as asked:
        other.tap("Emergency stop")
    assert asked.value.post_data_json["robots"] == [2]  # robot-3, its own, alone
    other.is_driving(False)
    other.leave()


def is_of_its_own(response):
    is_stop = response.url.endswith("/api/emergency")
    return is_stop and response.request.post_data_json["robots"] == [0]


def test_emergency_stop_works_from_every_screen_first_of_all_robots_then_of_its_own(hand):
    stop = hand.page.get_by_role("button", name="Emergency stop")
    expect(hand.page.get_by_text("Stops all robots.")).to_be_visible()
    with hand.page.expect_response("**/api/emergency") as answer:
        stop.tap()
    assert '"robots":"all"' in (answer.value.request.post_data or "")
    hand.hold()
    for screen in ("Main", "Authentication", "Calibration", "Instructions"):
        hand.go(screen)
        # A robot of another test may not have confirmed yet, and is stopped again meanwhile.
        with hand.page.expect_response(is_of_its_own) as answer:
            stop.tap()
        assert answer.value.json()["ok"], screen


def test_without_a_sensor_the_stick_keys_and_gamepad_steer(running, visits):
    hand = Hand(visits(**SCREEN), running.phone, sensor=False)
    hand.register()
    hand.take()
    hand.go("Calibration")
    hand.alert("no sensor")
    hand.tap("Calibrate")
    expect(hand.status("Calibration")).to_have_text("Calibrated.")
    assert hand.sent("phone_calibrate")[0]["reference_mps2"] is None
    hand.go("Teleoperation")
    hand.start()
    hand.page.keyboard.down("ArrowUp")
    hand.speed("0.50")
    hand.page.keyboard.up("ArrowUp")
    hand.speed("0.00")
    box = hand.page.locator(".stick").bounding_box()
    assert box
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    at = [{"x": x, "y": y - box["height"]}]
    touch = hand.debugger.send
    touch("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [{"x": x, "y": y}]})
    touch("Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": at})
    hand.speed("0.50")
    hand.page.evaluate(HIDE)
    hand.is_driving(False)
    assert hand.sent("samples") == []
    hand.leave()


DENIED = """DeviceMotionEvent.requestPermission = async () => 'denied';
const add = window.addEventListener;
window.addEventListener = function (kind, ...rest) {
  if (!kind.startsWith('device')) add.call(this, kind, ...rest); };"""


def test_a_sensor_that_may_not_be_read_is_told_with_the_way_out(running, visits):
    hand = Hand(visits(**SCREEN), running.phone, sensor=False, script=DENIED)
    hand.go("Calibration")
    hand.tap("Turn on the sensor")
    hand.alert("no sensor: this page has no permission to read it")
    hand.alert("steer by the stick")


TAP_FIRST = """let asked = false; window.asked = 0; const add = window.addEventListener;
DeviceMotionEvent.requestPermission = async () => {
  if (!navigator.userActivation.isActive) throw new Error('no tap');
  window.asked += 1; asked = true; return 'granted'; };
window.addEventListener = function (kind, hear, ...rest) {
  add.call(this, kind, (e) => (asked || !kind.startsWith('device')) && hear(e), ...rest); };"""


def test_a_phone_that_wants_a_tap_first_is_asked_by_calibrate_and_again_by_start(running, visits):
    hand = Hand(visits(**SCREEN), running.phone, script=TAP_FIRST)
    hand.register()
    hand.take()
    hand.go("Calibration")
    expect(hand.status("Sensor")).to_contain_text("asks before it shares")
    hand.tap("Calibrate")
    expect(hand.status("Calibration")).to_have_text("Calibrated.")
    assert hand.sent("phone_calibrate")[0]["reference_mps2"] == pytest.approx([0, 6.9, 6.9])
    hand.go("Teleoperation")
    hand.page.reload()
    start = hand.page.get_by_role("button", name="Start", exact=True)
    expect(start).to_be_enabled()
    expect(hand.page.get_by_role("status", name="Doing")).to_contain_text("asks before it shares")
    start.tap()
    hand.is_driving()
    assert hand.page.evaluate("window.asked") == 1
    hand.leave()


ANGLES = """const add = window.addEventListener;
window.addEventListener = function (kind, ...rest) {
  if (kind !== 'devicemotion') add.call(this, kind, ...rest); };"""


def test_where_motion_is_missing_angles_become_what_gravity_would_be(running, visits):
    hand = Hand(visits(**SCREEN), running.phone, sensor=False, script=ANGLES)
    hand.register()
    hand.go("Calibration")
    for beta, gamma in ((90, 0), (0, 0), (0, -90)):
        angles = {"alpha": 0, "beta": beta, "gamma": gamma}
        hand.debugger.send("DeviceOrientation.setDeviceOrientationOverride", angles)
        hand.page.wait_for_timeout(150)
    assert becomes(lambda: hand.sent("samples"))
    read = [xyz for line in hand.sent("samples") for xyz in line["xyz"]]
    for wanted in ([0, 9.8067, 0], [0, 0, 9.8067], [9.8067, 0, 0]):
        assert any(xyz == pytest.approx(wanted, abs=0.001) for xyz in read), wanted


SCRIPT = "<script>alert(1)</script>"


def test_a_hostile_label_is_shown_as_text(running, visits):
    one = visits(**SCREEN)
    for name in ("state", "drive"):
        sockets_of(one.context, name, renamed("robot-2", SCRIPT))
    hand = Hand(one, running.phone)
    hand.register(HOSTILE)
    expect(hand.page.get_by_text(f"{HOSTILE} is registered")).to_be_visible()
    hand.take(SCRIPT)
    expect(hand.page.get_by_text(f"{SCRIPT} is in your hands")).to_be_visible()
    hand.leave()


def test_by_https_the_page_is_secure_and_its_sensor_works(running, visits):
    """The browser is made to accept the certificate; curl and Python verify it elsewhere."""
    hand = Hand(visits(**SCREEN, ignore_https_errors=True), running.phones)
    assert hand.page.url.startswith("https://")
    assert "token" not in hand.page.url
    assert hand.page.evaluate("isSecureContext")
    hand.drive("robot-3")
    hand.tilt(FORWARDS)
    hand.speed("0.20")
    hand.leave()


def test_a_certificate_that_is_not_trusted_lets_no_browser_in(running, visits):
    page = visits(**SCREEN).context.new_page()
    with pytest.raises(Exception, match="ERR_CERT_AUTHORITY_INVALID"):
        page.goto(running.phones)


def test_a_wrong_token_leads_to_a_page_of_words(running, visits):
    page = visits(**SCREEN).context.new_page()
    answer = page.goto(f"{running.base}phone?token=wrong")
    assert answer is not None
    assert answer.status == 401
    assert "token" in page.inner_text("body")


def test_the_consoles_page_shows_the_code_to_who_may_drive(running, visits):
    page = visits().open(running.drive)
    page.get_by_role("button", name="Phone").click()
    code = page.get_by_role("img", name="QR code of the address for phones")
    expect(code).to_be_visible()
    assert becomes(lambda: code.evaluate("image => image.naturalWidth") > 100)
    expect(page.get_by_role("dialog")).to_contain_text(running.phones)
    page.get_by_role("button", name="Close").click()
    expect(code).to_have_count(0)
    other = visits().open(running.look)
    expect(other.get_by_text("you may look")).to_be_visible()
    expect(other.get_by_role("button", name="Phone")).to_have_count(0)


def test_the_consoles_address_leads_to_the_phones_screens(running, visits):
    page = visits(**SCREEN).tab()
    page.goto(f"{running.drive}#/phone/calibration")
    expect(page.get_by_role("heading", name="Calibration", level=1)).to_be_visible()
    page.goto(f"{running.base}#/guard")
    expect(page.get_by_role("heading", name="Who are you?")).to_be_visible()


def test_who_may_drive_needs_no_second_registration(running, visits):
    hand = Hand(visits(**SCREEN), running.drive.replace("/?", "/phone?"))
    hand.go("Authentication")
    hand.page.get_by_label("Robot", exact=True).select_option(label="robot-1")
    hand.tap("Take control")
    expect(hand.page.get_by_text("is in your hands")).to_be_visible()
    hand.calibrate()
    hand.go("Teleoperation")
    hand.start()
    hand.tilt(FORWARDS)
    hand.speed("0.20")
    assert hand.sent("phone_register") == []
    hand.tap("Stop")
    hand.leave()
