"""Decisions on events as messages: pure, for any console and any control room."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from dva_sim.console.asking.refusal import Refused
from dva_sim.console.wire.actions import Asked
from dva_sim.console.wire.arguments import PlaceAsked, ReportAsked
from dva_sim.console.wire.events import DecidedShown, DispatchShown, EventDecisions
from dva_sim.console.wire.scenes import LabelledMoment
from dva_sim.console.wire.seats import Answered, CandidateShown
from dva_sim.protocol import messages as m
from dva_sim.protocol.control_room import FREE
from dva_sim.protocol.event_kinds import SEVERITIES
from dva_sim.worlds.site import Site

UNKNOWN_ROOM: Final = "unknown room"  # where no site is known
BEFORE: Final = 2.0  # farthest of an event from the place that somebody pointed at [m]
CERTAIN: Final = 0.9  # of what somebody in a control room reports
DECISIONS: Final = (
    *("event_acknowledge", "event_assign", "event_take_off", "event_false_alarm"),
    *("event_escalate", "event_note", "event_proposal", "dispatch_mode"),
)


def decision_of(
    line: Asked, device: Callable[[str], str], seen: Callable[[int], int | None]
) -> tuple[m.Body, str]:
    """Return the message that a page's line requests, and the text shown on success.

    Args:
        line: Line as checked by the web process.
        device: Function that returns the id of a label.
        seen: Number of known decisions on an event, for pages that do not send it.
    """
    number = line.get("event", 0)
    reason = line.get("reason") or None
    label = str(line.get("device", ""))

    def known() -> int | None:
        decisions: int | None = line.get("decisions")
        return seen(number) if decisions is None else decisions

    match line["do"]:
        case "event_acknowledge":
            return m.Acknowledge(number), f"event {number} is acknowledged"
        case "event_assign":
            text = f"{label} is sent to event {number}"
            task = line.get("task")
            return m.Assign(number, device(label), None, task, reason, known()), text
        case "event_take_off":
            text = f"{label} is called off event {number}"
            return m.TakeOff(number, device(label), reason, known()), text
        case "event_false_alarm":
            return m.FalseAlarm(number, reason or "", known()), f"event {number} is a false alarm"
        case "event_escalate":
            return m.Escalate(number, reason, known()), f"event {number} is escalated"
        case "event_note":
            return m.AddNote(number, str(line["text"])), f"noted at event {number}"
        case "event_proposal":
            return m.GetProposal(number), ""
    mode = str(line["mode"])
    asks = "the policy asks first" if mode == "ask_first" else "the policy decides by itself"
    return m.SetDispatch(mode, reason), asks


def on_site(line: PlaceAsked, site: Site | None) -> tuple[float, float]:
    """Return a place that a page names [m]; where no site is known, any place.

    Raises:
        Refused: it lies beyond the site.
    """
    x = line["x_m"]
    y = line["y_m"]
    left, low, right, high = (x, y, x, y) if site is None else site.extent
    if not (left <= x <= right and low <= y <= high):
        raise Refused("that is outside the site, where nobody can go")
    return x, y


def place_of(line: PlaceAsked, site: Site | None) -> tuple[float, float]:
    """Return where an event is raised [m]: on floor that a robot can reach, at the named place.

    Who points at a desk or a wall means the floor before it. Where no site is known, any place.

    Raises:
        Refused: nobody can go there.
    """
    x, y = on_site(line, site)
    if site is None:
        return x, y
    floor = site.floor_near(x, y, BEFORE)
    if floor is None:
        room = site.room_at(x, y)
        where = f"there in {room}" if room else "there"
        raise Refused(f"nobody can go {where}: a robot reaches no floor within {BEFORE:g} m")
    return floor


def report_of(line: ReportAsked, place: m.Position) -> tuple[m.EventReport, str]:
    """Return the report of an event raised at a page, and the text shown on success."""
    kind = str(line["kind"])
    severity = SEVERITIES[line["severity"]]
    report = m.EventReport(None, kind, place, severity, CERTAIN, "detected")
    return report, f"{kind.replace('_', ' ')} is raised"


def answer_of(reply: m.Reply, is_robot: Callable[[str], bool]) -> Answered:
    """Return what a page gets of a reply besides success: a proposal with its reasons."""
    proposal = reply.content
    if not isinstance(proposal, m.Proposal):
        return {}
    label = next((c.label for c in proposal.candidates if c.device == proposal.device), "")
    return {
        "proposal": {
            "event": proposal.event_id,
            "policy": proposal.policy,
            "reason": proposal.reason,
            "task": proposal.task,
            "label": label,
            "arrival_s": proposal.arrival_in,
            "decide_within_s": proposal.decide_within,
            "candidates": [_candidate(each, is_robot) for each in proposal.candidates],
        }
    }


def _candidate(who: m.Candidate, is_robot: Callable[[str], bool]) -> CandidateShown:
    return {
        "label": who.label,
        "robot": is_robot(who.device),
        "can": who.arrival_in is not None,
        "free": who.arrival_in is not None and who.reason == FREE,
        "reason": who.reason,
        "arrival_s": who.arrival_in,
    }


def about_event(status: m.EventStatus, received_at: float) -> EventDecisions:
    """Return what a page gets of an event besides what everybody sees, as stated at a time [s]."""
    last = status.last_decision
    decided = None
    if last is not None:
        decided = DecidedShown(
            label=last.label,
            action=last.action,
            at_ms=moment_ms(received_at - last.ago),
            reason=last.reason or "",
        )
    return {
        "decisions": status.decisions,
        "acknowledged": by_whom(status.acknowledged, received_at),
        "decided": decided,
        "note": status.note,
    }


def dispatch_shown(status: m.DispatchStatus | None, at: float) -> DispatchShown | None:
    """Return the dispatch mode, as the DVA reported it at a time [s]."""
    if status is None:
        return None
    by = status.switched
    return {
        "mode": status.dispatch_mode,
        "decide_within_s": status.decide_within,
        "switched": None if by is None else {"label": by.label, "at_ms": moment_ms(at)},
    }


def moment_ms(seconds: float) -> int:
    """Return the time to the tenth of a second [ms]: one moment said twice stays one."""
    return 100 * round(10 * seconds)


def by_whom(whom: m.ByWhom | None, at: float) -> LabelledMoment | None:
    """Return who did something, and when."""
    return None if whom is None else {"label": whom.label, "at_ms": moment_ms(at - whom.ago)}
