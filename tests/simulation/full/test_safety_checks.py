"""The audit of the safety rules: for each rule a program with a planted bug that breaks it."""

import json
from collections.abc import Callable
from functools import cache
from typing import Any

import pytest
from helpers.dva.permissions import enter
from helpers.mutation.bugs import planted
from helpers.wording import counted

from dva_sim.agents.device import command_topic
from dva_sim.agents.operator.drive import Teleoperation
from dva_sim.agents.operator.operator import OperatorAgent
from dva_sim.agents.people.guard import GuardAgent
from dva_sim.agents.robot.controller import (
    LEASE_S,
    Decision,
    Mode,
    RobotController,
    TimedSetPoint,
)
from dva_sim.agents.robot.faults import RobotFaults
from dva_sim.agents.robot.robot import RobotAgent
from dva_sim.agents.robot.sensors import sensor_topic
from dva_sim.core.dispatcher import Dispatcher
from dva_sim.core.events import Cause, EventTable, State
from dva_sim.core.orders import Orders
from dva_sim.core.registry import Registry
from dva_sim.core.sessions import Sessions
from dva_sim.kernel.recorder import Sent
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import encode
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full.event_ledger import SILENT_AFTER
from dva_sim.simulation.full.observation_json import as_plain, of_plain
from dva_sim.simulation.full.observations import STATIONARY, FactLog, page_of, terms_of
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.safety_checks import CHECKED, LEASE, Held, Witness
from dva_sim.simulation.full.stage import DVA, id_of
from dva_sim.simulation.full.verdicts import RULES, judged
from dva_sim.worlds.bodies import RobotBody, TickTarget

ROBOT, STRANGER = id_of("robot", 1), "02:00:00:09:00:01"
EARLY = {"horizon_s": 60}


def made(changes: dict[str, object]) -> Run:
    """A drive to a fire whose facts are kept, so that they can be judged once more."""
    return Run(scenarios.build(scenarios.load("drive-to-event"), changes), 1, keep_traffic=True)


def played(**changes: object) -> Run:
    """A drive to a fire, one minute of it at most."""
    run = made(EARLY | changes)
    run.run()
    return run


def staged(**changes: object) -> Run:
    """Everybody in place and nothing to do; the test lets time pass."""
    quiet = {"events": [{"kind": "fire", "at_s": 500}], "horizon_s": 600}
    return made(quiet | changes)


def ask(run: Run, time: float, body: m.Body, session: int = 5, source: str = DVA) -> None:
    """Somebody sends the robot a request at a time [s]; the DVA if nobody else is named."""
    device = run.dva.device if source == DVA else stranger(run)

    def send() -> None:
        if source == DVA:
            enter(run.dva.core, ROBOT, body)
        device.ask(ROBOT, body, session=session)

    run.clock.call_at(time, send)


def stranger(run: Run) -> Any:
    """A device that nobody has registered."""
    device = run.stage.device("operator", 200)
    device.id_tag = device.outbox.source = STRANGER
    return device


def broken(run: Run) -> set[str]:
    """Rules broken by the run's own audit, and by the judge of its recording."""
    assert run.recorder.facts is not None
    facts, terms = map(recorded, run.recorder.facts), terms_of(run.scenario)
    found = {verdict.rule for verdict in judged(facts, terms) if verdict.is_broken}
    assert found == set(run.recorder.violations)
    return found


def recorded(fact: Any) -> Any:
    """A fact as it comes back from JSON."""
    if isinstance(fact, Sent):
        return fact
    word, time, text = as_plain(fact)
    return of_plain(word, time, json.loads(json.dumps(text, allow_nan=False)))


def test_what_the_audit_checks_is_said_of_every_rule_it_can_find_broken():
    assert list(CHECKED) == list(RULES) == [f"S{number}" for number in range(1, 8)]
    assert all("slack" in entry for entry in CHECKED.values())


def test_an_honest_drive_breaks_no_rule():
    assert played().recorder.violations == {}


# --- robots with a planted bug ------------------------------------------------------------

Plan = tuple[float, m.Body]
TURN = m.SetTeleOp(0.1, 0.3)


def asked(until: float, *plans: Plan, source: str = DVA, **changes: object) -> Run:
    """A robot that somebody asks for something at some times."""
    run = staged(**changes)
    for time, body in plans:
        ask(run, time, body, 0 if isinstance(body, m.Emergency) else 5, source)
    run.clock.run(until)
    return run


