"""Verdicts on a live run from its parts' reports, in any order and with gaps."""

import json
import random
from collections import defaultdict
from contextlib import nullcontext
from typing import Any

import pytest

from dva_sim.agents.robot.controller import Decision, RobotController
from dva_sim.kernel.errors import DvaSimError
from dva_sim.kernel.recorder import Sent
from dva_sim.live.judging import FRAME, OWN_SIDE, SEEN, SENT_LINE, LiveJudge
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import encode
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full.observation_json import as_plain
from dva_sim.simulation.full.observations import (
    Arrived,
    BookNews,
    FactGap,
    Heard,
    MotionNews,
    RobotMotion,
    Slowed,
    terms_of,
)
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.stage import DVA, id_of, kind_of
from dva_sim.simulation.full.verdicts import RULES, Judge, Verdict, refuse_unheld, rules_on

ROBOT, PHONE, OTHER = id_of("robot", 1), id_of("operator", 1), id_of("operator", 2)
WORLD, AT_DVA, REST = 1, 0, 2  # parts

Line = list[Any]


def drive(seconds: float = 25.0) -> Run:
    """A drive in virtual time, with an emergency that the DVA sends."""
    run = Run(scenarios.build(scenarios.load("drive-to-event"), {}), 1, keep_traffic=True)
    run.clock.call_at(20.0, lambda: run.dva.device.ask(ROBOT, m.Emergency()))
    run.clock.run(seconds)
    return run


def part_of(fact: Any) -> int:
    """The process of a live run that would have seen a fact."""
    if isinstance(fact, BookNews | Heard):
        return AT_DVA
    if isinstance(fact, Sent | Arrived):
        seen_by = fact.source if isinstance(fact, Sent) else fact.to
        kinds = {"dva": AT_DVA, "operator": REST}
        return kinds.get(kind_of(seen_by)[0], WORLD)
    return WORLD


def line_of(fact: Any) -> Line:
    """Line in which a part of a live run reports a fact."""
    if not isinstance(fact, Sent):
        word, time, text = as_plain(fact)
        return [SEEN, time, word, text]
    if isinstance(fact.payload, bytes):
        return [SENT_LINE, fact.time, fact.source, fact.destination, fact.payload.decode()]
    return [FRAME, fact.time, fact.source, fact.payload.observation, fact.payload.captured]


def lines_by_part(run: Run) -> dict[int, list[Line]]:
    """The lines of each part."""
    lines: dict[int, list[Line]] = defaultdict(list)
    for device in run.stage.devices:
        part = part_of(Sent(0.0, device.id_tag, "", 0, b""))
        lines[part].append([OWN_SIDE, 0.0, [device.id_tag]])
    for fact in run.recorder.facts or ():
        lines[part_of(fact)].append(line_of(fact))
    return lines


def judged(run: Run, lines: dict[int, list[Line]], seed: int = 1) -> dict[str, str]:
    """Verdicts by rule, for parts that report some lines at a time, in random order."""
    judge, rng = LiveJudge(terms_of(run.scenario)), random.Random(seed)
    for part in lines:
        judge.joins(part)
    left = {part: list(entry) for part, entry in lines.items()}
    while left:
        part = min(left, key=lambda one: left[one][0][1] + rng.uniform(0.0, 4.0))
        some, left[part] = left[part][:20], left[part][20:]
        judge.hear(part, [json.dumps(line).encode() for line in some])
        if not left[part]:
            judge.leaves(part)
            del left[part]
    return {verdict.rule: verdict.state for verdict in judge.verdicts()}


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_an_honest_run_holds_every_rule_whichever_part_is_read_first(seed):
    run = drive()
    assert run.field.robots[ROBOT].applied > 50
    assert judged(run, lines_by_part(run), seed) == dict.fromkeys(RULES, "held")


@pytest.mark.invariant("S3")
def test_a_robot_that_answers_an_emergency_and_drives_on_is_found_out(monkeypatch):
    monkeypatch.setattr(RobotController, "stop", lambda *_: Decision(m.OK, "stopped"))
    run = drive()
    found = judged(run, lines_by_part(run))
    assert {rule for rule, state in found.items() if state == "broken"} == {"S3"}


@pytest.mark.parametrize("ahead", [-0.3, 0.3])
def test_no_rule_is_broken_by_two_clocks_that_differ(ahead):
    """Each rule compares times of one part; the DVA and the phones are on another machine."""
    run = drive()
    lines = lines_by_part(run)
    for part in (AT_DVA, REST):
        lines[part] = [_later(line, ahead) for line in lines[part]]
    assert judged(run, lines) == dict.fromkeys(RULES, "held")


def _later(line: Line, seconds: float) -> Line:
    """A line by a clock that is ahead: of the DVA's own times only differences count."""
    word, time, *rest = line
    return [word, max(0.0, time + seconds), *rest]


def test_without_the_world_robots_are_not_judged_and_without_the_dva_no_events():
    run = drive(10.0)
    lines = lines_by_part(run)
    alone = judged(run, {WORLD: lines[WORLD]})
    assert [alone[rule] for rule in RULES] == ["held"] * 5 + ["not judged"] * 2
    alone = judged(run, {AT_DVA: lines[AT_DVA]})
    assert [alone[rule] for rule in RULES] == ["not judged"] * 5 + ["held"] * 2


def test_what_could_not_be_said_leaves_every_rule_unjudged():
    run = drive(10.0)
    lines = lines_by_part(run)
    lines[WORLD].insert(50, [SEEN, lines[WORLD][50][1], "gap", {"missing": 3}])
    assert judged(run, lines) == dict.fromkeys(RULES, "not judged")


