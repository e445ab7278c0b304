"""Lines for a person in a seat about its own drives, 20 times a second."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from dva_sim.agents.operator.held_robot import REVOKED, HeldRobot
from dva_sim.agents.operator.person_at_console import PersonAgent
from dva_sim.console.driving.driven_system import DrivenSystem
from dva_sim.console.driving.seat_sensors import SeatSensors
from dva_sim.console.phones.phone_seat import PhoneSeat
from dva_sim.console.wire.scenes import OrderShown
from dva_sim.console.wire.seats import DriveShown, InputHeard, MissionShown, PhoneShown, SeatLine
from dva_sim.kernel.recorder import DriveLog
from dva_sim.protocol import messages as m

PHASES = ("driving", "starting", "stopping", "asking", "held")  # the first that holds is told


@dataclass
class ActedInput:
    """The newest command that has taken effect on a robot: its age, and the input behind it."""

    age_ms: float | None = None
    loop_ms: float | None = None
    input: InputHeard | None = None


_NOTHING = ActedInput()
_NO_DRIVE = DriveLog("", "", 0, 0.0)


class SeatLines:
    """Lines for those who sit somewhere.

    Args:
        system: System whose robots are driven.
        phones: By their clients.
        sensors: Sensors of robots in hand.
    """

    def __init__(
        self, system: DrivenSystem, phones: Mapping[str, PhoneSeat], sensors: SeatSensors
    ) -> None:
        self._system = system
        self._persons = system.seating.persons
        self._client_of = system.seating.client_of
        self._phones = phones
        self._sensors = sensors
        self._acted: dict[str, ActedInput] = {}  # of the newest command in force, by robot

    def applied(self, drive: DriveLog) -> None:
        """Find the input behind a command that has taken effect."""
        held = self._held(drive)
        if held is None or not drive.applied:
            return
        command = drive.applied[-1]
        acted = self._acted.setdefault(drive.robot, ActedInput())
        acted.age_ms = round(1000 * (command.time - command.issued), 1)
        given_at = held.acted(command.issued, command.sample_age)
        if given_at is not None:
            acted.input = {"n": given_at.number, "at_ms": round(1000 * time.time(), 1)}
            acted.loop_ms = round(1000 * (command.time - given_at.time), 1)

    def _held(self, drive: DriveLog) -> HeldRobot | None:
        for person in self._persons.values():
            held = person.robots.get(drive.robot)
            if held is not None and held.log is drive:
                return held
        return None

    def waiting_order(self) -> OrderShown | None:
        """Return an order for a seat in which nobody sits yet."""
        persons = self._persons.values()
        orders = [p.order for p in persons if p.order is not None and not p.attended]
        return self._order(orders[0]) if orders else None

    def lines(self) -> Iterator[tuple[str, SeatLine]]:
        """Yield a line for each client that sits somewhere, and for phones not registered yet."""
        for number, client in self._client_of.items():
            yield client, self._line(client, self._persons[number])
        for client in self._phones.keys() - self._client_of.values():
            yield client, self.free(client, self._phone(client))

    def _phone(self, client: str) -> PhoneShown | None:
        phone = self._phones.get(client)
        return None if phone is None else phone.line(time.monotonic())

    def free(self, client: str, phone: PhoneShown | None = None) -> SeatLine:
        """Return the line of a client that sits nowhere."""
        return {
            "k": "seat",
            "t": self._system.now_ms,
            "seat": client,
            "label": "",
            "phase": "free",
            "order": None,
            "alert": "",
            "drives": [],
            "phone": phone,
        }

    def _line(self, client: str, person: PersonAgent) -> SeatLine:
        held = list(person.robots.values())
        phases = {each.phase for each in held}
        return {
            "k": "seat",
            "t": self._system.now_ms,
            "seat": client,
            "label": person.device.label,
            "phase": next((phase for phase in PHASES if phase in phases), "free"),
            "order": None if person.order is None else self._order(person.order),
            "alert": self._alert(person.alert) or person.device.dva_alert,
            "drives": [self._drive(each) for each in held],
            "phone": self._phone(client),
        }

    def _alert(self, alert: str) -> str:
        """Return the alert of a person, with the name of who took the robot away."""
        robot, _, what = alert.partition(": ")
        by = self._system.revokers.get(robot) if what.startswith(REVOKED) else None
        return alert if by is None else f"{alert} {by}"

    def _order(self, order: m.Order) -> OrderShown:
        x, y, room = self._system.place_of(order.position)
        return {
            "event": order.event_id,
            "kind": order.kind,
            "robot": self._system.number_of(order.device or ""),
            "x_m": round(x, 2),
            "y_m": round(y, 2),
            "room": room,
        }

    def _drive(self, held: HeldRobot) -> DriveShown:
        system = self._system
        log = held.log or _NO_DRIVE
        reach = system.reach(held.robot)
        acted = self._acted.get(held.robot, _NOTHING)
        frame = held.frame
        silent = system.clock.now - held.heard_at
        trips = log.round_trips
        is_over = log.ended is not None
        command = log.commands[-1][1:] if log.commands and not is_over else (0.0, 0.0)
        return {
            "i": system.number_of(held.robot),
            "level": held.level,
            "mission": _mission_shown(held),
            "sensors": self._sensors.lines(held),
            "pattern": system.pattern_of(held.robot),
            "phase": held.phase,
            "mode": system.mode_of(held.robot),
            "session": held.session,
            "wanted": [
                round(held.last.speed * reach.speed, 3),
                round(held.last.turn * reach.turn_rate, 3),
            ],
            "command": [round(number, 3) for number in command],
            "command_age_ms": acted.age_ms,
            "picture_ms": None if frame is None else round(1000 * frame.captured),
            "picture_arrived_ms": None if frame is None else round(1000 * held.arrived),
            "silent_s": round(silent) if silent < math.inf else None,
            "loop_ms": acted.loop_ms,
            "input": acted.input,
            "sent": log.sent,
            "answered": len(trips),
            "timeouts": log.timeouts,
            "refused": sum(log.refused.values()),
            "superseded": log.superseded,
            "round_trip_ms": round(1000 * trips[-1], 1) if trips else None,
            "outcome": log.outcome if is_over else None,
        }


def _mission_shown(held: HeldRobot) -> MissionShown | None:
    status = None if held.missions is None else held.missions.status
    if status is None:
        return None
    return {
        "state": status.mission_state,
        "places_left": status.waypoints_left,
        "reason": status.reason,
    }