def driven(until: float, *plans: Plan, **changes: object) -> Run:
    """The DVA drives it from 11 s on."""
    begins = (10.0, m.PermissionGrant(DVA, "both", 5)), (11.0, m.StartTeleOp())
    return asked(until, *begins, *plans, **changes)


def sent(word: m.Body) -> Run:
    """Send the robot to a place 12 s after the start, and another message 2 s later."""
    goal = m.Position(*made(EARLY).stage.site.frame.to_latlon(30.0, 12.0))
    begins = (10.0, m.PermissionGrant(DVA, "missions", 5)), (12.0, m.GoTo((goal,)))
    return asked(20.0, *begins, (14.0, word))


def every_second(first: float, last: float, body: m.Body) -> list[Plan]:
    return [(first + n, body) for n in range(int(last - first) + 1)]


def ok(*_: Any) -> Decision:
    return Decision(m.OK, "stopped")


def deaf(self: RobotController, now: float, stopped_by: str | None = None) -> Decision:
    """It says that it has heard of an emergency, or even does not remember one."""
    self.emergency_at = now
    return ok()


HONEST = RobotController._set


def sets(**changed: Callable[[TimedSetPoint], float]) -> Callable[..., Decision]:
    """A robot that makes something else of the set points that it is given."""

    def other(self: RobotController, *args: Any) -> Decision:
        decision = HONEST(self, *args)
        wanted = decision.set_point
        assert wanted is not None
        new = {name: value(wanted) for name, value in changed.items()}
        return decision._replace(set_point=wanted._replace(**new))

    return other


def careless(self: RobotController, message: m.Message, body: Any, *args: Any) -> Decision:
    """It does not mind how old the picture behind a command is, or whether it can be."""
    return HONEST(self, message, m.SetTeleOp(body.speed, body.turn_rate, None), *args)


def asks_for(speed: float) -> Callable[..., None]:
    """Motors that are asked for a speed beyond their limits."""

    def unlimited(self: RobotBody, wanted: float, turn_rate: float, until: float) -> None:
        target = TickTarget(speed if wanted else 0.0, turn_rate, self._world.tick_at(until))
        self._asked.put(self._world.next_tick(), target)

    return unlimited


READS = m.DevSub("temperature", 1.0)
MAY_READ = m.PermissionGrant(DVA, "sensors", 5, None, ("temperature",))
OVER = m.PermissionRevocation(ROBOT, DVA, 5)
FAST = (12.0, m.SetTeleOp(0.5, 0.0))
AFTER_AN_EMERGENCY = (*every_second(12, 39, m.SetTeleOp(0.1, 0.4)), (20.5, m.Emergency()))
LEFT_TO_THE_WATCHDOG = (12.0, TURN), (12.1, m.Emergency())
PLANTED: dict[str, tuple[Callable[[], Run], str, Callable[..., Any], set[str]]] = {
    "a stranger drives": (
        lambda: asked(25, (10, m.StartTeleOp()), *every_second(11, 19, TURN), source=STRANGER),
        *("_refusal", lambda *_: None, {"S5"}),
    ),
    "a stranger reads": (
        lambda: asked(12, (10.0, READS), source=STRANGER),
        *("_subscription", ok, {"S5"}),
    ),
    "one whose permission is over reads": (
        lambda: asked(14, (10.0, MAY_READ), (11.0, OVER), (12.0, READS)),
        *("_subscription", ok, {"S5"}),
    ),
    "it does not hear that a session is over": (
        lambda: driven(45, (15.0, OVER), *every_second(12.5, 39.5, TURN)),
        *("_revoked", ok, {"S2"}),
    ),
    "a silent driver keeps it": (
        lambda: driven(50, (12.0, TURN)),
        *("expire", lambda *_: False, {"S2"}),
    ),
    "a driver keeps it who speaks again": (
        lambda: driven(50, (12.0, TURN), (47.0, TURN)),
        *("expire", lambda *_: False, {"S1", "S2"}),
    ),
    "it forgets an emergency": (lambda: driven(45, *AFTER_AN_EMERGENCY), "stop", ok, {"S3"}),
    "it lies about an emergency": (
        lambda: driven(45, *AFTER_AN_EMERGENCY),
        *("stop", deaf, {"S3"}),
    ),
    "the watchdog ends an emergency": (
        lambda: driven(15, *LEFT_TO_THE_WATCHDOG, **{"robot.watchdog_s": 1.0}),
        *("stop", ok, {"S3"}),
    ),
    "too fast": (lambda: driven(13, FAST), "drive", asks_for(0.6), {"S4"}),
    "no number": (lambda: driven(13, FAST), "drive", asks_for(float("nan")), {"S4"}),
    "backwards": (lambda: driven(13, FAST), "drive", asks_for(-0.2), {"S4"}),
    "a set point that never expires": (
        lambda: driven(30, (12.0, m.SetTeleOp(0.1, 0.4))),
        *("_set", sets(until=lambda _: 1e6), {"S1"}),
    ),
    "it is told to stop once": (
        lambda: driven(20, (12.0, TURN), (12.1, m.StopTeleOp())),
        *("_stop", ok, {"S1"}),
    ),
    "it is told to stop and driven on": (
        lambda: driven(20, (12.0, TURN), (12.1, m.StopTeleOp()), *every_second(14, 16, TURN)),
        *("_stop", ok, {"S1"}),
    ),
    "a watchdog a second too long": (
        lambda: played(horizon_s=20),
        *("_set", sets(until=lambda wanted: wanted.until + 1.0), {"S1"}),
    ),
    "a watchdog a tenth too long": (
        lambda: played(horizon_s=20),
        *("_set", sets(until=lambda wanted: wanted.until + 0.1), {"S1"}),
    ),
    "a mission outlives its session": (lambda: sent(OVER), "_revoked", ok, {"S1"}),
    "a mission outlives its end": (lambda: sent(m.CancelMission()), "_cancel", ok, {"S1"}),
}


