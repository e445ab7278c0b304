"""What people at an attached console ask for: it becomes messages, and nothing else."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final

from dva_sim.console.answers import Answers
from dva_sim.console.attached.decisions import AttachedDecisions
from dva_sim.console.attached.system import AttachedSystem
from dva_sim.console.refusal import Refused, Said
from dva_sim.protocol import messages as m

Line = dict[str, Any]
NOT_HERE: Final = "this console is attached to a DVA that runs elsewhere: that cannot be done here"


class AttachedActions:
    """Does what lines of the web process ask for.

    Args:
        system: To which the console is attached.
    """

    def __init__(self, system: AttachedSystem) -> None:
        self._system, self._answers = system, Answers()
        self._doers: Mapping[str, Callable[[Line, Said], object]] = {
            "emergency": self._emergency,
            "revoke": self._revoke,
            "fake_add": self._add_fake,
            "fake_remove": self._remove_fake,
            "release": lambda _, said: said(True, "released"),
            **AttachedDecisions(system).doers,
        }

    def take(self, line: Line) -> None:
        """Do what a line asks for; nothing that it can hold does any harm."""
        what, number = str(line.get("do", "")), line.get("id")
        if what == "look":
            tables = line.get("tables")
            self._system.looked = isinstance(tables, list) and "devices" in tables
        elif isinstance(number, str):
            self._answers.once(number, partial(self._do, what, line), self._tell)

    def _do(self, what: str, line: Line, said: Said) -> None:
        do = self._doers.get(what)
        if do is None:
            raise Refused(NOT_HERE)
        do(line, said)

    def _tell(self, answer: Line) -> None:
        self._system.tell({**answer, "t": self._system.now_ms})

    def _emergency(self, line: Line, said: Said) -> None:
        """Each robot is told by a connection of its own; who does not answer is named."""
        system, wanted = self._system, line.get("robots", "all")
        robots = system.robots()
        if isinstance(wanted, list):
            robots = [i for i in robots if system.number_of(i) in wanted]
        if not robots:
            raise Refused("the DVA has listed no robot")
        left, deaf = set(robots), list[str]()

        def ended(robot: str, ok: bool) -> None:
            left.discard(robot)
            if not ok:
                deaf.append(system.label_of(robot))
            if not left:
                said(not deaf, f"no answer of {', '.join(deaf)}" if deaf else "robots stop")

        for robot in robots:
            ok, failed = partial(ended, robot, True), partial(ended, robot, False)
            system.device.ask(robot, m.Emergency(), lambda _, ok=ok: ok(), failed)  # type: ignore[misc]

    def _revoke(self, line: Line, said: Said) -> None:
        robot = str(line.get("device"))
        if robot not in self._system.robots():
            raise Refused(f"the DVA has listed no robot {robot}")

        def answered(reply: m.Reply) -> None:
            done = f"the permission for {self._system.label_of(robot)} is revoked"
            said(reply.code == m.OK, reply.text or done)

        failed = partial(said, False, "the DVA does not answer")
        self._system.agent.ask(m.Revoke(robot), answered, failed)

    def _add_fake(self, line: Line, said: Said) -> None:
        if self._system.options.keys is not None:
            raise Refused(
                "with keys nobody can pretend to be a device: it would need one of its own"
            )
        self._system.fakes.add(line, said)

    def _remove_fake(self, line: Line, said: Said) -> None:
        label = self._system.fakes.remove(line.get("device"))
        said(True, f"{label} speaks no more: the DVA takes it from its list within some seconds")
