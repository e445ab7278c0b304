"""S8: when faults cease, everything recovers within a stated time, shown by doing it.

Some time after the last fault somebody new does what anybody could do before: reports an event,
asks for each robot in turn, drives it and stops it by an emergency. What does not succeed has not
recovered. Nobody is asked how it is.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from dva_sim.kernel.recorder import Accepted, Recorder
from dva_sim.protocol import messages as m
from dva_sim.simulation.full.observations import RobotMotion
from dva_sim.simulation.full.safety_checks import MOVING
from dva_sim.simulation.full.stage import DVA, Stage
from dva_sim.storms.intruder import NUMBER, Intruder
from dva_sim.storms.plan import PROBES_LAST, RECOVERS_WITHIN

AGAIN = 1.0  # between two attempts of a probe [s]
USED_LATELY = 30.0  # a robot that obeyed somebody so lately needs no probe [s]
STANDS_AFTER = 5.0  # an emergency was answered [s]
BYSTANDER = NUMBER + 50


class RecoveryProbes:
    """Probes whether everything works again.

    Args:
        stage: Where.
        recorder: Told what has not recovered.
        motion_of: Gives the motion of a robot now, by its id.
        calm: When the last fault has ended [s].
    """

    def __init__(
        self,
        stage: Stage,
        recorder: Recorder,
        motion_of: Callable[[str], RobotMotion],
        calm: float,
    ) -> None:
        self._stage, self._recorder, self._motion_of = stage, recorder, motion_of
        self._calm, self._clock = calm, stage.clock
        self._probe = Intruder(stage, BYSTANDER, "probe")
        self._open: dict[str, str] = {}
        self._used: dict[str, float] = {}
        self._session: dict[str, int] = {}

    def begin(self, robots: Sequence[str], place: m.Position) -> None:
        """Begin to probe, once the time for recovery has passed.

        Args:
            robots: Ids of the robots that have power.
            place: Where an event is reported.
        """
        self._open = dict.fromkeys(robots, "gives nobody the robot")
        self._open[DVA] = "takes no report"
        self._clock.call_at(self._calm, self._probe.device.register)
        begins = self._calm + RECOVERS_WITHIN
        self._clock.call_at(begins, self._report, place)
        for robot in robots:
            self._clock.call_at(begins, self._ask_for, robot)

    def accepted(self, command: Accepted) -> None:
        """Note that a robot obeys somebody."""
        self._used[command.robot] = command.time
        if command.source == self._probe.device.id_tag and command.robot in self._open:
            self._open[command.robot] = "does not answer an emergency"
            self._stop(command.robot)

    def moves(self, now: float, motions: Mapping[str, RobotMotion]) -> None:
        """Note which robots go somewhere."""
        for robot, motion in motions.items():
            if motion.speed > MOVING:
                self._used[robot] = now

    def end(self) -> None:
        """Tell what has not recovered."""
        for robot, what in self._open.items():
            after = RECOVERS_WITHIN + PROBES_LAST
            text = f"{what} {after:.0f} s after the last fault"
            self._recorder.violated("S8", self._clock.now, self._stage.labels[robot], text)

    def _report(self, place: m.Position) -> None:
        def answered(reply: m.Reply) -> None:
            if reply.code == m.OK:
                self._open.pop(DVA, None)
            else:
                again()

        def again() -> None:
            self._clock.call_after(AGAIN, self._report, place)

        body = m.EventReport(None, "flood", place, 0.1, 0.9, "detected")
        self._probe.ask(DVA, body, answered, again)

    def _ask_for(self, robot: str) -> None:
        """Ask for a robot until it is granted; one that others drive works, and is left to them."""
        if robot not in self._open:
            return
        if self._clock.now - self._used.get(robot, -1e9) < USED_LATELY:
            del self._open[robot]
            return

        def again(*_: object) -> None:
            self._clock.call_after(AGAIN, self._ask_for, robot)

        def answered(reply: m.Reply) -> None:
            if isinstance(reply.content, m.Permission):
                self._open[robot] = "does not start for who holds it"
                self._start(robot, reply.content.session)
            else:
                again()

        self._probe.ask(DVA, m.PermissionRequest(robot, "teleoperation"), answered, again)

    def _start(self, robot: str, session: int) -> None:
        def again(*_: object) -> None:
            self._clock.call_after(AGAIN, self._start, robot, session)

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
        """Command until it obeys; a drive that ended before its start was answered begins again."""
        waits, self._session[robot] = "obeys no command of its driver", session
        if self._open.get(robot) != waits:
            return

        def answered(reply: m.Reply) -> None:
            if reply.code == m.WRONG_MODE and self._open.get(robot) == waits:
                self._open[robot] = "does not start for who holds it"
                self._start(robot, session)

        self._probe.ask(robot, m.SetTeleOp(0.05, 0.1), answered, session=session)
        self._clock.call_after(AGAIN, self._drive, robot, session)

    def _stop(self, robot: str) -> None:
        def answered(reply: m.Reply) -> None:
            self._open[robot] = "moves after an emergency"
            self._clock.call_after(STANDS_AFTER, self._look, robot)

        self._probe.ask(
            robot, m.Emergency(), answered, lambda: self._clock.call_after(AGAIN, self._stop, robot)
        )

    def _look(self, robot: str) -> None:
        if abs(self._motion_of(robot).speed) < MOVING:
            self._open.pop(robot, None)
            held = m.PermissionRevocation(robot, self._probe.device.id_tag, self._session[robot])
            self._probe.ask(DVA, held)
