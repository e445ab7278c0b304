"""Messages forged in the DVA's name, without keys, give nobody a robot."""

import itertools
from collections.abc import Callable, Iterator

import pytest
from helpers.dva.permissions import enter

from dva_sim.agents.robot.controller import INQUIRY_WAIT_S, RobotController
from dva_sim.agents.robot.inquiry import BURST, RATE
from dva_sim.agents.robot.robot import RobotAgent
from dva_sim.core.dva import Dva
from dva_sim.core.sessions import DvaAnswer
from dva_sim.network.messaging import Request, Requester
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode
from dva_sim.protocol.exchange import Outbox
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.stage import DVA, id_of

ROBOT, OPERATOR, STRANGER = id_of("robot", 1), id_of("operator", 1), "02:00:00:0F:00:01"
DRIVEN = 8.0  # by then an operator drives, and long after [s]
SESSION = 9 << 33
QUIET = {"events": [{"kind": "fire", "at_s": 500}], "horizon_s": 600}
ASKED = "asked the DVA who holds a robot"


def run_of(**changes: object) -> Run:
    scenario = scenarios.build(scenarios.load("drive-to-event"), {"horizon_s": 90} | changes)
    return Run(scenario, 1)


def robot_of(run: Run) -> RobotAgent:
    return run.field.robots[ROBOT]


class Forger:
    """Somebody on the network who says what they like, in whose name they like."""

    def __init__(self, run: Run, number: int = 1) -> None:
        self.run, self.codes = run, list[int]()
        self.node = f"02:00:00:0F:{number >> 8:02X}:{number & 255:02X}"
        self.requester = Requester(run.network, self.node, ROBOT, 9.0)
        self.outboxes: dict[str, Outbox] = {}

    def say(self, body: m.Body, source: str = DVA, session: int = SESSION) -> None:
        outbox = self.outboxes.setdefault(source, Outbox(source))
        data = outbox.encode(ROBOT, body, self.run.clock.now, session)

        def answered(reply: bytes) -> None:
            body = decode(reply).body
            assert isinstance(body, m.Reply)
            self.codes.append(body.code)

        self.requester.request(data, answered)

    def drives(self, seconds: float) -> list[int]:
        """It begins to drive, and sends commands; what that was answered with."""
        self.say(m.StartTeleOp(), STRANGER)
        end = self.run.clock.now + seconds
        while self.run.clock.now < end:
            self.say(m.SetTeleOp(0.5, 0.3), STRANGER)
            self.run.clock.run(self.run.clock.now + 0.1)
        return self.codes


def forged_grants(run: Run) -> Iterator[m.Body]:
    """Grants of all kinds to a stranger, and of the holder's to another address."""
    yield m.PermissionGrant(STRANGER, "both", SESSION)
    yield m.PermissionGrant(STRANGER, "teleoperation", 1)
    yield m.PermissionGrant(STRANGER, "sensors", SESSION + 1, None, ("heat_flux",))
    held = robot_of(run).controller.grant
    if held is not None:
        yield m.PermissionGrant(held.holder, held.level, held.session, "192.168.1.66")


@pytest.mark.invariant("S2", "S5")
@pytest.mark.parametrize("pattern", ["req-rep", "pub-sub", "latest-wins"])
def test_no_forged_grant_takes_a_robot_from_its_driver(pattern):
    run = run_of(pattern=pattern)
    run.clock.run(DRIVEN)
    held, before = robot_of(run).controller.grant, robot_of(run).applied
    forger = Forger(run)
    for body in forged_grants(run):
        forger.say(body)
        forger.drives(1.0)
    assert robot_of(run).controller.grant == held
    assert set(forger.codes[1:]) <= {m.OK, m.NOT_PERMITTED}
    assert robot_of(run).applied > before
    run.run()
    assert [drive.outcome for drive in run.recorder.drives] == ["confirmed"]
    assert run.recorder.violations == {}


