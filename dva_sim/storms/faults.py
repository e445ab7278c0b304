"""Kinds of faults: their effects, possible targets, durations and strengths."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

from dva_sim.agents.robot.faults import SLOWEST
from dva_sim.agents.robot.manual_control import ManualControl
from dva_sim.network.virtual_network import VirtualNetwork
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import encode
from dva_sim.protocol.messages import Position
from dva_sim.simulation.full.stage import DVA
from dva_sim.storms import interference as i
from dva_sim.storms.intruder import give_back
from dva_sim.storms.plan import Fault
from dva_sim.storms.scene import StormRobot, StormScene

End = Callable[[], object]
Begin = Callable[[StormScene, Fault, random.Random], End | None]
ANY_ROLE: Final = ("robot", "operator", "driver", "guard", "dva")
DRIVERS: Final = ("operator", "driver")
ON_MISSION: Final = ("GoTo", "Patrol", "GetMissionStatus")
DRIVEN: Final = ("SetTeleOp", "SetTeleOp", "StartTeleOp", "PermissionGrant", *ON_MISSION)
ON_DRIVING: Final = (*DRIVEN, "PermissionRevocation", "PermissionRevocation", "Reply", "Reply")
DRIFT: Final = 200e-6  # drift of a robot's clock; a quartz drifts less, a slewed clock more
GIVEN_BACK: Final = 5.0  # delay after which a superfluous permission is given back [s]
HAND: Final = "somebody at the robot"
DEADLINES: Final = (3.0, 6.0, 9.0, 10.0, 27.0, 30.0)
"""Watchdog, age limit, time-out, silence, three time-outs, lease [s]: a fault often lasts about
as long as one of them."""


@dataclass(frozen=True)
class FaultKind:
    """One kind of fault.

    Attributes:
        words: Description for people; N is the strength.
        strikes: Kinds of devices that may be its target; empty: none is named.
        begin: Function that starts the fault; returns a function that ends it, if it is to be
            ended.
        lasts: Shortest and longest duration [s]; an act takes none.
        value: Lowest and highest strength.
        on: Messages to the target that it may wait for.
        weight: Relative frequency of being drawn.
    """

    words: str
    strikes: tuple[str, ...]
    begin: Begin
    lasts: tuple[float, float] = (0.0, 0.0)
    value: tuple[float, float] = (0.0, 0.0)
    on: tuple[str, ...] = ()
    weight: float = 1.0


# --- messages ----------------------------------------------------------------------------


def _messages(make: Callable[[float, random.Random], Callable[..., bool]]) -> Begin:
    """Return a fault that applies a rule to the messages between two nodes."""

    def begin(storm: StormScene, fault: Fault, chance: random.Random) -> End:
        source = storm.id_of(fault.source)
        to = storm.id_of(fault.target)
        rule = make(fault.value, chance)
        interference = storm.interference

        def meets(passing: i.PassingMessage) -> bool:
            if source not in ("", passing.source) or to not in ("", passing.to):
                return False
            # A rule that delivers a copy or an altered message has interfered, too.
            before = interference.delivered
            done = rule(interference, passing)
            if done or interference.delivered != before:
                interference.counts[fault.kind] += 1
            return done

        interference.rules.append(meets)
        return lambda: interference.rules.remove(meets)

    return begin


def _freeze(storm: StormScene, fault: Fault, chance: random.Random) -> End:
    """Stop a process: its messages wait both ways, and arrive all at once in the end."""
    node = storm.id_of(fault.target)
    messages = list[i.PassingMessage]()
    interference = storm.interference

    def meets(passing: i.PassingMessage) -> bool:
        if node not in (passing.source, passing.to):
            return False
        messages.append(passing)
        interference.counts[fault.kind] += 1
        return True

    def ends() -> None:
        interference.rules.remove(meets)
        for passing in messages:
            interference.deliver(passing)

    interference.rules.append(meets)
    return ends


def _replay(storm: StormScene, fault: Fault, chance: random.Random) -> None:
    """Replay some of the last messages to a node, at once or within some seconds."""
    past = storm.interference.past(storm.id_of(fault.target))
    after = chance.choice((0.0, chance.uniform(0.0, 5.0)))
    for passing in chance.sample(past, min(len(past), max(1, round(fault.value)))):
        storm.interference.later(passing, after)


def _order_again(storm: StormScene, fault: Fault, chance: random.Random) -> None:
    """Let a copy of an order arrive again after its effect has ended.

    Meanwhile an intruder sends requests in the sender's name, until the robot has forgotten its
    reply to the order.
    """
    robot = storm.id_of(fault.target)
    clock = storm.run.clock
    past = storm.interference.past(robot)
    orders = [each for each in past if any(kind in each.payload for kind in _ORDERS)]
    for passing in orders[-1:]:
        for number in range(FORGOTTEN_AFTER):
            order = m.Message(robot, 2**29 + number, passing.source, "12:00:00", 0, _HARMLESS)
            after = fault.value * number / FORGOTTEN_AFTER
            clock.call_after(after, storm.intruder.send, robot, encode(order))
        storm.interference.later(passing, fault.value + 0.5)


_ORDERS: Final = b"<StartTeleOp", b"<GoTo", b"<Patrol", b"<ReturnToBase"
_HARMLESS: Final = m.GetMissionStatus()
FORGOTTEN_AFTER: Final = 80  # requests that make a robot forget a reply: it keeps the last 64


def _replay_by_another(storm: StormScene, fault: Fault, chance: random.Random) -> None:
    """Replay some of the last messages from an intruder, over its own connection."""
    to = storm.id_of(fault.target)
    past = storm.interference.past(to)
    for passing in chance.sample(past, min(len(past), max(1, round(fault.value)))):
        storm.intruder.send(to, passing.payload)


def _junk(storm: StormScene, fault: Fault, chance: random.Random) -> None:
    """Send invalid messages, or impossible requests, from an intruder."""
    to = storm.id_of(fault.target)
    for _ in range(max(1, round(fault.value))):
        storm.intruder.send(to, chance.choice(_JUNK)(to, chance))


_JUNK: Final[tuple[Callable[[str, random.Random], bytes], ...]] = (
    lambda to, chance: chance.randbytes(chance.randrange(200)),
    lambda to, chance: b"<DVA>" * chance.randrange(50),
    lambda to, chance: _set_to(to, "NaN"),
    lambda to, chance: _set_to(to, "1e308"),
    lambda to, chance: _set_to(to, "-1"),
)


def _set_to(to: str, speed: str) -> bytes:
    """Return a command with another text in place of its speed."""
    message = m.Message(to, 1, to, "12:00:00", 1, m.SetTeleOp(0.25, 0.0))
    return encode(message).replace(b"0.25", speed.encode())


# --- robots ------------------------------------------------------------------------------


def _hang(storm: StormScene, fault: Fault, chance: random.Random) -> End:
    robot = storm.robot(fault.target)
    robot.faults.freeze(True)
    storm.run.deafened(robot.id, True)

    def ends() -> None:
        if robot.faults.frozen:  # otherwise another fault has restarted it
            storm.run.deafened(robot.id, False)
            robot.faults.freeze(False)

    return ends


def _restart(storm: StormScene, fault: Fault, chance: random.Random) -> None:
    _restart_program(storm, storm.robot(fault.target), chance)


def _restart_program(storm: StormScene, robot: StormRobot, chance: random.Random) -> None:
    """Restart the program of a robot; its clock then differs at random, or is a little slow.

    Without power nothing happens.
    """
    if not robot.agent.body.powered:
        return
    storm.run.deafened(robot.id, True)
    slow = max(0.0, robot.agent.controller.clock_offset - chance.uniform(0.5, 10.0))
    robot.agent.restart(chance.choice((slow, chance.uniform(0.0, 1e5))))
    storm.run.deafened(robot.id, False)


def _power(storm: StormScene, fault: Fault, chance: random.Random) -> End:
    robot = storm.robot(fault.target)
    robot.agent.drained = True
    robot.agent.power(False)

    def ends() -> None:
        robot.agent.drained = False
        robot.agent.power(True)
        _restart_program(storm, robot, chance)

    return ends


def _slow(storm: StormScene, fault: Fault, chance: random.Random) -> End:
    robot = storm.robot(fault.target)
    robot.faults.slow_down(fault.value)
    storm.run.slowed(fault.value)
    return lambda: robot.faults.slow_down(None)


def _drop_replies(storm: StormScene, fault: Fault, chance: random.Random) -> End:
    faults = storm.robot(fault.target).faults
    faults.drop_replies(True)
    return lambda: faults.drop_replies(False)


def _blind(storm: StormScene, fault: Fault, chance: random.Random) -> End:
    faults = storm.robot(fault.target).faults
    faults.lose_camera(True)
    return lambda: faults.lose_camera(False)


def _lie(storm: StormScene, fault: Fault, chance: random.Random) -> End | None:
    """Make a sensor publish arbitrary values."""
    sensors = storm.robot(fault.target).agent.sensors
    if not sensors:
        return None
    name = chance.choice(sorted(sensors))
    port = sensors[name]
    values = tuple(chance.choice((0.0, 1e9, -1e9, 200.0)) for _ in port.read(storm.now))
    sensors[name] = replace(port, read=lambda _: values)
    return lambda: sensors.update({name: port})


def _drift(storm: StormScene, fault: Fault, chance: random.Random) -> End:
    controller = storm.robot(fault.target).agent.controller
    clock = storm.run.clock
    goes = [True]
    rate = chance.choice((-DRIFT, DRIFT))

    def tick() -> bool:
        controller.clock_offset += rate
        return goes[0]

    clock.every(1.0, tick)
    return lambda: goes.__setitem__(0, False)


def _by_hand(storm: StormScene, fault: Fault, chance: random.Random) -> End:
    """Take the robot by hand as soon as it allows that, and drive about.

    It keeps trying, also while others drive the robot. Now and then the hand rests, or lets go
    and takes the robot again at once.
    """
    hand = ManualControl(storm.robot(fault.target).agent)
    goes = [True]
    rests = storm.now

    def drive() -> bool:
        nonlocal rests
        if not goes[0]:
            return False
        if storm.now < rests:
            return True
        if chance.random() < 0.01:
            rests = storm.now + chance.choice(DEADLINES) + 5.0
        elif chance.random() < 0.02:
            hand.let_go(HAND)
        wild = chance.random() < 0.05
        speed = chance.choice((-0.5, 2.0, math.nan)) if wild else chance.uniform(0.0, 0.6)
        taken = hand.drive(HAND, speed, chance.uniform(-0.6, 0.6))
        if taken.code == m.WRONG_MODE:
            hand.take(HAND)
        return True

    def ends() -> None:
        goes[0] = False
        hand.let_go(HAND)

    storm.run.clock.every(0.2, drive)
    return ends


# --- the DVA -----------------------------------------------------------------------------


def _kill_dva(storm: StormScene, fault: Fault, chance: random.Random) -> None:
    """Kill the DVA before it receives the awaited message, or shortly after."""
    after = chance.choice((0.0, 0.001, chance.uniform(0.0, 3.0)))
    storm.run.clock.call_after(after, storm.dva.kill, fault.value)


def _kill_dva_writing(storm: StormScene, fault: Fault, chance: random.Random) -> None:
    """Kill the DVA at a random one of the next writes to its memory."""
    storm.dva.kill_at_write(chance.randrange(40), fault.value)


def _fill_disk(storm: StormScene, fault: Fault, chance: random.Random) -> End:
    """Let all writes of the DVA fail, and perhaps kill it meanwhile."""
    storm.dva.full += 1
    if fault.value:
        storm.run.clock.call_after(chance.random() * fault.for_s, storm.dva.kill, fault.value)

    def ends() -> None:
        storm.dva.full -= 1

    return ends


def _slow_dva(storm: StormScene, fault: Fault, chance: random.Random) -> End:
    """Delay requests as if each took the DVA the time of the fault's strength."""
    interference = storm.interference
    free_at = storm.now

    def meets(passing: i.PassingMessage) -> bool:
        nonlocal free_at
        if passing.to != DVA:
            return False
        free_at = max(free_at, storm.now) + fault.value
        interference.counts[fault.kind] += 1
        interference.later(passing, free_at - storm.now)
        return True

    interference.rules.append(meets)
    return lambda: interference.rules.remove(meets)


