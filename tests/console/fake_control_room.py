"""Control room actions in the fake world: invented events, and a real audit log."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from dva_sim.console.events.alarms import AlarmCondition, Alarms
from dva_sim.recordings.audit_log import BEGIN, AuditEntry, AuditLog

Line = dict[str, Any]
UNDECIDED = {"decisions": 0, "acknowledged": None, "decided": None, "note": None}
WHO = {"robot-2": 41.0, "robot-3": 58.0, "guard-1": 74.0}  # could go, and when they would be there


class FakeControlRoom:
    """Part of the fake world: events that people decide on.

    Attributes:
        decided: By event: what stands in its row beside what the world invents.
        more: Further fields of the answer to an action.
    """

    ms: int
    t: float
    more: Line
    hostile: bool

    def open_audit_log(self, place: str) -> Path:
        """Begin, with an audit log in a file or a folder; where it is."""
        self.decided: dict[int, Line] = {}
        self.raised: list[Line] = []
        self.rooms: dict[str, Line] = {}
        self.mode: Line = {"mode": "automatic", "decide_within_s": 20.0, "switched": None}
        self.alarms = Alarms()
        path = Path(place)
        self.log = AuditLog(path / "audit.sqlite" if path.is_dir() else path)
        self.log.append([self._entry("console", BEGIN)])
        return self.log.path

    def _entry(self, author: str, action: str, **more: Any) -> AuditEntry:
        return AuditEntry(time_s=self.t, at_utc="", author=author, action=action, **more)

    def dispatch_lines(self) -> list[Line]:
        """Lines that pages receive repeatedly."""
        control = {"k": "control", "dispatch": self.mode, "rooms": list(self.rooms.values())}
        now = self.t
        alarms = {
            "k": "alarms",
            "alarms": self.alarms.rows(now),
            "shelved": self.alarms.shelved(now),
            "flood": self.alarms.is_flood,
            "rate": self.alarms.rate(now),
            "left_out": 0,
        }
        audit = {
            "k": "audit",
            "rows": self.log.number,
            "hash": self.log.head,
            "problem": "",
            "lasting": False,
            "file": "",
        }
        return [control, alarms, audit]

    def with_decisions(self, events: Line) -> Line:
        """The line of events, with what was decided and raised; their alarms are noted."""
        rows = [
            row | UNDECIDED | self.decided.get(row["number"], {})
            for row in (*events["events"], *self.raised)
        ]
        self.alarms.update([self._condition(row) for row in rows], self.t)
        return {"k": "events", "events": rows}

    @staticmethod
    def _condition(row: Line) -> AlarmCondition:
        seen = row["acknowledged"]
        return AlarmCondition(
            f"event {row['number']}",
            row["kind"],
            row["severity"],
            row["room"],
            f"{row['kind']}, {row['room']}",
            row["reported_ms"],
            row["number"],
            seen and seen["label"],
        )

    def _who(self, asked: Line) -> str:
        if asked["client"] not in self.rooms:
            self.do_room_join({"client": asked["client"], "name": ""})
        return str(self.rooms[asked["client"]]["label"])

    def _decide(self, asked: Line, action: str, **more: Any) -> str:
        row = self.decided.setdefault(asked["event"], {"decisions": 0})
        seen = asked.get("decisions")
        if seen is not None and seen != row.get("decisions", 0):
            raise ValueError(f"decided meanwhile: {row['decided']['action']}")
        who = self._who(asked)
        why = asked.get("reason", "")
        last = {"label": who, "action": action, "at_ms": self.ms, "reason": why}
        row |= {"decisions": row.get("decisions", 0) + 1, "decided": last, **more}
        self._write(who, action, asked)
        return f"event {asked['event']}: {action}"

    def _write(self, who: str, action: str, asked: Line) -> None:
        about: Line = {"event": asked.get("event"), "subject": str(asked.get("device", ""))}
        about |= {"cause": asked.get("reason", ""), "text": asked.get("text", "")}
        details: Line = {"waited_s": self.t}
        if action == "assign":
            details |= {"arrival_s": WHO[asked["device"]], "advised": "robot-2", "advised_s": 41.0}
        self.log.append([self._entry(who, action, role="dispatch", details=details, **about)])

    def do_room_join(self, asked: Line) -> str:
        """Somebody opens the page Events."""
        client = asked["client"]
        label = asked["name"] or f"supervise-{len(self.rooms) + 1}"
        self.rooms[client] = {"label": label, "role": "supervise", "client": client}
        return f"you are {label}"

    def do_event_raise(self, asked: Line) -> str:
        """Somebody has seen something."""
        number = 100 + len(self.raised)
        row: Line = {"number": number, "state": "pending", "since_ms": self.ms}
        row |= {"reported_ms": self.ms, "assigned": [], "room": "somewhere", "over": False}
        row |= {"latitude_deg": 38.66, "longitude_deg": -9.2, "severity_value": 0.5}
        self.raised.append(row | {k: asked[k] for k in ("kind", "severity", "x_m", "y_m")})
        self._write(self._who(asked), "raise", {"event": number})
        self.more = {"event": number}
        return f"event {number} is raised"

    def do_event_acknowledge(self, asked: Line) -> str:
        """Somebody has seen an event."""
        row, who = self.decided.setdefault(asked["event"], {"decisions": 0}), self._who(asked)
        if row.get("acknowledged"):
            raise ValueError(f"acknowledged by {row['acknowledged']['label']} already")
        row["acknowledged"] = {"label": who, "at_ms": self.ms}
        self._write(who, "acknowledge", asked)
        return f"event {asked['event']} is acknowledged"

    def do_event_assign(self, asked: Line) -> str:
        """Somebody is sent."""
        return self._decide(asked, "assign", assigned=[asked["device"]], state="assigned")

    def do_event_take_off(self, asked: Line) -> str:
        """Somebody is called off."""
        return self._decide(asked, "take off", assigned=[], state="pending")

    def do_event_false_alarm(self, asked: Line) -> str:
        """There is nothing."""
        return self._decide(asked, "false alarm", assigned=[], state="refuted", over=True)

    def do_event_escalate(self, asked: Line) -> str:
        """Others have to go."""
        return self._decide(asked, "escalate", assigned=[], state="escalated", over=True)

    def do_event_note(self, asked: Line) -> str:
        """Somebody writes something down."""
        self.decided.setdefault(asked["event"], {"decisions": 0})["note"] = asked["text"]
        self._write(self._who(asked), "note", asked)
        return "noted"

    def do_event_proposal(self, asked: Line) -> str:
        """The policy's proposal."""
        strange = "<img src=x onerror=alert(1)>" if self.hostile else "free"
        could = [(who, True, strange, when) for who, when in WHO.items()]
        rows = [
            {"label": who, "robot": who.startswith("robot"), "can": can, "free": can}
            | {"reason": reason, "arrival_s": when}
            for who, can, reason, when in (*could, ("guard-2", False, "at event 1", None))
        ]
        about = {"event": asked["event"], "policy": "nearest", "reason": "is there first"}
        about |= {"task": "confirm", "label": "robot-2", "arrival_s": 41.0}
        self.more = {"proposal": about | {"decide_within_s": None, "candidates": rows}}
        return ""

    def do_dispatch_mode(self, asked: Line) -> str:
        """Set the dispatch mode."""
        by = {"label": self._who(asked), "at_ms": self.ms}
        self.mode = self.mode | {"mode": asked["mode"], "switched": by}
        return str(asked["mode"])

    def do_mission(self, asked: Line) -> str:
        """A robot goes somewhere by itself."""
        return f"robot {asked['robot']} goes there"

    def do_alarm_acknowledge(self, asked: Line) -> str:
        """Somebody has seen an alarm."""
        for key in self.alarms.members(asked["alarm"]):
            self.alarms.acknowledge(key, self._who(asked))
        return "seen"

    def do_alarm_shelve(self, asked: Line) -> str:
        """Not now."""
        for key in self.alarms.members(asked["alarm"]):
            self.alarms.shelve(key, asked["for_s"], self._who(asked), self.t)
        return "shelved"

    def do_alarm_unshelve(self, asked: Line) -> str:
        """Now."""
        self.alarms.unshelve(asked["alarm"], self.t)
        return "back"