@pytest.mark.invariant("S2", "S5")
def test_an_idle_robot_obeys_nobody_on_a_forged_grant():
    run = run_of(**QUIET)
    run.clock.run(5.0)
    forger = Forger(run)
    for body in forged_grants(run):
        forger.say(body)
        forger.drives(6.0)
    obeyed = forger.codes.count(m.OK)
    assert obeyed == 3  # what was said in the DVA's name is heard; the rest is refused
    assert len(forger.codes) > 54
    assert robot_of(run).body.distance == pytest.approx(0.0, abs=0.01)
    assert run.recorder.violations == {}


@pytest.mark.invariant("S2")
def test_a_forged_revocation_stops_the_driver_who_drives_on_soon():
    run = run_of(horizon_s=120)
    run.clock.run(DRIVEN)
    held = robot_of(run).controller.grant
    assert held is not None
    forger = Forger(run)
    forger.say(m.PermissionRevocation(ROBOT, held.holder, held.session))
    run.clock.run(DRIVEN + 0.5)
    assert robot_of(run).controller.mode == "Idle"
    assert robot_of(run).controller.grant == held
    assert set(forger.drives(1.0)[1:]) == {m.NOT_PERMITTED}
    run.run()
    assert [drive.outcome for drive in run.recorder.drives] == ["refused", "confirmed"]
    assert {drive.operator for drive in run.recorder.drives} == {OPERATOR}
    assert run.recorder.violations == {}


@pytest.mark.system
@pytest.mark.invariant("S2", "S10")
def test_no_flood_of_forgeries_keeps_the_dvas_own_grant_away():
    """Each of 50 connections forges two grants a second, to other holders, and as many orders."""

    def begins(floods: bool) -> tuple[float, Run]:
        run = run_of(events=[{"kind": "fire", "at_s": 5}])
        numbers = itertools.count(1)
        service, outbox = run.network.service(ROBOT), Outbox(DVA)
        assert service is not None

        def flood(peer: str) -> bool:
            number = next(numbers)
            holder = f"02:00:00:0E:{number >> 8 & 255:02X}:{number & 255:02X}"
            for body in (m.PermissionGrant(holder, "both", SESSION + number), m.StartTeleOp()):
                outbox.source = DVA if isinstance(body, m.PermissionGrant) else holder
                data = outbox.encode(ROBOT, body, run.clock.now, SESSION)
                service(Request(data, lambda _: None, peer=peer))
            return run.clock.now < 14.0

        for number in range(50 * floods):
            peer = f"connection {number}"
            run.clock.every(0.5, lambda p=peer: flood(p), start=1.0 + number / 999)
        while not any(drive.started for drive in run.recorder.drives):
            assert run.clock.now < 60.0
            run.clock.run(run.clock.now + 0.1)
        run.clock.run(run.clock.now + 2.0)
        assert robot_of(run).controller.owner == OPERATOR
        assert run.recorder.violations == {}
        return run.recorder.drives[0].started or 0.0, run

    alone, _ = begins(floods=False)
    flooded, run = begins(floods=True)
    assert flooded < alone + 3.0
    assert run.recorder.counters[ASKED] < BURST + RATE * run.clock.now + 1


@pytest.mark.invariant("S2")
def test_without_the_dva_the_driver_drives_on_and_a_new_grant_waits():
    run = run_of(**{"horizon_s": 100, "link.delay_s": 0.05, "request.timeout_s": 3.0})
    run.clock.run(DRIVEN)
    held, before = robot_of(run).controller.grant, robot_of(run).applied
    run.dva.silence(True)
    run.network.serve(DVA, lambda _: None)
    forger = Forger(run)
    forger.say(m.PermissionGrant(STRANGER, "both", SESSION))
    run.clock.run(DRIVEN + 10.0)
    assert robot_of(run).controller.grant == held
    assert robot_of(run).applied > before + 50
    enter(run.dva.core, ROBOT, m.PermissionGrant(STRANGER, "both", SESSION))
    run.dva.silence(False)
    run.dva.device.serve(run.dva._on_request)
    run.clock.run(DRIVEN + 30.0)
    held = robot_of(run).controller.grant
    assert held is not None
    assert held.holder == STRANGER