def _silence_dva(storm: StormScene, fault: Fault, chance: random.Random) -> End:
    silenced = storm.run.dva
    silenced.silence(True)

    def ends() -> None:
        if not silenced.is_gone:
            silenced.silence(False)

    return ends


# --- people ------------------------------------------------------------------------------


def _set_clock(storm: StormScene, fault: Fault, chance: random.Random) -> None:
    storm.device(fault.target).outbox.set_clock(fault.value)


def _vanish(storm: StormScene, fault: Fault, chance: random.Random) -> End:
    device = storm.device(fault.target)
    device.silent = True
    return lambda: setattr(device, "silent", False)


def _idle(storm: StormScene, fault: Fault, chance: random.Random) -> End:
    """Let a guard answer every order with OK, and do nothing."""
    node = storm.id_of(fault.target)
    network = storm.device(fault.target).network
    assert isinstance(network, VirtualNetwork)
    heeds = network.service(node)
    assert heeds is not None
    storm.device(fault.target).serve(lambda message: m.Reply(message.message_id, m.OK, ""))
    return lambda: network.serve(node, heeds)


def _restart_app(storm: StormScene, fault: Fault, chance: random.Random) -> None:
    storm.drivers[fault.target].restart()


def _emergency(storm: StormScene, fault: Fault, chance: random.Random) -> None:
    """Send an emergency under any name, addressed to any robot, in any session."""
    robot = storm.id_of(fault.target)
    if chance.random() < 0.4:
        storm.intruder.ask(robot, m.Emergency())
        return
    named = chance.choice((robot, *(each.id for each in storm.robots)))
    claimed = chance.choice((storm.intruder.device.id_tag, DVA, *storm.labelled.values()))
    session = chance.choice((0, 1, *storm.sessions_seen(robot)))
    number = chance.randrange(2**29, 2**30)  # of no other message
    message = m.Message(named, number, claimed, "12:00:00", session, m.Emergency())
    for _ in range(chance.choice((1, 1, 20))):
        storm.intruder.send(robot, encode(message))


