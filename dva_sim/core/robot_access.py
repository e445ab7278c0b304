"""Requests for robots: which device may have one, and which gets it."""

from __future__ import annotations

from dva_sim.core.control_rooms import ControlRooms
from dva_sim.core.dispatcher import Dispatcher
from dva_sim.core.handovers import Handovers
from dva_sim.core.permissions import Access
from dva_sim.core.registry import DeviceEntry
from dva_sim.core.roles import Roles
from dva_sim.core.sessions import DvaAnswer
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import CONTROL_ROOM, ROBOT, ControlRoomRole


class RobotAccess:
    """Grants robots by the rules of access, and ends permissions whose rule has ended.

    Args:
        dispatcher: Dispatcher, with all orders and sessions.
        handovers: Handovers of robots.
        control_rooms: Keeps what control rooms do with robots.
        access: Rules of access.
        roles: Roles of the control rooms.
    """

    def __init__(
        self,
        dispatcher: Dispatcher,
        handovers: Handovers,
        control_rooms: ControlRooms,
        access: Access,
        roles: Roles,
    ) -> None:
        self._dispatcher = dispatcher
        self._handovers = handovers
        self._rooms = control_rooms
        self._access = access
        self._roles = roles
        self._entries = dispatcher.orders.registry.entries
        self._sessions = dispatcher.orders.sessions
        self.next_end = access.next_end(-1.0)

    def request(self, asker: DeviceEntry, body: m.PermissionRequest, now: float) -> DvaAnswer:
        """Grant a robot or its sensors, or return why not."""
        answer = self._request(asker.device, body, now)
        in_use = body.takeover == "force" or asker.device.device_type == CONTROL_ROOM
        if in_use and body.level != "sensors":
            self._rooms.asked_for_robot(asker.device, body, answer, now)
        return answer

    def _request(self, asker: m.Device, body: m.PermissionRequest, now: float) -> DvaAnswer:
        robot = self._entries.get(body.device)
        if robot is None or robot.device.device_type != ROBOT:
            return DvaAnswer(m.UNKNOWN_DEVICE, f"no robot {body.device}")
        if asker.device_type == CONTROL_ROOM and body.level != "sensors":
            need = ControlRoomRole.DRIVE
            if (text := self._rooms.may(asker, need, "take a robot")) is not None:
                return DvaAnswer(m.NOT_PERMITTED, text)
        if not self._access.allows(asker, robot.device, body.level, now):
            text = f"{asker.label} may not have {body.level} of {robot.device.label}"
            return DvaAnswer(m.NOT_PERMITTED, text)
        sensors = self._access.sensors(asker, robot.device, body.sensors, now)
        if body.level == "sensors" and body.sensors and not sensors:
            text = f"{asker.label} may read none of these of {robot.device.label}"
            return DvaAnswer(m.NOT_PERMITTED, text)
        if body.level != "sensors":
            holder = self._handovers.holder(body.device, asker.id_tag, now)
            if holder is not None:
                return self._held(asker, body, holder, now)
            if wait := self._handovers.waits(body.device, asker.id_tag):
                return DvaAnswer(m.BUSY, wait)
        wish = m.PermissionRequest(body.device, body.level, sensors)
        granted = self._sessions.grant(robot.device, asker, wish)
        if granted is None:
            return DvaAnswer(m.BUSY, f"{robot.device.label} is held by another")
        content, sends = granted
        if body.level != "sensors":
            self._handovers.granted(body.device, content.session, now)
        return DvaAnswer(content=content, sends=sends)

    def _held(
        self, asker: m.Device, body: m.PermissionRequest, holder: m.Holder, now: float
    ) -> DvaAnswer:
        """Refuse a robot that is taken: name its driver, and accept a request for handover."""
        if body.takeover == "force" and not self._may_force(asker):
            return DvaAnswer(m.NOT_PERMITTED, f"{asker.label} is no supervisor")
        step, sends = self._handovers.wish(body, asker, holder, now)
        text = f"held by {holder.label} for {holder.held_for:.0f} s" + (step and f"; {step}")
        content = holder if body.takeover is not None else None  # 1.3 does not know it
        if body.takeover == "force":
            sends += self._dispatcher.decide(now)
        return DvaAnswer(m.BUSY, text, content, sends)

    def _may_force(self, asker: m.Device) -> bool:
        """Return True if a device may take a robot from its holder."""
        if asker.device_type == CONTROL_ROOM:
            return self._roles.of(asker.id_tag).includes(ControlRoomRole.SUPERVISE)
        return asker.id_tag in self._handovers.supervisors

    def give_back(self, holder: m.Device, body: m.PermissionRevocation, now: float) -> DvaAnswer:
        """End a permission that its holder needs no longer; only its own."""
        if body.holder != holder.id_tag or not self._sessions.give_back(body):
            return DvaAnswer(m.BAD_SESSION, "that session is not yours, or is over")
        if holder.device_type == CONTROL_ROOM:
            self._rooms.gave_back(holder, body.device, now)
        return DvaAnswer()

    def grant_of(self, robot: m.Device, body: m.GetGrant) -> DvaAnswer:
        """Tell a robot who may act on it: its holder, or what another device may read."""
        grant = self._sessions.held(robot.id_tag, body.holder, body.level == "sensors")
        if robot.device_type != ROBOT or grant is None:
            text = "nobody holds the robot now"
            if body.holder:
                text = f"{body.holder} holds no such robot"
            return DvaAnswer(m.NOT_PERMITTED, text)
        content = m.Permission(
            grant.holder, grant.level, grant.session, grant.address, grant.sensors
        )
        return DvaAnswer(content=content)

    def check(self, now: float) -> None:
        """Revoke the permissions in use whose rule has ended."""
        for grant in self._sessions.permissions.all():
            holder = self._entries.get(grant.holder)
            robot = self._entries.get(grant.robot)
            if holder is None or robot is None:
                continue
            sensors = self._access.sensors(holder.device, robot.device, grant.sensors, now)
            allowed = self._access.allows(holder.device, robot.device, grant.level, now)
            if not allowed or sensors != grant.sensors:
                self._dispatcher.orders.counters["permission revoked"] += 1
                self._sessions.revoke(grant)
        self.next_end = self._access.next_end(now)
