"""Checks of messaging patterns, in drives over links with delay and loss.

Robot and app are the smallest that can show a fault: the app numbers its commands and counts what
becomes of each, the robot obeys whatever is newer than the last.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from dva_sim.agents.device import command_topic
from dva_sim.agents.operator.refusals import Refusals
from dva_sim.agents.robot.command_queue import CommandQueue, Letter
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.streams import Streams
from dva_sim.network.link import ConstantRate, Link, LinkConfig
from dva_sim.network.messaging import Requester, Subscription, Transport
from dva_sim.network.patterns import Pattern, load_pattern
from dva_sim.network.virtual_network import VirtualNetwork
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode, decode_if_valid, encode
from dva_sim.protocol.exchange import Outbox
from dva_sim.testing.promises import Case, Outcome, broken_in, is_slow, kept, part_by_part

PHONE = "02:00:00:03:00:01"
ROBOT = "02:00:00:01:00:01"
RATE: Final = 10.0  # commands per second
LONG: Final = 20.0  # duration of a drive [s]
DELAYS: Final = (0.0, 0.05, 0.5)  # one-way delays [s]
LOSS: Final = 0.03
SERVICE: Final = 0.005  # processing time of a command at the robot [s]
SLOW_SERVICE: Final = 0.4  # the same for a slow robot [s]
TIMEOUT: Final = 9.0  # time-out of a request [s]
ATTEMPTS: Final = 3
MAX_QUEUED: Final = 20  # maximum commands that may wait at the app
SLACK: Final = 1.0  # tolerance beyond the time that the link needs [s]
NOTICED: Final = 5.0  # margin after the time-outs of all attempts [s]
RETURN_DELAY_S: Final = 15.0  # time after which a robot that is back must be driven again [s]
SLOW: Final = 50e-6  # time of a command above which an episode is slow [s]


def check_pattern(
    pattern: str | Callable[..., Pattern],
    options: Mapping[str, Any] | None = None,
    *,
    slow: float = SLOW,
) -> Outcome:
    """See that a messaging pattern keeps what every pattern promises.

    It is tried on good links and bad ones, with a robot that is slow, gone, or refuses.

    Args:
        pattern: Name, as in a scenario, or its class.
        options: Keyword arguments of its constructor.
        slow: A command that takes longer earns a warning [s].

    Raises:
        BrokenPromises: it does not; a line for each promise.
        ConfigError: there is none of that name, or it cannot be made with these options.
    """
    make = load_pattern(pattern, options)
    make()
    trial = _Trial(make)
    broken = broken_in(part_by_part(trial.parts))
    slowest = min(trial.took, default=0.0)
    doubts = [] if broken else trial.doubts
    return kept(broken, doubts + is_slow(slowest, slow, "a command"), trial.count, slowest)


@dataclass(frozen=True)
class Numbered:
    """A command of the app that is tried: which one, and when it was made [s]."""

    number: int
    time: float


@dataclass
class TriedDrive:
    """One drive by a pattern over any transport; see `Line`, which it is to the pattern.

    Attributes:
        network: Transport of the messages.
        pattern: This drive's.
        service: Processing time of a command at the robot [s].
        refuses: Code of the robot's reply to everything; 0: it obeys. None:
            invalid bytes.
        node: Id of the phone.
        robot: Id of the robot.
        rate_hz: See `Line`, as the next three.
        sent: Numbers of commands in the order in which they were sent, and when [s].
        applied: Numbers of commands that the robot obeyed, and when [s].
        ages: Ages of the applied commands [s].
        superseded: Numbers of commands that a newer one took the place of.
        rejections: Times and reasons at which the pattern reported that nobody obeys.
        wrong: Broken promises.
        spent: Time that its decisions took [s].
    """

    network: Transport
    pattern: Pattern
    service: float = SERVICE
    refuses: int | None = 0
    node: str = PHONE
    robot: str = ROBOT
    rate_hz: float = RATE
    timeout: float = TIMEOUT
    attempts: int = ATTEMPTS
    window: int = 8
    sent: list[tuple[int, float]] = field(default_factory=list)
    applied: list[tuple[int, float]] = field(default_factory=list)
    ages: list[float] = field(default_factory=list)
    superseded: list[int] = field(default_factory=list)
    rejections: list[tuple[float, str]] = field(default_factory=list)
    wrong: list[Case] = field(default_factory=list)
    offered: int = 0
    spent: float = 0.0

    def __post_init__(self) -> None:
        self.clock = self.network.clock
        self._outbox = Outbox(self.node)
        self._says = Outbox(self.robot)
        self._refusals = Refusals(self.node)
        self._of: dict[int, Numbered] = {}
        self._last = 0
        self._on = False
        self._requester: Requester | None = None
        self._subscription: Subscription | None = None
        latest = self.pattern.newest_wins
        self.inbox = CommandQueue(self.clock, lambda: self.service, self._handle, latest)

    # --- the app ---------------------------------------------------------------------------

    def begin(self) -> None:
        """Let the robot listen, and the app begin to send."""
        self.network.serve(self.robot, self.inbox.request)
        self.listen()
        self._on = True
        self.pattern.begin(self)
        self.clock.every(1.0 / self.rate_hz, self._offer)

    def end(self) -> None:
        """Let the app send nothing more."""
        if self._on:
            self.pattern.end()
        self._on = False
        if self._requester is not None:
            self._requester.close()

    def listen(self, on: bool = True) -> None:
        """Let the robot subscribe, or be gone."""
        if self._subscription is not None:
            self._subscription.close()
        self._subscription = self.inbox.flow = None
        if on and self.pattern.published:
            self._subscription = self.inbox.flow = self.network.subscribe(
                self.robot, self.node, command_topic(self.robot), self.inbox.published
            )

    def _offer(self) -> bool:
        if self._on:
            self.offered += 1
            started = time.perf_counter()
            self.pattern.offer(Numbered(self.offered, self.clock.now))
            self.spent += time.perf_counter() - started
        return self._on

    @property
    def held(self) -> int:
        """Number of commands neither sent nor superseded yet."""
        return self.offered - len(self.sent) - len(self.superseded)

    def _send(self, command: Any) -> bytes:
        if not isinstance(command, Numbered):
            raise TypeError(f"sends {type(command).__name__}, which the app has not made")
        number = command.number
        now = self.clock.now
        if not self._on:
            self.wrong.append(("sends when the drive is over", f"command {number}"))
        if number in self.superseded:
            self.wrong.append(("sends what it counted as superseded", f"command {number}"))
        if self.sent and number == self.sent[-1][0]:
            self.wrong.append(("sends a command twice", f"command {number}"))
        elif self.sent and number < self.sent[-1][0]:
            case = f"command {number} after {self.sent[-1][0]}"
            self.wrong.append(("sends an older command after a newer one", case))
        self.sent.append((number, now))
        message = self._outbox.message(self.robot, m.SetTeleOp(0.1, 0.0, 1), now, 1)
        self._of[message.message_id] = command
        return encode(message)

    def open_requests(
        self, window: int = 1, *, timeout: float | None = None, attempts: int | None = None
    ) -> None:
        """Implement `Line`."""
        timeout = self.timeout if timeout is None else timeout
        attempts = self.attempts if attempts is None else attempts
        self._requester = Requester(self.network, self.node, self.robot, timeout, attempts, window)
        self._requester.open()

    @property
    def busy(self) -> bool:
        """Implement `Line`."""
        return self._asking().busy

    def request(
        self, command: Any, then: Callable[[bytes], object], failed: Callable[[], object]
    ) -> None:
        """Send a command as a request; the app reads every reply."""

        def answered(reply: bytes) -> None:
            if why := self._refusals.answered(self.code_of(reply), self.clock.now):
                self.lost(why)
            then(reply)

        self._asking().request(self._send(command), answered, failed)

    def _asking(self) -> Requester:
        if self._requester is None:
            raise RuntimeError("asks without open_requests()")
        return self._requester

    def publish(self, command: Any) -> None:
        """Implement `Line`."""
        if not self.pattern.published:
            self.wrong.append(("publishes, and says that it does not", f"at {self.clock.now:g} s"))
        data = self._send(command)
        self.network.publish(self.node, command_topic(self.robot), data, len(data))

    def newest(self, command: Any) -> Any:
        """See `Line`: return the command itself."""
        return command

    def supersede(self, command: Any) -> None:
        """Implement `Line`."""
        self.superseded.append(command.number)

    def code_of(self, reply: bytes) -> int | None:
        """Implement `Line`."""
        message = decode_if_valid(reply)
        body = None if message is None else message.body
        return body.code if isinstance(body, m.Reply) else None

    def lost(self, why: str = "") -> None:
        """Implement `Line`."""
        self.rejections.append((self.clock.now, why))

    # --- the robot -------------------------------------------------------------------------

    def _handle(self, letter: Letter) -> None:
        message = decode(letter.data)
        code = self._obey(message) if self.refuses == 0 else self.refuses
        if letter.answer is not None:
            reply = m.Reply(message.message_id, code or 0, "")
            data = self._says.encode(message.source, reply, self.clock.now)
            letter.answer(b"no message" if code is None else data)

    def _obey(self, message: m.Message) -> int:
        if isinstance(message.body, m.Emergency):
            return m.OK
        if message.message_id <= self._last:
            return m.OUT_OF_ORDER
        self._last = message.message_id
        command = self._of[message.message_id]
        self.applied.append((command.number, self.clock.now))
        self.ages.append(self.clock.now - command.time)
        return m.OK


class _Trial:
    """All that is tried with one pattern.

    Attributes:
        count: Drives so far.
        took: Mean time of a command, for each drive [s].
        doubts: Allowed behaviour that its users should know.
    """

    def __init__(self, make: Callable[[], Pattern]) -> None:
        self._make = make
        self.count = 0
        self.took = list[float]()
        self.doubts = list[str]()
        links = self._facts, self._good_links, self._copies, self._bad_link
        robots = self._slow_robot, self._gone, self._back_again, self._refused
        self.parts = (*links, *robots, self._after_the_end)

    def _drive(self, delay: float, loss: float = 0.0, **of_drive: Any) -> TriedDrive:
        """Return a drive that has just begun, over links of this delay [s] and loss."""
        config = LinkConfig(delay_s=delay, loss=loss)
        links: dict[tuple[str, str], Link] = {}

        def link(one: str, other: str) -> Link:
            made = Link(config, ConstantRate(1e6), Streams(1), f"{one}>{other}")
            return links.setdefault((one, other), made)

        network = VirtualNetwork(Clock(), lambda a, b: (link(a, b), link(b, a)))
        self.count += 1
        drive = TriedDrive(network, self._make(), **of_drive)
        drive.begin()
        return drive

    def _run(self, drive: TriedDrive, until: float = LONG) -> Iterator[Case]:
        """Run on, and yield mistakes that no state of the link or the robot excuses."""
        drive.clock.run(until)
        self.took.append(drive.spent / max(drive.offered, 1))
        yield from drive.wrong
        if drive.held > MAX_QUEUED:
            case = f"{drive.held} of {drive.offered} neither sent nor superseded"
            yield "loses commands, or keeps too many", case
        if drive.held < 0:
            yield "counts commands more than once", f"{-drive.held} too many"
        numbers = [number for number, _ in drive.applied]
        if numbers != sorted(set(numbers)):
            yield "brings commands out of their order", f"{numbers[:9]}"

    def _facts(self) -> Iterator[Case]:
        """Check the attributes that other code reads."""
        made = self._make()
        for name in ("answered", "in_step", "published", "newest_wins"):
            if not isinstance(getattr(made, name), bool):
                yield "says what is neither yes nor no", f"{name} is {getattr(made, name)!r}"
        for name in ("title", "label", "colour", "sockets", "when_slow"):
            if not isinstance(getattr(made, name), str):
                yield "says what is no text", f"{name} is {getattr(made, name)!r}"

    def _good_links(self) -> Iterator[Case]:
        """Check that commands keep coming, and stay fresh, on links without loss."""
        for delay in DELAYS:
            drive = self._drive(delay)
            where = f"with a delay of {delay:g} s"
            yield from self._run(drive)
            most = 4 * delay + 1 / RATE + SLACK
            times = [when for _, when in drive.applied if when > 8 * delay + SLACK]
            gaps = [b - a for a, b in zip([8 * delay + SLACK, *times], [*times, LONG], strict=True)]
            if max(gaps) > most:
                yield "leaves the robot without commands", f"for {max(gaps):.1f} s {where}"
            if drive.ages and max(drive.ages[10:], default=0.0) > most:
                yield "brings old commands", f"of {max(drive.ages[10:]):.1f} s {where}"
            if drive.rejections:
                yield "gives up a robot that obeys", f"after {drive.rejections[0][0]:.1f} s {where}"

    def _copies(self) -> Iterator[Case]:
        """Check that a new copy repeats the drive: no shared memory, no random numbers."""
        one = self._drive(DELAYS[1])
        other = self._drive(DELAYS[1])
        for drive in (one, other):
            yield from self._run(drive, LONG / 2)
        if one.sent != other.sent:
            yield "shares memory with other copies, or draws random numbers", "two drives differ"

    def _bad_link(self) -> Iterator[Case]:
        """Yield cases in which losses make commands late, not fewer uncounted."""
        drive = self._drive(DELAYS[1], LOSS, attempts=10)
        yield from self._run(drive, 2 * LONG)
        if not any(when > 1.5 * LONG for _, when in drive.applied):
            yield "leaves the robot without commands", f"where {100 * LOSS:g} % is lost"

    def _slow_robot(self) -> Iterator[Case]:
        """Yield cases of a robot that cannot keep up: emergencies get through, ages may grow."""
        drive = self._drive(DELAYS[1], service=SLOW_SERVICE)
        yield from self._run(drive)
        answered = list[float]()
        button = Requester(drive.network, PHONE, ROBOT, TIMEOUT)
        now = drive.clock.now
        data = drive._outbox.encode(ROBOT, m.Emergency(), now)
        button.request(data, lambda _: answered.append(drive.clock.now))
        yield from self._run(drive, 1.5 * LONG)
        most = 8 * DELAYS[1] + 2 * SLOW_SERVICE + SLACK
        if not answered or answered[0] - now > most:
            yield "holds up an emergency", f"that is not answered within {most:g} s"
        oldest = drive.ages[-1] if drive.ages else 0.0
        if oldest > 10 * SLOW_SERVICE + SLACK:
            self.doubts.append(f"lets commands grow old at a slow robot: {oldest:.0f} s")

    def _gone(self) -> Iterator[Case]:
        """Yield cases in which nobody is there any more: who asks finds out in time."""
        drive = self._drive(DELAYS[1])
        yield from self._run(drive, 5.0)
        self._leave(drive)
        limit = 5.0 + TIMEOUT * ATTEMPTS + NOTICED
        yield from self._run(drive, limit)
        if self._make().answered and not drive.rejections:
            case = f"{limit - 5.0:g} s after the robot went"
            yield "does not find out that nobody is there, and says it would", case

    def _back_again(self) -> Iterator[Case]:
        """Yield cases in which the robot was away for a moment."""
        drive = self._drive(DELAYS[1], attempts=10, timeout=1.0)
        yield from self._run(drive, 5.0)
        self._leave(drive)
        drive.clock.run(7.0)
        drive.network.come_back(ROBOT)  # type: ignore[attr-defined]
        drive.listen()
        yield from self._run(drive, 7.0 + RETURN_DELAY_S)
        if not any(when > 7.0 for _, when in drive.applied):
            yield "does not go on with a robot that is back", f"within {RETURN_DELAY_S:g} s"

    def _leave(self, drive: TriedDrive) -> None:
        drive.listen(on=False)
        drive.network.leave(ROBOT)  # type: ignore[attr-defined]

    def _refused(self) -> Iterator[Case]:
        """Yield cases in which the app goes on, or says that it is over, whatever is answered."""
        for code in (m.BAD_SESSION, m.OUT_OF_ORDER, m.BUSY, 999, None):
            drive = self._drive(DELAYS[1], refuses=code)
            yield from self._run(drive, NOTICED)
            if drive.pattern.answered and code == m.BAD_SESSION and not drive.rejections:
                yield "does not find out that it is refused", f"within {NOTICED:g} s"

    def _after_the_end(self) -> Iterator[Case]:
        drive = self._drive(DELAYS[1])
        drive.clock.run(5.0)
        drive.end()
        yield from self._run(drive, 10.0)
