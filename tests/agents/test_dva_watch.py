"""Devices notice by its heartbeats that the DVA is gone, and go on with what they do."""

import pytest
from helpers.wording import counted

from dva_sim.agents.device import HEARTBEAT
from dva_sim.agents.dva_watch import SILENT_AFTER, DvaWatch
from dva_sim.network.messaging import Request, Service
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode, encode
from dva_sim.protocol.exchange import Outbox
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.stage import DVA, id_of
from dva_sim.simulation.scenario import build, load

ROBOT = id_of("robot", 1)


# --- what decides --------------------------------------------------------------------------


def test_the_dva_is_silent_only_after_its_time_has_passed():
    watch = DvaWatch()
    watch.beat(5.0, 1)
    assert not watch.look(5.0 + SILENT_AFTER)
    assert not watch.silent
    assert watch.look(5.1 + SILENT_AFTER)
    assert watch.silent
    assert watch.silence(17.0) == 12.0
    watch.beat(18.0, 2)
    assert watch.look(18.0)
    assert not watch.silent


def test_a_dva_that_has_never_published_a_heartbeat_is_judged_by_its_answers_alone():
    watch = DvaWatch()
    watch.answered(1.0)
    assert not watch.look(1000.0)
    watch.failed()
    assert watch.look(1001.0)
    watch.answered(1002.0)
    assert watch.look(1002.0)
    assert not watch.silent


def test_a_heartbeat_does_not_make_up_for_a_request_that_was_not_answered():
    watch = DvaWatch()
    watch.beat(1.0, 1)
    watch.failed()
    assert watch.look(2.0)
    watch.beat(3.0, 2)
    assert not watch.look(3.0)
    assert watch.silent


def test_heartbeats_that_are_counted_from_one_again_show_a_restart():
    watch = DvaWatch()
    assert [watch.beat(float(n), n) for n in (7, 8, 8, 2, 3)] == [False, False, False, True, False]


# --- in a run ------------------------------------------------------------------------------


class Registrations:
    """Notes when a robot registers at the DVA."""

    def __init__(self, run: Run) -> None:
        self._run = run
        self.times: list[float] = []

    def serve(self, service: Service, request: Request) -> None:
        message = decode(request.data)
        if isinstance(message.body, m.Registration) and message.source == ROBOT:
            self.times.append(self._run.clock.now)
        service(request)

    def heard(self, publisher: str, payload: object) -> None:
        pass


class Silenced:
    """A fire drill whose DVA is unplugged for a while."""

    def __init__(self, name: str = "fire-drill") -> None:
        self.run = Run(build(load(name), {}), 1)
        registrations = Registrations(self.run)
        self.registrations = registrations.times
        self.run.network.taps[DVA] = registrations

    def until(self, now: float) -> None:
        self.run.clock.run(now)

    def unplug(self) -> None:
        self.run.network.leave(DVA)  # type: ignore[attr-defined]
        self.run.dva.silence(True)

    def plug_in(self) -> None:
        self.run.network.come_back(DVA)  # type: ignore[attr-defined]
        self.run.dva.silence(False)

    def times_of(self, who: str, what: str) -> list[float]:
        return [
            t for t, name, entry, _ in self.run.recorder.timeline if name == who and what in entry
        ]


def test_everybody_says_that_the_dva_is_silent_and_that_it_is_back():
    drill = Silenced()
    drill.until(20.0)
    assert drill.run.field.robots[ROBOT].device.dva_watch.beats
    drill.unplug()
    drill.until(35.0)
    for who in ("robot-1", "robot-2", "guard-1", "guard-2", "operator-1", "operator-2"):
        (noticed,) = drill.times_of(who, "DVA is silent")
        assert 28.0 <= noticed <= 33.0
    assert drill.times_of("robot-1", "obeys its driver")
    assert drill.times_of("guard-1", "order in hand")
    assert counted(drill.run.recorder.counters, "silent") == 6
    drill.plug_in()
    drill.until(50.0)
    for who in ("robot-1", "guard-1", "operator-1"):
        assert len(drill.times_of(who, "hears the DVA again")) == 1
    assert not drill.run.recorder.violations


def test_a_robot_registers_at_once_when_the_dva_is_back():
    """Its renewal waits at its socket until the DVA can be reached."""
    drill = Silenced()
    drill.until(21.0)
    drill.unplug()
    drill.until(40.0)
    assert drill.times_of("robot-1", "DVA is silent")
    before = len(drill.registrations)
    drill.plug_in()
    drill.until(41.0)
    assert len(drill.registrations) == before + 1
    assert drill.times_of("robot-1", "hears the DVA again")


def test_a_drive_goes_on_while_the_dva_is_silent():
    drill = Silenced("drive-to-event")
    drill.until(1.0)
    while not (drives := drill.run.recorder.drives) or drives[0].started is None:
        drill.until(drill.run.clock.now + 0.5)
    drill.unplug()
    since, sent = drill.run.clock.now, drives[0].sent
    drill.until(since + 15.0)
    assert drill.times_of("robot-1", "DVA is silent")
    assert drives[0].sent > sent + 20
    assert drives[0].ended is None or drives[0].outcome == "confirmed"
    assert not drill.run.recorder.violations


def forged() -> bytes:
    return encode(Outbox(DVA).message(DVA, m.Heartbeat(), 0.0))


@pytest.mark.parametrize("by", ["the DVA", "another"])
def test_forged_heartbeats_hide_a_silence_only_until_a_request_is_not_answered(by):
    drill = Silenced()
    drill.until(20.0)
    drill.unplug()
    source = DVA if by == "the DVA" else id_of("guard", 9)
    data = forged().replace(f"<SourceID>{DVA}".encode(), f"<SourceID>{source}".encode())

    def forge() -> None:
        for robot in drill.run.field.robots.values():
            robot.device._on_dva_beat(data)

    drill.run.clock.every(1.0, forge)
    drill.until(33.0)
    assert bool(drill.times_of("robot-1", "DVA is silent")) == (by == "another")
    drill.until(90.0)  # the registration that is renewed has been sent three times
    assert len(drill.times_of("robot-1", "DVA is silent")) == 1
    assert drill.times_of("robot-1", "hears the DVA again") == []


def test_no_heartbeat_feeds_the_watchdog_of_the_motors():
    """The DVA's come all the time; a robot whose driver has gone stops all the same."""
    drill = Silenced("drive-to-event")
    drill.until(1.0)
    robot = drill.run.field.robots[ROBOT]
    while abs(robot.body.speed) < 0.1:
        drill.until(drill.run.clock.now + 0.5)
    operator = drill.run.recorder.drives[0].operator
    drill.run.network.leave(operator)  # type: ignore[attr-defined]
    watchdog = drill.run.scenario.robot.watchdog_s
    drill.until(drill.run.clock.now + watchdog + 3.0)
    drill.run.field.world.advance_to(drill.run.clock.now)
    assert not robot.device.dva_watch.silent
    assert abs(robot.body.speed) < 0.01


def test_a_heartbeat_of_the_dva_has_no_session():
    assert b"SessionID" not in forged()
    assert HEARTBEAT == "heartbeat|"