def _button(storm: StormScene, fault: Fault, chance: random.Random) -> None:
    ManualControl(storm.robot(fault.target).agent).press_emergency()


def _revoke(storm: StormScene, fault: Fault, chance: random.Random) -> None:
    if not storm.run.dva.is_gone:
        storm.run.dva.revoke(storm.id_of(fault.target), None, chance.random() < 0.5)


def _take_over(storm: StormScene, fault: Fault, chance: random.Random) -> None:
    """Give the robot, unasked, to another driver, who may start at once and gives it back later."""
    robot = storm.id_of(fault.target)
    dva = storm.run.dva
    if dva.is_gone:  # a killed DVA grants nothing
        return
    drivers = [device for device in storm.labelled if device.startswith(DRIVERS)]
    taker = storm.device(chance.choice(sorted(drivers)))
    dva.revoke(robot, taker.id_tag, chance.random() < 0.5)
    grant = dva.core.sessions.permissions.grants.get(robot)
    if grant is None or grant.holder != taker.id_tag:
        return
    session = grant.session
    until = storm.now + GIVEN_BACK

    def begin() -> bool:
        taker.ask(robot, m.StartTeleOp(), session=session)
        return storm.now < until

    if chance.random() < 0.7:
        storm.run.clock.every(0.3, begin)
    give_back(taker, m.PermissionRevocation(robot, taker.id_tag, session), GIVEN_BACK)


