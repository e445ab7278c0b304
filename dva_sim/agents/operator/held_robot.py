"""A robot in the hands of a person at a console: permission, picture, and drives one by one.

It sends the same messages as a simulated operator, at the person's request.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Literal

from dva_sim.agents.device import STATUS, AgentDevice
from dva_sim.agents.observation import CameraFrame
from dva_sim.agents.operator import steps
from dva_sim.agents.operator.command_sender import CommandSender
from dva_sim.agents.operator.handheld import Console, Input, OnResult
from dva_sim.agents.operator.held_missions import MISSIONS, HeldMissions
from dva_sim.agents.tilt import GivenTilt, TiltSources
from dva_sim.agents.tilt.calibration import SPEED_PER_LEVEL
from dva_sim.agents.tilt.velocity import GivenVelocity
from dva_sim.kernel.recorder import DriveLog, Shown
from dva_sim.network.messaging import Subscription
from dva_sim.protocol import messages as m

HeldPhase = Literal["asking", "held", "starting", "driving", "stopping", "gone"]
STILL_WANTED = 0.3  # design: maximum age of an input that still counts at the start of a drive [s]
MAX_INPUTS = 4096  # design: inputs remembered until they take effect
GRANT_WITHIN = 5.0  # design: maximum transit time of the DVA's grant to the robot [s]
MAX_PICTURES = 1024  # design: pictures whose ticks are remembered until they are drawn
LOST_AFTER = 9.0  # design: without a word of the robot: three times its watchdog [s]
STALE_STATUSES = 3  # design: status messages in a row, which may be older than the start of a drive


class HeldRobot:
    """One robot that a person has requested.

    Args:
        device: The person's.
        robot: Id of the robot.
        console: Current equipment of the person.
        tilt: Function that returns the source of commands for the next drive.
        alert: Callback with messages for the person.
        let_go: Callback once the person no longer controls the robot.
        wanted: Predicate for a robot's id: True if the person controls it.

    Attributes:
        phase: Current phase.
        session: Session of the permission; 0: none.
        log: Log of the newest drive.
        frame: The newest picture that has arrived.
        arrived: Arrival time of that picture [s].
        drawn: Capture time of the picture last drawn by the person's page [s]; before the first
            one, the start of the drive. None: the page does not report it.
        event: Event of the next drives; 0: no event.
        last: The newest input.
        level: Level of the requested permission.
        app: Function that makes the commands of the newest drive.
        missions: Missions of the robot, if the permission is for them.
        offered: Sensors to which one may subscribe.
    """

    def __init__(
        self,
        device: AgentDevice,
        robot: str,
        console: Callable[[], Console],
        tilt: Callable[[], GivenTilt | TiltSources],
        alert: Callable[[str], object],
        let_go: Callable[[HeldRobot], object],
        wanted: Callable[[str], bool],
    ) -> None:
        self.device = device
        self.robot = robot
        self._console = console
        self._alert = alert
        self._let_go = let_go
        self._wanted = wanted
        self.phase: HeldPhase = "asking"
        self.session = 0
        self.event = 0
        self._address = ""
        self._has_answered = False
        self._granted_at = -math.inf
        self._starting: OnResult | None = None
        self.log: DriveLog | None = None
        self.frame: CameraFrame | None = None
        self.arrived = -math.inf
        self.drawn: float | None = None
        self._drawn_tick: int | None = None
        self._ticks: dict[int, int] = {}  # ticks of the newest pictures by capture time [ms]
        self.last = Input(0, 0.0, 0.0, 0.0)
        self._tilt = tilt
        self.app = tilt()
        self.level = "teleoperation"
        self._wished = self.last
        self._inputs: deque[Input] = deque(maxlen=MAX_INPUTS)
        self.missions: HeldMissions | None = None
        self.offered: tuple[m.Sensor, ...] = ()
        self._sender: CommandSender | None = None
        self._picture: Subscription | None = None
        self._status: Subscription | None = None
        # of the newest status [s], [ms]
        self._heard = -math.inf
        self._tick = -math.inf
        self._idle = 0  # status messages in a row that deny the drive
        self.on_frame: Callable[[HeldRobot, CameraFrame], object] = lambda *_: None

    @property
    def label(self) -> str:
        """The robot's, for people."""
        return self.device.label_of(self.robot)

    @property
    def is_driven(self) -> bool:
        """True if the robot was asked to start and not to stop."""
        return self.phase in ("starting", "driving")

    # --- permission ----------------------------------------------------------------------

    def ask(self, on_result: OnResult, level: str = "teleoperation") -> None:
        """Request permission for the robot from the DVA, at the set level."""
        self.level = level

        def answered(reply: m.Reply) -> None:
            if self.phase == "gone":
                if isinstance(reply.content, m.Permission):
                    steps.give_back(self.device, self.robot, reply.content.session)
                on_result(False, "given back meanwhile")
            elif isinstance(reply.content, m.Permission):
                self.session = reply.content.session
                self.phase = "held"
                self._granted_at = self.device.clock.now
                self._address = reply.content.address or ""
                self._watch()
                on_result(True, f"{self.label} is yours")
            else:
                self._be_gone()
                why = reply.reason
                on_result(False, f"{self.label}: {why}")

        def unreachable() -> None:
            self._be_gone()
            on_result(False, f"{self.label}: the DVA does not answer")
            wanted = partial(self._wanted, self.robot)
            steps.give_back_unanswered(self.device, self.robot, level, wanted)

        body = m.PermissionRequest(self.robot, level)
        self.device.ask(self.device.dva, body, answered, unreachable)

    def give_back(self) -> None:
        """Stop the robot and give it back."""
        if self.phase == "gone":
            return
        self.stop("gave up" if self.is_driven else "")
        if self.session:
            steps.give_back(self.device, self.robot, self.session)
        self._be_gone()

    def revoked(self, session: int) -> None:
        """End a session that the DVA has ended, as the robot knows, too."""
        if self.phase != "gone" and session == self.session:
            self.end("gave up")
            silence = "" if self._has_answered else f"; {self._silence()}"
            self._alert(f"{self.label}: {REVOKED}{silence}")
            self._be_gone()

    def taken_back(self, outcome: str) -> None:
        """End the session that the DVA has ended; the robot has been told, or soon will be."""
        if self.phase != "gone":
            self.stop(outcome)
            self._be_gone()

    def _be_gone(self) -> None:
        self.phase = "gone"
        for heard in (self._picture, self._status, self.missions):
            if heard is not None:
                heard.close()
        self._picture = self._status = self.missions = None
        self._let_go(self)

    def _watch(self) -> None:
        def seen(picture: Subscription) -> None:
            self._picture = picture
            self._has_answered = True

        def offered(sensors: tuple[m.Sensor, ...]) -> None:
            self.offered = sensors

        def blind(url: str) -> None:
            self._has_answered = True
            self._alert(f"{self.label}: no camera to watch at {url!r}")

        steps.watch(
            self.device,
            self.robot,
            self.session,
            topic=self._console().setup.topic,
            on_frame=self._on_frame,
            seen=seen,
            blind=blind,
            wanted=lambda: self.phase != "gone",
            offered=offered,
            unreachable=self._unreachable,
        )
        network = self.device.network
        me = self.device.id_tag
        self._status = network.subscribe(me, self.robot, STATUS, self._on_status)
        if self.level in MISSIONS:
            self.missions = HeldMissions(self.device, self.robot, lambda: self.session)
        self.device.clock.call_after(self._lost_after, self._unanswered)

    @property
    def _lost_after(self) -> float:
        """Silence after which the link counts as lost [s]."""
        return max(LOST_AFTER, self.device.timeout)

    def _unanswered(self) -> None:
        """Give up waiting for the robot's camera address."""
        if self.phase != "gone" and not self._has_answered:
            self._alert(f"{self.label}: {self._silence()}")

    def _on_status(self, data: bytes) -> None:
        """Take a status: with its tick one may drive a robot in sight, without a picture."""
        message = self.device.read(data, self.robot) if self.phase != "gone" else None
        if message is not None and isinstance(message.body, m.RobotStatus):
            self._heard = self.device.clock.now
            self._tick = message.body.tick
            denies = self.phase == "driving" and message.body.mode != "Teleoperation"
            self._idle = self._idle + 1 if denies else 0
            if self._idle == STALE_STATUSES:
                self._refused("the robot has ended the drive: it obeys again after a start")

    @property
    def heard_at(self) -> float:
        """Time of the newest picture or status of the robot [s]; -inf if none has arrived."""
        return max(self.arrived, self._heard)

    def drew(self, captured_ms: int | None) -> None:
        """Note which picture of the robot the person's page has drawn last.

        A page that stops drawing goes on saying so: what it commands is then as old as that
        picture, whatever has arrived here since.

        Args:
            captured_ms: Capture time of the picture [ms]; None: none is drawn yet.
        """
        if not self._ticks:
            return  # a robot without a camera is driven in sight
        if self._drawn_tick is None:
            self._drawn_tick = self._newest_tick
            self.drawn = self.device.clock.now
        tick = None if captured_ms is None else self._ticks.get(captured_ms)
        if tick is not None and captured_ms is not None:
            self._drawn_tick = tick
            self.drawn = captured_ms / 1000
            self._ticks = {at: known for at, known in self._ticks.items() if at >= captured_ms}

    @property
    def _seen_tick(self) -> int | None:
        """The robot's newest tick that the person may have seen [ms]."""
        return self._newest_tick if self._drawn_tick is None else self._drawn_tick

    @property
    def _newest_tick(self) -> int | None:
        """The robot's newest tick that is known here [ms]."""
        drawn_tick = -math.inf if self.frame is None else self.frame.observation.tick
        newest = max(drawn_tick, self._tick)
        return None if newest == -math.inf else int(newest)

    def _unreachable(self) -> None:
        """Give up on a robot after unanswered attempts; it may be requested again."""
        if self.phase != "gone":
            self._alert(f"{self.label}: {self._silence()} after {self.device.attempts} attempts")

    def _silence(self) -> str:
        """Format the message that an address did not answer."""
        where = f" at {self._address}" if self._address else ""
        return f"link lost: no answer{where}"

    def _on_frame(self, payload: CameraFrame | bytes) -> None:
        frame = payload if isinstance(payload, CameraFrame) else CameraFrame.unpack(payload)
        if frame is None or self.phase == "gone":
            return
        now = self.device.clock.now
        self.frame = frame
        self.arrived = now
        self._ticks[round(1000 * frame.captured)] = frame.observation.tick
        if len(self._ticks) > MAX_PICTURES:
            del self._ticks[next(iter(self._ticks))]
        if self.log is not None and self.log.ended is None:
            self.log.frames.append(Shown(frame.captured, now, frame.observation.tick))
        self.on_frame(self, frame)

    # --- drives --------------------------------------------------------------------------

    def start(self, on_result: OnResult) -> None:
        """Ask the robot to be driven."""
        if self.phase != "held":
            on_result(False, f"{self.label}: {_NOT_NOW.get(self.phase, self.phase)}")
            return
        if self.level not in DRIVES:
            on_result(
                False, f"{self.label}: the permission is for {self.level}, not for teleoperation"
            )
            return
        now = self.device.clock.now
        self.phase = "starting"
        self.log = log = DriveLog(self.robot, self.device.id_tag, self.event, now)
        log.taken_up = now
        self.device.recorder.drive_ordered(log)

        self._starting = on_result

        def refused(why: str, outcome: str = "gave up") -> None:
            self._starting = None
            self.end(outcome)
            on_result(False, f"{self.label}: {why}")

        def lost() -> None:
            if self._starting is on_result:  # otherwise it has ended, which was reported
                self._unreachable()
                silence = f"{self._silence()} after {self.device.attempts} attempts"
                refused(silence, "lost link")

        def waits(reply: m.Reply) -> None:
            recently = self.device.clock.now < self._granted_at + GRANT_WITHIN
            if reply.code == m.BUSY or not recently:
                why = reply.text.replace(self.device.id_tag, "this console")
                self._alert(f"{self.label} does not start yet: {why}")

        def begun() -> None:
            self._alert("")
            self._starting = None
            self._begin(log)
            on_result(True, f"{self.label} is driven")

        steps.start(
            self.device,
            self.robot,
            m.StartTeleOp(),
            lambda: self.session,
            wanted=lambda: self.phase == "starting" and self.log is log,
            begun=begun,
            refused=refused,
            lost=lost,
            waits=waits,
        )

    def _begin(self, log: DriveLog) -> None:
        setup = self._console().setup
        device = self.device
        self.phase = "driving"
        log.started = device.clock.now
        if self.event:
            device.progress(self.event, "departed")
        device.tell(f"drives {self.label}", "drive")
        self._inputs.clear()
        self.app = self._tilt()
        self._sender = CommandSender(
            device,
            pattern=setup.pattern(self.robot),
            drive=log,
            session=self.session,
            phone=self.app,
            rate_hz=setup.rate_hz,
            timeout=setup.timeout,
            attempts=setup.attempts,
            window=setup.window,
            seen_tick=lambda: self._seen_tick,
            on_lost=self._lost,
            on_refused=self._refused,
            heeds=setup.heeds,
        )
        self._sender.start()
        if device.clock.now - self._wished.time < STILL_WANTED:
            self.want(self._wished.number, self._wished.speed, self._wished.turn)
        device.clock.every(1.0, lambda: self._listen(log), start=device.clock.now + 1.0)

    def want(self, number: int, speed: float, turn: float) -> None:
        """Set the person's command from now on, as shares of the robot's limits."""
        now = self.device.clock.now
        reach = self._console().reach(self.robot)
        self._wished = Input(number, now, speed, turn)
        self.steered(self._wished)
        if self.phase == "driving":
            self.app.ask(now, speed * reach.speed, turn * reach.turn_rate)
            if isinstance(self.app, GivenVelocity) and self._sender is not None:
                self._sender.look_now()

    def tilted(self, number: int, at: float) -> None:
        """Handle samples of the person's phone, the newest of which was taken at a time [s]."""
        reach = self._console().reach(self.robot)
        level, turn = self.app.shown
        speed = level * SPEED_PER_LEVEL / reach.speed
        self.steered(Input(number, at, speed, math.radians(turn) / reach.turn_rate))

    def steered(self, command: Input) -> None:
        """Take an input, and remember it until it acts."""
        self.last = command
        if self.phase == "driving":
            self._inputs.append(command)

    def acted(self, made: float, sample_age: float) -> Input | None:
        """Return the newest input behind a command made then, of samples so old on average [s]."""
        newest = None
        while self._inputs and self._inputs[0].time <= made - sample_age:
            newest = self._inputs.popleft()
        return newest

    def stop(self, outcome: str = "stopped", on_result: OnResult | None = None) -> None:
        """Stop the robot by a regular command; an ended drive never resumes by itself."""
        if not self.is_driven:
            if on_result is not None:
                on_result(True, f"{self.label} is not driven")
            return
        self.end(outcome)
        self.phase = "stopping"

        def stopped(reply: m.Reply | None = None) -> None:
            if self.phase == "stopping":
                self.phase = "held"
            if on_result is not None:
                done = reply is not None and reply.code == m.OK
                on_result(
                    done, f"{self.label} {'has been told to stop' if done else 'does not answer'}"
                )

        self.device.ask(self.robot, m.StopTeleOp(), stopped, stopped, self.session)

    def emergency(self, on_result: OnResult) -> None:
        """Stop at once, by an emergency message, which overtakes all others."""
        self.end("emergency")
        steps.ask_emergency(self.device, self.robot, self.session, on_result)

    def _listen(self, log: DriveLog) -> bool:
        """Lose the link after too long without picture or status; return True in a drive."""
        goes_on = self.log is log and self.phase == "driving"
        silent = self.device.clock.now - max(self.heard_at, log.started or 0.0)
        if goes_on and silent > self._lost_after:
            self._lost(f"nothing was heard for {silent:.0f} s")
        return goes_on

    def _lost(self, why: str) -> None:
        """End the drive without replies; the watchdog stops the robot."""
        self.end("lost link")
        self._alert(f"{self.label}: link lost: {why}")
        self.device.ask(self.robot, m.StopTeleOp(), session=self.session)

    def _refused(self, why: str) -> None:
        self.end("refused")
        self._alert(f"{self.label}: {why}")

    def end(self, outcome: str) -> None:
        """End a drive, or its start, whatever the cause."""
        on_started = self._starting
        self._starting = None
        if on_started is not None:
            on_started(False, f"{self.label} was not started: {outcome}")
        if self._sender is not None:
            self._sender.stop()
            self._sender = None
        log = self.log
        if log is not None and log.ended is None:
            log.ended = self.device.clock.now
            log.outcome = log.outcome if log.outcome in FOUND else outcome or "stopped"
            self.device.tell(f"ends the drive of {self.label}: {log.outcome}", "drive")
        if self.phase in ("starting", "driving"):
            self.phase = "held"


FOUND = ("confirmed", "refuted")
REVOKED = "the permission was revoked"
DRIVES = ("teleoperation", "both")  # levels of permission
_NOT_NOW = {
    "asking": "the DVA has not answered yet",
    "starting": "it is being started",
    "driving": "it is driven already",
    "stopping": "it has not stopped yet",
    "gone": "it is not yours",
}