@pytest.mark.invariant("S1", "S2", "S3", "S4", "S5")
@pytest.mark.parametrize("what", PLANTED)
def test_a_robot_with_a_planted_bug_breaks_its_rule_and_an_honest_one_none(monkeypatch, what):
    play, method, bug, rules = PLANTED[what]
    assert broken(play()) == set()
    monkeypatch.setattr(RobotBody if method == "drive" else RobotController, method, bug)
    assert broken(play()) == rules


@pytest.mark.invariant("S1")
def test_a_robot_that_does_not_mind_how_old_the_picture_is_breaks_s1(monkeypatch):
    """The phone has just issued the command; the camera gives its first picture for ever."""

    def drive() -> Run:
        run = made({"robot.max_age_s": 2.0, "robot.watchdog_s": 30.0, **EARLY})
        robot = run.field.robots[ROBOT]
        robot.observe = cache(robot.observe)  # type: ignore[method-assign]
        run.run()
        return run

    assert broken(drive()) == set()
    monkeypatch.setattr(RobotController, "_set", careless)
    assert broken(drive()) == {"S1"}


@pytest.mark.invariant("S2")
def test_a_robot_that_changes_hands_while_it_moves_breaks_s2(monkeypatch):
    other = id_of("operator", 1)

    def handed_over() -> Run:
        run = staged()
        ask(run, 10.0, m.PermissionGrant(DVA, "both", 5))
        ask(run, 11.0, m.StartTeleOp())
        for second in range(12, 16):
            ask(run, second, m.SetTeleOp(0.5, 0.0))
        ask(run, 15.2, m.PermissionGrant(other, "both", 6))
        start = m.Message(ROBOT, 9_999, other, "12:00:00", 6, m.StartTeleOp())
        wire: list[Any] = []

        def begin() -> None:
            wire.append(run.network.connect(other, ROBOT, lambda *_: None, True))
            wire[0].send(1, encode(start))

        run.clock.call_at(15.25, begin)
        run.clock.run(20.0)
        return run

    assert broken(handed_over()) == set()
    monkeypatch.setattr(RobotController, "_begin", lambda *_, **__: None)
    assert "S2" in broken(handed_over())


def test_the_limits_of_silence_are_those_of_robots_and_the_dva():
    """The audit has its own: one that is changed by mistake is to be found out."""
    assert (LEASE_S, Registry().silent_after) == (LEASE, SILENT_AFTER)


