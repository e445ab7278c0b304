"""Actions of people at an attached console: each becomes messages, and nothing else."""

from __future__ import annotations

from functools import partial
from typing import Final

from dva_sim.console.asking.answers import BYE
from dva_sim.console.asking.dispatcher import ActionDispatcher, does
from dva_sim.console.asking.refusal import OnResult, Refused, unanswered
from dva_sim.console.asking.releases import NOBODY_STOPPED, release_robots
from dva_sim.console.attached.decisions import AttachedDecisions
from dva_sim.console.attached.lines import emergency_of
from dva_sim.console.attached.pages import AttachedPages
from dva_sim.console.events.alarm_actions import AlarmActions
from dva_sim.console.wire.actions import ActionPlace, Asked
from dva_sim.console.wire.arguments import (
    FakeAsked,
    LogsLooked,
    OfDevice,
    OfSome,
    RobotsWatched,
)
from dva_sim.console.wire.seats import DoneLine
from dva_sim.protocol import messages as m

NOT_HERE: Final = "this console is attached to a DVA that runs elsewhere: that cannot be done here"


class AttachedActions:
    """Does what lines of the web process ask for.

    Args:
        pages: Pages of the system to which the console is attached.

    Attributes:
        take: Does what a line asks for.
    """

    def __init__(self, pages: AttachedPages) -> None:
        self._pages, self._system = pages, pages.system
        decisions = AttachedDecisions(self._system, pages.people)
        author = pages.people.author
        alarms = AlarmActions(pages.alarms, author, lambda *given: dispatcher.do(*given))
        dispatcher = ActionDispatcher(
            *(ActionPlace.ATTACHED, (self, decisions, alarms), self._tell, NOT_HERE),
            lambda: pages.audited,
        )
        self.take = dispatcher.take

    @does("look")
    def _look(self, _: str, line: LogsLooked) -> None:
        self._pages.looked = "devices" in line["tables"]

    @does("watch")
    def _watch(self, _: str, line: RobotsWatched) -> None:
        self._pages.sensors.watch(line["robots"])

    def _tell(self, answer: DoneLine) -> None:
        self._pages.tell({**answer, "t": self._system.now_ms})

    @does("release")
    def _release(self, client: str, line: Asked, on_result: OnResult) -> None:
        """Nothing is in hand; but a page may be gone for good."""
        if str(line["id"]).startswith(BYE):
            self._pages.people.leave(client)
        on_result(True, "released")

    @does("emergency")
    def _emergency(self, _: str, line: OfSome, on_result: OnResult) -> None:
        """Stop robots, each over its own connection; those that do not reply are named."""
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
                unanswered(on_result, f"no answer of {', '.join(deaf)}")
            elif not left:
                on_result(True, "robots stop")

        for robot in robots:
            ok, failed = partial(ended, robot, True), partial(ended, robot, False)
            system.device.ask(robot, m.Emergency(), lambda _, ok=ok: ok(), failed)  # type: ignore[misc]

    @does("release_emergency")
    def _release_emergency(self, _: str, line: OfSome, on_result: OnResult) -> None:
        """Release robots that an emergency holds; the DVA decides whether this console may."""
        system, wanted = self._system, line.get("robots", "all")
        now, devices = system.device.clock.now, system.state.devices
        robots = [i for i in system.robots() if emergency_of(devices[i], now, {}) is not None]
        if isinstance(wanted, list):
            robots = [i for i in robots if system.numbers.get(i) in wanted]
        if not robots:
            raise Refused(NOBODY_STOPPED)
        labels = {robot: system.label_of(robot) for robot in robots}
        release_robots(robots, labels, system.agent.ask, on_result)

    @does("revoke")
    def _revoke(self, _: str, line: OfDevice, on_result: OnResult) -> None:
        robot = line["device"]
        if robot not in self._system.robots():
            raise Refused(f"the DVA has listed no robot {robot}")

        def answered(reply: m.Reply) -> None:
            done = f"the permission for {self._system.label_of(robot)} is revoked"
            on_result(reply.code == m.OK, reply.text or done)

        self._system.agent.ask(m.Revoke(robot), answered, partial(unanswered, on_result))

    @does("fake_add")
    def _add_fake(self, _: str, line: FakeAsked, on_result: OnResult) -> None:
        if self._system.options.keys is not None:
            raise Refused("with --keys, a fake device would need a key of its own")
        self._system.fakes.add(line, on_result)

    @does("fake_remove")
    def _remove_fake(self, _: str, line: OfDevice, on_result: OnResult) -> None:
        label = self._system.fakes.remove(line["device"])
        on_result(
            True, f"{label} speaks no more: the DVA takes it from its list within some seconds"
        )
