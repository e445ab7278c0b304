"""Missions that people order by hand, of robots that they hold."""

from __future__ import annotations

from dva_sim.agents.operator.held_missions import HeldMissions
from dva_sim.console.asking.dispatcher import does
from dva_sim.console.asking.refusal import OnResult, Refused
from dva_sim.console.driving.decision_actions import DecidingRooms
from dva_sim.console.driving.drive_actions import Driving
from dva_sim.console.driving.driven_system import DrivenSystem
from dva_sim.console.events.decisions import place_of
from dva_sim.console.wire.arguments import MissionOrdered, OfRobot
from dva_sim.protocol import messages as m


class MissionActions:
    """Does what people ask robots in their hands to do by themselves.

    Args:
        system: System of the robots.
        rooms: Control rooms of the console, which know the events.
        driving: Seats, and what their people hold.
    """

    def __init__(self, system: DrivenSystem, rooms: DecidingRooms, driving: Driving) -> None:
        self._system = system
        self._rooms = rooms
        self._driving = driving

    @does("mission_order")
    def _order(self, client: str, line: MissionOrdered, on_result: OnResult) -> None:
        self._missions(client, line).begin(self._mission(line), on_result)

    @does("mission_cancel")
    def _cancel(self, client: str, line: OfRobot, on_result: OnResult) -> None:
        self._missions(client, line).cancel(on_result)

    def _missions(self, client: str, line: OfRobot) -> HeldMissions:
        held = self._driving.held(client, line)
        if held.missions is None:
            raise Refused(f"{held.label}: the permission is for {held.level}, not for missions")
        return held.missions

    def _mission(self, line: MissionOrdered) -> m.Body:
        """Return the message of a mission.

        Raises:
            Refused: it names no place or event, or one where nobody can go.
        """
        what = line["what"]
        if what == "return_to_base":
            return m.ReturnToBase()
        if what == "inspect":
            event = self._rooms.listener.events.get(line.get("event", 0))
            if event is None:
                raise Refused("Choose an event.")
            return m.Inspect(event.event_id, event.kind, event.position)
        site = self._system.site
        floors = [place_of({"x_m": x, "y_m": y}, site) for x, y in line.get("places_m", [])]
        if not floors:
            raise Refused("Tap a place on the map.")
        places = tuple(m.Position(*self._system.frame.to_latlon(x, y)) for x, y in floors)
        return m.GoTo(places) if what == "go_to" else m.Patrol(places, laps=0)
