"""A DVA killed while events are open, and restarted from its memory."""

from pathlib import Path

import pytest

from dva_sim.core.events import Event, State
from dva_sim.core.store import Store
from dva_sim.simulation.full.control_room import add_dva
from dva_sim.simulation.full.dva_server import DvaAgent
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.stage import DVA
from dva_sim.simulation.scenario import build

pytestmark = pytest.mark.system

EVENTS = [
    {"kind": "fire", "at_s": 5, "reported": True, "hazard": {"growth": "slow"}},
    {"kind": "gas_leak", "at_s": 10, "reported": True},
    {"kind": "flood", "at_s": 15, "reported": True},
]
HORIZON, DEADLINE = 900.0, 600.0


class Killed:
    """A run whose DVA dies at some times and is back some seconds later."""

    def __init__(self, folder: Path, times: list[float], away: float, **changes: object) -> None:
        team = {"guard": {"count": 2}, "robot": {"count": 1}, "operator": {"count": 1}}
        dispatch = {"containment": True, "escalate_after_s": DEADLINE}
        data = {**team, "events": EVENTS, "dispatch": dispatch, "horizon_s": HORIZON}
        self.run = Run(build(data, changes), seed=2)
        self.file = folder / "dva.sqlite"
        self.dva = self._start()
        clock = self.run.clock
        for time in times:
            clock.call_at(time, self._kill)
            clock.call_at(time + away, self._back)
        end = times[-1] + away
        while clock.now < HORIZON and (clock.now < end or not self.is_over):
            clock.run(clock.now + 10.0)

    def _start(self) -> DvaAgent:
        dva = add_dva(self.run.stage, memory=Store(self.file))
        dva.start()
        self.run.dva = dva
        return dva

    def _kill(self) -> None:
        """From now on nobody hears of it, and it hears nobody."""
        self.run.network.leave(DVA)
        self.dva.device.silent = True  # the audit sees that it is down
        self.dva.device.ask = lambda *_, **__: None  # type: ignore[method-assign]
        self.dva._memory = None

    def _back(self) -> None:
        self.dva = self._start()
        self.run.network.come_back(DVA)

    @property
    def is_over(self) -> bool:
        return len(self.events) == len(EVENTS) and not any(event.open for event in self.events)

    @property
    def events(self) -> list[Event]:
        events = self.dva.core.events
        return sorted((*events.open.values(), *events.closed.values()), key=lambda e: e.number)


@pytest.mark.parametrize(
    "time",
    [17.0, *(pytest.param(t, marks=pytest.mark.soak) for t in (11.0, 30.0, 60.0, 90.0, 120.0))],
)
def test_every_event_is_dealt_with_once_whenever_the_dva_is_killed(tmp_path, time):
    killed = Killed(tmp_path, [time], away=5.0)
    assert [e.kind for e in killed.events] == ["fire", "gas_leak", "flood"]
    assert [e.state for e in killed.events] == [State.CONTAINED] * 3
    assert sorted(killed.run.field.contained) == [0, 1, 2]
    assert killed.run.recorder.violations == {}


@pytest.mark.invariant("S8")
def test_a_dva_that_is_killed_again_and_again_loses_nothing(tmp_path):
    killed = Killed(tmp_path, [12.0, 25.0, 41.0, 66.0, 93.0, 128.0], away=3.0)
    assert [e.kind for e in killed.events] == ["fire", "gas_leak", "flood"]
    assert [e.state for e in killed.events] == [State.CONTAINED] * 3
    assert killed.dva.core.events.total == 3


def test_neither_kills_nor_a_link_that_loses_leave_an_event_hanging(tmp_path):
    killed = Killed(tmp_path, [20.0, 70.0], 4.0, **{"link.loss": 0.1, "link.delay_s": 0.1})
    assert killed.is_over


@pytest.mark.invariant("S6")
def test_what_is_detected_while_the_dva_is_away_is_reported_until_it_is_there(tmp_path):
    """It is away for longer than three attempts last."""
    killed = Killed(tmp_path, [4.0], away=90.0)
    assert len(killed.events) == len(EVENTS)
    assert all(event.times["detected"] > 94.0 for event in killed.events)