@pytest.mark.invariant("S2")
def test_a_dva_that_never_takes_back_the_permission_of_a_silent_device_breaks_s2(monkeypatch):
    def falls_silent() -> Run:
        run = made({"horizon_s": 60})
        run.clock.run(15.0)
        (right,) = run.dva.core.sessions.permissions.grants.values()
        assert right.holder == id_of("operator", 1)
        run.network.leave(right.holder)
        phone = next(d for d in run.stage.devices if d.id_tag == right.holder)
        monkeypatch.setattr(phone, "publish", lambda *_: None)
        monkeypatch.setattr(phone, "ask", lambda *_, **__: None)
        run.clock.run(32.0)
        return run

    assert broken(falls_silent()) == set()
    for name in ("take_back", "take_back_all"):
        monkeypatch.setattr(Sessions, name, lambda *_: None)
    assert broken(falls_silent()) == {"S2"}


def test_what_a_dva_remembers_of_an_earlier_life_breaks_no_rule():
    """Its first page has events that others have confirmed, and one that somebody is sent to."""
    run = made({"horizon_s": 60})
    run.run()
    page, terms = page_of(run.dva), terms_of(run.scenario)
    (event,) = page.events.closed.values()
    assert "confirmed" in event.times
    pending = page.events.add("fire", m.Position(38.66, -9.2), 0.5, 0.0)
    page.events.move(pending, Cause.ORDERED, 0.5)
    pending.responder = id_of("guard", 1)
    facts: list[Any] = []
    log = FactLog(facts.append, (), lambda _: STATIONARY)
    log.shows(1.0, page)
    report = m.EventReport(2, "fire", pending.position, 0.5, 0.9, "confirmed")
    data = encode(m.Message(DVA, 9, id_of("guard", 1), "12:00:00", 0, report))
    log.delivered(1.2, id_of("guard", 1), DVA, data)
    page.events.move(pending, Cause.CONFIRMED, 1.2)
    log.shows(1.5, page)
    found = {verdict.rule: verdict.state for verdict in judged(facts, terms)}
    assert (found["S6"], found["S7"]) == ("held", "held")


def test_a_dva_that_was_silenced_is_late_with_nothing():
    """Somebody has stopped it at a console: what waits for it waits no longer by the rules."""
    run = made({"dispatch.escalate_after_s": 20})
    run.dva.core.dispatcher.decide = lambda _: []  # type: ignore[method-assign]
    run.clock.run(10.0)
    run.dva.silence(True)
    run.clock.run(60.0)
    run.dva.silence(False)
    run.clock.run(70.0)
    assert broken(run) == set()


@pytest.mark.invariant("S3")
def test_a_robot_that_moves_by_itself_after_an_emergency_breaks_s3(monkeypatch):
    """Its mode says Mission, so that no command is looked for; its body gives it away."""
    run = staged()
    ask(run, 10.0, m.PermissionGrant(DVA, "missions", 5))
    goal = m.Position(*run.stage.site.frame.to_latlon(30.0, 12.0))
    ask(run, 12.0, m.GoTo((goal,)))
    ask(run, 20.0, m.Emergency(), session=0)

    monkeypatch.setattr(RobotController, "stop", deaf)
    run.clock.run(30.0)
    assert run.field.robots[ROBOT].controller.mode is Mode.MISSION
    assert broken(run) == {"S3"}


@pytest.mark.invariant("S3")
@pytest.mark.parametrize(("is_deaf", "rules"), [(False, set()), (True, {"S3"})])
def test_an_emergency_whose_answer_is_lost_stops_a_robot_once(monkeypatch, is_deaf, rules):
    """An honest robot stands, and is driven again by a new order; a deaf one just goes on."""
    before = (10.0, m.PermissionGrant(DVA, "both", 5)), (11.0, m.StartTeleOp())
    run = staged()
    if is_deaf:
        monkeypatch.setattr(RobotController, "stop", deaf)
    again = () if is_deaf else ((22.0, m.StartTeleOp()), *every_second(23, 39, TURN))
    commands = every_second(12, 39 if is_deaf else 19, TURN)
    for time, body in (*before, *commands, *again):
        ask(run, time, body)
    ask(run, 20.0, m.Emergency(), session=0)
    faults = RobotFaults(run.field.robots[ROBOT])
    run.clock.call_at(19.9, faults.drop_replies, True)
    run.clock.call_at(20.9, faults.drop_replies, False)
    run.clock.run(39.0)
    assert broken(run) == rules


@pytest.mark.invariant("S4")
def test_motors_that_ignore_their_limit_break_s4():
    run = staged()
    run.clock.run(10.0)
    body = run.field.robots[ROBOT].body
    body.body.angular_velocity = 2.0
    run._watch()
    assert "S4" in broken(run)


