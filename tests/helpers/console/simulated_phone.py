"""A phone at a console's world in virtual time: what its page does, and a hand that tilts it."""

import math

import numpy as np
from helpers.console.simulated_console import Page

from dva_sim.agents.tilt import Accelerometer, Hand, load_part
from dva_sim.agents.tilt.device_axes import to_device_axes

FIRE = [{"kind": "fire", "room": "North office", "at_s": 2, "latest_s": 2, "reported": True}]
CALIBRATION = {
    "reference_mps2": [0.0, 0.0, 9.80665],
    "speed_step_mps2": 0.35,
    "turn_step_mps2": 0.12,
    "max_delay_s": 0.5,
    "pipeline": "default",
    "filter": None,
    "mapping": "absolute",
}


class HeldPhone:
    """A phone in a simulated hand: samples by its own clock, in its own axes.

    Args:
        page: Page of the run.
        client: The name of its page.
        hz: Samples per second.
        fast: By which share its clock goes too fast.
        ios: True if its signs are those of iOS.
        orientation: Orientation of its screen [deg].
    """

    def __init__(self, page, client="p1", hz=60.0, fast=0.0, ios=False, orientation=0, part=None):
        rng = np.random.default_rng(len(client) + ord(client[-1]))
        self.page, self.client, self.fast = page, client, fast
        self.ios, self.orientation, self.hand = ios, orientation, True
        self._part = Accelerometer(load_part(part or "perfect"), rng, rate_hz=hz, jitter=0.1)
        self._hand = Hand(0.15, rng, tremor=math.radians(0.1))
        self._aim, self._count = (0.0, 0.0), 0
        self._next = page.world.clock.now + self._part.interval()
        self.step, self.on, self.sent = 1.0 / hz, False, []
        page.world.clock.every(0.035, self._send)

    def tilt(self, pitch_deg, roll_deg=0.0):
        """Aim at angles away from flat: forwards, and to the left."""
        self._aim, self.on = (math.radians(pitch_deg), math.radians(roll_deg)), True

    def put_away(self):
        """Say nothing more."""
        self.on = False

    def _send(self):
        now, at, xyz = self.page.world.clock.now, [], []
        while self._next <= now:
            tilt = self._part.sample(*self._hand.step(*self._aim, self.step))
            at.append(1000.0 * (7.25 + self._next * (1.0 + self.fast)))
            xyz.append(list(to_device_axes(tilt, self.orientation, self.ios)))
            self._next += self._part.interval()
        if self.on and at:
            self.say(at, xyz)
        self._count += len(at)

    def say(self, at, xyz, **other):
        """Send samples."""
        line = {"do": "samples", "client": self.client, "n": self._count, "at": at, "xyz": xyz}
        line |= {"hand": self.hand, "orientation": self.orientation}
        self.sent.append(line | other)
        self.page.actions.take(line | other)


class PhonePage(Page):
    """A console's world, and a phone that takes part in it."""

    def __init__(self, monkeypatch, client="p1", **changes):
        super().__init__(monkeypatch, client=client, **changes)
        self.world.run.network.delivered = self._note(self.world.run.network.delivered)

    def _note(self, usual):
        self.heard = []

        def delivered(now, source, to, payload):
            self.heard.append((source, to, payload))
            usual(now, source, to, payload)

        return delivered

    def register(self, client=None, label="BQ Curie 2", kind="Teleoperation", address=None):
        """Register a phone; the whole answer."""
        server, port = (address or self.world.phones.address).split(":")
        about = {"server": server, "port": int(port), "label": label, "type": kind}
        return self.ask("phone_register", client=client, **about)

    def permit(self, robot=0, level="teleoperation", client=None):
        """Ask for a robot."""
        device = self.robot(robot).device.id_tag
        return self.ask("phone_permission", client=client, device=device, level=level)

    def calibrate(self, client=None, **other):
        """Calibrate."""
        return self.ask("phone_calibrate", client=client, **CALIBRATION | other)

    def drives_by_tilt(self, client=None, robot=0, then=3.0, **calibration):
        """Everything up to a robot that goes straight on; the phone in the hand."""
        assert self.register(client, label=f"phone {client or self.client}")["ok"]
        assert self.permit(robot, client=client)["ok"]
        assert self.calibrate(client, **calibration)["ok"]
        self.held = HeldPhone(self, client or self.client)
        self.held.tilt(10.3)  # five levels of 0.35 m/s^2
        self.let(1.0)
        assert self.do("start", client=client)[0]
        self.let(then)
        return self.held

    def ask(self, what, /, client=None, **about):
        """An action, and its whole answer."""
        self.do(what, within=60.0, client=client, **about)
        return self.lines_of("done")[-1]

    def phone(self, client=None):
        """The phone's part of its newest line."""
        mine = client or self.client
        return next(x for x in reversed(self.lines_of("seat")) if x["seat"] == mine)["phone"]
