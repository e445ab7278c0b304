"""Steps of driving a robot, for persons and simulated operators: picture, start, release.

Each step only reports its result; the caller decides what follows.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from dva_sim.agents.device import AgentDevice, do_nothing
from dva_sim.agents.operator.handheld import OnResult
from dva_sim.network.messaging import Subscription
from dva_sim.protocol import messages as m

START_TRIES = 20  # design: maximum attempts to start, as the grant may be in transit
GIVE_BACK_AGAIN = 2.0  # design: pause after an unanswered return of a permission [s]
GIVE_BACK_TRIES = 3  # design: attempts to return a session unknown to the DVA
START_AGAIN = 1.0  # design: pause between two attempts to start [s]
NOT_YET = (m.BUSY, m.NOT_PERMITTED, m.BAD_SESSION)  # refusals while the grant is in transit


def watch(
    device: AgentDevice,
    robot: str,
    session: int,
    *,
    topic: Callable[[str], str | None],
    on_frame: Callable[[Any], object],
    seen: Callable[[Subscription], object],
    blind: Callable[[str], object],
    wanted: Callable[[], bool],
    offered: Callable[[tuple[m.Sensor, ...]], object] = do_nothing,
    unreachable: Callable[[], object] = do_nothing,
) -> None:
    """Ask a robot where its camera is, and watch it.

    Args:
        device: Device with the screen.
        robot: Id of the robot.
        session: Session of the permission.
        topic: Topic of the frames of a URL; see `Cameras`.
        on_frame: Callback for each frame.
        seen: Callback once it is watched.
        blind: Callback with the URL, if there is nothing to see there.
        wanted: Predicate: True while it is still wanted.
        offered: Callback for the sensors to which one may subscribe.
        unreachable: Callback if the robot does not reply.
    """

    def answered(reply: m.Reply) -> None:
        if not wanted():
            return
        info = reply.content if isinstance(reply.content, m.SensorInfo) else m.SensorInfo("")
        url = info.camera_url
        offered(info.sensors)
        camera = topic(url)
        if camera is None:
            blind(url)
        else:
            seen(device.network.subscribe(device.id_tag, robot, camera, on_frame))

    device.ask(robot, m.GetSensorInfo(), answered, unreachable, session)


def start(
    device: AgentDevice,
    robot: str,
    body: m.Body,
    session: Callable[[], int],
    *,
    wanted: Callable[[], bool],
    begun: Callable[[], object],
    refused: Callable[[str], object],
    lost: Callable[[], object],
    waits: Callable[[m.Reply], object] = do_nothing,
    tries: int = 1,
) -> None:
    """Ask a robot to begin, again and again while it may not know of the permission yet.

    Args:
        device: Device that sends the request.
        robot: Id of the robot.
        body: Content of the request.
        session: Current session of the permission.
        wanted: Predicate: True while it is still wanted.
        begun: Callback once the robot agrees.
        refused: Callback with the reason for a refusal.
        lost: Callback if it does not reply.
        waits: Callback for the reply that refuses, each time before it is asked again.
        tries: Number of this attempt.
    """
    if not wanted():
        return

    def again() -> None:
        start(
            device,
            robot,
            body,
            session,
            wanted=wanted,
            begun=begun,
            refused=refused,
            lost=lost,
            waits=waits,
            tries=tries + 1,
        )

    def answered(reply: m.Reply) -> None:
        if not wanted():
            return
        if reply.code == m.OK:
            begun()
        elif tries < START_TRIES and reply.code in NOT_YET:
            waits(reply)
            device.clock.call_after(START_AGAIN, again)
        else:
            refused(reply.text)

    device.ask(robot, body, answered, lost, session())


def give_back(device: AgentDevice, robot: str, session: int, tries: int = 1) -> None:
    """Notify the DVA that a permission is no longer needed, and retry until it has kept that.

    Args:
        device: Device with the permission.
        robot: Id of the robot.
        session: Session of the permission.
        tries: Number of this attempt.
    """

    def again(tries: int = tries) -> None:
        device.clock.call_after(GIVE_BACK_AGAIN, give_back, device, robot, session, tries)

    def answered(reply: m.Reply) -> None:
        if reply.code == m.BUSY:
            again()
        elif reply.code == m.BAD_SESSION and tries < GIVE_BACK_TRIES:
            again(tries + 1)  # a message that was damaged on its way names another session

    body = m.PermissionRevocation(robot, device.id_tag, session)
    device.ask(device.dva, body, answered, again)


def give_back_unanswered(
    device: AgentDevice, robot: str, level: str, is_wanted: Callable[[], bool]
) -> None:
    """Give back a permission that may have been granted by a request without an answer.

    Who is alive keeps what it was granted, so the DVA is asked until it says what that was.

    Args:
        device: Device with the permission.
        robot: Id of the robot.
        level: Level as in the request.
        is_wanted: Predicate: while the robot is wanted again, nothing is given back.
    """

    def answered(reply: m.Reply) -> None:
        if isinstance(reply.content, m.Permission):
            let_go(reply.content.session)

    def let_go(session: int) -> None:
        if is_wanted():  # the robot may be wanted no longer before anybody asks for it
            device.clock.call_after(GIVE_BACK_AGAIN, let_go, session)
        else:
            give_back(device, robot, session)

    def again() -> None:
        device.clock.call_after(GIVE_BACK_AGAIN, ask)

    def ask() -> None:
        if not is_wanted():
            device.ask(device.dva, m.PermissionRequest(robot, level), answered, again)

    again()


def ask_emergency(device: AgentDevice, robot: str, session: int, on_result: OnResult) -> None:
    """Send a robot an emergency, which it obeys from any sender."""
    label = device.label_of(robot)

    def answered(reply: m.Reply) -> None:
        if reply.code == m.OK:
            on_result(True, f"{label} has stopped")
        else:
            on_result(False, f"{label} has not stopped: {reply.reason}")

    def unanswered() -> None:
        on_result(False, f"{label} does not answer")

    device.ask(robot, m.Emergency(), answered, unanswered, session)