@pytest.mark.invariant("S6")
@pytest.mark.parametrize(
    "lose",
    [
        lambda events, event: events.open.pop(event.number),
        lambda events, event: events.counts.update(
            {State.ASSIGNED: events.counts[State.ASSIGNED] + 1}
        ),
        lambda events, event: events.closed.update({event.number: event}),
        lambda events, event: setattr(event, "state", State.ON_SCENE),
    ],
    ids=["lost", "counted twice", "open and closed", "in a state nobody counted"],
)
def test_an_event_table_that_loses_or_doubles_an_event_breaks_s6(lose):
    run = made(EARLY)
    run.clock.run(10.0)
    assert broken(run) == set()
    events = run.dva.core.events
    lose(events, next(iter(events.open.values())))
    run.clock.run(11.0)
    assert "S6" in broken(run)


@pytest.mark.invariant("S6")
def test_a_report_that_the_dva_thanks_for_and_forgets_breaks_s6(monkeypatch):
    def forgetful(self: EventTable, *args: Any, **more: Any) -> Any:
        event = honest(self, *args, **more)
        del self.open[event.number], self.waiting[event.number]
        self.total -= 1
        self.counts[event.state] -= 1
        return event

    honest = EventTable.add
    run = made(EARLY)
    monkeypatch.setattr(EventTable, "add", forgetful)
    run.clock.run(10.0)
    assert "S6" in broken(run)


@pytest.mark.invariant("S6")
def test_an_order_that_is_kept_for_ever_breaks_s6(monkeypatch):
    def kept() -> Run:
        """A drive takes 40 s, an order may take 20."""
        return played(**{"dispatch.order_limit_s": 20})

    assert broken(kept()) == set()
    monkeypatch.setattr(Orders, "take_back", lambda *_: [])
    assert "S6" in broken(kept())


@pytest.mark.invariant("S6")
def test_an_event_that_is_over_and_counts_as_something_else_breaks_s6():
    run = played()
    counts = run.dva.core.events.counts
    assert counts[State.CONFIRMED] == 1
    counts[State.CONFIRMED], counts[State.EXPIRED] = 0, 1
    run.show_page()
    assert broken(run) == {"S6"}


@pytest.mark.invariant("S6")
@pytest.mark.parametrize(("within", "rules"), [(3.0, {"S6"}), (30.0, set())])
def test_somebody_who_says_ok_and_does_not_set_out_breaks_s6(monkeypatch, within, rules):
    monkeypatch.setattr(OperatorAgent, "_go_on", lambda self: None)  # takes up nothing
    monkeypatch.setattr(Orders, "_overdue", lambda *_: [])
    run = played(**{"dispatch.depart_within_s": within, "horizon_s": 20})
    assert broken(run) == rules


@pytest.mark.invariant("S5")
def test_a_sensor_that_is_shown_to_somebody_who_may_not_read_it_breaks_s5():
    run = staged()
    run.clock.run(5.0)
    value = m.SensorValue("smoke", (0.1,), "1/m", 5000)
    data = encode(m.Message(DVA, 1, ROBOT, "12:00:00", 0, value))
    run.sent(5.0, ROBOT, STRANGER, data)
    assert broken(run) == {"S5"}


@pytest.mark.invariant("S5")
def test_a_robot_that_has_restarted_shows_its_sensors_to_nobody_until_it_is_asked_again():
    thermometer = {"robot.sensors": [{"name": "temperature"}]}
    run, shown = staged(**thermometer), list[float]()
    topic = sensor_topic("temperature", DVA)
    run.network.subscribe(DVA, ROBOT, topic, lambda _: shown.append(run.clock.now))
    ask(run, 10.0, MAY_READ)
    ask(run, 11.0, READS)
    run.clock.run(15.0)
    assert len(shown) > 1
    run.dva.device.silent = True
    run.field.robots[ROBOT].restart(0.0)
    run.clock.run(30.0)
    assert max(shown) < 16.0  # one may have been on its way
    assert broken(run) == set()


def confirmed(witness: Witness, session: int) -> None:
    witness.given(session, Held("driver", "both", ()))
    witness.confirmed.add(session)


