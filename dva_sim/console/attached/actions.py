"""Actions that people at the pages of an attached console ask for."""

from __future__ import annotations

from dva_sim.console.asking.dispatcher import ActionDispatcher, does
from dva_sim.console.asking.refusal import OnResult
from dva_sim.console.attached.pages import AttachedPages
from dva_sim.console.bench import NOT_HERE, ServerActions
from dva_sim.console.driving.decision_actions import DecisionActions
from dva_sim.console.driving.drive_actions import LOOK, Driving, is_gone_for_good
from dva_sim.console.events.alarm_actions import AlarmActions
from dva_sim.console.wire.actions import ActionPlace, Asked
from dva_sim.console.wire.arguments import (
    LogsLooked,
    PagesHere,
    RobotsWatched,
)
from dva_sim.console.wire.seats import DoneLine


class AttachedActions:
    """Does what lines of the web process ask for.

    Args:
        pages: Pages of the system to which the console is attached.

    Attributes:
        take: Does what a line asks for.
    """

    def __init__(self, pages: AttachedPages) -> None:
        self._pages = pages
        system = pages.system
        self._driving = driving = Driving(pages.driven)
        decisions = DecisionActions(pages.driven, pages.people, driving)
        author = pages.people.author
        alarms = AlarmActions(pages.alarms, author, lambda *given: dispatcher.do(*given))
        dispatcher = ActionDispatcher(
            ActionPlace.ATTACHED,
            holders=(self, driving, decisions, alarms, system.fakes, ServerActions(system.bench)),
            tell=self._tell,
            elsewhere=NOT_HERE,
            audited=lambda: pages.audited,
        )
        self.take = dispatcher.take
        pages.clock.pulse(LOOK, driving.look)

    @does("look")
    def _look(self, _: str, line: LogsLooked) -> None:
        self._pages.look(line)

    @does("watch")
    def _watch(self, _: str, line: RobotsWatched) -> None:
        self._pages.sensors.watch(line["robots"])

    def _tell(self, answer: DoneLine) -> None:
        self._pages.tell({**answer, "t": self._pages.system.now_ms})

    @does("release")
    def _release(self, client: str, line: Asked, on_result: OnResult) -> None:
        if is_gone_for_good(line):
            self._pages.people.leave(client)
            self._pages.let_go()
        self._driving.release(client, on_result)

    @does("here")
    def _here(self, _: str, line: PagesHere) -> None:
        self._driving.attend(line)

    @does("gone")
    def _gone(self, client: str, _: Asked) -> None:
        self._driving.end_hidden(client)