@pytest.mark.parametrize(
    ("rules", "unjudged"),
    [((), set(RULES)), (("S6",), {"S6"}), (("S1", "S2"), {"S1", "S2"})],
)
def test_a_gap_leaves_only_the_rules_that_depend_on_it_unjudged(rules, unjudged):
    run = drive(10.0)
    lines = lines_by_part(run)
    gap = {"missing": 3, "since_s": 4.0, "rules": list(rules)}
    lines[WORLD].insert(50, [SEEN, lines[WORLD][50][1], "gap", gap])
    found = judged(run, lines)
    assert {rule for rule, state in found.items() if state == "not judged"} == unjudged


@pytest.mark.parametrize(
    ("time", "state"),
    [
        (3.9, "broken"),
        (4.0, "not judged"),
        (6.0, "not judged"),
        (10.9, "not judged"),
        (11.1, "broken"),
    ],
)
def test_a_gap_voids_breaches_of_its_own_span_alone(time, state):
    judge = Judge(terms_of(scenarios.build(scenarios.load("drive-to-event"), {})))
    gap = FactGap(6.0, 3, 4.0, ("S4",))
    for moment in sorted({time, gap.time}):
        if moment == gap.time:
            judge.take(gap)
        if moment == time:
            judge.recorder.violated("S4", time, "robot-1", "too fast")
            judge.take(Slowed(time, 0.0))
    assert {v.rule: v.state for v in judge.verdicts()}["S4"] == state


@pytest.mark.parametrize(
    ("sees", "of_strangers", "rules"),
    [
        ((True, False), False, "S1 S2 S3 S4 S5"),
        ((True, False), True, "S1 S2 S3 S5"),
        ((False, True), False, "S2 S5 S6 S7"),
        ((False, True), True, "S2 S6"),
        ((False, False), False, "S1 S2 S3 S5"),  # an operator
        ((True, True), False, "S1 S2 S3 S4 S5 S6 S7"),
    ],
)
def test_a_rule_depends_on_the_facts_of_some_parts(sees, of_strangers, rules):
    assert rules_on(*sees, of_strangers) == tuple(rules.split())


@pytest.mark.parametrize(
    ("found", "code"),
    [
        ([], 0),
        ([Verdict("S1", "held", "")], 0),
        ([Verdict("S1", "not judged", "")], 0),  # no robot takes part
        ([Verdict("S1", "not judged", "", lacks_facts=True)], 5),
        ([Verdict("S1", "not judged", "", lacks_facts=True), Verdict("S2", "broken", "")], 1),
    ],
)
def test_each_outcome_has_an_exit_code(found, code):
    with pytest.raises(DvaSimError) if code else nullcontext() as failure:
        refuse_unheld(found)
    assert (failure.value.exit_code if failure else 0) == code


def test_a_judge_that_has_failed_has_held_nothing():
    run = drive(10.0)
    judge = LiveJudge(terms_of(run.scenario))
    judge.joins(WORLD)
    judge.hear(WORLD, [json.dumps(line_of(fact)).encode() for fact in run.recorder.facts or ()])
    with pytest.raises(KeyError):
        judge.hear(WORLD, [b'["seen", 11.0, "nonsense", {}]', b'["here", 12.0, []]'])
    found = judge.verdicts()
    assert {verdict.state for verdict in found} == {"not judged"}
    assert "11.0 s" in found[0].text


# --- who has really said it ----------------------------------------------------------------


def sent(time: float, source: str, to: str, body: m.Body, session: int, number: int) -> Sent:
    data = encode(m.Message(to, number, source, "12:00:00", session, body))
    return Sent(time, source, to, len(data), data)


def reply(time: float, to: str, number: int) -> Sent:
    return sent(time, ROBOT, to, m.Reply(number, m.OK, ""), 0, 900 + number)


@pytest.mark.invariant("S5")
@pytest.mark.parametrize("is_forged", [False, True])
def test_a_permission_that_nobody_but_its_own_words_says_the_dva_gave_is_none(is_forged):
    """Two operators; the robot believes what one of them says and answers in the DVA's name."""
    scenario = scenarios.build(scenarios.load("drive-to-event"), {"operator.count": 2})
    grant = sent(1.0, DVA, ROBOT, m.PermissionGrant(PHONE, "both", 5), 5, 1)
    question = sent(1.1, ROBOT, DVA, m.GetGrant(), 0, 3)
    confirmed = m.Reply(3, m.OK, "", m.Permission(PHONE, "both", 5))
    answer = sent(1.2, DVA, ROBOT, confirmed, 0, 4)
    start = sent(1.2, PHONE, ROBOT, m.StartTeleOp(), 5, 2)
    facts: list[Any] = [
        Arrived(1.1, DVA, ROBOT, grant.payload),
        reply(1.1, DVA, 1),
        question,
        Arrived(1.2, DVA, ROBOT, answer.payload),
        start,
        Arrived(1.3, PHONE, ROBOT, start.payload),
        reply(1.3, PHONE, 2),
        MotionNews(2.0, {ROBOT: RobotMotion("Teleoperation", 0.0, 0.0)}),
    ]
    if not is_forged:
        facts[:0] = [grant, answer]
    judge = LiveJudge(terms_of(scenario))
    judge.joins(0)
    here = [OWN_SIDE, 0.0, [DVA, ROBOT, PHONE, OTHER]]
    judge.hear(0, [json.dumps(line).encode() for line in (here, *map(line_of, facts))])
    states = {verdict.rule: verdict.state for verdict in judge.verdicts()}
    assert states["S5"] == ("broken" if is_forged else "held")
