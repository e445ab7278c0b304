"""A robot's computer: it takes one message at a time, each for its processing time.

That time is always the same, or drawn from a distribution.
"""

from __future__ import annotations

import math
from collections import OrderedDict, deque
from collections.abc import Callable, Hashable, Iterator, Mapping
from typing import Annotated, Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Discriminator, Field, Tag, model_validator

from dva_sim.kernel.clock import Clock
from dva_sim.kernel.config import Config
from dva_sim.network.messaging import Answer, Request
from dva_sim.network.zmtp import Flow
from dva_sim.protocol.codec import decode
from dva_sim.protocol.errors import ProtocolError
from dva_sim.protocol.messages import Emergency, Message, SetTeleOp

LIMIT = 1000  # ZeroMQ's default high-water mark, in messages


PUBLISHED: Final = object()  # stands for whoever publishes commands: one at a time


class Letter(NamedTuple):
    """A message that has arrived.

    Attributes:
        data: Its bytes.
        arrived: When [s].
        request: What it came by; None if nobody waits for an answer.
        message: What it says, where the queue was told how to read it.
    """

    data: bytes
    arrived: float
    request: Request | None = None
    message: Message | None = None

    @property
    def answer(self) -> Answer | None:
        """Takes the reply; None if nobody waits for one."""
        return None if self.request is None else self.request.answer


class FairQueue:
    """First come, first served among peers who wait with one message; else by turns.

    Whoever sends much waits for itself: of a queue that is full, the newest of who has most in it
    makes room for the others.

    Args:
        limit: How many messages may wait.
    """

    def __init__(self, limit: int) -> None:
        self._limit, self._length = limit, 0
        self._peers: OrderedDict[Hashable, deque[Letter]] = OrderedDict()

    def __len__(self) -> int:
        return self._length

    def put(self, letter: Letter) -> bool:
        """Take a letter in; False if one was dropped for it, or itself."""
        peer = PUBLISHED if letter.request is None else letter.request.peer
        has_room = self._length < self._limit
        if not has_room:
            most = max(self._peers, key=lambda one: len(self._peers[one]))
            if most == peer or len(self._peers[most]) == 1:
                return False
            self._peers[most].pop()
            self._length -= 1
        self._peers.setdefault(peer, deque()).append(letter)
        self._length += 1
        return has_room

    def pop(self) -> Letter:
        """The next one; who has more waits until all others have had their turn."""
        peer, letters = self._peers.popitem(last=False)
        letter = letters.popleft()
        if letters:
            self._peers[peer] = letters
        self._length -= 1
        return letter

    def forget_published(self) -> int:
        """Drop what nobody waits to be answered: how many those were."""
        gone = len(self._peers.pop(PUBLISHED, ()))
        self._length -= gone
        return gone


Read = Callable[[Request], Message | None]