@pytest.mark.parametrize(("number", "holder"), [(101, "driver"), (4, None)])
def test_a_status_shows_that_a_robot_has_restarted_and_knows_no_holder(number, holder):
    witness = Witness(obeys_within=1.0)
    confirmed(witness, 7)
    witness.reports(100, 1.0)
    witness.reports(number, 2.0)
    assert witness.holder() == holder


def test_a_restart_counts_once_whichever_message_shows_it_first():
    witness = Witness(obeys_within=1.0)
    witness.registers("a DVA", (9, "12:00:00"), 0.0)
    witness.registers("another DVA", (8, "11:59:58"), 0.1)
    witness.asks(2, 0.5)
    witness.reports(100, 1.0)
    witness.asks(2, 1.5)
    assert witness.restarts == 0
    witness.registers("a DVA", (1, "12:00:05"), 6.0)
    witness.asks(2, 6.0)
    assert witness.restarts == 1
    confirmed(witness, 7)
    witness.reports(4, 6.5)
    assert (witness.restarts, witness.holder()) == (1, "driver")
    witness.asks(5, 7.0)
    witness.reports(3, 8.0)
    assert (witness.restarts, witness.holder(), witness.question) == (2, None, 0)


@pytest.mark.parametrize(
    ("mutant", "rule"), [("confirmed-on-arrival", "S7"), ("confirms-more", "S5")]
)
def test_a_planted_bug_breaks_its_rule_in_an_ordinary_run(mutant, rule):
    with planted(mutant) as bug:
        run = played()
    assert bug.acts
    assert broken(run) == {rule}


@pytest.mark.invariant("S7")
def test_times_out_of_order_break_s7():
    run = made(EARLY)
    run.clock.run(10.0)
    event = next(iter(run.dva.core.events.open.values()))
    event.times["assigned"] = event.times["detected"] - 1.0
    run.clock.run(11.0)
    assert broken(run) == {"S7"}


def test_time_that_runs_back_breaks_s7():
    run = staged()
    run.clock.run(10.0)
    for observer in run._observers:
        observer.shows(9.0, page_of(run.dva))
    assert broken(run) == {"S7"}


@pytest.mark.parametrize("forged", ["revocation", "grant"])
def test_a_forgery_makes_no_honest_robot_a_breaker_of_rules(forged):
    """Somebody speaks in the DVA's name; the robot asks the DVA, and is driven on."""
    run = made({"horizon_s": 90})
    run.clock.run(25.0)
    controller = run.field.robots[ROBOT].controller
    grant = controller.grant
    assert grant is not None
    body: m.Body = m.PermissionGrant(STRANGER, "both", grant.session + 1)
    if forged == "revocation":
        body = m.PermissionRevocation(ROBOT, grant.holder, grant.session)
    message = m.Message(ROBOT, 77, DVA, "12:00:00", 0, body)
    wire = run.network.connect(STRANGER, ROBOT, lambda *_: None, True)
    wire.send(1, encode(message))
    run.run()
    assert broken(run) == set()


def test_a_count_below_zero_breaks_s6():
    run = staged()
    run.clock.run(10.0)
    counts = run.dva.core.events.counts
    counts[State.ESCALATED] -= 1
    counts[State.CONFIRMED] += 1
    run._watch()
    assert broken(run) == {"S6"}


# --- what others say of themselves -------------------------------------------------------


@pytest.mark.invariant("S1")
@pytest.mark.parametrize("numbers", [(51, 50), (50, 50)], ids=["out of order", "twice"])
def test_commands_that_act_out_of_order_or_twice_break_s1(monkeypatch, numbers):
    def driven() -> Run:
        run = staged(pattern="pub-sub")
        ask(run, 10.0, m.PermissionGrant(DVA, "both", 5))
        ask(run, 11.0, m.StartTeleOp())
        for time, number in zip((12.0, 12.1), numbers, strict=True):
            command = m.Message(ROBOT, number, DVA, "12:00:00", 5, m.SetTeleOp(0.1, 0.3))
            data = encode(command)
            run.clock.call_at(time, run.network.publish, DVA, command_topic(ROBOT), data, len(data))
        run.clock.run(14.0)
        assert run.field.robots[ROBOT].applied >= 1
        return run

    assert broken(driven()) == set()

    def forgetful(self: RobotController, *args: Any) -> Decision:
        self.last_set_id = 0
        return HONEST(self, *args)

    monkeypatch.setattr(RobotController, "_set", forgetful)
    assert broken(driven()) == {"S1"}


