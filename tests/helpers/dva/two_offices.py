"""Two DVAs of one street, west and east of 50 m, whose messages reach each other at once or not."""

from __future__ import annotations

import numpy as np
from helpers.dva.dispatch_office import DEGREE_EAST, HERE, crow, east

from dva_sim.core.assignments import Rules
from dva_sim.core.dispatch import MinEta
from dva_sim.core.regions.division import Division
from dva_sim.core.regions.help import event_told
from dva_sim.core.regions.regional_dva import RegionalDva
from dva_sim.core.sessions import Permissions, Send, Sessions
from dva_sim.protocol import messages as m

WEST, EAST = "02:00:00:00:00:01", "02:00:00:00:00:02"
BORDER = 50.0  # [m]
LINES = {"west": (WEST, EAST), "east": (EAST, WEST)}
ADDRESS = "192.168.1.9"


def metres(place: m.Position) -> float:
    return (place.longitude - HERE.longitude) * DEGREE_EAST


def region_at(place: m.Position) -> str:
    return "west" if metres(place) < BORDER else "east"


def outside(region: str, place: m.Position) -> float:
    beyond = metres(place) - BORDER
    return max(0.0, beyond if region == "west" else -beyond)


class Street:
    """Two cores; all that they want said is in `sent`, and what is for the other one arrives.

    Attributes:
        parted: True to let nothing through between the two.
        sent: All messages: from whom, and what.
    """

    def __init__(self, rules: Rules | None = None) -> None:
        self.now = 0.0
        self.number = 0
        self.parted = False
        self.dead: set[str] = set()
        self.sent: list[tuple[str, Send]] = []
        self._rules = rules or Rules()
        self.cores = {dva: self.new_core(dva) for dva in (WEST, EAST)}
        for dva, other in ((WEST, EAST), (EAST, WEST)):
            self.register(dva, other, "DVA")

    def new_core(self, own: str, life: int = 0) -> RegionalDva:
        """A core that knows nobody yet."""
        sessions = Sessions(Permissions(lambda: 0, own=own))
        division = Division(own, LINES, region_at, outside, life)
        rng = np.random.default_rng(1)
        return RegionalDva(
            MinEta(), crow, self._rules, rng=rng, sessions=sessions, division=division
        )

    def say(self, to: str, source: str, body: m.Body, session: int = 0) -> m.Reply:
        self.number += 1
        message = m.Message(to, self.number, source, "12:00:00", session, body)
        reply, sends = self.cores[to].handle(message, self.now)
        self.deliver(to, sends)
        return reply

    def publish(self, to: str, source: str, body: m.Body) -> None:
        self.number += 1
        message = m.Message(to, self.number, source, "12:00:00", 0, body)
        self.deliver(to, self.cores[to].note(message, self.now))

    def deliver(self, dva: str, sends: list[Send]) -> None:
        for send in sends:
            self.sent.append((dva, send))
            reaches = send.to not in self.cores or not (self.parted or send.to in self.dead)
            if send.to in self.cores and reaches:
                reply = self.say(send.to, dva, send.body)
                reaches = reply.code == m.OK or event_told(send.body) is not None
            core = self.cores[dva]
            again = core.delivered if reaches else core.undelivered
            self.deliver(dva, again(send, self.now))

    def register(self, dva: str, device: str, kind: str) -> None:
        assert self.say(dva, device, m.Registration(device, kind, ADDRESS)).code == m.OK

    def guard(self, dva: str, device: str, at: float) -> None:
        """Register a guard, and tell where it is [m]."""
        if device not in self.cores[dva].registry.entries:
            self.register(dva, device, "Guard")
        self.publish(dva, device, m.PersonStatus("waiting", east(at)))

    def tick(self, seconds: float, *heard: str) -> None:
        """Let time pass; these devices, and DVAs that reach each other, are heard each second."""
        for _ in range(int(seconds)):
            self.now += 1.0
            for dva, core in self.cores.items():
                if dva in self.dead:
                    continue
                other = EAST if dva == WEST else WEST
                if not self.parted and other not in self.dead:
                    status = self.cores[other].peer_status(self.now)
                    self.publish(dva, other, status)
                for device in heard:
                    core.registry.heard(device, self.now)
                self.deliver(dva, core.tick(self.now))

    def fire(self, dva: str, source: str, at: float) -> m.Reply:
        return self.say(dva, source, m.EventReport(None, "fire", east(at), 0.5, 0.9, "detected"))

    def told(self, device: str, kind: type) -> list[m.Body]:
        return [s.body for _, s in self.sent if s.to == device and isinstance(s.body, kind)]
