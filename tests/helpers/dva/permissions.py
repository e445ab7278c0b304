"""Permissions as the DVA gives them: it says so, is asked by the robot, and confirms it."""

from dva_sim.agents.robot.controller import Decision, RobotController
from dva_sim.core.dva import Dva
from dva_sim.core.sessions import Grant
from dva_sim.protocol import messages as m


def confirmation(grant: m.PermissionGrant | None) -> m.Reply:
    """Reply of the DVA to a robot's inquiry about its holder."""
    if grant is None:
        return m.Reply(1, m.NOT_PERMITTED, "nobody holds it")
    reported = m.Permission(grant.holder, grant.level, grant.session, grant.address, grant.sensors)
    return m.Reply(1, m.OK, "", reported)


def hear(controller: RobotController, reply: m.Reply, now: float = 0.0) -> Decision:
    """Let a robot have the DVA's answer to its question."""
    message = m.Message(controller.id_tag, 1, controller.dva, "12:00:00", 0, reply)
    return controller.handle(message, now, now, moving=False)


def give(controller: RobotController, grant: m.PermissionGrant, now: float = 0.0) -> Decision:
    """Let a robot have a permission that the DVA has given: what the confirmation does."""
    message = m.Message(controller.id_tag, 1, controller.dva, "12:00:00", 0, grant)
    reported = controller.handle(message, now, now, moving=False)
    if grant.level == "sensors":
        controller.inquiry.about_reader(grant.holder)
    question = controller.inquiry.next(now)
    return reported if question is None else hear(controller, confirmation(grant), now)


def enter(core: Dva, robot: str, body: m.Body) -> None:
    """Set the answers of a DVA to a robot."""
    known = core.sessions.permissions
    if isinstance(body, m.PermissionGrant):
        address, sensors = body.address, body.sensors
        known.restore(
            Grant(robot, body.holder, body.level, body.session, sensors=sensors, address=address)
        )
    elif isinstance(body, m.PermissionRevocation):
        known.end(body.session)
