"""A DVA whose disk is full: it confirms nothing that it cannot keep, and acts on reports."""

import ctypes
import os
import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from helpers.wording import unnamed
from storms.test_storms import SMALL, small

from dva_sim.core.store import Store
from dva_sim.protocol import messages as m
from dva_sim.simulation.full.stage import DVA
from dva_sim.storms.plan import Fault, StormPlan
from dva_sim.storms.storm import Storm, play

PLACE = m.Position(38.6612, -9.2058)
FIRE = m.EventReport(None, "fire", PLACE, 0.5, 0.9, "detected")
TEAM = {**SMALL, "guard": {"count": 1}}


class Disk:
    """A disk that can be full; how is for others to say."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @contextmanager
    def full(self, storm: Storm) -> Iterator[None]:
        raise NotImplementedError


class MadeUp(Disk):
    """Full disk as storms simulate it."""

    @contextmanager
    def full(self, storm):
        storm.dva.full += 1
        yield
        storm.dva.full -= 1


class Limited(Disk):
    """The process may write to no file, as far as the kernel is concerned."""

    @contextmanager
    def full(self, storm):
        before = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (0, before[1]))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)


class Tiny(Disk):
    """A real file system without a free byte."""

    @contextmanager
    def full(self, storm):
        filler = self.folder / "filler"
        with filler.open("wb", buffering=0) as file:
            try:
                while file.write(bytes(1024)) == 1024:
                    pass
            except OSError:
                pass
        yield
        filler.unlink()


@pytest.fixture(params=[MadeUp, Limited, Tiny], ids=["made-up", "no-writes", "tmpfs"])
def disk(request, tmp_path):
    if request.param is not Tiny:
        yield request.param(tmp_path)
        return
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.mount(b"tmpfs", os.fsencode(tmp_path), b"tmpfs", 0, b"size=1m") != 0:
        pytest.skip(f"mounting a small file system: {os.strerror(ctypes.get_errno())}")
    try:
        yield Tiny(tmp_path)
    finally:
        libc.umount2(os.fsencode(tmp_path), 2)


class Answers:
    """Asks devices of a storm, and gives their answers."""

    def __init__(self, storm: Storm) -> None:
        self.storm, self.hand = storm, storm.intruder
        self.hand.device.register()

    def ask(self, to: str, body: m.Body) -> m.Reply:
        replies = []
        self.hand.ask(to, body, replies.append)
        self.storm.dva.survive(self.storm.now + 3.0)
        return replies[0]


@pytest.fixture
def storm(disk):
    made = Storm(StormPlan(1, TEAM, (), 200.0), disk.folder)
    made.dva.survive(20.0)
    return made


def lines(storm: Storm) -> list[str]:
    return [moment.what for moment in storm.recorder.timeline if "its memory" in moment.what]


@pytest.mark.invariant("S6")
def test_what_is_not_kept_is_not_confirmed_and_a_report_is_acted_on(storm, disk):
    asks, robot, events = Answers(storm), storm.robots[0].id, storm.run.dva.core.events
    with disk.full(storm):
        assert asks.ask(DVA, FIRE).code == m.BUSY
        assert asks.ask(DVA, m.PermissionRequest(robot, "teleoperation")).code == m.BUSY
        assert asks.ask(robot, m.Emergency()).code == m.OK
        assert asks.ask(DVA, m.GetDeviceList()).code == m.OK
        (fire,) = (event for event in events.open.values() if event.kind == "fire")
        assert fire.sent
        (line,) = lines(storm)
        assert unnamed(line, "memory") == []
    assert asks.ask(DVA, FIRE).code == m.OK
    assert robot in storm.run.dva.core.sessions.permissions.grants
    assert len(lines(storm)) == 2
    assert storm.recorder.broken == {}


@pytest.mark.invariant("S2", "S6")
def test_what_was_confirmed_survives_a_dva_that_is_killed_on_a_full_disk(storm, disk):
    asks, robot = Answers(storm), storm.robots[0].id
    storm.run.dva.core.sessions.take_back_everything()
    asks.ask(DVA, m.GetDeviceList())
    held = asks.ask(DVA, m.PermissionRequest(robot, "teleoperation")).content
    with disk.full(storm):
        given_back = m.PermissionRevocation(robot, asks.hand.device.id_tag, held.session)
        assert asks.ask(DVA, given_back).code == m.BUSY
        assert asks.ask(DVA, given_back).code == m.BUSY
        assert asks.ask(DVA, FIRE).code == m.BUSY
        storm.dva.kill(5.0)
        storm.dva.survive(storm.now + 2.0)
    storm.dva.survive(storm.now + 10.0)
    core = storm.run.dva.core
    assert {event.kind for event in core.events.open.values()} <= {"flood", "fire"}
    assert core.sessions.permissions.grants[robot].session == held.session
    assert asks.ask(DVA, given_back).code == m.OK
    assert asks.ask(DVA, FIRE).code == m.OK
    assert storm.recorder.broken == {}


def test_a_permission_that_replaces_one_and_cannot_be_kept_leaves_that_in_force(storm, disk):
    asks, robot = Answers(storm), storm.robots[0].id
    sessions = storm.run.dva.core.sessions
    sessions.take_back_everything()
    asks.ask(DVA, m.GetDeviceList())
    held = asks.ask(DVA, m.PermissionRequest(robot, "teleoperation")).content
    with disk.full(storm):
        assert asks.ask(DVA, m.PermissionRequest(robot, "both")).code == m.BUSY
        assert asks.ask(DVA, m.PermissionRequest(robot, "teleoperation")).content == held
        assert sessions.permissions.grants[robot].session == held.session


@pytest.mark.invariant("S6", "S8")
def test_a_dva_that_was_killed_restarts_on_a_full_disk(storm, disk, monkeypatch):
    asks, killed = Answers(storm), storm.dva.memory
    assert asks.ask(DVA, FIRE).code == m.OK
    monkeypatch.setattr(Store, "close", lambda self: None)  # nobody closes what a killed one had
    with disk.full(storm):
        storm.dva.kill(1.0)
        storm.dva.survive(storm.now + 5.0)
        assert storm.dva.memory is not killed
        assert "fire" in {event.kind for event in storm.run.dva.core.events.open.values()}
        assert asks.ask(DVA, FIRE).code == m.BUSY
    assert asks.ask(DVA, FIRE).code == m.OK
    assert storm.recorder.broken == {}


@pytest.mark.invariant("S6")
def test_a_finding_that_cannot_be_kept_is_reported_until_it_can(storm, disk):
    device, replies = Answers(storm).hand.device, list[m.Reply]()
    storm.dva.survive(storm.now + 3.0)
    with disk.full(storm):
        device.report_finding(FIRE, replies.append)
        storm.dva.survive(storm.now + 12.0)
        events = storm.run.dva.core.events
        (fire,) = (event for event in events.open.values() if event.kind == "fire")
        assert [reply.code for reply in replies] == [m.BUSY]
        assert fire.reports == 3
    storm.dva.survive(storm.now + 20.0)
    assert fire.reports == 4


@pytest.mark.system
@pytest.mark.invariant("S6", "S8")
def test_a_storm_recovers_from_full_disks_and_kills():
    faults = (
        Fault("disk-full", 16.0, 30.0, "dva"),
        Fault("dva-killed", 25.0, target="dva", value=3.0),
        Fault("disk-full", 40.0, 20.0, "dva"),
        Fault("dva-killed-writing", 50.0, target="dva", value=3.0),
    )
    plan = small(*faults, calm=80.0)
    outcome = play(StormPlan(1, TEAM, plan.faults, plan.calm_s, drivers=1))
    assert (outcome.breaches, outcome.error) == ([], "")
