"""A robot on site: its controller bound to body, computer, camera and network."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial

from dva_sim.agents.device import (
    EMERGENCY,
    HOLDER,
    MAX_BID,
    MISSION,
    STATUS,
    AgentDevice,
    command_topic,
)
from dva_sim.agents.observation import FRAME, CameraFrame, Observation, make_frame, make_observation
from dva_sim.agents.robot import command_queue as queue
from dva_sim.agents.robot.command_queue import LIMIT, CommandQueue, Letter, Standing
from dva_sim.agents.robot.confirmations import Confirmations
from dva_sim.agents.robot.controller import (
    ENDS,
    STANDSTILL,
    TELEOPERATION,
    Decision,
    Mission,
    Mode,
    RobotController,
    TimedSetPoint,
)
from dva_sim.agents.robot.decision_log import (
    HANGS,
    LEASE_ENDS,
    MISSION_ENDS,
    PRESSED,
    RELEASES_UNKNOWN,
    STANDS,
    DecisionLog,
)
from dva_sim.agents.robot.emergency_latch import DRIVE
from dva_sim.agents.robot.field_of_view import FieldOfView, HazardSpot
from dva_sim.agents.robot.loops import CollisionGuardedDrive, MissionLoop, Surrounded
from dva_sim.agents.robot.sensors import SensorPort, SensorSubscriptions
from dva_sim.kernel.recorder import ByHand, DriveLog, make_accepted
from dva_sim.network.messaging import Request, Subscription
from dva_sim.network.patterns import Pattern
from dva_sim.protocol import messages as m
from dva_sim.worlds.bodies import RobotBody
from dva_sim.worlds.physics import World
from dva_sim.worlds.planning import Planner

HOLDERS_ONLY = m.StartTeleOp | m.StopTeleOp | m.SetTeleOp | Mission | m.CancelMission
DVAS_ONLY = (
    m.PermissionGrant
    | m.PermissionRevocation
    | m.ReleaseEmergency
    | m.TaskAnnouncement
    | m.TaskAward
)
RESTRICTED = HOLDERS_ONLY | DVAS_ONLY
DRIVING = m.StartTeleOp, m.SetTeleOp
MAX_HELD = 1e6  # longest holding time that a message can state [s]
WHATEVER_WAITS = 1 << 40  # a size below which no backlog of the link holds a message back [B]
STATUS_PERIOD = 1.0  # time between two status messages [s]
WAKES_UP = 1.0  # time after a sleep in which messages may date from before its end [s]
EXPECTED_SPEED = 0.35  # speed under teleoperation, for bids; the DVA expects the same [m/s]
EXPECTED_READY = 4.0  # time until an operator drives, for bids; the DVA expects the same [s]
STANDING = 0.02  # slower wheels count as still [m/s, rad/s]


@dataclass(frozen=True, kw_only=True)
class RobotSetup:
    """Connections of a robot.

    Attributes:
        pattern: Messaging pattern of SetTeleOp.
        service: Function that returns the time that the next message takes its computer [s].
        frame_rate: Frame rate of the camera [1/s].
        frame_bytes: Size of a frame [B].
        view: Field of view of the camera.
        hazards: Visible hazards at a time [s].
        sensors: Sensors by name.
        guarded: True if a collision guard slows its drivers (coordinated control).
        encode: Time from taking a frame to publishing it [s]; one frame at a time.
        charge: Share of the battery's charge that is left.
        conflates: True if its socket keeps only the newest published command.
        limit: Maximum number of queued messages of a class.
    """

    pattern: Pattern
    service: Callable[[], float]
    frame_rate: float
    frame_bytes: int
    view: FieldOfView
    hazards: Callable[[float], list[HazardSpot]]
    sensors: Mapping[str, SensorPort] = field(default_factory=dict)
    guarded: bool = False
    encode: float = 0.0
    charge: Callable[[], float] = lambda: 1.0
    conflates: bool = False
    limit: int = LIMIT


class RobotAgent:
    """A robot: obeys its controller, moves its body, publishes frames, status, heartbeats.

    Args:
        device: Identity and connections of the robot.
        controller: Controller that decides.
        world: The physics that it is part of.
        body: Body of the robot in that world.
        planner: Planner with the map, for missions.
        setup: Pattern, processing time, camera.
        drive_of: The log of a robot's newest drive, if it had any.

    Attributes:
        applied: Commands that took effect.
        refused: Messages that were refused.
        picture_age: Age of the picture behind the last command when it took effect [s], by the
            robot's own clock.
        set_point: Latest set point, and its end of validity.
        filmed: Callback for each frame that it takes, with its id.
        trace: Trace that receives each decision, if there is one.
        unfit: Reason why it cannot be driven now; empty: it can.
        takes_missions: True if it drives missions by itself.
        refuses: Injected fault: every command is refused with this code.
        blind: Injected fault: the camera takes no pictures.
        drained: Injected fault: the battery counts as empty, whatever its charge.
        sensors: Sensors by name; each may be given another port.
    """

    def __init__(
        self,
        device: AgentDevice,
        controller: RobotController,
        *,
        world: World,
        body: RobotBody,
        planner: Planner,
        setup: RobotSetup,
        drive_of: Callable[[str], DriveLog | None],
    ) -> None:
        self.device = device
        self.controller = controller
        device.meanwhile = "it obeys its driver as before"
        device.on_dva = self._obeys
        device.is_engaged = lambda: controller.mode is not Mode.IDLE
        device.clock.on_suspended(self._woke)
        self.body = body
        self._world = world
        self._planner = planner
        self._setup = setup
        self._drive_of = drive_of
        self.applied = self.refused = 0
        self.picture_age: float | None = None
        self.set_point = STANDSTILL
        self.filmed: Callable[[str, CameraFrame], object] | None = None
        self.trace: DecisionLog | None = None
        self.unfit = ""
        self.takes_missions = True
        self.refuses: int | None = None
        self.blind = self.drained = False
        self._fared = m.OK
        self._held_since = 0.0
        # Holder and code of its newest command, as last published.
        self._last_published: tuple[str | None, int] = (None, m.WRONG_MODE)
        self.inbox = CommandQueue(
            clock=device.clock,
            service=setup.service,
            handle=self._handle,
            latest_wins=setup.pattern.newest_wins or setup.conflates,
            limit=setup.limit,
            read=self._admit,
            standing=self._standing,
            driven=self._is_driven,
            refuse=self._turn_away,
        )
        self._confirmations = Confirmations(
            device,
            controller,
            self._dva_answered,
            partial(self._conclude, waited=True),
            self._happened,
        )
        self.sensors = dict(setup.sensors)
        self._sensing = SensorSubscriptions(
            device, self.sensors, controller.tick, controller.may_read
        )
        controller.sensors = tuple(m.Sensor(n, port.unit) for n, port in setup.sensors.items())
        self._latch_published = (False, 0)
        self._asks_release = False
        self._asks_release_again = False
        self._pattern = setup.pattern
        self._commands: Subscription | None = None
        self._encoding = False
        around = Surrounded(device.clock, world, body, planner)
        self._guarded = CollisionGuardedDrive(around, controller) if setup.guarded else None
        self._missions = MissionLoop(
            around, controller, self.observe, setup.charge, self._mission_news
        )
        device.network.serve(device.id_tag, self.inbox.request)

    def start(self) -> None:
        """Begin to publish frames, status and mode changes."""
        clock = self.device.clock
        self.device.connect(self.device.dva)  # ahead of the first question to the DVA
        clock.every(1.0 / self._setup.frame_rate, self._take_frame)
        clock.every(STATUS_PERIOD, self._publish_status)

    def observe(self) -> Observation:
        """Return the present view of the camera."""
        now = self.device.clock.now
        self._world.advance_to(now)
        body = self.body
        view = self._setup.view
        tick = self.controller.tick(now)
        x, y, heading = body.pose()
        hazards = view.look(x, y, heading, self._setup.hazards(now))
        visibility = view.visibility(x, y, heading)
        return make_observation(
            tick=tick,
            x=x,
            y=y,
            heading=heading,
            speed=body.speed,
            turn_rate=body.turn_rate,
            hazards=hazards,
            visibility=visibility,
        )

    def expect(self, pattern: Pattern) -> None:
        """Take commands by another pattern, from the next drive on.

        Raises:
            RuntimeError: it is driven now.
        """
        if self.controller.mode is TELEOPERATION:
            raise RuntimeError(f"{self.device.label} is driven")
        self._pattern = pattern
        self.inbox.latest_wins = pattern.newest_wins or self._setup.conflates

    @property
    def stale(self) -> bool:
        """True if the newest command of its holder came too late to be obeyed."""
        return self._fared == m.STALE

    @property
    def charge(self) -> float:
        """Share of the battery's charge that is left."""
        return 0.0 if self.drained else self._setup.charge()

    @property
    def holder(self) -> tuple[str | None, float]:
        """Current holder, by id, and for how long already [s]."""
        return self._holder, self.device.clock.now - self._held_since

    @property
    def is_moving(self) -> bool:
        """True if its wheels turn now."""
        self._world.advance_to(self.device.clock.now)
        return abs(self.body.turn_rate) > STANDING or abs(self.body.speed) > STANDING

    def hang(self) -> None:
        """Hang the computer: it neither hears nor sends, and restarts idle.

        The motors keep what they were told last until its watchdog stops them; a mission, which the
        computer steers, stops at once.
        """
        if self.controller.mode is Mode.MISSION:
            self.move(STANDSTILL)
        self._happened(HANGS)
        before = self.controller.mode
        self.controller.hang()
        self._confirmations.forget()
        self._asks_release = False
        self._asks_release_again = False
        self.device.silent = True
        if self.controller.mode is not before:
            self.mode_changed("")

    def restart(self, clock_offset: float) -> None:
        """Restart the program: it forgets driver and readers, registers, and asks who holds it.

        Args:
            clock_offset: See `RobotController.restart`.
        """
        self.hang()
        self.controller.restart(clock_offset, self.device.clock.now)
        self._sensing.end_all()
        self.device.restart()
        self.device.register()
        self.device.connect(self.device.dva)
        self._confirmations.ask()

    def _obeys(self, dva: str) -> None:
        """Obey another DVA from now on, and report the driver to it, who continues."""
        self.controller.dva = dva
        self.device.connect(dva)
        grant = self.controller.grant
        if grant is not None:
            brought = m.GetGrant(grant.holder, grant.level)
            self.device.ask(dva, brought, session=grant.session)

    def withdraw(self, why: str) -> None:
        """Stand idle, and take no order until `return_to_service`: nobody can drive it safely.

        The robot publishes that it is idle. Then it falls silent, so that the DVA sends nobody to
        it; it still answers, and says why it refuses.
        """
        self.unfit = why
        self.device.tell(f"cannot be driven: {why}", "mode")
        self._stand()
        self.device.withdrawn = True

    def _woke(self, gap: float) -> None:
        """Drop all orders from before a sleep, and those sent meanwhile."""
        self.device.tell(f"stands: its computer was suspended for {gap:.0f} s", "mode")
        self._stand()
        self.controller.emergency_at += WAKES_UP  # the backlog of the sleep is read until then

    def _stand(self) -> None:
        """Stand idle until a new order, and publish that."""
        before = self.controller.mode
        now = self.device.clock.now
        decision = self.controller.stand(now)
        self.device.recorder.on_hand(ByHand(self.device.id_tag, "", "stands", now))
        self._happened(STANDS)
        if decision.set_point is not None:
            self.move(decision.set_point)
        if self.controller.mode is not before:
            self.mode_changed("")
        self._publish_status()
        self._publish_holder()

    def return_to_service(self) -> None:
        """Take orders again, since the robot is fit again."""
        self.unfit = ""
        self.device.withdrawn = False
        self.device.tell("can be driven again", "mode")

    def power(self, on: bool) -> None:
        """Give motors, computer and radio power, or none: then it brakes, and is silent."""
        if on is not self.body.powered:
            self.body.powered = on
            self.device.silent = not on
            self.device.tell("has power again" if on else "has no power left: it is silent", "link")

    # --- messages ----------------------------------------------------------------------

    def _admit(self, request: Request) -> m.Message | None:
        """Return a request that is worth waiting for; without power it hears none.

        While somebody drives, orders of strangers are refused before they cost any processing,
        unless a message of the DVA waits that may make one of them the holder.
        """
        message = None if self.device.silent else self.device.admit(request)
        if message is None or not isinstance(body := message.body, RESTRICTED):
            return message
        if self._sender_standing(message) is not queue.OTHER:
            return message
        is_informed = self.inbox.hears_the_dva or self.controller.inquiry.is_open
        if (is_informed or not self._is_driven()) and isinstance(body, HOLDERS_ONLY):
            return message
        # Decided at once, without the queue: strangers must not slow the holder down.
        letter = Letter(request.data, self.device.clock.now, request, message)
        answer = partial(self._reply, letter, waited=True)
        self.device.conclude(request, message, answer, at_once=True)
        return None

    def _sender_standing(self, message: m.Message) -> Standing:
        if self.controller.knows(message):
            return queue.HOLDER
        return queue.DVA if message.source == self.controller.dva else queue.OTHER

    def _standing(self, letter: Letter) -> Standing:
        """Return the standing of a publisher: the holder, since the robot subscribed to it."""
        if letter.request is None or letter.message is None:
            return queue.HOLDER
        return self._sender_standing(letter.message)

    def _is_driven(self) -> bool:
        return self.controller.mode is TELEOPERATION

    def _turn_away(self, letter: Letter) -> None:
        """Turn away a letter, as the queue is full."""
        if letter.request is not None and not self.device.silent:
            answers = letter.message.message_id if letter.message is not None else 0
            refusal = m.Reply(answers, m.BUSY, "too many of your messages wait")
            self.device.turn_away(letter.request, letter.message, refusal)

    def _published(self, data: bytes) -> None:
        """Queue a published command of the driver; other messages cost no processing time."""
        message = None if self.device.silent else self.device.read(data, self.controller.owner)
        if message is None:
            return
        if message.destination == self.device.id_tag:
            self.inbox.published(data, message)
        else:
            self.device.recorder.counters["refused: to another device"] += 1

    def _handle(self, letter: Letter) -> None:
        """Handle a letter whose processing is done."""
        if self.device.silent or letter.message is None:
            return
        if letter.request is None:
            self._decide(letter.message, letter.arrived)
        else:
            self._conclude(letter)

    def _conclude(self, letter: Letter, waited: bool = False) -> None:
        """Answer a letter, unless it has to wait for a query to the DVA."""
        if letter.request is not None and letter.message is not None and not self.device.silent:
            answer = partial(self._reply, letter, waited=waited)
            self.device.conclude(letter.request, letter.message, answer)

    def _reply(self, letter: Letter, message: m.Message, *, waited: bool) -> m.Reply | None:
        decision = self._decide(message, letter.arrived, waited)
        if decision.waits and not waited:
            if self._confirmations.keep(letter, message):
                self._confirmations.ask()
                return None
            # The list of waiting messages is full: the decision is final as it is.
            decision = self._decide(message, letter.arrived, waited=True)
        return m.Reply(message.message_id, decision.code, decision.text, decision.content)

    def _decide(self, message: m.Message, arrived: float, waited: bool = False) -> Decision:
        now = self.device.clock.now
        moving = self.is_moving
        controller = self.controller
        is_command = isinstance(message.body, m.SetTeleOp)
        before = controller.mode
        mission = controller.mission_status
        unable = self._unable(message)
        if unable is None:
            decision = controller.handle(message, arrived, now, moving, waited)
        else:
            decision = unable
        if self.trace is not None and unable is None:
            self.trace.decided(message, arrived, now, moving, decision, waited)
        if decision.waits and not waited:
            return decision
        if decision.set_point is not None:
            self.move(decision.set_point)
        if decision.code == m.OK and not is_command:
            decision = self._follow_up(message, decision)
        if decision.code != m.OK:
            self.refused += 1
            name = m.CODE_NAMES[decision.code]
            self.device.recorder.counters[f"robot refused: {name}"] += 1
        elif is_command:
            self._log_command(message, arrived, now, decision.set_point)
        if controller.mode is not before:
            self.mode_changed(message.source)
        if controller.mission_status is not mission:
            self._publish_mission()
        self._note_holder(message, decision.code)
        if not is_command:
            self._confirmations.ask()
            if isinstance(message.body, m.ReleaseEmergency):
                self._ask_for_release()
            self.latch_changed()
        return decision

    def _unable(self, message: m.Message) -> Decision | None:
        """Return why the robot cannot fulfil a request of any sender; None if it can.

        It obeys an emergency as far as it reaches the motors, and does not promise more.
        """
        body = message.body
        if isinstance(body, m.SetTeleOp) and self.refuses is not None:
            return Decision(self.refuses, "refuses all commands")
        if isinstance(body, Mission) and not self.takes_missions:
            return Decision(m.NOT_SUPPORTED, "this robot drives no missions")
        if self.unfit and isinstance(body, m.StartTeleOp | Mission):
            return Decision(m.BUSY, self.unfit)
        if self.unfit and isinstance(body, m.Emergency):
            stop = self.controller.stop(self.device.clock.now, message.source)
            self._happened(PRESSED)
            return stop._replace(code=m.BUSY, text=f"told to stop, but {self.unfit}")
        return None

    def _dva_answered(self, reply: m.Reply) -> Decision:
        """Take the DVA's answer, over a connection of the robot's own."""
        me = self.device.id_tag
        dva = self.device.dva
        answer = m.Message(me, 1, dva, "00:00:00", 0, reply)
        return self._decide(answer, self.device.clock.now)

    def _happened(self, what: str) -> None:
        if self.trace is not None:
            self.trace.happened(what, self.device.clock.now)

    def _note_holder(self, message: m.Message, code: int) -> None:
        """Note the code of the holder's newest command; a change is published at once."""
        holder = self._holder
        if isinstance(message.body, DRIVING) and message.source == holder:
            self._fared = code
        if holder != self._last_published[0]:
            self._held_since = self.device.clock.now
        fares = self._fares
        if (holder, fares if fares in m.OBEYS_NO_MORE else m.OK) != self._last_published:
            self._publish_holder()

    @property
    def _holder(self) -> str | None:
        return None if self.controller.grant is None else self.controller.grant.holder

    @property
    def _fares(self) -> int:
        return self._fared if self.controller.mode is TELEOPERATION else m.WRONG_MODE

    def _publish_holder(self) -> None:
        """Publish the holder: drivers that publish their commands get no replies."""
        network = self.device.network
        me = self.device.id_tag
        fares = self._fares
        self._last_published = self._holder, fares if fares in m.OBEYS_NO_MORE else m.OK
        duration = min(self.device.clock.now - self._held_since, MAX_HELD)
        if network.ready(me, HOLDER, WHATEVER_WAITS):
            self.device.publish(HOLDER, m.RobotHolder(self._holder, None, duration, fares or None))

    # --- emergency ---------------------------------------------------------------------

    def latch_changed(self) -> None:
        """Publish that an emergency holds the robot, or was released, and ask for a release."""
        latch = self.controller.latch
        state = latch.holds, latch.tick
        if state == self._latch_published:
            return
        was_held, _ = self._latch_published
        self._latch_published = state
        if was_held and not latch.holds:
            released_by = latch.released.label if latch.released else "a new start"
            self.device.tell(f"is released after an emergency by {released_by}", "mode")
        self.device.clock.call_after(0.0, self._announce_emergency)  # after the reply

    def _announce_emergency(self) -> None:
        """Publish the latch, and ask the DVA for a release."""
        network = self.device.network
        me = self.device.id_tag
        if network.ready(me, EMERGENCY, WHATEVER_WAITS):
            self.device.publish(EMERGENCY, self.controller.latch.message(self.device.clock.now))
        self._ask_for_release()

    def _ask_for_release(self) -> None:
        """Ask the DVA whether a person has released the robot; one request at a time."""
        latch = self.controller.latch
        if not latch.holds or latch.rule == DRIVE:
            return
        if self._asks_release:
            self._asks_release_again = True
            return
        self._asks_release = True
        emergency = latch.message(self.device.clock.now)
        self.device.ask(self.device.dva, emergency, self._release_answered, self._release_over)

    def _release_answered(self, reply: m.Reply) -> None:
        if not self.device.silent and isinstance(reply.content, m.EmergencyRelease):
            self._dva_answered(reply)
        elif not self.device.silent and reply.code in (m.BAD_MESSAGE, m.NOT_SUPPORTED):
            self.controller.latch.take_refusal()
            self._happened(RELEASES_UNKNOWN)
        self._release_over()

    def _release_over(self) -> None:
        asks_again = self._asks_release_again
        self._asks_release = False
        self._asks_release_again = False
        if asks_again:
            self._ask_for_release()

    def _follow_up(self, message: m.Message, decision: Decision) -> Decision:
        """Apply a decision to everything but the motors."""
        match message.body:
            case m.DevSub() as wish:
                return Decision(*self._sensing.subscribe(message.source, wish))
            case m.TaskAnnouncement() as announced if self.controller.free:
                self.device.clock.call_after(0.0, self._bid, announced)
        return decision

    def _bid(self, announced: m.TaskAnnouncement) -> None:
        """Offer to be driven there, by the robot's own map."""
        place = announced.position
        pose = self.body.pose()
        goal = self.device.frame.to_xy(place.latitude, place.longitude)
        distance = self._planner.distance((pose.x, pose.y), goal)
        arrival = EXPECTED_READY + distance / EXPECTED_SPEED
        if arrival <= MAX_BID:
            self.device.ask(self.device.dva, m.TaskBid(announced.event_id, arrival))

    def _log_command(
        self, message: m.Message, arrived: float, now: float, set_point: TimedSetPoint | None
    ) -> None:
        assert isinstance(message.body, m.SetTeleOp)
        self.applied += 1
        tick = message.body.seen_tick
        if tick is not None:
            self.picture_age = (self.controller.tick(now) - tick) / 1000
        number = message.message_id
        recorder = self.device.recorder
        recorder.on_accepted(
            make_accepted(
                robot=self.device.id_tag,
                source=message.source,
                session=message.session,
                message_id=number,
                seen_tick=tick,
                arrived=arrived,
                time=now,
            )
        )
        drive = self._drive_of(self.device.id_tag)
        if drive is not None and set_point is not None:
            recorder.command_applied(drive, message.source, number, arrived, now, set_point.until)

    def move(self, set_point: TimedSetPoint) -> None:
        """Pass a set point on to the motors."""
        self.set_point = set_point
        if self._guarded is not None and self.controller.mode is TELEOPERATION:
            self._guarded.take(set_point)
            return
        self.body.drive(set_point.speed, set_point.turn_rate, set_point.until)

    def mode_changed(self, source: str) -> None:
        """Note that its activity has changed, on the order of a source."""
        mode = self.controller.mode
        if not self.device.silent:
            self.device.tell(f"is now in mode {mode}", "mode")
        if self._commands is not None:
            self._commands.close()
            # Commands of the previous drive must not act in the next one.
            self._commands = self.inbox.flow = None
            self.inbox.forget_published()
        if mode is TELEOPERATION and self._pattern.published:
            me = self.device.id_tag
            self._commands = self.inbox.flow = self.device.network.subscribe(
                me, source, command_topic(me), self._published
            )
        if self.controller.mission is not None:
            self._missions.begin(self.controller.mission, self.device.frame)

    # --- periodic work -----------------------------------------------------------------

    def _take_frame(self) -> None:
        """Send a frame to the viewers; skip it while the last one still waits."""
        network = self.device.network
        me = self.device.id_tag
        size = self._setup.frame_bytes
        if self.device.silent or self.blind or self._encoding or not network.ready(me, FRAME, size):
            return
        frame = make_frame(self.observe(), self.device.clock.now)
        if self.filmed is not None:
            self.filmed(me, frame)
        # The frame is captured before encoding, and published afterwards.
        if self._setup.encode > 0.0:
            self._encoding = True
            self.device.clock.call_after(self._setup.encode, self._encoded, frame)
        else:
            network.publish(me, FRAME, frame, size)

    def _encoded(self, frame: CameraFrame) -> None:
        self._encoding = False
        size = self._setup.frame_bytes
        if not self.device.silent:
            self.device.network.publish(self.device.id_tag, FRAME, frame, size)

    def _publish_status(self) -> None:
        now = self.device.clock.now
        self._world.advance_to(now)
        if self.controller.expire(now):
            self._happened(LEASE_ENDS)
            self.mode_changed("")
        pose = self.body.pose()
        body = m.RobotStatus(
            self.controller.mode.value,
            m.Position(*self.device.frame.to_latlon(pose.x, pose.y)),
            pose.heading,
            self.body.speed,
            self.body.turn_rate,
            self.controller.tick(now),
        )
        self.device.publish(STATUS, body)
        if self._holder is not None:
            self._publish_holder()
        if self.controller.latch.holds:
            self._announce_emergency()

    def _publish_mission(self) -> None:
        self.device.publish(MISSION, self.controller.mission_status)

    def _mission_news(self) -> None:
        """Publish that the state of the mission has changed; it may be over."""
        status = self.controller.mission_status
        self._publish_mission()
        if status.mission_state in ENDS:
            why = f": {status.reason}" if status.reason else ""
            self.device.tell(f"mission {status.mission_state}{why}", "mode")
            self._happened(MISSION_ENDS)
            self.mode_changed("")
