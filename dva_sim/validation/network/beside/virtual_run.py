"""A run of a middleware scenario in virtual time, measured as the real one is.

The operator's program is that of the real run, the robot's needs the same time for every message.
The link has the seed of the real run: outages, bursts in time and the moment of a recorded link are
the same ones. Losses packet by packet are not, since a packet more or less would shift them all.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from typing_extensions import override

from dva_sim.kernel.clock import Clock
from dva_sim.network.emulator.forwarder import links_of
from dva_sim.network.link import Link, PartedLink
from dva_sim.network.middleware import load_transport
from dva_sim.network.pattern_runs import RunLog
from dva_sim.network.workload import Note, NoteKind, OperatorWorkload
from dva_sim.simulation.measures.commands import Row
from dva_sim.simulation.measures.middleware import command_row
from dva_sim.simulation.middleware import MiddlewareScenario
from dva_sim.simulation.middleware.run import LINGER_S, Window
from dva_sim.validation.network.beside.carriers import Act, BetweenPrograms, make_carrier

PROGRAM_S = 0.0005
"""From the arrival of a command's last packet to its application: assumed. It also decides what
comes first where a round trip is a whole number of periods."""
STARTS_S = (0.3, 1.0)
ENDS_S = (0.0, 0.6)
"""Start of the programs after the link, and time the operator's takes to end: assumed ranges,
uniform."""


class ProgramTimes(NamedTuple):
    """Start of both programs in the time of the link, and time a program takes to end [s]."""

    near: float
    far: float
    ending: float

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> ProgramTimes:
        """Return some, by chance."""
        return cls(rng.uniform(*STARTS_S), rng.uniform(*STARTS_S), rng.uniform(*ENDS_S))


class CountedLink(PartedLink):
    """A link that knows how many bytes have left it by when."""

    def __init__(self, whole: Link) -> None:
        super().__init__(whole, ())
        self._passed: list[tuple[float, int]] = []

    @override
    def carry(self, now: float, size: int) -> float | None:
        arrival = super().carry(now, size)
        if arrival is not None:
            self._passed.append((arrival, size))
        return arrival

    def passed_bytes(self, by: float) -> int:
        """Return the number of bytes that have left the link by a time [s]."""
        return sum(size for arrival, size in self._passed if arrival <= by)


class VirtualRun:
    """Both programs over a carrier.

    Args:
        scenario: Scenario with messages and transport; the model must support the transport.
        seed: Random seed of the link.
        times: Start times and durations of the programs.
    """

    def __init__(self, scenario: MiddlewareScenario, seed: int, times: ProgramTimes) -> None:
        self._scenario = scenario
        self._times = times
        since = scenario.set_up_s
        self._window = Window(0.0, since, since + scenario.measure_s)
        self._clock = Clock()
        up, down = links_of(scenario.link, seed, by_packet=False)
        self._up = CountedLink(up)
        self._down = CountedLink(down)
        pictures = scenario.pictures
        between = BetweenPrograms(
            self._clock,
            self._up,
            self._down,
            0 if pictures is None else pictures.bytes,
            self._hear,
            lambda number: None,
        )
        transport = load_transport(scenario.transport.name, scenario.transport.options)()
        self._carrier = make_carrier(transport, between)
        self._operator = OperatorWorkload(
            self._clock, self._carrier, self._note, scenario.command_rate_hz
        )
        self._notes: list[Note] = []
        self._pictures = 0

    def play(self) -> Row:
        """Return the measures of the run, by the columns of a real one."""
        clock = self._clock
        window = self._window
        times = self._times
        end = window.until + times.ending + LINGER_S
        clock.call_at(max(times.near, times.far), self._carrier.open, self._begin)
        if self._scenario.pictures is not None:
            clock.call_at(times.far, self._take_picture, 1.0 / self._scenario.pictures.rate_hz)
        clock.run(end)
        robot = self._scenario.robot
        return {
            **command_row(
                *RunLog.of(self._notes).arrivals(),
                window,
                max_age_s=robot.max_age_s,
                watchdog_s=robot.watchdog_s,
            ),
            "up_bytes": self._up.passed_bytes(end),
            "down_bytes": self._down.passed_bytes(end),
        }

    def _note(self, kind: NoteKind, number: int, at: float | None = None) -> None:
        self._notes.append(Note(kind, number, self._clock.now))

    def _begin(self) -> None:
        """Begin on a connection that stands; after too long a wait the program has given up."""
        if self._clock.now < self._window.since:
            self._operator.start(self._window.until)

    def _hear(self, number: int, answer: Act) -> None:
        self._clock.call_after(PROGRAM_S, self._obey, number, answer)

    def _obey(self, number: int, answer: Act) -> None:
        self._note(NoteKind.APPLIED, number)
        answer()

    def _take_picture(self, period: float) -> None:
        self._pictures += 1
        self._carrier.picture(self._pictures)
        self._clock.call_after(period, self._take_picture, period)