def _ask_twice(storm: StormScene, fault: Fault, chance: random.Random) -> None:
    """Request a robot several times, whatever it is doing.

    The device gives back every permission that it gets, even the one by which it drives.
    """
    device = storm.device(fault.target)
    robot = chance.choice(storm.robots)

    def answered(reply: m.Reply) -> None:
        if isinstance(reply.content, m.Permission):
            session = reply.content.session
            revocation = m.PermissionRevocation(robot.id, device.id_tag, session)
            give_back(device, revocation, GIVEN_BACK)

    for _ in range(max(1, round(fault.value))):
        device.ask(DVA, m.PermissionRequest(robot.id, "teleoperation"), answered)


def _old_session(storm: StormScene, fault: Fault, chance: random.Random) -> None:
    """Act as an operator by former sessions, or by some that never existed."""
    device = storm.device(fault.target)
    robot = chance.choice(storm.robots)
    bodies: list[m.Body] = [m.StartTeleOp(), m.SetTeleOp(0.4, 0.1), m.StopTeleOp()]
    bodies += [m.GoTo((storm.free_place(chance),)), m.CancelMission()]
    bodies += [m.DevSub(name, 2.0) for name in robot.agent.sensors]
    for body in bodies:
        session = chance.choice([1, chance.randrange(2**40), *storm.sessions_seen(robot.id)])
        device.ask(robot.id, body, session=session)


