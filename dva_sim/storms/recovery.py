"""S8: after the faults everything recovers within a stated time, shown by using it.

Some time after the last fault a new device does what any device could do before: it reports an
event, requests each robot in turn, drives it, and stops it by an emergency; a permitted person
releases the robot, and it is sent out and called back. For a while the DVA must list all devices
and receive their heartbeats. Whatever does not succeed has not recovered; no component is asked
about its state.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

from dva_sim.kernel.recorder import Accepted, Recorder
from dva_sim.protocol import messages as m
from dva_sim.simulation.full.observations import RobotMotion
from dva_sim.simulation.full.safety_checks import MOVING
from dva_sim.simulation.full.stage import DVA, Stage
from dva_sim.storms.intruder import NUMBER, Intruder
from dva_sim.storms.plan import PROBES_LAST, RECOVERS_WITHIN
from dva_sim.storms.releaser import Releaser

RETRY_DELAY_S = 1.0  # between two attempts of a probe [s]
USED_LATELY = 30.0  # a robot that obeyed a device this recently needs no probe [s]
STOPPED_AFTER = 5.0  # time from the reply to an emergency until the robot must stand [s]
LISTED = 30  # complete device lists in a row, a second apart, that the DVA has to give
LIST = "the list"
BEATS_WITHIN = 30.0  # time before the end within which each device's heartbeat must arrive [s]
BYSTANDER = NUMBER + 50  # number of the probing device, beyond those of all others


class RecoveryProbes:
    """Probes of whether everything works again.

    Args:
        recorder: Recorder of what has not recovered.
        motion_of: Function that returns the motion of a robot now, by its id.
        calm: End of the last fault [s].
        releaser: Person who releases robots after emergencies.
    """

    def __init__(
        self,
        stage: Stage,
        recorder: Recorder,
        motion_of: Callable[[str], RobotMotion],
        calm: float,
        releaser: Releaser,
    ) -> None:
        self._stage = stage
        self._recorder = recorder
        self._motion_of = motion_of
        self._calm = calm
        self._clock = stage.clock
        self._releaser = releaser
        self._probe = Intruder(stage, BYSTANDER, "probe")
        self._open: dict[str, str] = {}
        self._used: dict[str, float] = {}
        self._session: dict[str, int] = {}
        self._granted: dict[str, float] = {}
        self._missing = set[str]()
        self._listed = 0
        self._beats: dict[str, float] = {}
        self._place = m.Position(0.0, 0.0)

    def begin(self, robots: Sequence[str], others: Iterable[str], place: m.Position) -> None:
        """Begin to probe, once the time for recovery has passed.

        Args:
            robots: Ids of the robots that have power.
            others: Ids of the guards and operators.
            place: Place of the reported event, and destination of the robots.
        """
        self._place = place
        self._beats = dict.fromkeys((*robots, *others), 0.0)
        self._open = dict.fromkeys(robots, "gives nobody the robot")
        self._open[DVA] = "takes no report"
        self._open[LIST] = "does not list everybody"
        self._clock.call_at(self._calm, self._probe.device.register)
        begins = self._calm + RECOVERS_WITHIN
        self._clock.call_at(begins, self._report, place)
        self._clock.call_at(begins, self._list, frozenset((*robots, *others)))
        for robot in robots:
            self._clock.call_at(begins, self._ask_for, robot)

    def accepted(self, command: Accepted) -> None:
        """Note that a robot obeys a command."""
        self._used[command.robot] = command.time
        if command.source == self._probe.device.id_tag and command.robot in self._open:
            self._open[command.robot] = "does not answer an emergency"
            self._stop(command.robot)

    def moves(self, now: float, motions: Mapping[str, RobotMotion]) -> None:
        """Note which robots are moving."""
        for robot, motion in motions.items():
            if motion.speed > MOVING:
                self._used[robot] = now

    def beats(self, now: float, source: str) -> None:
        """Note that the heartbeat of a device has reached the DVA."""
        if source in self._beats:
            self._beats[source] = now

    def due(self) -> float:
        """Return when the last probe must have succeeded [s].

        A robot that its holder kept until then is granted late, and its probe then takes its time.
        """
        begins = self._calm + RECOVERS_WITHIN
        late = max((self._granted.get(device, begins) for device in self._open), default=begins)
        return min(late, begins + PROBES_LAST) + PROBES_LAST

    def end(self) -> None:
        """Report the devices that have not recovered."""
        for device, when in self._beats.items():
            if self._clock.now - when > BEATS_WITHIN:
                text = f"has not heard the heartbeat of {self._stage.labels[device]}"
                text += f" for {self._clock.now - when:.0f} s"
                self._recorder.violated("S8", self._clock.now, self._stage.labels[DVA], text)
        after = f"{self._clock.now - self._calm:.0f} s after the last fault"
        for who, what in self._open.items():
            label = self._stage.labels[DVA if who == LIST else who]
            missing = ", ".join(sorted(self._missing)) if who == LIST else ""
            text = f"{what} {after}{missing and ', such as '}{missing}"
            self._recorder.violated("S8", self._clock.now, label, text)

    def _list(self, expected: frozenset[str]) -> None:
        """Ask for the device list until it was complete often enough in a row."""

        def again() -> None:
            self._clock.call_after(RETRY_DELAY_S, self._list, expected)

        def answered(reply: m.Reply) -> None:
            if not isinstance(reply.content, m.DeviceList):
                again()
                return
            missing = expected - {device.id_tag for device in reply.content.devices}
            self._missing |= {self._stage.labels[device] for device in missing}
            self._listed = 0 if missing else self._listed + 1
            if self._listed == LISTED:
                del self._open[LIST]
            else:
                again()

        self._probe.ask(DVA, m.GetDeviceList(), answered, again)

    def _report(self, place: m.Position) -> None:
        def answered(reply: m.Reply) -> None:
            if reply.code == m.OK:
                self._open.pop(DVA, None)
            else:
                again()

        def again() -> None:
            self._clock.call_after(RETRY_DELAY_S, self._report, place)

        body = m.EventReport(None, "flood", place, 0.1, 0.9, "detected")
        self._probe.ask(DVA, body, answered, again)

    def _ask_for(self, robot: str) -> None:
        """Request a robot until it is granted; a robot that others drive works and is left alone.

        The request asks the holder to give it up: a DVA that could not write before it was killed
        may remember a permission whose holder knows that it is over, and does not use it.
        """
        if robot not in self._open:
            return
        if self._clock.now - self._used.get(robot, -1e9) < USED_LATELY:
            del self._open[robot]
            return

        def again(*_: object) -> None:
            self._clock.call_after(RETRY_DELAY_S, self._ask_for, robot)

        def answered(reply: m.Reply) -> None:
            if isinstance(reply.content, m.Permission):
                self._open[robot] = "does not start for who holds it"
                self._granted[robot] = self._clock.now
                self._start(robot, reply.content.session)
            else:
                again()

        wish = m.PermissionRequest(robot, "both", takeover="ask")
        self._probe.ask(DVA, wish, answered, again)

    def _start(self, robot: str, session: int) -> None:
        def again(*_: object) -> None:
            self._clock.call_after(RETRY_DELAY_S, self._start, robot, session)

        def answered(reply: m.Reply) -> None:
            if reply.code == m.OK:
                self._open[robot] = "obeys no command of its driver"
                self._drive(robot, session)
            elif reply.code in (m.NOT_PERMITTED, m.BAD_SESSION):
                self._ask_for(robot)  # the permission was lost meanwhile
            else:
                again()

        self._probe.ask(robot, m.StartTeleOp(), answered, again, session)

    def _drive(self, robot: str, session: int) -> None:
        """Send commands until the robot obeys; start again if the drive has ended meanwhile."""
        waits = "obeys no command of its driver"
        self._session[robot] = session
        if self._open.get(robot) != waits:
            return

        def answered(reply: m.Reply) -> None:
            if reply.code == m.WRONG_MODE and self._open.get(robot) == waits:
                self._open[robot] = "does not start for who holds it"
                self._start(robot, session)

        self._probe.ask(robot, m.SetTeleOp(0.05, 0.1), answered, session=session)
        self._clock.call_after(RETRY_DELAY_S, self._drive, robot, session)

    def _stop(self, robot: str) -> None:
        def answered(reply: m.Reply) -> None:
            self._open[robot] = "moves after an emergency"
            self._clock.call_after(STOPPED_AFTER, self._look, robot)

        self._probe.ask(
            robot,
            m.Emergency(),
            answered,
            lambda: self._clock.call_after(RETRY_DELAY_S, self._stop, robot),
        )

    def _look(self, robot: str) -> None:
        if abs(self._motion_of(robot).speed) < MOVING:
            self._open[robot] = "is not released after an emergency"
            self._release(robot)

    def _release(self, robot: str) -> None:
        def again() -> None:
            self._clock.call_after(RETRY_DELAY_S, self._release, robot)

        def answered(reply: m.Reply) -> None:
            if reply.code == m.OK:
                self._open[robot] = "does not go where it is sent"
                self._send_out(robot)
            else:
                again()

        self._releaser.release(robot, answered, again)

    def _send_out(self, robot: str) -> None:
        """Send a robot on a mission, and call it back; request a lost permission again."""
        session = self._session[robot]

        def again(*_: object) -> None:
            self._clock.call_after(RETRY_DELAY_S, self._send_out, robot)

        def called_back(reply: m.Reply) -> None:
            if reply.code != m.OK:
                again()
                return
            self._open.pop(robot, None)
            revocation = m.PermissionRevocation(robot, self._probe.device.id_tag, session)
            self._probe.ask(DVA, revocation)

        def answered(reply: m.Reply) -> None:
            if reply.code in (m.NOT_PERMITTED, m.BAD_SESSION):
                self._open[robot] = "gives nobody the robot"
                self._ask_for(robot)
            elif reply.code == m.OK:
                self._open[robot] = "does not come back when it is called"
                self._probe.ask(robot, m.CancelMission(), called_back, again, session)
            else:
                again()

        self._probe.ask(robot, m.GoTo((self._place,)), answered, again, session)
