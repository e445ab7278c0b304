"""Drivers who are never idle: they keep robots moving, so that faults meet robots in motion.

A driver keeps to the protocol, but is as careless as people are: it stops sending during a drive,
stops late or not at all, gives a robot back while it moves, keeps one without driving it, commands
impossible speeds, names pictures that were not taken yet, and requests what its permission does
not include. It also takes robots from others.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from typing import Final

from dva_sim.agents.device import command_topic, do_nothing
from dva_sim.agents.observation import FRAME, CameraFrame
from dva_sim.agents.robot.sensors import sensor_topic
from dva_sim.network.messaging import Subscription
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import encode
from dva_sim.simulation.full.stage import DVA, Stage
from dva_sim.storms.intruder import Intruder, give_back

FIRST_NUMBER: Final = 1000  # number before the first driver: beyond all operators and intruders
RATES: Final = 2.0, 5.0, 8.0  # rates of commands [Hz]
MAX_WAIT = 20.0  # longest wait for the start of a granted robot [s]
HOLD_S = 40.0  # time for which a robot is held without a drive: longer than a lease [s]
LOST: Final = m.NOT_PERMITTED, m.BAD_SESSION
LEVELS: Final = "teleoperation", "teleoperation", "both", "both", "missions"
TAKEOVERS: Final[tuple[str | None, ...]] = (None, None, "ask", "force")
INSISTS: Final = 2.0, 40.0, 40.0
"""Times for which a driver insists on a robot of another [s]: shorter or longer than the robot is
stopped and reserved."""


class BusyDriver:
    """Driver that takes a robot, drives it or sends it somewhere, gives it back, takes another.

    Args:
        number: Number, from 1.
        robots: Ids of the robots.
        sensors: Names of the sensors that robots have.
        chance: Random numbers of its decisions.
        place: Function that draws a place to send a robot to.

    Attributes:
        device: Its device, called `driver-1` and so on.
    """

    def __init__(
        self,
        stage: Stage,
        number: int,
        robots: Sequence[str],
        *,
        sensors: tuple[str, ...],
        chance: random.Random,
        place: Callable[[], m.Position],
    ) -> None:
        self._hand = Intruder(stage, FIRST_NUMBER + number, f"driver-{number}")
        self.device = self._hand.device
        self._robots = robots
        self._sensors = sensors
        self._chance = chance
        self._place = place
        self._publishes = stage.pattern().published
        self._clock = stage.clock
        self._robot = ""
        self._session = 0
        self._level = LEVELS[0]
        self._does: Callable[[], object] = self._look_for_robot
        self._until = self._hushed = 0.0
        self._wish = m.SetTeleOp(0.0, 0.0)
        self._tick: int | None = None
        self._wanted = robots[0]
        self._takeover = TAKEOVERS[0]
        self._frames: Subscription | None = None
        self._life = 0
        self._insists = 0.0
        self._listening: list[Subscription] = []
        self.device.serve(self._on_request)

    def start(self, until: float) -> None:
        """Begin to work, and finish at a time [s]."""
        self.device.register()
        rate = self._chance.choice(RATES)
        self._until = self._clock.now + self._chance.uniform(1.0, 10.0)
        self._clock.every(1.0, lambda: self._act(until))
        self._clock.every(1.0 / rate, lambda: self._command(until))

    def restart(self) -> None:
        """Restart the app: it numbers its messages from 1 again, and has forgotten its robot."""
        self.device.restart()
        self.device.register()
        self._forget()

    # --- actions, once a second --------------------------------------------------------------

    def _act(self, until: float) -> bool:
        now = self._clock.now
        if now >= until:
            self._give_back()
        elif not self.device.silent:
            self._does()
        return now < until

    def _look_for_robot(self) -> None:
        if self._clock.now < self._until:
            return
        if self._clock.now >= self._insists:
            self._wanted = self._chance.choice(self._robots)
            self._level = self._chance.choice(LEVELS)
            self._takeover = self._chance.choice(TAKEOVERS)
        robot = self._wanted
        level = self._level
        self._until = self._clock.now + (1.0 if self._takeover == "force" else 3.0)
        life = self._life

        def answered(reply: m.Reply) -> None:
            if reply.code == m.BUSY and self._takeover and self._insists <= self._clock.now:
                self._insists = self._clock.now + self._chance.choice(INSISTS)
            if not isinstance(reply.content, m.Permission):
                return
            session = reply.content.session
            if life == self._life and not self._robot:
                self._take(robot, level, session)
            elif session != self._session:  # it comes too late
                give_back(self.device, m.PermissionRevocation(robot, self.device.id_tag, session))

        wish = m.PermissionRequest(robot, level, self._sensors, self._takeover)
        self._hand.ask(DVA, wish, answered)

    def _take(self, robot: str, level: str, session: int) -> None:
        """Begin with a robot that was granted."""
        self._robot = robot
        self._session = session
        self._level = level
        self._until = self._clock.now + MAX_WAIT
        self._insists = 0.0
        for listening in self._listening:
            listening.close()
        self._listening = [self._listen(sensor) for sensor in self._sensors]
        if level == "missions" or (level == "both" and self._chance.random() < 0.6):
            self._send_out()
            return
        network = self.device.network
        me = self.device.id_tag
        self._frames = network.subscribe(me, robot, FRAME, self._see)
        self._does = self._start
        self._start()

    def _listen(self, sensor: str) -> Subscription:
        """Subscribe to a sensor until the next robot is taken, even if this one is lost."""
        self._order(m.DevSub(sensor, 1.0))
        network = self.device.network
        me = self.device.id_tag
        return network.subscribe(me, self._robot, sensor_topic(sensor, me), do_nothing)

    def _see(self, frame: object) -> None:
        if isinstance(frame, CameraFrame):
            self._tick = frame.observation.tick

    def _start(self) -> None:
        """Start to drive, until that is accepted."""

        def begin() -> None:
            self._does = self._drive
            self._until = self._clock.now + self._chance.uniform(5.0, 45.0)

        self._order(m.StartTeleOp(), begin)
        if self._clock.now >= self._until:
            self._give_back()

    def _drive(self) -> None:
        """Drive about with occasional requests, and stop in one of several ways."""
        chance = self._chance
        now = self._clock.now
        if now >= self._until:
            chance.choice(_ENDS)(self)
            return
        if chance.random() < 0.5:
            self._wish = m.SetTeleOp(chance.uniform(0.1, 0.5), chance.uniform(-0.4, 0.4))
        if chance.random() < 0.05:
            wild = chance.choice((-0.3, 0.9, 3.0, 99.0)), chance.choice((0.0, -4.0, 40.0))
            self._wish = m.SetTeleOp(*wild)
        if now >= self._hushed and chance.random() < 0.1:
            self._hushed = now + chance.choice((1.0, 4.0, 8.0, HOLD_S))
        if chance.random() < 0.5:
            body = chance.choice((m.GetMissionStatus(), m.GetSensorInfo(), m.StartTeleOp()))
            self._order(body)

    def _send_out(self) -> None:
        """Send it on a mission."""
        places = tuple(self._place() for _ in range(2))
        body = self._chance.choice((m.GoTo(places), m.Patrol(places, 0), m.ReturnToBase()))

        def begin() -> None:
            self._does = self._watch
            self._until = self._clock.now + self._chance.uniform(5.0, 45.0)

        def send() -> None:
            self._order(body, begin)
            if self._clock.now >= self._until:
                self._give_back()

        self._does = send
        send()

    def _watch(self) -> None:
        """Follow a mission, and cancel it in the end, or just forget it."""
        if self._clock.now < self._until:
            if self._chance.random() < 0.5:
                self._order(m.GetMissionStatus())
            return
        if self._chance.random() < 0.8:
            self._order(m.CancelMission())
        self._finish(self._chance.uniform(1.0, 15.0))

    def _wait(self) -> None:
        """Hold the robot without driving it; now and then request what the permission excludes."""
        chance = self._chance
        if self._clock.now >= self._until:
            self._give_back()
        elif self._level != "both" and chance.random() < 0.1:
            is_driver = self._level == "teleoperation"
            mission = m.GoTo((self._place(),)), m.CancelMission(), m.ReturnToBase()
            drive = m.StartTeleOp(), m.StopTeleOp()
            self._order(chance.choice(mission if is_driver else drive))

    # --- how a drive ends --------------------------------------------------------------------

    def _stop(self) -> None:
        self._order(m.StopTeleOp())
        self._finish(self._chance.uniform(1.0, 15.0))

    def _stop_and_go_on(self) -> None:
        self._order(m.StopTeleOp())
        self._until = self._clock.now + MAX_WAIT
        self._does = self._start

    def _keep(self) -> None:
        """Hold the robot without driving it, for longer than a lease lasts."""
        self._finish(HOLD_S)

    def _finish(self, after: float) -> None:
        self._does = self._wait
        self._until = self._clock.now + after

    def _give_back(self) -> None:
        if self._robot:
            revocation = m.PermissionRevocation(self._robot, self.device.id_tag, self._session)
            give_back(self.device, revocation)
        self._forget()

    def _forget(self) -> None:
        """Forget the robot, and look for another one a little later."""
        if self._frames is not None:
            self._frames.close()
        self._frames = None
        self._tick = None
        self._robot = ""
        self._life += 1
        self._does = self._look_for_robot
        self._until = self._clock.now + self._chance.uniform(1.0, 20.0)

    # --- messages ----------------------------------------------------------------------------

    def _order(self, body: m.Body, begin: Callable[[], object] = lambda: None) -> None:
        """Send the robot a request; give up a robot that refuses its driver."""
        life = self._life

        def answered(reply: m.Reply) -> None:
            if life != self._life:
                return
            if reply.code == m.OK:
                begin()
            elif reply.code in LOST and self._does in (self._drive, self._watch):
                self._give_back()

        self._hand.ask(self._robot, body, answered, session=self._session)

    def _command(self, until: float) -> bool:
        now = self._clock.now
        if self._does == self._drive and now >= self._hushed and not self.device.silent:
            body = self._wish._replace(seen_tick=self._tick)
            if self._tick is not None and self._chance.random() < 0.02:  # a picture not taken yet
                body = body._replace(seen_tick=self._tick + self._chance.randrange(100, 5000))
            if self._publishes:
                message = self.device.outbox.message(self._robot, body, now, self._session)
                data = encode(message)
                topic = command_topic(self._robot)
                self.device.network.publish(self.device.id_tag, topic, data, len(data))
            else:
                self._hand.send_message(self._robot, body, self._session)
        return now < until

    def _on_request(self, message: m.Message) -> m.Reply:
        """Answer a request; in most cases obey the end of a session."""
        body = message.body
        is_over = isinstance(body, m.PermissionRevocation) and body.session == self._session
        if is_over and self._robot and self._chance.random() < 0.7:
            self._forget()
        return m.Reply(message.message_id, m.OK, "")


_ENDS: Final = (
    *(BusyDriver._stop,) * 4,
    BusyDriver._stop_and_go_on,
    BusyDriver._stop_and_go_on,
    BusyDriver._give_back,
    BusyDriver._give_back,
    BusyDriver._keep,
)
