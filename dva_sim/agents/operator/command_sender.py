"""The sender of the phone's commands, by the rules of a pattern."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from dva_sim.agents.device import HOLDER, AgentDevice, command_topic
from dva_sim.agents.operator.refusals import Refusals
from dva_sim.agents.tilt import TiltApp, TiltCommand, TiltSources
from dva_sim.kernel.makers import maker
from dva_sim.kernel.plugins import FAILURES, error_text
from dva_sim.kernel.recorder import DriveLog, make_issued
from dva_sim.network.messaging import Requester, Subscription
from dva_sim.network.patterns import PATTERNS, Pattern
from dva_sim.protocol.codec import encode
from dva_sim.protocol.messages import Message, Reply, RobotHolder, make_set_tele_op


class Made(NamedTuple):
    """A command as the app made it: when [s], and the newest robot tick on the screen [ms]."""

    command: TiltCommand
    time: float
    seen_tick: int


_make_made = maker(Made)


class CommandSender:
    """Reads the phone's command when it is due, and passes it to the pattern; see `Line`.

    Args:
        device: The operator's.
        pattern: This drive's.
        drive: Log of this drive; names the robot.
        session: Session of this drive.
        phone: Source of commands from the tilt.
        rate_hz: Desired rate of commands [1/s].
        timeout: Time-out of a command that needs a reply [s].
        attempts: Number of attempts of such a command.
        window: Maximum number of such commands without a reply.
        seen_tick: The newest robot tick on the screen [ms], if there is any.
        on_lost: Callback with the reason when replies have ceased.
        on_refused: Callback with the reason when all commands are refused.
        heeds: True if the app reacts to refusals.

    Attributes:
        drive: The log of this drive.
        failures: Number of errors raised by a user's pattern.
        first_failure: The first of those, in a line.
    """

    def __init__(
        self,
        device: AgentDevice,
        *,
        pattern: Pattern,
        drive: DriveLog,
        session: int,
        phone: TiltApp | TiltSources,
        rate_hz: float,
        timeout: float,
        attempts: int,
        window: int,
        seen_tick: Callable[[], int | None],
        on_lost: Callable[[str], object],
        on_refused: Callable[[str], object],
        heeds: bool = True,
    ) -> None:
        self._device = device
        self.clock = device.clock
        self._pattern = pattern
        self.drive = drive
        self._session = session
        self._phone = phone
        self.rate_hz = rate_hz
        self.timeout = timeout
        self.attempts = attempts
        self.window = window
        self._seen_tick = seen_tick
        self._on_lost = on_lost
        self._topic = command_topic(drive.robot)
        self._requester: Requester | None = None
        self._on_refused = on_refused
        self._heeds = heeds
        self.refusals = Refusals(device.id_tag, drive.refused)
        self._holder: Subscription | None = None
        self._on = self._is_held = False
        self._looked_at = 0.0
        self.failures = 0
        self.first_failure = ""

    def start(self) -> None:
        """Begin to send."""
        self._on = True
        self._let(self._pattern.begin, self)
        self._phone.pick_up(self.clock.now)
        if self._heeds and not self._pattern.answered:
            me = self._device.id_tag
            robot = self.drive.robot
            self._holder = self._device.network.subscribe(me, robot, HOLDER, self._on_holder)
        self._look()

    def stop(self) -> None:
        """Send nothing more and close the socket."""
        if self._on:
            self._let(self._pattern.end)
        self._on = False
        if self._holder is not None:
            self._holder.close()
        if self._requester is not None:
            self.drive.timeouts = self._requester.timeouts
            self._requester.close()

    def _look(self) -> None:
        if not self._on:
            return
        now = self._looked_at = self.clock.now
        made = self._make()
        if made is not None:
            self._let(self._pattern.offer, made)
            if self._phone.waits and self._pattern.in_step and self._is_asking:
                self._phone.hold()  # until the reply, as the app blocks meanwhile
                self._is_held = True
                return
        self.clock.call_at(self._phone.next_look(now, self.rate_hz), self._look)

    def look_now(self) -> None:
        """Read the phone between two periods, since it has a new command."""
        made = self._make() if self._on else None
        if made is not None:
            self._let(self._pattern.offer, made)

    def _go_on(self) -> None:
        """Continue after a reply or a time-out; an app that waited reads the phone again."""
        if not (self._is_held and self._on) or self._is_asking:
            return
        self._is_held = False
        now = self.clock.now
        self._phone.release(now)
        due = self._looked_at + 1.0 / self.rate_hz
        if self._phone.keeps_alive and due > now:
            self.clock.call_at(due, self._look)
        else:
            self._look()

    def _make(self) -> Made | None:
        """Return the phone's present command, if it is worth a message.

        Commands before the first picture are not sent: without its tick the robot could not bound
        the age of a command that waits for a connection to open.
        """
        now = self.clock.now
        tick = self._seen_tick()
        if tick is None:
            return None
        command = self._phone.look(now)
        self.drive.samples = self._phone.samples
        self.drive.values = self._phone.values
        return None if command is None else _make_made(command, now, tick)

    def _message(self, made: Made) -> Message:
        """Return a command that is sent now; its tick is of when it was made."""
        now = self.clock.now
        command = made.command
        body = make_set_tele_op(command.speed, command.turn_rate, made.seen_tick)
        message = self._device.outbox.message(self.drive.robot, body, now, self._session)
        issued = make_issued(made.time, now, command.sample_age, command.captured)
        self._device.recorder.command_issued(message.source, message.message_id, issued)
        self.drive.sent += 1
        self.drive.commands.append((made.time, command.speed, command.turn_rate))
        return message

    # --- refusals ------------------------------------------------------------------------

    def _answered(self, command: Message, data: bytes) -> None:
        """Handle a reply: refusals are noted for any pattern."""
        reply = self._device.reply_to(command, data)
        code = None if reply is None else reply.code
        self._heed(self.refusals.answered(code, self.clock.now))

    def _on_holder(self, data: bytes) -> None:
        """Note the holder that the robot publishes, for patterns without replies."""
        message = self._device.read(data, self.drive.robot) if self._on else None
        if message is not None and isinstance(body := message.body, RobotHolder):
            now = self.clock.now
            sent = self.drive.sent
            was_late = self.refusals.late
            self._heed(self.refusals.held(body.holder, body.code, now, sent))
            if self._on and self.refusals.late and not was_late:
                self._device.recorder.counters["alerts: every command comes late"] += 1
                self._device.tell("is told that every command comes late", "drive")

    def _heed(self, why: str) -> None:
        if why and self._on and self._heeds:
            self.drive.alerts += 1
            self.drive.refusal = self.refusals.last
            self._on_refused(why)

    def _let(self, act: Callable[..., object], *arguments: Any) -> None:
        """Call the pattern; errors of a user's pattern are counted, and the command is dropped."""
        try:
            act(*arguments)
        except FAILURES as error:
            if type(self._pattern) in PATTERNS.values():
                raise
            self.failures += 1
            self.first_failure = self.first_failure or error_text(error)

    # --- for the pattern -----------------------------------------------------------------

    def open_requests(
        self, window: int = 1, *, timeout: float | None = None, attempts: int | None = None
    ) -> None:
        """Connect to the robot's service; see `Line`."""
        self._requester = Requester(
            self._device.network,
            self._device.id_tag,
            self.drive.robot,
            self.timeout if timeout is None else timeout,
            self.attempts if attempts is None else attempts,
            window,
        )
        self._requester.open()
        self.drive.round_trips = self._requester.round_trips

    @property
    def busy(self) -> bool:
        """True if a further request would have to wait."""
        return self._asking().busy

    def request(
        self, command: Made, then: Callable[[bytes], object], failed: Callable[[], object]
    ) -> None:
        """Send a command as a request; nothing is sent once the drive is over."""
        requester = self._asking()
        if not self._on:
            return
        message = self._message(command)

        def answered(reply: bytes) -> None:
            self._answered(message, reply)
            if self._on:
                self._let(then, reply)
                self._go_on()

        def unanswered() -> None:
            self._let(failed)
            self._go_on()

        requester.request(encode(message), answered, unanswered)

    @property
    def _is_asking(self) -> bool:
        return self._requester is not None and self._requester.busy

    def _asking(self) -> Requester:
        if self._requester is None:
            raise RuntimeError("asks without open_requests()")
        return self._requester

    def publish(self, command: Made) -> None:
        """Publish a command; nothing is sent once the drive is over."""
        if self._on:
            data = encode(self._message(command))
            self._device.network.publish(self._device.id_tag, self._topic, data, len(data))

    def newest(self, command: Made) -> Made:
        """Return the phone's present command, if the app keeps sending; else the command itself."""
        return (self._make() or command) if self._phone.keeps_alive else command

    def supersede(self, command: Made) -> None:
        """Count a command that is not sent, since a newer one took its place."""
        self.drive.superseded += 1

    def code_of(self, reply: bytes) -> int | None:
        """Return the code in a reply; None if it cannot be read."""
        message = self._device.read(reply, self.drive.robot)
        return message.body.code if message and isinstance(message.body, Reply) else None

    def lost(self, why: str = "") -> None:
        """Alert that all commands are refused, and end the drive."""
        self.drive.alerts += 1
        self._on_lost(why or f"no answer after {self.attempts} attempts")