def _second_driver(storm: StormScene, fault: Fault, chance: random.Random) -> End:
    """Let a registered intruder request the robot, and drive it once it is granted."""
    return storm.intruder.drive(storm.id_of(fault.target), fault.value)


def _flood(storm: StormScene, fault: Fault, chance: random.Random) -> End:
    """Send requests at a rate as an intruder: of all kinds, or of one."""
    to = storm.id_of(fault.target)
    goes = [True]
    clock = storm.run.clock
    every = m.GetMissionStatus(), m.StartTeleOp(), m.GetSensorInfo(), m.SetTeleOp(0.5, 0.0)
    bodies = chance.choice((every, every[:1], every[1:2], (m.DevSub("smoke", 1.0),)))

    def send() -> bool:
        storm.flooder.send_message(to, chance.choice(bodies), chance.randrange(2**40))
        return goes[0]

    clock.every(1.0 / fault.value, send)
    return lambda: goes.__setitem__(0, False)


def _flood_in_doubt(storm: StormScene, fault: Fault, chance: random.Random) -> End:
    """Send a robot orders at a rate as an intruder; the DVA does not hear of them."""
    robot = storm.id_of(fault.target)
    goes = [True]
    rules = storm.interference.rules

    def meets(passing: i.PassingMessage) -> bool:
        storm.interference.counts[fault.kind] += passing[:2] == (robot, DVA)
        return passing[:2] == (robot, DVA)

    def send() -> bool:
        storm.flooder.send_message(robot, m.StartTeleOp(), chance.randrange(2**40))
        return goes[0]

    def ends() -> None:
        goes[0] = False
        rules.remove(meets)

    rules.append(meets)
    storm.run.clock.every(1.0 / fault.value, send)
    return ends


# --- events ------------------------------------------------------------------------------


def _report(storm: StormScene, fault: Fault, chance: random.Random) -> None:
    """Report events that may be anywhere: in a wall, outside, at one place."""
    kind = chance.choice(("fire", "gas_leak", "flood"))
    for _ in range(max(1, round(fault.value))):
        storm.intruder.report(kind, storm.anywhere(chance))


def _report_twice(storm: StormScene, fault: Fault, chance: random.Random) -> None:
    kind = chance.choice(("fire", "gas_leak"))
    place = storm.anywhere(chance)
    for _ in range(max(2, round(fault.value))):
        storm.intruder.report(kind, Position(place.latitude, place.longitude))


def _take_back(storm: StormScene, fault: Fault, chance: random.Random) -> None:
    """Report an event, and take it back a little later."""
    place = storm.anywhere(chance)
    hand = storm.intruder
    hand.report("flood", place)
    body = m.EventReport(None, "flood", place, 0.5, 0.9, "refuted")
    storm.run.clock.call_after(fault.value, hand.ask, DVA, body)


