"""Actions that people at the pages of a system ask for, of whatever DVA."""

from __future__ import annotations

from collections.abc import Iterable

from dva_sim.console.asking.dispatcher import ActionDispatcher, does
from dva_sim.console.asking.refusal import OnResult
from dva_sim.console.bench import ServerActions
from dva_sim.console.desk.console_pages import ConsolePages
from dva_sim.console.driving.decision_actions import DecisionActions
from dva_sim.console.driving.desk_actions import DeskActions, instructions_of
from dva_sim.console.driving.drive_actions import LOOK, Driving, is_gone_for_good
from dva_sim.console.driving.mission_actions import MissionActions
from dva_sim.console.driving.seat_sensors import SensorActions
from dva_sim.console.events.alarm_actions import AlarmActions
from dva_sim.console.wire.actions import ActionPlace, Asked
from dva_sim.console.wire.arguments import LogsLooked, PagesHere, RobotsWatched
from dva_sim.console.wire.seats import DoneLine


class ConsoleActions:
    """Does what lines of the web process ask for.

    Args:
        pages: Pages of the system.
        place: Place whose actions are carried out.
        elsewhere: Refusal of actions that are declared for other places only.

    Attributes:
        take: Does what a line asks for.
    """

    def __init__(self, pages: ConsolePages, place: ActionPlace, elsewhere: str) -> None:
        self._pages = pages
        self._driving = driving = Driving(pages.driven)
        alarms = AlarmActions(
            pages.alarms, pages.author, lambda *arguments: dispatcher.do(*arguments)
        )
        decisions = DecisionActions(pages.driven, pages.rooms, driving, alarms.seeing)
        desk = DeskActions(
            pages.driven,
            pages.rooms,
            driving,
            decisions,
            instructions_of(pages.scenario),
            author=pages.author,
        )
        server = ServerActions(pages.system.bench)
        missions = MissionActions(pages.driven, pages.rooms, driving)
        sensors = SensorActions(pages.seat_sensors, driving)
        holders = self, driving, decisions, desk, missions, sensors, alarms, pages.fakes, server
        dispatcher = ActionDispatcher(
            place,
            holders=(*holders, *self.holders(driving)),
            tell=self._tell,
            elsewhere=elsewhere,
            audited=lambda: pages.audited,
        )
        self.take = dispatcher.take
        pages.clock.pulse(LOOK, self.look_for_the_silent)

    def holders(self, _: Driving) -> Iterable[object]:
        """Make what else does actions here."""
        return ()

    def look_for_the_silent(self) -> None:
        """End the drives of pages that say nothing any more."""
        self._driving.look()

    def _tell(self, answer: DoneLine) -> None:
        self._pages.tell({**answer, "t": self._pages.system.now_ms})
        self._pages.tell_now()

    @does("look")
    def _look(self, _: str, line: LogsLooked) -> None:
        self._pages.look(line)

    @does("watch")
    def _watch(self, _: str, line: RobotsWatched) -> None:
        self._pages.watch(line["robots"])

    @does("release")
    def _release(self, client: str, line: Asked, on_result: OnResult) -> None:
        if is_gone_for_good(line):
            self.forget(client)
            if not self._driving.sits(client):
                return  # it gives nothing back, and the audit log says nothing
        self._driving.release(client, on_result)

    def forget(self, client: str) -> None:
        """Let the person of a page go that will never come back."""
        self._pages.rooms.leave(client)

    @does("here")
    def _here(self, _: str, line: PagesHere) -> None:
        self._pages.users.clear()
        self._pages.users.update(line.get("users", {}))
        self._driving.attend(line)
        self._pages.rooms.attend(line["pages"])

    @does("gone")
    def _gone(self, client: str, _: Asked) -> None:
        self.hide(client)

    def hide(self, client: str) -> None:
        """End what the person of a hidden page has in hand."""
        self._driving.end_hidden(client)
