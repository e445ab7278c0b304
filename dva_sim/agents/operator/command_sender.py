"""How the phone's app sends SetTeleOp: by requests or by publishing. Nothing else differs."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from dva_sim.agents.tilt import Phone, TiltCommand
from dva_sim.kernel.recorder import DriveLog, Issued, Recorder
from dva_sim.network.patterns import Requester, Transport
from dva_sim.protocol.codec import encode
from dva_sim.protocol.exchange import Outbox
from dva_sim.protocol.messages import SetTeleOp


def topic_of(robot: str) -> str:
    """Topic of the commands for a robot; the bar ends it, so that no topic begins another."""
    return f"{robot}|"


class Made(NamedTuple):
    """A command as the app made it: when [s], and the newest robot tick on the screen [ms]."""

    command: TiltCommand
    time: float
    seen_tick: int


class CommandSender:
    """Looks at the phone whenever it is time and sends what it says.

    Args:
        network: Where messages travel.
        outbox: Headers of the operator's messages.
        drive: Log of this drive; names the robot.
        session: Session of this drive.
        phone: The tilt phone.
        rate_hz: Wanted commands per second.
        recorder: Told of each command.
        seen_tick: The newest robot tick on the screen [ms], if there is any.
    """

    def __init__(
        self,
        network: Transport,
        outbox: Outbox,
        drive: DriveLog,
        session: int,
        phone: Phone,
        rate_hz: float,
        recorder: Recorder,
        seen_tick: Callable[[], int | None],
    ) -> None:
        self._network, self._clock, self._outbox = network, network.clock, outbox
        self._drive, self._session, self._phone = drive, session, phone
        self._rate, self._recorder, self._seen_tick = rate_hz, recorder, seen_tick
        self._topic = topic_of(drive.robot)
        self._on = False

    def start(self) -> None:
        """Begin to send."""
        self._on = True
        self._phone.pick_up(self._clock.now)
        self._look()

    def stop(self) -> None:
        """Send nothing more."""
        self._on = False

    def _look(self) -> None:
        if not self._on:
            return
        now = self._clock.now
        made = self._make()
        if made is not None:
            self._offer(made)
        self._clock.call_at(self._phone.next_look(now, self._rate), self._look)

    def _make(self) -> Made | None:
        """What the phone says now, if it is worth a message.

        Nobody drives before the first picture: without its tick the robot could not bound
        the age of a command that waits for a connection to open.
        """
        now, tick = self._clock.now, self._seen_tick()
        if tick is None:
            return None
        command = self._phone.look(now)
        self._drive.samples, self._drive.values = self._phone.samples, self._phone.values
        return None if command is None else Made(command, now, tick)

    def _offer(self, made: Made) -> None:
        raise NotImplementedError

    def _encode(self, made: Made) -> bytes:
        """The bytes of a command that is sent now; its tick is of when it was made."""
        now, command = self._clock.now, made.command
        body = SetTeleOp(command.speed, command.turn_rate, made.seen_tick)
        message = self._outbox.message(self._drive.robot, body, now, self._session)
        issued = Issued(made.time, now, command.sample_age, command.captured)
        self._recorder.command_issued(message.source, message.message_id, issued)
        self._drive.sent += 1
        self._drive.commands.append((made.time, command.speed, command.turn_rate))
        return encode(message)


class PublishedCommands(CommandSender):
    """Publish/subscribe: send and forget."""

    def _offer(self, made: Made) -> None:
        data = self._encode(made)
        self._network.publish(self._outbox.source, self._topic, data, len(data))


class RequestedCommands(CommandSender):
    """Request/reply: the next command goes when the window allows, at the latest when the last
    one is answered; so it is with one request at a time and with several under way.

    What the phone says meanwhile is overtaken by what it says last. After the last attempt
    without an answer the app alerts: the link is lost.
    """

    def connect(self, requester: Requester, on_alert: Callable[[], object]) -> None:
        """Give it its socket, and say what to do when the link is lost."""
        self._requester, self._on_alert = requester, on_alert
        requester.open()
        self._drive.round_trips = requester.round_trips
        self._pending: Made | None = None

    def stop(self) -> None:
        """Send nothing more and close the socket."""
        super().stop()
        self._drive.timeouts = self._requester.timeouts
        self._requester.close()

    def _offer(self, made: Made) -> None:
        if self._requester.busy:
            if self._pending is not None:
                self._drive.superseded += 1
            self._pending = made
            return
        self._requester.request(self._encode(made), self._answered, self._failed)

    def _answered(self, _: bytes) -> None:
        """A command that waited goes now: the newest value if the app keeps sending anyway."""
        pending, self._pending = self._pending, None
        if pending is None or not self._on:
            return
        if self._phone.keeps_alive:
            pending = self._make() or pending
        self._offer(pending)

    def _failed(self) -> None:
        self._drive.alerts += 1
        self._on_alert()