class CommandQueue:
    """First come, first served within a class; emergencies before control before commands.

    Args:
        clock: The run's clock.
        service: Gives the time that the next message takes [s].
        handle: Takes each letter when its processing is done.
        latest_wins: Keep only the newest waiting command, as a subscriber that drains its
            socket before it works does.
        limit: How many messages of a class may wait.
        read: Reads what arrives, before it waits: what is None was refused, and takes no time.
            Without it all is taken as bytes, and only emergencies are read.

    Attributes:
        service: As given; may be replaced at any time.
        latest_wins: The same.
        flow: Where published commands come from, if it can be told to wait: then a full inbox
            takes nothing more until half of it is done. What cannot wait is dropped.
    """

    def __init__(
        self,
        clock: Clock,
        service: Callable[[], float],
        handle: Callable[[Letter], object],
        latest_wins: bool,
        limit: int = LIMIT,
        read: Read | None = None,
    ) -> None:
        self._clock, self.service, self._handle = clock, service, handle
        self.latest_wins, self._limit, self._read = latest_wins, limit, read
        self.flow: Flow | None = None
        self._paused = False
        self._emergencies, self._control = FairQueue(limit), FairQueue(limit)
        self._commands = FairQueue(limit)
        self._busy = False
        self.longest = self.superseded = self.overflowed = 0

    def __len__(self) -> int:
        return len(self._emergencies) + len(self._control) + len(self._commands)

    def request(self, request: Request) -> None:
        """A request has arrived; somebody waits for the answer."""
        data, message = request.data, None
        if self._read is not None:
            message = self._read(request)
            if message is None:
                return
            urgent, moves = isinstance(message.body, Emergency), isinstance(message.body, SetTeleOp)
        else:
            urgent = b"<EmergencyMsg" in data and _is_emergency(data)
            moves = b"<SetTeleOp>" in data
        queue = self._emergencies if urgent else self._commands if moves else self._control
        self._put(queue, Letter(data, self._clock.now, request, message))

    def published(self, data: bytes, message: Message | None = None) -> None:
        """A command has arrived that nobody waits to be answered; who has read it, says so."""
        if self.latest_wins:
            self.superseded += self.forget_published()
        self._put(self._commands, Letter(data, self._clock.now, None, message))
        if self.flow is not None and len(self._commands) >= self._limit:
            self._paused = True
            self.flow.pause()

    def forget_published(self) -> int:
        """Drop the published commands that wait: how many those were."""
        return self._commands.forget_published()

    def _put(self, queue: FairQueue, letter: Letter) -> None:
        if not queue.put(letter):
            self.overflowed += 1
        if len(queue) > self.longest:
            self.longest = len(queue)
        if not self._busy:
            self._work()

    def _work(self) -> None:
        """Take the next letter; where processing takes no time, all of them."""
        while queue := self._emergencies or self._control or self._commands:
            self._busy = True
            letter = queue.pop()
            if self._paused:
                self._take_more()
            duration = self.service()
            if duration > 0.0:
                self._clock.call_after(duration, self._done, letter)
                return
            self._handle(letter)
        self._busy = False

    def _take_more(self) -> None:
        """Let published commands come again once half of the inbox is done."""
        if self.flow is not None and len(self._commands) <= self._limit // 2:
            self._paused = False
            self.flow.resume()

    def _done(self, letter: Letter) -> None:
        self._handle(letter)
        self._work()


def _is_emergency(data: bytes) -> bool:
    try:
        return isinstance(decode(data).body, Emergency)
    except ProtocolError:
        return False


BLOCK = 256  # draws made at once


class ServiceLaw(Config):
    """A law of service times.

    Attributes:
        law: `constant`, `exponential`, `lognormal` or `gamma`.
        mean_s: Of all messages but the first.
        cv: Standard deviation over mean; of a lognormal or gamma law only.
        first_s: What the first message takes (a cold start); left out: as the others.
    """

    law: Literal["constant", "exponential", "lognormal", "gamma"]
    mean_s: Annotated[float, Field(gt=0, le=10)]
    cv: Annotated[float, Field(ge=0.001, le=10)] | None = None
    first_s: Annotated[float, Field(ge=0, le=60)] | None = None

    @model_validator(mode="after")
    def _spread(self) -> ServiceLaw:
        spreads = self.law in ("lognormal", "gamma")
        if spreads and self.cv is None:
            raise ValueError(f"the {self.law} law needs cv")
        if not spreads and self.cv is not None:
            raise ValueError(f"the {self.law} law has no cv of its own")
        return self

    def sample(self, rng: np.random.Generator, count: int) -> NDArray[np.float64]:
        """That many draws [s], shape `(count,)`."""
        if self.law == "exponential":
            return self.mean_s * rng.standard_exponential(count)
        if self.cv is None:
            return np.full(count, self.mean_s)
        if self.law == "gamma":
            shape = self.cv**-2
            return self.mean_s / shape * rng.standard_gamma(shape, count)
        spread = math.sqrt(math.log1p(self.cv**2))
        draws = np.exp(spread * rng.standard_normal(count) - 0.5 * spread**2)
        return np.asarray(self.mean_s * draws)


def _form(value: object) -> str:
    return "a law" if isinstance(value, Mapping | ServiceLaw) else "seconds"


ServiceTime = Annotated[
    Annotated[float, Field(ge=0, le=10), Tag("seconds")] | Annotated[ServiceLaw, Tag("a law")],
    Discriminator(_form),
]
"""In a configuration file: a number of seconds, or a law."""


def mean_of(service: float | ServiceLaw) -> float:
    """Mean service time of all messages but the first [s]."""
    return service.mean_s if isinstance(service, ServiceLaw) else service


def service_times(service: float | ServiceLaw, rng: np.random.Generator) -> Callable[[], float]:
    """What gives the service time of each message [s], one after the other."""
    if isinstance(service, ServiceLaw):
        return _draws(service, rng).__next__
    return lambda: service


def _draws(law: ServiceLaw, rng: np.random.Generator) -> Iterator[float]:
    if law.first_s is not None:
        yield law.first_s
    while True:
        yield from law.sample(rng, BLOCK).tolist()