@pytest.mark.parametrize("delay", [0.05, 0.4])
def test_a_start_that_overtakes_the_grant_waits_one_round_trip_to_the_dva(delay):
    run = run_of(**QUIET, **{"link.delay_s": delay})
    run.clock.run(10.0)
    enter(run.dva.core, ROBOT, m.PermissionGrant(STRANGER, "both", SESSION))
    forger = Forger(run)
    forger.say(m.GetSensorInfo(), STRANGER)
    run.clock.run(20.0)
    forger.say(m.StartTeleOp(), STRANGER)
    begun = run.clock.now
    while len(forger.codes) < 2:
        run.clock.run(run.clock.now + 0.01)
    assert forger.codes == [m.OK, m.OK]
    processing = 0.05
    assert run.clock.now - begun < 4 * delay + processing + 0.05


def test_an_order_waits_for_the_dva_only_so_long():
    run = run_of(**QUIET, **{"link.delay_s": 0.05})
    run.clock.run(10.0)
    run.network.serve(DVA, lambda _: None)
    forger = Forger(run)
    forger.say(m.StartTeleOp(), STRANGER)
    run.clock.run(10.0 + INQUIRY_WAIT_S - 0.5)
    assert forger.codes == []
    run.clock.run(10.0 + INQUIRY_WAIT_S + 1.0)
    assert forger.codes == [m.NOT_PERMITTED]


@pytest.mark.invariant("S2", "S8")
def test_permissions_are_confirmed_over_a_slow_link_that_loses_much():
    link = {"delay_s": 0.3, "jitter_s": 0.2, "loss": 0.1}
    run = run_of(link=link, horizon_s=150).run()
    assert run.recorder.drives[0].started is not None
    assert run.recorder.violations == {}


# --- older ones -----------------------------------------------------------------------------


def of_version(version: str) -> Callable[[Dva, m.Message, float], DvaAnswer]:
    """A DVA that answers questions of robots as one of an older version does."""
    honest = Dva._answer

    def answer(self: Dva, message: m.Message, now: float) -> DvaAnswer:
        body = message.body
        if isinstance(body, m.GetGrant) and (version < "1.4" or body.holder is None or body.level):
            return DvaAnswer(m.BAD_MESSAGE, "not valid")
        return honest(self, message, now)

    return answer


@pytest.mark.parametrize(
    ("version", "outcomes"),
    [("1.3", {"", "gave up", "timeout"}), ("1.4", {"confirmed"}), ("1.6", {"confirmed"})],
)
def test_a_dva_that_cannot_confirm_its_grants_gives_nobody_a_robot(monkeypatch, version, outcomes):
    if version != "1.6":
        monkeypatch.setattr(Dva, "_answer", of_version(version))
    run = run_of().run()
    assert {drive.outcome for drive in run.recorder.drives} <= outcomes
    assert (run.recorder.drives[0].started is not None) is (version != "1.3")
    assert run.recorder.violations == {}


# --- the audit ------------------------------------------------------------------------------


@pytest.mark.invariant("S5")
def test_a_robot_that_obeys_before_the_dva_has_confirmed_it_breaks_s5(monkeypatch):
    """It takes the word of the DVA, as robots did before 1.6, and drives well otherwise."""

    def believes(self: RobotController, message: m.Message, body: m.PermissionGrant) -> object:
        return self._is_held(body)

    assert run_of().run().recorder.violations == {}
    monkeypatch.setattr(RobotController, "_granted", believes)
    assert set(run_of().run().recorder.violations) == {"S5"}
