"""A simulated phone: a small touch screen, and a sensor with readings from the test."""

from collections.abc import Callable
from typing import Any

from playwright.sync_api import Page, expect

UPRIGHT = (0.0, 6.9, 6.9)  # how it is held, half upright [m/s^2]
FORWARDS = (0.0, 5.5, 8.1)  # four levels of speed; browsers round to tenths
LEFT_FORWARDS = (1.8, 5.5, 7.9)  # and 15 degrees/s to the left
KINDS = ("accelerometer", "linear-acceleration", "gyroscope")

LISTEN = """() => { window.sent = []; const send = WebSocket.prototype.send;
WebSocket.prototype.send = function (text) {
  if (window.hangs) return;
  window.sent.push(JSON.parse(text)); return send.call(this, text); };
  window.ends = []; const Plain = window.WebSocket;
  window.WebSocket = class extends Plain {
    constructor(...a) { super(...a); window.ends.push(this);
      this.addEventListener('message', (e) => window.hangs && e.stopImmediatePropagation()); } };
  window.shaken = []; navigator.vibrate = (what) => window.shaken.push(what); }"""
HIDE = """Object.defineProperty(document, 'hidden', {value: true, configurable: true});
document.dispatchEvent(new Event('visibilitychange'));
Object.defineProperty(document, 'hidden', {value: false, configurable: true});
document.dispatchEvent(new Event('visibilitychange'));"""


class Hand:
    """A phone's page, and the sensor under it.

    Args:
        visit: A browser.
        address: Address of the phone's page, with its token.
        sensor: True if there is a sensor.
    """

    def __init__(self, visit: Any, address: str, sensor: bool = True, script: str = "") -> None:
        self.page: Page = visit.tab()
        self.page.add_init_script(f"({LISTEN})()")
        if script:
            self.page.add_init_script(script)
        self.debugger = visit.context.new_cdp_session(self.page)
        if sensor:
            about = {"available": True, "minimumFrequency": 1, "maximumFrequency": 60}
            for kind in KINDS:
                asked = {"enabled": True, "type": kind, "metadata": about}
                self.debugger.send("Emulation.setSensorOverrideEnabled", asked)
            self.tilt(UPRIGHT)
        self.page.goto(address)
        expect(self.page.get_by_role("link", name="Authentication")).to_be_visible()
        if sensor:
            self.tilt(UPRIGHT)

    def tilt(self, acceleration: tuple[float, float, float]) -> None:
        """Hold it so."""
        reading = {"xyz": dict(zip("xyz", acceleration, strict=True))}
        for kind in KINDS:
            asked = {"type": kind, "reading": reading}
            self.debugger.send("Emulation.setSensorOverrideReadings", asked)

    def tap(self, name: str, role: Any = "button") -> None:
        """Tap something by its whole name."""
        self.page.get_by_role(role, name=name, exact=True).tap()

    def go(self, screen: str) -> None:
        """To a screen by its address, as a link would lead there."""
        self.page.evaluate(f"location.hash = '#/{screen.lower()}'")
        expect(self.page.get_by_role("heading", name=screen, level=1)).to_be_visible()

    def sent(self, what: str) -> list[dict[str, Any]]:
        """Requests of one kind that the page has sent."""
        return [line for line in self.page.evaluate("window.sent") if line.get("do") == what]

    def status(self, name: str) -> Any:
        return self.page.get_by_role("status", name=name, exact=True)

    def alert(self, text: str) -> None:
        """Expect an alert with this text."""
        found = self.page.get_by_role("alert").filter(has_text=text)
        expect(found.first).to_be_visible()

    # --- the story -----------------------------------------------------------------------

    def register(self, label: str = "my phone") -> None:
        self.go("Authentication")
        self.page.get_by_label("Device label").fill(label)
        self.tap("Register")
        expect(self.page.get_by_role("button", name="Get device list")).to_be_enabled()

    def take(self, robot: str = "robot-1", level: str = "teleoperation") -> None:
        """Ask for the permission to drive a robot."""
        self.tap("Get device list")
        device = self.page.get_by_label("Device", exact=True)
        expect(device).to_be_enabled()
        value = device.locator("option", has_text=f"= {robot}@").get_attribute("value")
        device.select_option(value)
        self.page.get_by_label("Permission level").select_option(level)
        self.tap("Get Permission Level")

    def calibrate(self) -> None:
        self.go("Calibration")
        expect(self.page.get_by_role("button", name="Calibrate", exact=True)).to_be_enabled()
        self.tap("Calibrate")
        expect(self.status("Calibration")).to_contain_text("Calibrated")

    def drive(self, robot: str = "robot-1", label: str = "my phone") -> None:
        """Everything up to a robot that listens."""
        self.hold(robot, label)
        self.calibrate()
        self.go("Teleoperation")
        self.start()

    def hold(self, robot: str = "robot-1", label: str = "my phone") -> None:
        """Be given a robot."""
        self.register(label)
        self.take(robot)
        expect(self.page.get_by_text("is in your hands")).to_be_visible()

    def start(self) -> None:
        """Start to drive, again after a refusal because the machine is still busy with the page."""
        self.tap("Start")
        stop = self.page.get_by_role("button", name="Stop", exact=True, disabled=False)
        late = self.page.get_by_role("alert").filter(has_text="cannot keep up with real time")
        expect(stop.or_(late)).to_be_visible()
        if late.count():
            late.get_by_role("button", name="Dismiss").tap()
            expect(self.status("Doing")).not_to_contain_text("behind real time")
            self.tap("Start")
        self.is_driving()

    def is_driving(self, driving: bool = True) -> None:
        """Wait until the phone drives, or until it does not."""
        name = "Stop" if driving else "Start"
        expect(self.page.get_by_role("button", name=name, exact=True)).to_be_enabled()

    def speed(self, mps: str) -> None:
        """Expect this reading on the page."""
        expect(self.status("Speed")).to_have_text(f"Speed: {mps}m/s")

    def leave(self) -> None:
        """Give the robot back, for the next test."""
        self.go("Authentication")
        give = self.page.get_by_role("button", name="Give it back")
        if give.count():
            give.dispatch_event("click")  # wherever alerts push it
            expect(give).to_have_count(0)

    def swipe(self, far: int, hold: bool = False) -> Callable[[], None]:
        """Move a finger over the picture, downwards if positive; how it is lifted."""
        box = self.page.locator(".surface").bounding_box()
        assert box
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2 - far / 2
        touch = self.debugger.send
        touch("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [{"x": x, "y": y}]})
        for step in (1, 2, 3, 4):
            at = [{"x": x, "y": y + far * step / 4}]
            touch("Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": at})

        def lift() -> None:
            touch("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})

        if not hold:
            lift()
        return lift
