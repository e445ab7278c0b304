"""What people at an attached console ask for: it becomes messages, and nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any, Final

from dva_sim.console.alarm_actions import AlarmActions, Doer
from dva_sim.console.answers import BYE, Answers, answering
from dva_sim.console.attached.decisions import AttachedDecisions
from dva_sim.console.attached.pages import AttachedPages
from dva_sim.console.refusal import Refused, Said, unanswered
from dva_sim.protocol import messages as m

Line = dict[str, Any]
NOT_HERE: Final = "this console is attached to a DVA that runs elsewhere: that cannot be done here"


class AttachedActions:
    """Does what lines of the web process ask for.

    Args:
        pages: Of the system to which the console is attached.
    """

    def __init__(self, pages: AttachedPages) -> None:
        self._pages, self._system, self._answers = pages, pages.system, Answers()
        decisions = AttachedDecisions(self._system, pages.people)
        alarms = AlarmActions(pages.alarms, pages.people.author, self._acknowledge)
        self._decide = decisions.decide
        self._doers: Mapping[str, Doer] = {
            "emergency": self._emergency,
            "revoke": self._revoke,
            "fake_add": self._add_fake,
            "fake_remove": self._remove_fake,
            "release": self._release,
            **decisions.doers,
            **alarms.doers,
        }

    def take(self, line: Line) -> None:
        """Do what a line asks for; nothing that it can hold does any harm."""
        what, number = str(line.get("do", "")), line.get("id")
        if what == "look":
            tables = line.get("tables")
            self._pages.looked = isinstance(tables, list) and "devices" in tables
        elif what == "watch":
            robots = line.get("robots")
            self._pages.sensors.watch(robots if isinstance(robots, list) else [])
        elif isinstance(number, str):
            self._answers.once(
                number,
                partial(self._do, what, line),
                self._tell,
                repeats=what == "emergency",
            )

    def _do(self, what: str, line: Line, said: Said) -> None:
        do = self._doers.get(what)
        if do is None:
            raise Refused(NOT_HERE)
        client = str(line.get("client", ""))
        said = self._pages.audited.answered(what, client, line, said)
        answering(partial(do, client, line), said)

    def _acknowledge(self, client: str, line: Line, said: Said) -> None:
        """An alarm is seen that an event is behind: a decision like any other."""
        said = self._pages.audited.answered("event_acknowledge", client, line, said)
        self._decide(client, line, said)

    def _tell(self, answer: Line) -> None:
        self._pages.tell({**answer, "t": self._system.now_ms})

    def _release(self, client: str, line: Line, said: Said) -> None:
        """Nothing is in hand; but a page may be gone for good."""
        if str(line["id"]).startswith(BYE):
            self._pages.people.leave(client)
        said(True, "released")

    def _emergency(self, _: str, line: Line, said: Said) -> None:
        """Each robot is told by a connection of its own; who does not answer is named."""
        system, wanted = self._system, line.get("robots", "all")
        robots = system.robots()
        if isinstance(wanted, list):
            robots = [i for i in robots if system.numbers.get(i) in wanted]
        if not robots:
            raise Refused("the DVA has listed no robot")
        left, deaf = set(robots), list[str]()

        def ended(robot: str, ok: bool) -> None:
            left.discard(robot)
            if not ok:
                deaf.append(system.label_of(robot))
            if not left and deaf:
                unanswered(said, f"no answer of {', '.join(deaf)}")
            elif not left:
                said(True, "robots stop")

        for robot in robots:
            ok, failed = partial(ended, robot, True), partial(ended, robot, False)
            system.device.ask(robot, m.Emergency(), lambda _, ok=ok: ok(), failed)  # type: ignore[misc]

    def _revoke(self, _: str, line: Line, said: Said) -> None:
        robot = str(line.get("device"))
        if robot not in self._system.robots():
            raise Refused(f"the DVA has listed no robot {robot}")

        def answered(reply: m.Reply) -> None:
            done = f"the permission for {self._system.label_of(robot)} is revoked"
            said(reply.code == m.OK, reply.text or done)

        self._system.agent.ask(m.Revoke(robot), answered, partial(unanswered, said))

    def _add_fake(self, _: str, line: Line, said: Said) -> None:
        if self._system.options.keys is not None:
            raise Refused(
                "with keys nobody can pretend to be a device: it would need one of its own"
            )
        self._system.fakes.add(line, said)

    def _remove_fake(self, _: str, line: Line, said: Said) -> None:
        label = self._system.fakes.remove(line.get("device"))
        said(True, f"{label} speaks no more: the DVA takes it from its list within some seconds")