_LONG = (2.0, 60.0)
_SHORT = (0.5, 15.0)
_SHARE = (0.1, 0.9)
FAULTS: Final[dict[str, FaultKind]] = {
    "messages-lost": FaultKind(
        "a share of the messages is lost",
        ANY_ROLE,
        _messages(i.loses),
        lasts=_SHORT,
        value=_SHARE,
        on=ON_DRIVING,
        weight=2.0,
    ),
    "messages-late": FaultKind(
        "messages are late by up to N s",
        ANY_ROLE,
        _messages(i.delays),
        lasts=_LONG,
        value=(0.1, 8.0),
        on=ON_DRIVING,
        weight=2.0,
    ),
    "messages-doubled": FaultKind(
        "each message arrives again within N s",
        ANY_ROLE,
        _messages(i.doubles),
        lasts=_LONG,
        value=(0.0, 10.0),
        on=ON_DRIVING,
        weight=2.0,
    ),
    "messages-reordered": FaultKind(
        "messages overtake each other by up to N s",
        ANY_ROLE,
        _messages(i.reorders),
        lasts=_LONG,
        value=(0.1, 4.0),
    ),
    "messages-corrupted": FaultKind(
        "a share of the messages has a wrong byte",
        ANY_ROLE,
        _messages(i.corrupts),
        lasts=_LONG,
        value=_SHARE,
    ),
    "messages-lost-in-bursts": FaultKind(
        "a share of the quarter seconds loses everything",
        ANY_ROLE,
        _messages(i.loses_in_bursts),
        lasts=_LONG,
        value=_SHARE,
    ),
    "partition": FaultKind(
        "nothing gets from one device to another",
        ANY_ROLE,
        _messages(lambda _, chance: i.loses(1.0, chance)),
        lasts=_LONG,
        value=(0.0, 0.0),
        on=ON_DRIVING,
        weight=2.0,
    ),
    "frozen": FaultKind(
        "a process stands still: its messages wait both ways",
        ANY_ROLE,
        _freeze,
        lasts=_SHORT,
        value=(0.0, 0.0),
        on=ON_DRIVING,
    ),
    "replay": FaultKind(
        "N of the last messages arrive again",
        ANY_ROLE,
        _replay,
        value=(1.0, 64.0),
        on=("StopTeleOp", "CancelMission", "StartTeleOp", "PermissionRevocation"),
        weight=2.0,
    ),
    "order-again": FaultKind(
        "the last orders to a robot arrive again, N s after it was told to stop",
        ("robot",),
        _order_again,
        value=(2.0, 8.0),
        on=("StopTeleOp", "CancelMission"),
        weight=3.0,
    ),
    "replay-by-another": FaultKind(
        "an intruder repeats N of the last messages",
        ("robot", "dva"),
        _replay_by_another,
        value=(1.0, 64.0),
        on=ON_DRIVING,
    ),
    "junk": FaultKind(
        "an intruder sends N invalid messages",
        ("robot", "dva"),
        _junk,
        value=(1.0, 100.0),
    ),
    "robot-hangs": FaultKind(
        "a robot's computer hangs, and starts again idle",
        ("robot",),
        _hang,
        lasts=_SHORT,
        on=ON_DRIVING,
        weight=2.0,
    ),
    "robot-restarts": FaultKind(
        "a robot's program restarts", ("robot",), _restart, on=ON_DRIVING, weight=2.0
    ),
    "robot-without-power": FaultKind(
        "a robot's battery is empty, and is exchanged",
        ("robot",),
        _power,
        lasts=_LONG,
        on=ON_DRIVING,
    ),
    "robot-slow": FaultKind(
        "a message takes a robot's computer N s",
        ("robot",),
        _slow,
        lasts=_LONG,
        value=(0.2, SLOWEST),
    ),
    "replies-lost": FaultKind(
        "all replies of a robot are lost", ("robot",), _drop_replies, lasts=_LONG, on=ON_DRIVING
    ),
    "camera-lost": FaultKind("a camera takes no pictures", ("robot",), _blind, lasts=_LONG),
    "camera-lies": FaultKind(
        "a camera shows an old picture as new", ("",), _messages(i.freezes_pictures), lasts=_LONG
    ),
    "sensor-lies": FaultKind(
        "a sensor of a robot shows arbitrary values", ("robot",), _lie, lasts=_LONG
    ),
    "clock-drifts": FaultKind("a robot's clock runs fast or slow", ("robot",), _drift, lasts=_LONG),
    "clock-jumps": FaultKind(
        "a device's clock is set by N s",
        ("robot", "operator", "driver", "guard"),
        _set_clock,
        value=(-4000.0, 4000.0),
    ),
    "taken-by-hand": FaultKind(
        "somebody drives a robot by hand, at the robot",
        ("robot",),
        _by_hand,
        lasts=_LONG,
        on=("StartTeleOp", "PermissionRevocation"),
    ),
    "dva-killed": FaultKind(
        "the DVA is killed, and is back after N s",
        ("dva",),
        _kill_dva,
        value=(0.5, 40.0),
        on=("EventReport", "PermissionRequest", "GetGrant", "OrderProgress"),
        weight=2.0,
    ),
    "dva-killed-writing": FaultKind(
        "the DVA is killed between two writes, and is back after N s",
        ("dva",),
        _kill_dva_writing,
        value=(0.5, 20.0),
        weight=2.0,
    ),
    "disk-full": FaultKind("the DVA cannot write to its memory", ("dva",), _fill_disk, lasts=_LONG),
    "disk-full-and-killed": FaultKind(
        "the DVA cannot write, is killed meanwhile, and is back after N s",
        ("dva",),
        _fill_disk,
        lasts=_LONG,
        value=(0.5, 20.0),
        on=("EventReport", "PermissionRequest"),
        weight=2.0,
    ),
    "dva-slow": FaultKind(
        "a message takes the DVA N s",
        ("dva",),
        _slow_dva,
        lasts=_SHORT,
        value=(0.002, 0.02),
        on=("EventReport", "PermissionRequest", "GetGrant"),
    ),
    "dva-silent": FaultKind(
        "the DVA sends and decides nothing", ("dva",), _silence_dva, lasts=_LONG
    ),
    "vanishes": FaultKind(
        "a device falls silent, and comes back",
        ("operator", "driver", "guard"),
        _vanish,
        lasts=_LONG,
        on=("PermissionGrant", "Order"),
        weight=2.0,
    ),
    "guard-idle": FaultKind(
        "a guard answers OK to every order, and does nothing",
        ("guard",),
        _idle,
        lasts=(20.0, 120.0),
        on=("Order",),
    ),
    "app-restarts": FaultKind(
        "the app of a driver restarts, and counts from 1 again",
        ("driver",),
        _restart_app,
        on=("Reply",),
    ),
    "emergency": FaultKind(
        "somebody stops a robot", ("robot",), _emergency, on=ON_DRIVING, weight=3.0
    ),
    "emergency-button": FaultKind(
        "somebody presses the button at a robot", ("robot",), _button, on=ON_DRIVING
    ),
    "revocation": FaultKind(
        "the DVA ends a permission", ("robot",), _revoke, on=DRIVEN, weight=2.0
    ),
    "take-over": FaultKind(
        "the DVA gives a robot to somebody else", ("robot",), _take_over, on=DRIVEN, weight=2.0
    ),
    "asks-twice": FaultKind(
        "an operator requests a robot N times", DRIVERS, _ask_twice, value=(1.0, 5.0)
    ),
    "old-session": FaultKind(
        "an operator acts by an old session", DRIVERS, _old_session, weight=2.0
    ),
    "held-tilt": FaultKind(
        "all commands have the same speed, N m/s",
        ("",),
        _messages(i.holds_tilt),
        lasts=(10.0, 60.0),
        value=(0.1, 0.5),
    ),
    "second-driver": FaultKind(
        "an intruder requests a robot, and sends N commands a second",
        ("robot",),
        _second_driver,
        lasts=(5.0, 60.0),
        value=(1.0, 20.0),
        on=("StartTeleOp", "StopTeleOp"),
        weight=2.0,
    ),
    "flood": FaultKind(
        "an intruder sends N requests a second",
        ("robot", "dva"),
        _flood,
        lasts=_SHORT,
        value=(20.0, 200.0),
    ),
    "flood-in-doubt": FaultKind(
        "an intruder sends N orders a second to a robot whose questions do not reach the DVA",
        ("robot",),
        _flood_in_doubt,
        lasts=(3.0, 10.0),
        value=(50.0, 200.0),
    ),
    "event-anywhere": FaultKind(
        "N events are reported, in walls and elsewhere",
        ("",),
        _report,
        value=(1.0, 4.0),
    ),
    "event-doubled": FaultKind(
        "one event is reported N times", ("",), _report_twice, value=(2.0, 6.0)
    ),
    "event-taken-back": FaultKind(
        "a report is withdrawn N s after it was made",
        ("",),
        _take_back,
        value=(0.5, 40.0),
    ),
    "events-by-the-hundred": FaultKind(
        "N events are reported at once", ("",), _report, value=(100.0, 1000.0), weight=0.1
    ),
}
