"""Verdicts on the safety rules: each was kept, broken by a device, or not judged.

A `Judge` takes the facts of a live run or of a recording, and lets the audit compare them with the
rules. It runs nothing of the program that was recorded.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from dva_sim.kernel.errors import DvaSimError, ExitCode
from dva_sim.kernel.recorder import Accepted, Breach, ByHand, Recorder, Sent
from dva_sim.protocol.messages import Position
from dva_sim.simulation.full import observations as o
from dva_sim.simulation.full.safety_checks import OBEYS_WITHIN, SafetyAudit

RULES: Final = {
    "S1": "a robot moves only by a valid command in time, or a mission that holds",
    "S2": "a robot has one owner, and changes hands at a standstill",
    "S3": "an emergency stops a robot until a permitted person releases it",
    "S4": "motors stay within their limits",
    "S5": "nobody acts without a permission",
    "S6": "no event is lost, counted twice or left waiting",
    "S7": "the times of events are in order",
}
OF_REGIONS: Final = {
    "S12": "a device obeys one DVA at a time, and no DVA whose epoch is over orders anybody",
    "S13": "an event whose report was kept by two DVAs survives the death of one",
    "S14": "DVAs that hear each other have one DVA for a region, and one look at an event",
    "S15": "help that was lent comes back",
}
"""Rules of runs with several DVAs."""
OF_ROBOTS: Final = ("S1", "S2", "S3", "S4", "S5")
OF_THE_DVA: Final = ("S6", "S7")
_AT_ROBOTS: Final = ("S1", "S2", "S3", "S5")  # rules on messages that reach robots
_AT_THE_DVA: Final = ("S2", "S6")  # rules on messages that reach the DVA
OF_MESSAGES: Final = tuple(sorted({*_AT_ROBOTS, *_AT_THE_DVA}))
SETTLES: Final = OBEYS_WITHIN  # time for which facts missing in a gap may still have effects [s]
EVENTS_UNKNOWN = "what the DVA's book showed is not known here"
MAX_SPANS: Final = 3  # maximum gaps that a verdict names
HELD = "held"
BROKEN = "broken"
NOT_JUDGED = "not judged"


@dataclass(frozen=True)
class Verdict:
    """Verdict on one rule.

    Attributes:
        rule: Name of the rule, such as `S1`.
        state: `held`, `broken` or `not judged`.
        text: The rule in words, a breach of it, or the reason why it was not judged.
        lacks_facts: True if it was not judged because facts are missing that should be there.
    """

    rule: str
    state: str
    text: str
    lacks_facts: bool = False

    @property
    def is_broken(self) -> bool:
        """Return True if the rule is broken."""
        return self.state == BROKEN

    def __str__(self) -> str:
        return f"{self.rule} {self.state}: {self.text}"


def rules_on(sees_robots: bool, sees_dva: bool, of_strangers: bool) -> tuple[str, ...]:
    """Return the rules that depend on facts of a part of a run.

    Args:
        sees_robots: The part sees how robots move.
        sees_dva: It sees the DVA's book.
        of_strangers: The facts are messages of devices from outside the run, or to them.
    """
    rules: set[str] = set()
    if sees_robots:
        rules |= {*(_AT_ROBOTS if of_strangers else OF_ROBOTS)}
    elif not sees_dva:  # an operator, whose messages reach robots
        rules |= {*_AT_ROBOTS}
    if sees_dva:
        rules |= {*_AT_THE_DVA, *(() if of_strangers else ("S5", *OF_THE_DVA))}
    return tuple(sorted(rules))


def broken_lines(broken: Iterable[Breach]) -> dict[str, list[str]]:
    """Return a line for each rule and agent that broke it: agent, first time, count, breach."""
    lines: dict[str, list[str]] = {}
    for breach in sorted(broken, key=lambda each: (each.rule, each.time, each.who)):
        times = f", seen {breach.count} times" if breach.count > 1 else ""
        text = f"{breach.who}, at {breach.time:.1f} s{times}: {breach.what}"
        lines.setdefault(breach.rule, []).append(text)
    return lines


def verdicts(
    recorder: Recorder,
    not_judged: Mapping[str, str] | None = None,
    until: str = "",
    lost: Mapping[str, str] | None = None,
    *,
    of_regions: bool = False,
) -> list[Verdict]:
    """Return a verdict on each rule, in order; one for each agent where several broke it.

    Args:
        recorder: Holds the breaches that an audit has found.
        not_judged: Rules that could not be judged, each with the reason.
        until: Time up to which the run was judged, in words; empty: all of it.
        lost: Rules that lack facts which should be there, each with the reason.
        of_regions: True to judge the rules of several DVAs as well.
    """
    broken = broken_lines(recorder.broken.values())
    why_not = not_judged or {}
    lost = lost or {}
    entries: list[Verdict] = []
    for rule, says in (RULES | OF_REGIONS if of_regions else RULES).items():
        if rule in broken:
            entries += [Verdict(rule, BROKEN, line) for line in broken[rule]]
        elif rule in lost:
            entries.append(Verdict(rule, NOT_JUDGED, lost[rule], lacks_facts=True))
        elif rule in why_not:
            entries.append(Verdict(rule, NOT_JUDGED, why_not[rule]))
        else:
            entries.append(Verdict(rule, HELD, says + until))
    return entries


class RulesBroken(DvaSimError):
    """A run has broken safety rules."""

    exit_code = ExitCode.DOES_NOT_HOLD


class RulesNotJudged(DvaSimError):
    """Facts are missing to judge a run by all safety rules; no rule is known to be broken."""

    exit_code = ExitCode.NOT_JUDGED


def refuse_unheld(entries: Sequence[Verdict]) -> None:
    """Raise an error if any rule was broken, or could not be judged for lack of facts.

    Raises:
        RulesBroken: one was broken.
        RulesNotJudged: none was broken, but facts are missing.
    """
    if broken := broken_rules(entries):
        raise RulesBroken(broken)
    if unjudged := unjudged_rules(entries):
        raise RulesNotJudged(unjudged)


def unjudged_rules(entries: Iterable[Verdict]) -> str:
    """Return the names of all rules that lack facts in a line; empty: none."""
    unjudged = [verdict.rule for verdict in entries if verdict.lacks_facts]
    return f"facts are missing to judge {', '.join(unjudged)}" if unjudged else ""


def broken_rules(entries: Iterable[Verdict]) -> str:
    """Return the names of all broken rules in a line; empty: none."""
    broken = dict.fromkeys(verdict.rule for verdict in entries if verdict.is_broken)
    return f"the run has broken {', '.join(broken)}" if broken else ""


class Judge:
    """Lets the audit judge facts in their order.

    Args:
        terms: Limits that the run is held to.
    """

    def __init__(self, terms: o.SafetyTerms) -> None:
        self.recorder = Recorder()
        self._terms = terms
        merge_distance = terms.rules.merge_distance
        self._events = {dva: o.EventTableCopy(merge_distance) for dva in terms.dvas}
        self._motions: dict[str, o.RobotMotion] = {}
        self._places: dict[str, Position] = {}
        self._audit = SafetyAudit(self.recorder, terms, self._motion_of, self._places.get)
        self._sees_robots = self._sees_dva = False
        self._gaps: list[o.FactGap] = []

    def _motion_of(self, robot: str) -> o.RobotMotion:
        return self._motions.get(robot, o.STATIONARY)

    def take(self, fact: Any) -> None:
        """Judge one more fact."""
        audit = self._audit
        now = fact.time
        match fact:
            case Sent():
                audit.sent(now, fact.source, fact.destination, fact.payload)
            case o.Arrived():
                audit.delivered(now, fact.source, fact.to, fact.payload)
            case Accepted() if fact.robot in self._terms.motors:
                audit.accepted(fact)
            case ByHand() if fact.robot in self._terms.motors:
                audit.by_hand(fact)
            case o.MotionNews():
                self._sees_robots = True
                motions = {r: of for r, of in fact.motions.items() if r in self._terms.motors}
                self._motions |= motions
                audit.moves(now, self._motions)
            case o.BookNews() if fact.dva in self._events:
                self._sees_dva = True
                audit.knows_places(bool(self._places))
                audit.shows(now, self._events[fact.dva].page(fact))
            case o.Heard():
                for device in fact.devices:
                    audit.heard(now, device)
            case o.PlaceNews():
                self._places |= fact.places
            case o.Deafened():
                audit.deafened(now, fact.robot, fact.deaf)
            case o.Slowed():
                audit.slowed(now, fact.processing)
            case o.FactGap():
                self._gaps.append(fact)
        self._forget_doubtful()

    def _forget_doubtful(self) -> None:
        """Forget breaches that facts which were lost might explain."""
        broken = self.recorder.broken
        for gap in self._gaps if broken else ():
            for key in [key for key, breach in broken.items() if _is_doubtful(breach, gap)]:
                del broken[key]

    def verdicts(self, until: str = "") -> list[Verdict]:
        """Return the verdicts so far; see the function `verdicts`."""
        lost = {rule: _lost(gaps) for rule in RULES if (gaps := self._gaps_of(rule))}
        of_regions = self._terms.region_at is not None
        return verdicts(self.recorder, self._not_judged(), until, lost, of_regions=of_regions)

    def _not_judged(self) -> dict[str, str]:
        why_not: dict[str, str] = {}
        if not self._terms.motors:
            why_not |= dict.fromkeys(OF_ROBOTS, "no robot of the scenario takes part")
        elif not self._sees_robots:
            why_not |= dict.fromkeys(OF_ROBOTS, "how the robots moved is not known here")
        if not self._sees_dva:
            why_not |= dict.fromkeys(OF_THE_DVA, EVENTS_UNKNOWN)
        return why_not

    def _gaps_of(self, rule: str) -> list[o.FactGap]:
        return [gap for gap in self._gaps if not gap.rules or rule in gap.rules]


def _is_doubtful(breach: Breach, gap: o.FactGap) -> bool:
    is_of_rule = not gap.rules or breach.rule in gap.rules
    return is_of_rule and gap.since <= breach.time <= gap.time + SETTLES


def _lost(gaps: Sequence[o.FactGap]) -> str:
    """Return when which facts were lost, in words."""
    spans = ", ".join(
        f"from {gap.since:.1f} s on"
        if math.isinf(gap.time)
        else f"from {gap.since:.1f} s to {gap.time:.1f} s"
        for gap in gaps[:MAX_SPANS]
    )
    more = f" and {len(gaps) - MAX_SPANS} more times" if len(gaps) > MAX_SPANS else ""
    missing = sum(gap.missing for gap in gaps)
    return f"{spans}{more} {missing} facts could not be kept; held otherwise"


def judged(
    facts: Iterable[Any] | None, terms: o.SafetyTerms | None, until: str = ""
) -> list[Verdict]:
    """Return the verdicts on a recorded run.

    Args:
        facts: Its facts in order; None: it was recorded without them.
        terms: Limits that it is held to; None: likewise.
        until: See `verdicts`.
    """
    if facts is None or terms is None:
        lacks = dict.fromkeys(RULES, "it lacks what the DVA's book showed")
        lacks |= dict.fromkeys(OF_ROBOTS, "it lacks how robots moved, and what reached them when")
        return verdicts(Recorder(), lost=lacks)
    judge = Judge(terms)
    for fact in facts:
        judge.take(fact)
    return judge.verdicts(until)