@pytest.mark.invariant("S1")
@pytest.mark.parametrize(("tick", "watched"), [(60.0, True), (2.0, False)], ids=["ahead", "old"])
def test_a_robot_that_obeys_a_tick_from_the_future_or_an_old_one_breaks_s1(
    monkeypatch, tick, watched
):
    """The age of a command is known though nobody watches the camera."""

    def ticked() -> Run:
        run = staged()
        if watched:
            run.network.subscribe(DVA, ROBOT, "frame|", lambda _: None)
        ask(run, 10.0, m.PermissionGrant(DVA, "both", 5))
        ask(run, 11.0, m.StartTeleOp())
        seen = run.field.robots[ROBOT].controller.tick(tick)
        ask(run, 12.0, m.SetTeleOp(0.1, 0.4, seen))
        run.clock.run(14.0)
        return run

    assert broken(ticked()) == set()
    monkeypatch.setattr(RobotController, "_set", careless)
    assert broken(ticked()) == {"S1"}
    # Where it has never told its clock, nobody can have seen that tick.
    monkeypatch.setattr(RobotAgent, "_publish_status", lambda _: None)
    assert broken(ticked()) == {"S1"}


@pytest.mark.invariant("S6")
def test_a_wait_that_begins_again_for_ever_breaks_s6(monkeypatch):
    """Nobody is sent; the DVA sets back what it escalates by."""
    alone = {"dispatch.escalate_after_s": 20}
    monkeypatch.setattr(Dispatcher, "_decide", lambda *_: [])
    honest = Orders.give_up

    def patient(self: Orders, now: float) -> Any:
        for event in self.events.waiting.values():
            event.waiting_since = now
        return honest(self, now)

    assert broken(played(**alone)) == set()
    monkeypatch.setattr(Orders, "give_up", patient)
    assert broken(played(**alone)) == {"S6"}


@pytest.mark.invariant("S6")
def test_an_order_that_begins_again_for_ever_breaks_s6(monkeypatch):
    honest = Orders.take_back

    def patient(self: Orders, now: float) -> Any:
        for _, event in self.engaged.pairs():
            event.times["assigned"] = now
            for step in ("departed", "arrived"):
                event.times.pop(step, None)
        return honest(self, now)

    monkeypatch.setattr(Orders, "take_back", patient)
    assert broken(played(**{"dispatch.order_limit_s": 20})) == {"S6"}


@pytest.mark.invariant("S6")
def test_an_event_that_nobody_has_confirmed_breaks_s6(monkeypatch):
    honest = Orders.departed

    def hasty(self: Orders, event: Any, device: str, now: float) -> None:
        honest(self, event, device, now)
        if event.state is State.ASSIGNED:
            self.events.move(event, Cause.CONFIRMED, now)

    assert broken(played()) == set()
    monkeypatch.setattr(Orders, "departed", hasty)
    assert "S6" in broken(played())


@pytest.mark.invariant("S6")
def test_an_event_that_is_confirmed_from_afar_breaks_s6(monkeypatch):
    """The operator says so as soon as the drive begins."""

    monkeypatch.setattr(Teleoperation, "begin", lambda self: self.end("confirmed"))
    assert broken(played(**{"robot.way_m": 25, "dispatch.merge_distance_m": 0})) == {"S6"}


# --- who only says so --------------------------------------------------------------------


def test_a_guard_that_says_from_its_post_that_it_has_arrived_is_replaced_after_a_minute(
    monkeypatch,
):
    honest = GuardAgent._depart

    def lazy(self: GuardAgent, errand: Any) -> None:
        if self.device.label != "guard-1" or errand.order is None:
            honest(self, errand)
            return
        for state in ("departed", "arrived"):
            self.device.progress(errand.order.event_id, state)

    monkeypatch.setattr(GuardAgent, "_depart", lazy)
    alone = {"robot.count": 0, "operator.count": 0, "guard.count": 2}
    run = played(**alone, **{"dispatch.merge_distance_m": 0, "horizon_s": 150})
    story = {moment.what: moment.time for moment in run.recorder.timeline}
    (over,) = (time for what, time in story.items() if "order is over" in what)
    assert over == pytest.approx(141.0, abs=2.0)
    assert counted(run.dva.core.counters, "from afar") == 1
    assert run.dva.events[1].responder == id_of("guard", 2)
    assert broken(run) == set()
