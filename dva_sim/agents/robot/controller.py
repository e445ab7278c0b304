"""Controller of a robot: modes, sessions, order and age of commands, watchdog, emergency.

Pure: it takes messages with their times and returns what to answer and how to move.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import NamedTuple

from dva_sim.agents.robot.emergency_latch import EmergencyLatch
from dva_sim.agents.robot.inquiry import Inquiry
from dva_sim.kernel.makers import maker
from dva_sim.protocol import messages as m

LEASE_S = 30.0  # teleoperation without a valid command ends by itself after this [s]
ENDS = "done", "failed"  # states that end a mission
MAX_OBSERVERS = 64  # maximum devices that read sensors without holding the robot
INQUIRY_WAIT_S = 3.0  # minimum time for which an order waits for the DVA's answer [s]


class Mode(StrEnum):
    """Mode of a robot."""

    IDLE = "Idle"
    MISSION = "Mission"
    TELEOPERATION = "Teleoperation"


IDLE, MISSION, TELEOPERATION = Mode  # globals: looking a member up is fifteen times as slow


class TimedSetPoint(NamedTuple):
    """Set point with an end: speed [m/s], turn rate [rad/s], time [s]."""

    speed: float
    turn_rate: float
    until: float


_make_set_point = maker(TimedSetPoint)


STANDSTILL = TimedSetPoint(0.0, 0.0, 0.0)
NO_MISSION = m.MissionStatus(0, "none", 0, "")
Mission = m.GoTo | m.Patrol | m.Inspect | m.ReturnToBase


class Decision(NamedTuple):
    """Consequence of a message.

    Attributes:
        code: Reply code; anything but OK means that nothing has changed.
        text: Reason in words.
        set_point: The new set point, or None to leave it.
        content: Content of the reply.
        waits: True if the decision is provisional: the DVA must be asked, and the message decided
            on again after its answer.
    """

    code: int
    text: str = ""
    set_point: TimedSetPoint | None = None
    content: m.SensorInfo | m.MissionStatus | None = None
    waits: bool = False


_make_decision = maker(Decision)


@dataclass(frozen=True)
class Limits:
    """Time limits after which a robot no longer obeys a command.

    Attributes:
        watchdog: A command is in force for at most this long after its reception [s].
        max_age: A command is in force for at most this long after the newest picture that its
            sender had seen [s].
    """

    watchdog: float
    max_age: float


@dataclass
class RobotController:
    """Decision logic of one robot.

    Attributes:
        id_tag: The robot.
        dva: Id of the DVA: the only one whose grants count.
        limits: Watchdog and age limit.
        camera_url: URL in the answer to requests for the sensors.
        sensors: Sensors on board.
        clock_offset: Time of the robot's own clock at the run's start [s]; no other clock agrees
            with it.
        without_tick: Commands without `SeenTick` so far.
        future_ticks: Commands with a `SeenTick` that the robot's clock has not reached.
        grant: Permission of its holder, as the DVA has confirmed it.
        observers: Permissions to read its sensors, by device, as the DVA has confirmed them.
        inquiry: Open questions to the DVA.
        by_hand: Person who drives it by hand, at the robot itself; None if nobody does.
        latch: Latch that an emergency closes; while it holds, no order moves the robot.
    """

    id_tag: str
    dva: str
    limits: Limits
    camera_url: str = "http://192.168.1.20:8080/camera"
    sensors: tuple[m.Sensor, ...] = ()
    clock_offset: float = 0.0
    mode: Mode = IDLE
    owner: str | None = None
    grant: m.PermissionGrant | None = None
    observers: dict[str, m.PermissionGrant] = field(default_factory=dict)
    mission: Mission | None = None
    mission_status: m.MissionStatus = NO_MISSION
    last_order_id: int = 0
    last_set_id: int = 0
    last_valid: float = 0.0
    emergency_at: float = -1.0
    without_tick: int = 0
    future_ticks: int = 0
    inquiry: Inquiry = field(default_factory=Inquiry)
    by_hand: str | None = None
    latch: EmergencyLatch = field(default_factory=EmergencyLatch)
    _numbered: int = 0  # session to which `last_order_id` and `last_set_id` belong

    def tick(self, now: float) -> int:
        """Return the robot's own clock [ms]."""
        return round((now + self.clock_offset) * 1000)

    def handle(
        self, message: m.Message, arrived: float, now: float, moving: bool, waited: bool = False
    ) -> Decision:
        """Decide on a message.

        Args:
            message: Received and validated message.
            arrived: Arrival time at the robot [s]; the message may have been queued since.
            now: Time [s].
            moving: True while the robot's wheels still turn.
            waited: True if it has waited for the DVA: this decision is final.
        """
        decision = self._handle(message, arrived, now, moving)
        if decision.waits and not waited:
            # The sender may have been given a permission that is not known here yet.
            if isinstance(message.body, m.DevSub):
                self.inquiry.about_reader(message.source)
            elif not isinstance(message.body, m.Reply):
                self.inquiry.about_holder(message.source)
        return decision

    def _handle(self, message: m.Message, arrived: float, now: float, moving: bool) -> Decision:
        body = message.body
        match body:
            case m.SetTeleOp():
                return self._set(message, body, arrived, now)
            case m.Emergency():
                return self.stop(now, message.source)
            case m.ReleaseEmergency():
                return self._released(message)
            case m.PermissionGrant():
                return self._granted(message, body)
            case m.PermissionRevocation():
                return self._revoked(message, body)
            case m.DevSub():
                return self._subscription(message, body)
            case m.StartTeleOp():
                return self._start(message, arrived, now, moving)
            case m.StopTeleOp():
                return self._stop(message)
            case m.GoTo() | m.Patrol() | m.Inspect() | m.ReturnToBase():
                return self._mission(message, body, arrived, moving)
            case m.CancelMission():
                return self._cancel(message)
            case m.GetMissionStatus():
                return Decision(m.OK, content=self.mission_status)
            case m.TaskAnnouncement() | m.TaskAward():
                return self._auction(message)
            case m.GetSensorInfo(device=device) if device in (None, self.id_tag):
                return Decision(m.OK, content=m.SensorInfo(self.camera_url, self.sensors))
            case m.Reply():
                return self._dva_answered(body)
            case m.GetSensorInfo():
                return Decision(m.UNKNOWN_DEVICE, "ask the DVA for the sensors of others")
            case _:
                return Decision(m.NOT_SUPPORTED, f"a robot does not take {type(body).__name__}")

    def knows(self, message: m.Message) -> bool:
        """Return True if the session proves that a message is the holder's."""
        grant = self.grant
        return (
            grant is not None
            and message.source == grant.holder
            and message.session == grant.session
        )

    def expire(self, now: float) -> bool:
        """End a drive, by messages or by hand, whose driver has long been silent; True if so."""
        driven = self.mode is TELEOPERATION or self.by_hand is not None
        if driven and now - self.last_valid > LEASE_S:
            self._idle("")
            return True
        return False

    def hang(self) -> None:
        """Hang the computer; it will restart idle, and the current order is dropped."""
        self._idle("its computer hung")

    def restart(self, clock_offset: float, now: float) -> None:
        """Begin again as after a restart of the program: idle, and with no known holder.

        Args:
            clock_offset: New time of its clock at the run's start [s].
            now: Time [s].
        """
        self._idle("its computer was restarted")
        self.inquiry.restart(now)
        self.grant = None
        self.clock_offset = clock_offset
        self.observers.clear()
        self.last_order_id = self.last_set_id = self._numbered = 0

    # --- by hand, at the robot itself ---------------------------------------------------

    def take_by_hand(self, who: str, now: float, moving: bool) -> Decision:
        """Let a person at the robot drive it, without messages and without a session.

        Only a robot that is idle and that nobody holds can be taken so; from then on it is busy
        for everybody else, until it is let go, an emergency comes, or nothing is heard for long.

        Args:
            who: Name of the person, which is never sent over the network.
            now: Time [s].
            moving: True while the robot's wheels still turn.
        """
        if self.by_hand == who:
            return Decision(m.OK, "is in hand already")
        if self.grant is not None:
            return Decision(m.BUSY, f"held by {self.grant.holder}")
        if self.inquiry.is_open and now < self.inquiry.asked_at + INQUIRY_WAIT_S:
            return Decision(m.BUSY, "the DVA is being asked who holds it")
        refusal = self._begin(math.inf, moving, releases=self.latch.starts())
        if refusal is not None:
            return refusal
        if self.latch.holds:
            self.latch.release(None)
        self.by_hand = who
        self.last_valid = now
        return Decision(m.OK, set_point=STANDSTILL)

    def drive_by_hand(self, who: str, speed: float, turn_rate: float, now: float) -> Decision:
        """Return the set point of the person who drives by hand; in force until the watchdog.

        Args:
            who: Person, by the name under which the robot was taken.
            speed: Speed [m/s]; not negative.
            turn_rate: Turn rate [rad/s].
            now: Time [s].
        """
        if self.by_hand is None or self.by_hand != who:
            return Decision(m.WRONG_MODE, "you do not drive it: take manual control first")
        if not (math.isfinite(turn_rate) and 0.0 <= speed < math.inf):
            return Decision(m.BAD_MESSAGE, "no speed ahead and turn rate")
        self.last_valid = now
        point = TimedSetPoint(speed, turn_rate, now + self.limits.watchdog)
        return Decision(m.OK, set_point=point)

    def stop(self, now: float, stopped_by: str | None = None) -> Decision:
        """Stop and stand idle until released; nothing that was received before moves it (S3).

        Args:
            now: Time [s].
            stopped_by: Id of the device that sent the emergency; None: the button at the robot.
        """
        self._idle("emergency")
        self.emergency_at = now
        self.latch.close(stopped_by, now, self.tick(now))
        return Decision(m.OK, "stopped", STANDSTILL)

    def stand(self, now: float) -> Decision:
        """Stop and forget all orders of before; unlike an emergency, the next order moves it."""
        self._idle("stopped")
        self.emergency_at = now
        return Decision(m.OK, "stopped", STANDSTILL)

    def release_by_hand(self, label: str) -> Decision:
        """Release the robot after an emergency, by a person who stands beside it."""
        if not self.latch.holds:
            return Decision(m.WRONG_MODE, "no emergency has stopped it")
        self.latch.release(m.ByWhom(self.id_tag, label, 0.0))
        return Decision(m.OK, "released")

    def let_go(self, who: str) -> Decision:
        """Give the robot up; a request by anyone but its driver changes nothing."""
        if self.by_hand is None or self.by_hand != who:
            return Decision(m.WRONG_MODE, "it is not in this hand")
        self._idle("")
        return Decision(m.OK, set_point=STANDSTILL)

    def mission_changed(self, state: str, left: int, reason: str) -> bool:
        """Take the state of the mission from its pilot; return True if it has changed.

        Args:
            state: State as in `MissionStatus`; `done` and `failed` end the mission.
            left: Places still to be visited.
            reason: Reason in words.
        """
        before = self.mission_status
        if self.mode is MISSION:
            self.mission_status = m.MissionStatus(before.mission_id, state, left, reason)
            if state in ENDS:
                self._idle(reason)
        return self.mission_status != before

    def _idle(self, why: str) -> None:
        """Become idle; a mission that was still under way fails, for the reason `why`."""
        status = self.mission_status
        if self.mode is MISSION and status.mission_state not in ENDS:
            left = status.waypoints_left
            self.mission_status = m.MissionStatus(status.mission_id, "failed", left, why)
        self.mode = IDLE
        self.owner = None
        self.mission = None
        self.by_hand = None

    def _released(self, message: m.Message) -> Decision:
        """Accept a release as a reason to ask the DVA, whose answer alone counts."""
        if message.source != self.dva:
            return Decision(m.NOT_PERMITTED, "only the DVA releases: send it the request")
        if not self.latch.holds:
            return Decision(m.OK, "no emergency has stopped it")
        return Decision(m.OK, "takes effect when the DVA has confirmed it")

    def _granted(self, message: m.Message, body: m.PermissionGrant) -> Decision:
        """Take a grant as a reason to ask the DVA; it takes effect once confirmed (S2)."""
        if message.source != self.dva:
            return Decision(m.NOT_PERMITTED, "only the DVA grants permissions")
        if body.level == "sensors":
            return self._full(body.holder) or Decision(m.OK, "confirmed when it subscribes")
        if body == self.grant:
            return Decision(m.OK)
        self.inquiry.about_holder(body.holder)
        return Decision(m.OK, "takes effect when the DVA has confirmed it")

    def _revoked(self, message: m.Message, body: m.PermissionRevocation) -> Decision:
        """End a session at once if it is said to be over; the DVA may restore it.

        A forged revocation stops a drive, as an emergency would, but takes the robot from nobody.
        """
        if message.source != self.dva:
            return Decision(m.NOT_PERMITTED, "only the DVA revokes permissions")
        self.inquiry.is_over(body.session)
        observer = self.observers.get(body.holder)
        if observer is not None and observer.session == body.session:
            del self.observers[body.holder]
        if self.grant is None or self.grant.session != body.session:
            return Decision(m.OK)
        self.inquiry.about_holder(self.grant.holder)
        return self._is_held(None)

    def _dva_answered(self, body: m.Reply) -> Decision:
        """Apply an answer of the DVA, which alone can change the holder.

        "Nobody holds it" does not end a drive: a DVA that has lost its memory may say so.
        """
        if isinstance(body.content, m.EmergencyRelease):
            self.latch.take_answer(body.content)
            return Decision(m.OK)
        question = self.inquiry.answered(body)
        permission = body.content
        if question is None:
            return Decision(m.OK, waits=True)
        if body.code != m.OK or not isinstance(permission, m.Permission):
            if question.level is not None and question.holder is not None:
                self.observers.pop(question.holder, None)
            return Decision(m.OK)
        grant = m.PermissionGrant(
            permission.device,
            permission.level,
            permission.session,
            permission.address,
            permission.sensors,
        )
        if grant.level != "sensors":
            return self._is_held(grant)
        if self._full(grant.holder) is None:
            self.observers[grant.holder] = grant
        return Decision(m.OK)

    def _is_held(self, grant: m.PermissionGrant | None) -> Decision:
        """Replace the holder, or leave the robot without one; the current driver is stopped."""
        current = self.grant
        self.grant = grant
        if grant is not None and current is not None and grant.session == current.session:
            return Decision(m.OK)  # the same holder, perhaps at another address
        if grant is not None and grant.session != self._numbered:
            # A new session of a holder may reuse message numbers.
            self.last_order_id = 0
            self.last_set_id = 0
            self._numbered = grant.session
        if self.owner is None:  # also when driven by hand, which continues
            return Decision(m.OK)
        self._idle("revoked")
        return Decision(m.OK, set_point=STANDSTILL)

    def _full(self, observer: str) -> Decision | None:
        """Refuse one more observer if the limit is reached; the driver continues."""
        if observer in self.observers or len(self.observers) < MAX_OBSERVERS:
            return None
        return Decision(m.BUSY, f"this robot serves at most {MAX_OBSERVERS} observers")

    def _subscription(self, message: m.Message, body: m.DevSub) -> Decision:
        """Decide on a subscription to a sensor; permissions name each sensor (S5)."""
        grants = self._find_grants(message.source)
        if body.sensor not in {sensor.name for sensor in self.sensors}:
            names: Iterable[str] = (sensor.name for sensor in self.sensors)
            offer = f"there are {', '.join(names) or 'none'}"
            return Decision(m.UNKNOWN_SENSOR, f"no sensor of that name; {offer}")
        if not any(body.sensor in grant.sensors for grant in grants):
            text = f"{message.source} may not subscribe to {body.sensor}"
            return self._full(message.source) or Decision(m.NOT_PERMITTED, text, waits=True)
        if message.session not in {g.session for g in grants if body.sensor in g.sensors}:
            text = f"session {message.session} is not the current one"
            return Decision(m.BAD_SESSION, text, waits=True)
        return Decision(m.OK)

    @property
    def free(self) -> bool:
        """True if it is idle and nobody holds it, so that it can be sent on a mission."""
        idle = self.mode is IDLE and self.by_hand is None and not self.latch.holds
        return idle and self.owner is None and self.grant is None

    def _auction(self, message: m.Message) -> Decision:
        """Decide on an offer or an award, which move nothing: an operator has to drive."""
        if message.source != self.dva:
            return Decision(m.NOT_PERMITTED, "only the DVA holds auctions")
        if isinstance(message.body, m.TaskAward) and self.latch.holds:
            return Decision(m.BUSY, self.latch.refusal)
        if isinstance(message.body, m.TaskAward) and not self.free:
            return Decision(m.BUSY, f"in mode {self.mode}, held by {self._holder()}")
        return Decision(m.OK)

    def _holder(self) -> str:
        if self.by_hand is not None:
            return "somebody at the robot"
        return self.owner or (self.grant.holder if self.grant is not None else "nobody")

    def may_read(self, device: str, sensor: str) -> bool:
        """Return True if a device holds a permission to read a sensor."""
        return any(sensor in grant.sensors for grant in self._find_grants(device))

    def _find_grants(self, device: str) -> list[m.PermissionGrant]:
        grants = (self.grant, self.observers.get(device))
        return [grant for grant in grants if grant is not None and grant.holder == device]

    def _refusal(self, message: m.Message, level: str) -> Decision | None:
        """Return why a source may not act now, or None (S5)."""
        grant = self.grant
        if grant is None or grant.holder != message.source:
            return Decision(m.NOT_PERMITTED, f"{message.source} holds no permission here")
        if message.session != grant.session:
            return Decision(m.BAD_SESSION, f"session {message.session} is not the current one")
        if grant.level not in (level, "both"):
            return Decision(m.NOT_PERMITTED, f"permission is for {grant.level}, not {level}")
        return None

    def _order(self, message: m.Message) -> Decision | None:
        """Return why an order may not act now, or None: orders of a session act once, in order.

        A copy of an old one that comes late, after its reply was forgotten, ends here.
        """
        if message.message_id <= self.last_order_id:
            return Decision(m.OUT_OF_ORDER, "a newer order was received before")
        self.last_order_id = message.message_id
        return None

    def _begin(self, arrived: float, moving: bool, releases: bool = False) -> Decision | None:
        """Return why no new activity may begin now, or None.

        Args:
            arrived: Arrival time of the order [s].
            moving: True while the robot's wheels still turn.
            releases: True for a start that releases the robot after an emergency.
        """
        if arrived <= self.emergency_at:
            return Decision(m.STALE, "sent before the emergency")
        if self.latch.holds and not releases:
            return Decision(m.BUSY, self.latch.refusal)
        if self.mode is not IDLE:
            return Decision(m.BUSY, f"in mode {self.mode}")
        if self.by_hand is not None:
            return Decision(m.BUSY, "driven by hand, at the robot")
        if moving:
            return Decision(m.BUSY, "not at a standstill yet")
        return None

    def _start(self, message: m.Message, arrived: float, now: float, moving: bool) -> Decision:
        refusal = self._refusal(message, "teleoperation")
        if refusal is not None:
            return refusal._replace(waits=not self.knows(message))
        again = self.mode is TELEOPERATION and self.owner == message.source
        refusal = None if again else self._begin(arrived, moving, self.latch.starts())
        refusal = refusal or self._order(message)
        if refusal is not None:
            return refusal
        # Commands sent before this start must not act after it.
        self.last_set_id = max(self.last_set_id, message.message_id)
        if again:
            return Decision(m.OK, "already started")
        if self.latch.holds:
            self.latch.release(None)
        self.mode = TELEOPERATION
        self.owner = message.source
        self.last_valid = now
        return Decision(m.OK, set_point=STANDSTILL)

    def _set(self, message: m.Message, body: m.SetTeleOp, arrived: float, now: float) -> Decision:
        refusal = self._refusal(message, "teleoperation")
        if refusal is not None:
            return refusal
        if self.mode is not TELEOPERATION or self.owner != message.source:
            return Decision(m.WRONG_MODE, f"in mode {self.mode}, not driven by {message.source}")
        if message.message_id <= self.last_set_id:
            return Decision(m.OUT_OF_ORDER, "a newer command was received before")
        self.last_set_id = message.message_id
        if arrived <= self.emergency_at:  # later starts may have been accepted since
            return Decision(m.STALE, "sent before the emergency")
        until = arrived + self.limits.watchdog
        if body.seen_tick is None:
            self.without_tick += 1
        # A tick ahead of the robot's own clock would keep a command fresh for ever.
        elif body.seen_tick > self.tick(now):
            self.future_ticks += 1
            return Decision(m.STALE, "no picture of that tick was taken yet")
        else:
            seen_at = body.seen_tick / 1000 - self.clock_offset
            oldest = seen_at + self.limits.max_age
            until = until if until < oldest else oldest
        if until <= now:
            return Decision(m.STALE, "too old to obey")
        self.last_valid = now
        set_point = _make_set_point(body.speed, body.turn_rate, until)
        return _make_decision(m.OK, "", set_point, None, False)

    def _stop(self, message: m.Message) -> Decision:
        refusal = self._refusal(message, "teleoperation") or self._order(message)
        if refusal is not None:
            return refusal
        if self.mode is IDLE and self.by_hand is None:
            # After its computer hung, its motors may still obey their last set point.
            return Decision(m.OK, "not in teleoperation", STANDSTILL)
        if self.mode is not TELEOPERATION:
            return Decision(m.OK, "not in teleoperation")
        self._idle("")
        return Decision(m.OK, set_point=STANDSTILL)

    def _mission(self, message: m.Message, body: Mission, arrived: float, moving: bool) -> Decision:
        refusal = self._refusal(message, "missions")
        if refusal is not None:
            return refusal._replace(waits=not self.knows(message))
        refusal = self._begin(arrived, moving) or self._order(message)
        if refusal is not None:
            return refusal
        self.mode = MISSION
        self.owner = message.source
        self.mission = body
        left = len(body.waypoints) if isinstance(body, m.GoTo | m.Patrol) else 1
        self.mission_status = m.MissionStatus(message.message_id, "under_way", left, "")
        return Decision(m.OK)

    def _cancel(self, message: m.Message) -> Decision:
        refusal = self._refusal(message, "missions") or self._order(message)
        if refusal is not None:
            return refusal
        if self.mode is MISSION:
            self._idle("cancelled")
        return Decision(m.OK, set_point=STANDSTILL)
