"""Checks of evidence: recordings, traces and audit logs.

Messages are valid, every decision is made the same again, a chain of rows is whole; and what
happened in a recorded run is held against the safety rules, whatever was decided.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import listed
from dva_sim.protocol.mistakes import Problem, check_message

if TYPE_CHECKING:  # late: start-up
    from dva_sim.network.link.delay_logs import DelayLog
    from dva_sim.network.link.recorded import Floats
    from dva_sim.recordings.reading import Opened
    from dva_sim.simulation.full.verdicts import Verdict

UNFINISHED: Final = "the run was interrupted or is still running; it was checked as far as it goes"
CUT: Final = "its last line is cut off, as of a program that was killed; all others were checked"


OPPORTUNITIES: Final = (".up", ".down")  # endings of Mahimahi's traces
OPPORTUNITY_BYTES: Final = 1500  # bytes that one opportunity lets through [B]
LONG_GAP_S: Final = 60.0  # longest gap of a trace that is not questioned

Found = tuple[list[Problem], list[str], str]  # problems, doubts, and what was looked at


def check_recording(path: Path) -> tuple[list[Problem], list[str], str, list[Verdict]]:
    """Return problems of a recording, doubts, a note on its size, and a verdict on each rule.

    Problems are invalid messages and decisions that would be made otherwise now.
    """
    from dva_sim.live.recorded_lines import is_part, readable  # late: start-up
    from dva_sim.recordings.audit_log import verify_plain  # late: start-up
    from dva_sim.recordings.reading import read_recording  # late: start-up

    try:
        with readable(path) as file:
            opened = read_recording(file)
    except ConfigError as error:
        return [Problem(1, 1, error.problem)], [], "", []
    traffic = [(s, s.payload) for s in opened.playback.recorder.traffic or ()]
    messages = [(sent, data) for sent, data in traffic if isinstance(data, bytes)]
    problems = list[Problem]()
    for number, (sent, data) in enumerate(messages, 1):
        where = f"message {number}, at {sent.time:.1f} s, from {sent.source}"
        problems += [Problem(1, 1, f"{where}: {problem.text}") for problem in check_message(data)]
    if opened.left_out:
        lacking = listed((f"{topic} {n}" for topic, n in sorted(opened.left_out.items())), 4)
        problems.append(Problem(1, 1, f"was filtered: messages are missing, by topic: {lacking}"))
    note = f"{len(messages)} messages"
    for robot, lines in opened.traces.items():
        replayed = _replayed([line.encode() for line in lines], path)
        problems += [Problem(1, 1, f"{robot}, line {p.line}: {p.text}") for p in replayed.problems]
        note += f", {replayed.decisions} decisions of {robot}"
    if opened.audit:
        problem = verify_plain(opened.audit)
        if wrong := problem.problem:
            problems.append(Problem(1, 1, f"audit log: row {wrong.number} {wrong.text}"))
        note += f", an audit log whose last row is {problem.rows} with the hash {problem.head}"
    doubts = [] if opened.is_whole else ["was cut short"]
    if is_part(path):
        doubts = [UNFINISHED]
    try:
        return problems, doubts, note, judged_recording(opened)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        text = f"facts that no run of dva-sim has written: {' '.join(repr(error).split())[:200]}"
        return [*problems, Problem(1, 1, text)], doubts, note, []


def judged_recording(opened: Opened) -> list[Verdict]:
    """Return the verdict on each safety rule, as far as the recording goes.

    A rule whose topics are missing is not judged, whatever the others show.
    """
    from dva_sim.simulation.full import verdicts as v  # late: start-up

    until = "" if opened.is_whole else f", up to {opened.playback.duration:.0f} s"
    judged = v.judged(opened.playback.recorder.facts, opened.terms, until)
    topics = missing_topics(opened)
    verdicts = list[v.Verdict]()
    for rule in dict.fromkeys([*v.RULES, *(verdict.rule for verdict in judged)]):
        if lacking := topics.get(rule):
            text = f"the recording lacks {listed(lacking)}"
            verdicts.append(v.Verdict(rule, v.NOT_JUDGED, text, lacks_facts=True))
        else:
            verdicts += [verdict for verdict in judged if verdict.rule == rule]
    return verdicts


def missing_topics(opened: Opened) -> dict[str, list[str]]:
    """Return the topics that a recording lacks, by the rules that need them.

    A whole file that does not say how many messages each topic had was filtered, and may lack any
    topic; of these, what no recording of facts is without is named.
    """
    from dva_sim.recordings.channels import MESSAGES, OBSERVED  # late: start-up
    from dva_sim.recordings.raw_records import is_camera  # late: start-up
    from dva_sim.simulation.full.verdicts import (  # late: start-up
        OF_MESSAGES,
        OF_REGIONS,
        OF_ROBOTS,
        OF_THE_DVA,
        RULES,
    )

    facts = opened.playback.recorder.facts
    terms = opened.terms
    if facts is None or terms is None:
        return {}
    regional = () if terms.region_at is None else tuple(OF_REGIONS)
    needed_by: dict[str, tuple[str, ...]] = {
        "book": (*OF_THE_DVA, *regional),
        "arrived": (*OF_MESSAGES, *regional),
        "heard": ("S2",),
        "places": ("S6",),
    }
    topics: dict[str, list[str]] = {}
    for topic in _lacking(opened):
        rules: tuple[str, ...] = (*RULES, *regional)
        if topic.startswith(OBSERVED):
            rules = needed_by.get(topic.removeprefix(OBSERVED), OF_ROBOTS)
        elif is_camera(topic):
            rules = OF_ROBOTS
        elif topic.startswith("/") and not topic.startswith(MESSAGES):
            rules = ()  # drawn, and not judged
        for rule in rules:
            if rule in (*OF_THE_DVA, *regional) or terms.motors:
                topics.setdefault(rule, []).append(topic)
    return topics


def _lacking(opened: Opened) -> Iterator[str]:
    """Yield the kinds of facts that a recording lacks, as far as it shows that."""
    from dva_sim.recordings.channels import OBSERVED  # late: start-up
    from dva_sim.recordings.writing import COUNTS  # late: start-up
    from dva_sim.simulation.full import observations as o  # late: start-up

    yield from sorted(opened.left_out)
    kinds = set(map(type, opened.playback.recorder.facts or ()))
    usual = {"moves": o.MotionNews, "book": o.BookNews}
    if not opened.is_counted:
        usual["arrived"] = o.Arrived
    for word, kind in usual.items():
        if kind not in kinds and f"{OBSERVED}{word}" not in opened.left_out:
            yield f"{OBSERVED}{word}"
    if opened.is_whole and not opened.is_counted:
        yield f"the metadata {COUNTS!r}, without which missing topics are not seen"


def check_trace(path: Path) -> Found:
    """Check a trace: decisions that differ when replayed, and a missing end."""
    *lines, rest = path.read_bytes().split(b"\n")
    replayed = _replayed(lines, path)
    return replayed.problems, [CUT] if rest else [], f"{replayed.decisions} decisions"


def check_audit_log(path: Path) -> Found:
    """Return the first wrong row of an audit log, its oddities, and its last hash.

    A problem's line is the row's number.
    """
    from dva_sim.recordings.audit_log import verify  # late: start-up

    try:
        verified = verify(path)
    except ConfigError as error:
        return [Problem(1, 1, error.problem)], [], ""
    wrong = verified.problem
    problems = (
        [] if wrong is None else [Problem(wrong.number, 1, f"row {wrong.number} {wrong.text}")]
    )
    rows = "1 row" if verified.rows == 1 else f"{verified.rows} rows"
    return problems, list(verified.doubts), f"{rows}, the last one with the hash {verified.head}"


def check_recorded_link(path: Path) -> Found:
    """Check a recorded link: packet opportunities, a log of delays, or bare delays."""
    from dva_sim.network.link import delay_logs, recorded  # late: start-up

    file = str(path)
    try:
        if delay_logs.is_delay_log(file):
            log = delay_logs.read_delay_log(file)
            return [], list(log.doubts), _of_delay_log(log)
        if path.suffix not in OPPORTUNITIES and not recorded.is_trace(file):
            delays = np.array(recorded.read_delays(file))
            return [], [], f"{len(delays)} delays, {_spread_of(delays)}"
        times = recorded.read_trace(file)
    except ConfigError as error:
        return [Problem(error.line or 1, error.column or 1, error.problem)], [], ""
    gap = recorded.longest_gap_s(times)
    lasts = float(times[-1])
    rate = len(times) * OPPORTUNITY_BYTES * 8 / lasts
    doubts = []
    if gap > LONG_GAP_S:
        doubts.append(
            f"carries nothing for {gap:,.0f} s at a stretch; a run that falls there carries nothing"
        )
    return (
        [],
        doubts,
        f"{len(times)} packet opportunities in {lasts:,.6g} s, {rate / 1e3:,.4g} kbit/s",
    )


def _of_delay_log(log: DelayLog) -> str:
    from dva_sim.network.link.delay_logs import WRITE  # late: start-up

    lost = float(np.isnan(log.delays).mean())
    lasts = log.times[-1] - log.times[0]
    runs = f" in {log.runs} runs of ping" if log.runs > 1 else ""
    ask = ""
    if log.assumed:
        unnamed = " and ".join(log.assumed)
        ask = f": assumed, as the file names no unit of its {unnamed}; if it is another, {WRITE}"
    return (
        f"{len(log.times)} probes{runs} in {lasts:,.6g} s, {lost:.1%} of them lost, "
        f"{_spread_of(log.delays)}; times in {log.units[0]}, delays in {log.units[1]}{ask}"
    )


def _spread_of(delays: Floats) -> str:
    usual, long = np.nanpercentile(delays, (50, 95)) * 1000
    return f"{usual:.3g} ms in the median, {long:.3g} ms at 95 %"


class _Replayed(NamedTuple):
    """Number of decisions replayed, and the decisions that differ."""

    decisions: int
    problems: list[Problem]


def _replayed(lines: Sequence[bytes], path: Path) -> _Replayed:
    problems = list[Problem]()
    count = 0
    try:
        for line, what, then, now in (_of_dva if _is_of_dva(lines) else _of_robot)(lines, path):
            count += 1
            if then != now:
                problem = f"{what}: decided was {then or 'nothing'}, and now is {now or 'nothing'}"
                problems.append(Problem(line, 1, problem))
    except ConfigError as error:
        problems.append(Problem(error.line or 1, 1, error.problem))
    return _Replayed(count, problems)


def _is_of_dva(lines: Sequence[bytes]) -> bool:
    try:
        return "scenario" in json.loads(lines[0])
    except (ValueError, IndexError, TypeError, RecursionError):
        return False


def _of_dva(lines: Sequence[bytes], path: Path) -> Iterator[tuple[int, str, str, str]]:
    from dva_sim.simulation.full.dva_trace import replay_dva  # late: start-up

    for line, what, then, now in replay_dva(lines, path):
        yield line, what, "; ".join(then), "; ".join(now)


def _of_robot(lines: Sequence[bytes], path: Path) -> Iterator[tuple[int, str, str, str]]:
    from dva_sim.agents.robot.decision_log import replay  # late: start-up

    # The first line is what the robot was; what has happened to it takes lines, too.
    numbers = (number for number, line in enumerate(lines, 1) if b'"message"' in line)
    for (message, then, now), line in zip(replay(path, lines), numbers, strict=False):
        yield line, type(message.body).__name__, str(tuple(then[:3])), str(tuple(now[:3]))
