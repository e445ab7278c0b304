"""A console's world and what a page would do with it.

Over modelled links without real time: pulses come by virtual time, so that nothing has to wait.
"""

import time

from helpers.console.declared_lines import checked

from dva_sim.cameras.lines import PaintersLine
from dva_sim.console.world.run_actions import RunActions
from dva_sim.console.world.world import ConsoleWorld
from dva_sim.kernel.clock import US
from dva_sim.network.realtime import PacedClock
from dva_sim.simulation.scenario import build, load


class VirtualPace(PacedClock):
    """A paced clock whose real time is set by the test."""

    def pulse(self, period, action):
        def beat():
            action()

        self.every(period, beat)

    def run(self, until):
        while self.env.peek() <= round(until * US):
            self.step()
        self._set(max(self._now_us, round(until * US)))

    def _catch_up(self, end):
        pass


class Page:
    """Actions of a page, and the lines it receives.

    Args:
        measured: True to keep everything for tables.
        changes: Changes of the scenario, with `__` for a dot; by default without bystanders.
    """

    def __init__(
        self,
        monkeypatch,
        scenario="hands-on",
        seed=1,
        client="c1",
        sockets=None,
        measured=False,
        **changes,
    ):
        document = load(scenario) if isinstance(scenario, str) else scenario
        changes = {key.replace("__", "."): value for key, value in changes.items()}
        changes.setdefault("bystander.count", 0)
        clock = VirtualPace() if sockets is None else PacedClock()
        scenario = build(document, changes)
        self.world = ConsoleWorld(scenario, "a test", seed, clock, sockets, measured)
        if sockets is None:
            monkeypatch.setattr(time, "monotonic", lambda: self.world.clock.now)
        self.lines, self.frames, self.client = [], [], client
        self.world.tell = lambda line, key="": self.lines.append(checked(line))
        self.world.show = lambda line, key="": self.frames.append(checked(line, PaintersLine))
        self.actions = RunActions(self.world)
        self.world.begin()
        self.are_open(client)
        self.wanted, self._count = None, 0
        self.world.clock.every(0.03, self._want)

    def are_open(self, *clients, role="drive"):
        """Say which pages are open."""
        self.actions.take({"do": "here", "pages": dict.fromkeys(clients, role)})

    def do(self, what, /, within=30.0, client=None, **about):
        """Send an action; return its answer."""
        self._count += 1
        number = f"action {self._count}"
        self.actions.take({"id": number, "client": client or self.client, "do": what, **about})
        end = self.world.clock.now + within
        while self.world.clock.now < end:
            for line in self.lines_of("done"):
                if line["id"] == number:
                    return line["ok"], line["text"]
            self.let(0.01)
        raise AssertionError(f"{what}: no answer within {within} s")

    def sets_out(self, speed=None, turn=0.0, robots=(0,), then=0.0):
        """Take robots, start, and want something for a while."""
        assert self.do("take", robots=list(robots))[0]
        assert self.do("start")[0]
        if speed is not None:
            self.want(speed, turn)
        self.let(then)

    def want(self, speed, turn=0.0):
        """Hold on, and want this from now on."""
        self.wanted = {"speed": speed, "turn": turn, "held": True}

    def let_go(self):
        self.wanted = None

    def let(self, seconds):
        self.world.clock.run(self.world.clock.now + seconds)

    def until(self, seen, within=60.0, step=0.1):
        """Let time pass until a condition holds."""
        end = self.world.clock.now + within
        while not seen():
            assert self.world.clock.now < end, f"not so within {within} s"
            self.let(step)

    def lines_of(self, kind):
        return [line for line in self.lines if line["k"] == kind]

    def robot(self, number=0):
        return list(self.world.run.field.robots.values())[number]

    def seat(self):
        return [line for line in self.lines_of("seat") if line["seat"] == self.client][-1]

    def drive(self, number=0):
        return self.seat()["drives"][number]

    def _want(self):
        if self.wanted is not None:
            self._count += 1
            line = {"client": self.client, "do": "input", "n": self._count, **self.wanted}
            self.actions.take(line)
