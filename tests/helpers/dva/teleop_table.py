"""The transition table of `protocol/models/teleop.pml`, taken from the robot's own controller.

Every state of a robot meets every message under all circumstances that can matter; what the
controller does then is a row. `.venv/bin/python tests/helpers/dva/teleop_table.py` writes the file.
"""

import itertools
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType

from dva_sim.agents.robot.controller import Limits, Mode, RobotController
from dva_sim.agents.robot.emergency_latch import EmergencyLatch
from dva_sim.protocol import messages as m

TABLE = Path(__file__).parents[3] / "protocol" / "models" / "teleop_table.pml"
DVA, ROBOT, SENDER, OTHER = (f"02:00:00:00:00:0{n}" for n in range(1, 5))
HELD, ANOTHER = 7, 9  # the session in force, and any other
LAST, NUMBER = 10, 20  # the newest number so far, and that of a message that is newer
NOW, EMERGENCY_AT = 100.0, 99.5

STATES = {
    "FREE": (None, Mode.IDLE),
    "HELD": (SENDER, Mode.IDLE),
    "DRIVES": (SENDER, Mode.TELEOPERATION),
    "OTHER_HELD": (OTHER, Mode.IDLE),
    "OTHER_DRIVES": (OTHER, Mode.TELEOPERATION),
}
"""Holder and mode of the robot; the holder is the sender, or whom a claim or an answer names."""

FACTS = {
    "START": ("right", "newer", "still", "later", "released"),
    "SET": ("right", "newer", "still", "later", "fresh"),
    "STOP": ("right", "newer", "still", "later"),
    "EMERGENCY": ("right", "still"),
    "GRANT": ("right",),
    "REVOKE": ("right",),
    "ANSWER": ("somebody", "right", "current"),
}
"""Other facts that may matter: session, order, wheels, last emergency and its release, age."""

Facts = Mapping[str, bool]


def robot_in(state: str) -> RobotController:
    """A robot that has been in use for a while."""
    holder, mode = STATES[state]
    latch = EmergencyLatch("person")
    robot = RobotController(ROBOT, DVA, Limits(watchdog=3.0, max_age=6.0), latch=latch)
    if holder is not None:
        robot.inquiry.about_holder(holder)
        robot.inquiry.next(0.0)
        reported = m.Permission(holder, "teleoperation", HELD)
        _say(robot, DVA, m.Reply(1, m.OK, "", reported))
    robot.mode, robot.owner = mode, None if mode is Mode.IDLE else holder
    robot.last_order_id = robot.last_set_id = LAST
    robot.last_valid, robot.emergency_at = NOW - 1.0, EMERGENCY_AT
    return robot


def _say(
    robot: RobotController, source: str, body: m.Body, session: int = 0, **facts: bool
) -> tuple[int, bool | None]:
    """Hand the robot a message: its code, and whether it moves on (True), stops, or neither."""
    number = NUMBER if facts.get("newer", True) else LAST
    late = EMERGENCY_AT if not facts.get("later", True) else NOW - 0.25
    message = m.Message(ROBOT, number, source, "12:00:00", session, body)
    decision = robot.handle(message, late, NOW, moving=not facts.get("still", True))
    point = decision.set_point
    return decision.code, None if point is None else point.speed > 0.0


def _deliver(robot: RobotController, kind: str, facts: Facts) -> tuple[int, bool | None]:
    session = HELD if facts.get("right") else ANOTHER
    match kind:
        case "START":
            return _say(robot, SENDER, m.StartTeleOp(), session, **facts)
        case "SET":
            seen = robot.tick(NOW - (1.0 if facts["fresh"] else robot.limits.max_age))
            return _say(robot, SENDER, m.SetTeleOp(0.4, 0.0, seen), session, **facts)
        case "STOP":
            return _say(robot, SENDER, m.StopTeleOp(), session, **facts)
        case "EMERGENCY":
            return _say(robot, OTHER, m.Emergency(), session, **facts)
        case "GRANT":
            return _say(robot, DVA, m.PermissionGrant(SENDER, "teleoperation", session))
        case "REVOKE":
            return _say(robot, DVA, m.PermissionRevocation(ROBOT, SENDER, session))
    robot.inquiry.about_holder(None)
    robot.inquiry.next(NOW)
    if not facts["current"]:
        robot.inquiry.is_over(session)
    if facts["somebody"]:
        reported = m.Permission(SENDER, "teleoperation", session)
        return _say(robot, DVA, m.Reply(1, m.OK, "", reported))
    return _say(robot, DVA, m.Reply(1, m.NOT_PERMITTED, "nobody holds it"))


def outcome(state: str, kind: str, facts: Facts) -> tuple[str, ...]:
    """Reaction of the controller, in the words of the model; empty if none."""
    robot = robot_in(state)
    robot.latch.holds = not facts.get("released", True)
    drove, grant = robot.owner, robot.grant
    code, moves = _deliver(robot, kind, facts)
    session = robot.grant.session if robot.grant is not None else None
    before = grant.session if grant is not None else None
    done = {
        "accept": code == m.OK,
        "count_order": robot.last_order_id == NUMBER,
        "count_set": robot.last_set_id == NUMBER,
        "lose": session is None and before is not None,
        "hold": session is not None and session != before,
        "idle": drove is not None and robot.owner is None,
        "drive": robot.owner is not None and robot.owner != drove,
        "stand": moves is False,
        "move": moves is True,
        "heard": robot.last_valid == NOW,
        "latch": robot.emergency_at == NOW,
        "ask": robot.inquiry.due(NOW) <= NOW,
    }
    return tuple(name for name, is_so in done.items() if is_so)


def rows(
    state: str, kind: str, known: Facts = MappingProxyType({})
) -> Iterator[tuple[Facts, tuple[str, ...]]]:
    """Rows of a state and a message, by those circumstances alone that matter there."""
    open_facts = [name for name in FACTS[kind] if name not in known]

    def results(name: str, is_so: bool) -> list[tuple[str, ...]]:
        others = [other for other in open_facts if other != name]
        values = itertools.product((True, False), repeat=len(others))
        some = {**known, name: is_so}
        return [outcome(state, kind, some | dict(zip(others, v, strict=True))) for v in values]

    for name in open_facts:
        if results(name, True) != results(name, False):
            yield from rows(state, kind, {**known, name: True})
            yield from rows(state, kind, {**known, name: False})
            return
    done = outcome(state, kind, dict.fromkeys(open_facts, True) | dict(known))
    if done:
        yield known, done


def table() -> str:
    """The file's text."""
    lines = [
        "/* What a robot does with a message: written by tests/helpers/dva/teleop_table.py from",
        "   dva_sim/agents/robot/controller.py. Change that, not this. What no row names is",
        "   refused and changes nothing. */",
        "inline decide() {",
        "  if",
    ]
    for state, kind in itertools.product(STATES, FACTS):
        for facts, done in rows(state, kind):
            guard = [f"state == {state}", f"message == {kind}"]
            guard += [name if is_so else f"!{name}" for name, is_so in facts.items()]
            lines.append(f"  :: {' && '.join(guard)} -> {'; '.join(f'{d}()' for d in done)}")
    return "\n".join([*lines, "  :: else", "  fi", "}", ""])


if __name__ == "__main__":
    TABLE.write_text(table())
