"""Taking a robot, holding to drive, letting go, and everything that interrupts."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from helpers.console.driving_page import free_all, release, start, take
from helpers.processes.patience import becomes
from playwright.sync_api import Locator, Page, expect


@pytest.fixture
def page(console, shared) -> Iterator[Page]:
    """The page for driving, its robot taken and started."""
    page = shared(console().drive, "drive")
    listen(page)
    begin(page)
    yield page
    release(page)


def begin(page: Page) -> None:
    take(page)
    start(page)


def listen(page: Page) -> None:
    """Note what the page sends to steer by."""
    page.evaluate(
        """() => { const heard = window.sent; window.sent = [];
        if (heard) return;
        const send = WebSocket.prototype.send;
        WebSocket.prototype.send = function (text) {
          window.sent.push(JSON.parse(text)); return send.call(this, text); }; }"""
    )


def dragged(page: Page, slider: Locator) -> tuple[float, float, float]:
    """A pointer holds a slider in its middle: its left end, its width, its height on the page."""
    box = slider.bounding_box()
    assert box
    x, width, y = box["x"], box["width"], box["y"] + box["height"] / 2
    page.mouse.move(x + 0.5 * width, y)
    page.mouse.down()
    assert becomes(lambda: inputs(page) and inputs(page)[-1]["held"])
    return x, width, y


def inputs(page: Page) -> list[dict[str, object]]:
    """Steering input sent so far."""
    return [line for line in page.evaluate("window.sent") if line.get("do") == "input"]


def actions(page: Page) -> list[str]:
    """Actions requested so far."""
    return [line["do"] for line in page.evaluate("window.sent") if line.get("do") != "ping"]


@contextmanager
def held(page: Page, key: str) -> Iterator[None]:
    """A key, as long as the block lasts."""
    page.keyboard.down(key)
    yield
    page.keyboard.up(key)


@pytest.mark.parametrize(
    ("keys", "speed", "turn"),
    [
        (["ArrowUp"], 1, 0),
        (["KeyW"], 1, 0),
        (["ArrowUp", "ArrowLeft"], 1, 1),
        (["KeyW", "KeyD"], 1, -1),
        (["ArrowLeft", "ArrowRight"], 0, 0),
        (["Shift", "ArrowUp"], 0.4, 0),
        (["ArrowDown"], 0, 0),  # there is no reverse
    ],
)
def test_keys_steer_while_they_are_held(page, keys, speed, turn):
    for key in keys:
        page.keyboard.down(key)
    assert becomes(lambda: len(inputs(page)) > 5)
    last = inputs(page)[-1]
    assert (last["speed"], last["turn"], last["held"]) == (speed, turn, True)

    for key in keys:
        page.keyboard.up(key)
    assert becomes(lambda: inputs(page)[-1]["held"] is False)
    assert inputs(page)[-1]["speed"] == 0


def test_a_robot_moves_while_a_key_is_held(page):
    with held(page, "ArrowUp"):
        expect(page.locator(".stop-reason")).to_contain_text("Set point 0.50 m/s")
        expect(page.get_by_role("slider", name="Speed")).to_have_value("0.5")
    expect(page.get_by_role("slider", name="Speed")).to_have_value("0")


@pytest.mark.parametrize(
    "interruption",
    [
        "window.dispatchEvent(new Event('blur'))",
        "window.dispatchEvent(new Event('pagehide'))",
        "document.dispatchEvent(new Event('freeze'))",
        "Object.defineProperty(document, 'hidden', {value: true, configurable: true});"
        "document.dispatchEvent(new Event('visibilitychange'));"
        "Object.defineProperty(document, 'hidden', {value: false, configurable: true});",
        "screen.orientation.dispatchEvent(new Event('change'))",
    ],
)
def test_what_interrupts_stops_at_once_and_a_held_key_does_not_go_on(page, interruption):
    with held(page, "ArrowUp"):
        assert becomes(lambda: inputs(page))
        page.evaluate(interruption)
        assert becomes(lambda: "gone" in actions(page))
        assert inputs(page)[-1]["held"] is False
        count = len(inputs(page))
        page.keyboard.down("ArrowUp")  # the repeat of a key that is still down
        page.wait_for_timeout(200)
        assert len(inputs(page)) == count
        expect(page.locator(".hint")).to_contain_text("hold again")


def test_a_new_press_drives_again_after_an_interruption(page):
    with held(page, "ArrowUp"):
        assert becomes(lambda: inputs(page))
        page.evaluate("window.dispatchEvent(new Event('blur'))")
    expect(page.get_by_role("status", name="Mode")).to_have_text("Idle")
    start(page)
    with held(page, "ArrowUp"):
        assert becomes(lambda: inputs(page)[-1]["held"] is True)


def test_the_focus_goes_on_to_the_button_that_comes_next(page):
    page.get_by_role("button", name="Stop", exact=True).focus()
    page.keyboard.press("Enter")
    expect(page.get_by_role("status", name="Mode")).to_have_text("Idle")
    page.get_by_role("button", name="Start", exact=True).focus()
    page.keyboard.press("Enter")
    expect(page.get_by_role("button", name="Start", exact=True)).to_be_disabled()
    expect(page.get_by_role("button", name="Stop", exact=True)).to_be_focused()


def test_the_stick_steers_while_a_pointer_holds_it(page):
    box = page.locator(".stick").bounding_box()
    assert box
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 0.21 * box["width"], y - box["height"])
    assert becomes(lambda: inputs(page) and inputs(page)[-1]["speed"] == 1)
    assert inputs(page)[-1]["turn"] == pytest.approx(-0.5, abs=0.03)  # to the right
    page.mouse.up()
    assert becomes(lambda: inputs(page)[-1]["held"] is False)


def test_a_slider_springs_back_when_the_pointer_lets_it_go(page):
    slider = page.get_by_role("slider", name="Speed")
    dragged(page, slider)
    assert inputs(page)[-1]["speed"] == pytest.approx(0.5, abs=0.05)
    page.mouse.up()
    assert becomes(lambda: inputs(page)[-1]["held"] is False)
    expect(slider).to_have_value("0")


def test_a_slider_set_by_assistive_technology_counts_while_it_has_the_focus(page):
    page.get_by_role("slider", name="Speed").fill("0.3")
    assert becomes(lambda: inputs(page) and inputs(page)[-1]["held"])
    page.get_by_role("slider", name="Turn rate").fill("-15")  # to the right
    assert becomes(lambda: inputs(page)[-1]["turn"] == pytest.approx(-0.5, abs=0.02))

    page.get_by_role("button", name="Stop", exact=True).focus()
    assert becomes(lambda: inputs(page)[-1]["held"] is False)


def test_keys_of_a_slider_spring_back_too(page):
    slider = page.get_by_role("slider", name="Speed")
    slider.focus()
    page.keyboard.down("ArrowRight")
    assert becomes(lambda: inputs(page) and inputs(page)[-1]["held"])
    page.keyboard.up("ArrowRight")
    assert becomes(lambda: inputs(page)[-1]["held"] is False)


def test_a_second_key_does_not_wait_for_the_next_turn_to_send(console, visit):
    page = visit.open(console().drive, "drive")
    listen(page)
    begin(page)
    page.clock.install()
    page.clock.pause_at("2030-01-01")
    page.evaluate(
        """() => { for (const code of ['ArrowUp', 'ArrowLeft'])
        window.dispatchEvent(new KeyboardEvent('keydown', {code})); }"""
    )
    page.clock.run_for(15)  # a turn is 40 ms

    assert [(line["speed"], line["turn"]) for line in inputs(page)] == [(1, 0), (1, 1)]
    page.clock.resume()
    release(page)


PADS = "pad => { window.pad = pad; navigator.getGamepads = () => [window.pad]; }"


def test_a_gamepad_steers_while_its_shoulder_button_is_held(page):
    def pad(pressed: bool, *axes: float) -> dict[str, object]:
        buttons = [{"pressed": pressed and number == 5} for number in range(8)]
        return {"connected": True, "id": "a pad", "axes": axes, "buttons": buttons}

    page.evaluate(PADS, pad(False, -0.55, -1.0))
    expect(page.locator(".keys")).to_contain_text("a shoulder button of the gamepad")
    assert inputs(page) == []  # its dead man is not held

    page.evaluate(PADS, pad(True, -0.55, -1.0))
    assert becomes(lambda: inputs(page) and inputs(page)[-1]["held"])
    assert inputs(page)[-1]["speed"] == 1
    assert inputs(page)[-1]["turn"] == pytest.approx(0.5)  # to the left
    page.evaluate(PADS, pad(True, 0.09, 0.09))  # a stick that rests
    assert becomes(lambda: inputs(page)[-1]["speed"] == 0)
    assert (inputs(page)[-1]["turn"], inputs(page)[-1]["held"]) == (0, True)

    page.evaluate(PADS, None)
    assert becomes(lambda: "gone" in actions(page))
    expect(page.locator(".hint")).to_contain_text("The gamepad was disconnected.")


def test_input_comes_25_times_a_second_while_something_is_held(page):
    with held(page, "ArrowUp"):
        assert becomes(lambda: len(inputs(page)) > 40)
    numbers = [line["n"] for line in inputs(page)]

    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))


def test_emergency_stop_and_its_key_stop_all_robots(page):
    for press in (
        lambda: page.get_by_role("button", name="Emergency stop").click(),
        lambda: page.keyboard.press("Shift+Escape"),
    ):
        with page.expect_response("**/api/emergency") as answer:
            press()
        assert answer.value.json()["ok"]
        assert '"all"' in (answer.value.request.post_data or "")
        expect(page.get_by_role("status", name="Mode")).to_have_text("Emergency")
        free_all(page)
        start(page)


@pytest.mark.parametrize("end", ["key", "button", "stop"])
def test_a_key_held_since_before_a_stop_does_not_drive_at_the_next_start(page, end):
    with held(page, "ArrowLeft"):
        assert becomes(lambda: inputs(page) and inputs(page)[-1]["turn"] == 1)
        if end == "key":
            page.keyboard.press("Shift+Escape")
        else:
            name = "Stop" if end == "stop" else "Emergency stop"
            page.get_by_role("button", name=name, exact=True).click()
        if end != "stop":
            free_all(page)
        expect(page.get_by_role("status", name="Mode")).to_have_text("Idle")
        expect(page.get_by_role("slider", name="Turn rate")).to_have_value("0")
        count = len(inputs(page))
        start(page)
        page.keyboard.down("ArrowLeft")  # the repeat of a key that is still down
        page.wait_for_timeout(200)
        assert [line for line in inputs(page)[count:] if line["held"]] == []
    with held(page, "ArrowLeft"):
        assert becomes(lambda: inputs(page)[-1]["turn"] == 1)


def test_a_slider_dragged_since_before_a_stop_stays_at_zero_until_it_is_let_go(page):
    slider = page.get_by_role("slider", name="Speed")
    x, width, y = dragged(page, slider)
    page.keyboard.press("Shift+Escape")
    expect(page.get_by_role("status", name="Mode")).to_have_text("Emergency")
    count = len(inputs(page))
    page.mouse.move(x + 0.7 * width, y)
    page.mouse.move(x + 0.9 * width, y)
    expect(slider).to_have_value("0")
    assert [line for line in inputs(page)[count:] if line["held"]] == []
    page.mouse.up()
    free_all(page)
    slider.click()
    assert becomes(lambda: any(line["held"] for line in inputs(page)[count:]))


def test_two_robots_get_the_same_hand_under_two_patterns(console, shared):
    page = shared(console().drive, "drive")
    listen(page)
    page.get_by_role("button", name="Add robot-2").click()
    page.get_by_label("Pattern of robot-1").select_option("req-rep")
    page.get_by_label("Pattern of robot-2").select_option("latest-wins")
    begin(page)
    mode = page.get_by_role("status", name="Mode")
    expect(mode).to_have_text("robot-1 Teleoperation, robot-2 Teleoperation")
    taken = [line for line in page.evaluate("window.sent") if line.get("do") == "take"]
    assert taken[0]["robots"] == [0, 1]
    with held(page, "ArrowUp"):
        for place in (0, 1):
            expect(page.locator(".stop-reason").nth(place)).to_contain_text("Set point 0.50 m/s")
    expect(page.get_by_role("img", name="What robot-2 sees")).to_be_visible()
    release(page)
    expect(mode).not_to_contain_text("Teleoperation")


def test_a_reload_keeps_control_but_drives_no_further(page):
    who = page.evaluate("sessionStorage.getItem('dva-sim-client')")
    with held(page, "ArrowUp"):
        assert becomes(lambda: inputs(page))
        page.reload()
        expect(page.get_by_role("button", name="Release control")).to_be_enabled()
        expect(page.get_by_role("slider", name="Speed")).to_have_value("0")
    assert page.evaluate("sessionStorage.getItem('dva-sim-client')") == who


def test_the_picture_tells_its_age_and_goes_on(page):
    picture = page.get_by_role("img", name="What robot-1 sees")
    expect(page.locator(".picture-age")).to_contain_text("s old")
    first = picture.get_attribute("data-frame")

    assert becomes(lambda: picture.get_attribute("data-frame") != first)


def test_charts_draw_what_was_measured(page):
    region = page.get_by_role("region", name="Latency")
    expect(region.locator("canvas")).to_have_count(3)
    assert becomes(lambda: "ms" in region.locator(".figures b").first.inner_text())
    assert becomes(lambda: page.evaluate(COLOURED) > 20)


COLOURED = """() => { const c = document.querySelector('.latency canvas');
  const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; let n = 0;
  for (let i = 0; i < d.length; i += 4)
    if (d[i + 3] > 200 && Math.max(d[i], d[i+1], d[i+2]) - Math.min(d[i], d[i+1], d[i+2]) > 90) n++;
  return n; }"""
