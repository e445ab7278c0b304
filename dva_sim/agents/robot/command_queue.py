"""A robot's computer: it takes one message at a time, each for its processing time.

That time is constant or drawn from a distribution. The robot's holder has every second turn. While
the robot is driven, all strangers together get at most a fifth of the time, if possible right after
a message of the holder: their share must not grow with their number of connections, which cost
them nothing. An emergency waits only for the message that is being processed, and one processing
answers all emergencies that have come by its end: more of them cannot stop the robot any better.
"""

from __future__ import annotations

import math
from collections import OrderedDict, deque
from collections.abc import Callable, Hashable, Iterator, Mapping
from enum import IntEnum
from typing import Annotated, Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Discriminator, Field, Tag, model_validator

from dva_sim.kernel.clock import Clock
from dva_sim.kernel.config import Config
from dva_sim.kernel.makers import maker
from dva_sim.network.messaging import Answer, Request
from dva_sim.network.zmtp import Flow
from dva_sim.protocol.codec import decode_if_valid
from dva_sim.protocol.messages import Emergency, Message, SetTeleOp

LIMIT = 1000  # ZeroMQ's default high-water mark, in messages
MAX_OF_OTHERS = 64  # maximum waiting messages of all but the holder; each look at them costs time
PER_CONNECTION = 8  # maximum waiting messages of a connection that is not the holder's
REST = 4.0  # pause of strangers after a message of theirs, in processing times
AFTER_HOLDER = 1.0  # maximum further wait of strangers for a message of the holder to follow [s]
TICK = 1e-6  # resolution of the clock [s]


PUBLISHED: Final = object()  # key of the queue of published commands


class Standing(IntEnum):
    """Standing of a message's sender: why a robot should listen to it."""

    HOLDER = 0  # proved by the session, or by the robot's own subscription
    DVA = 1  # claims to be the DVA, which anybody can without keys
    OTHER = 2


HOLDER, DVA, OTHER = Standing  # globals: looking a member up is fifteen times as slow


class Letter(NamedTuple):
    """A message that has arrived.

    Attributes:
        data: Bytes of the message.
        arrived: Arrival time [s].
        request: Request that carried it; None if no reply is expected.
        message: Content, where the queue can decode it.
        moves: True for a command; all other messages are control.
    """

    data: bytes
    arrived: float
    request: Request | None = None
    message: Message | None = None
    moves: bool = True

    @property
    def answer(self) -> Answer | None:
        """Callback for the reply; None if no reply is expected."""
        return None if self.request is None else self.request.answer

    @property
    def peer(self) -> Hashable:
        """Connection by which the message arrived."""
        return PUBLISHED if self.request is None else self.request.peer


_make_letter = maker(Letter)


StandingOf = Callable[[Letter], Standing]
Queue = deque[Letter]
QueueKey = tuple[Hashable, bool]  # the connection, and whether the queue holds commands


class FairQueue:
    """A queue of control requests and one of commands for each connection, served in turn.

    A busy sender delays only itself. A connection that is not the holder's has
    `PER_CONNECTION` places. If there is no room at all, the newest message of the longest queue
    is dropped, strangers first.

    Args:
        limit: Maximum number of queued messages of the holder; of others no more than
            `MAX_OF_OTHERS`.
        standing: Function that returns the present standing of a sender, by the newest grants.

    Attributes:
        length: Number of queued messages.
    """

    def __init__(self, limit: int, standing: StandingOf) -> None:
        self._limit = limit
        self._standing = standing
        self.length = 0
        self._queues: OrderedDict[QueueKey, Queue] = OrderedDict()

    def count(self, holders: bool) -> int:
        """Return the number of messages of the holder, or of all others."""
        return sum(map(len, self._beside(holders).values()))

    def _beside(self, holders: bool) -> dict[QueueKey, Queue]:
        return {k: v for k, v in self._queues.items() if (self._standing(v[0]) == 0) is holders}

    def has(self, standing: Standing) -> bool:
        """Return True if a message of this standing is next in its queue."""
        return any(self._standing(queue[0]) is standing for queue in self._queues.values())

    def put(self, letter: Letter) -> Letter | None:
        """Add a letter; return the one dropped for lack of room, if any, which may be itself."""
        gone = None
        standing = self._standing(letter)
        if standing is not HOLDER or self.length >= self._limit:
            gone = self._make_room(letter, standing)
            if gone is letter:
                return letter
        self._queues.setdefault((letter.peer, letter.moves), deque()).append(letter)
        self.length += 1
        return gone

    def _make_room(self, letter: Letter, standing: Standing) -> Letter | None:
        """Drop and return the letter that does not fit, if any: another one or itself."""
        mine = [len(self._queues.get((letter.peer, moves), ())) for moves in (False, True)]
        if standing is not HOLDER and sum(mine) >= PER_CONNECTION:
            return letter
        places = self._limit if standing is HOLDER else min(self._limit, MAX_OF_OTHERS)
        if self.length >= places:
            beside = self._beside(standing is HOLDER)
            if sum(map(len, beside.values())) >= places:
                worst, queue = max(beside.items(), key=lambda one: self._rank(one[1]))
                if (standing, mine[letter.moves] + 1) >= self._rank(queue):
                    return letter
                return self._take(worst, newest=True)
        return None

    def _rank(self, queue: Queue) -> tuple[Standing, int]:
        return self._standing(queue[0]), len(queue)

    def next_queues(self) -> dict[Standing, QueueKey]:
        """Return the queue whose turn it is, for each standing that has messages.

        The holder's control requests come before its commands. Among strangers the same rule
        would let some of them keep the others out.
        """
        keys: dict[Standing, QueueKey] = {}
        for key, queue in self._queues.items():
            standing = self._standing(queue[0])
            first = keys.setdefault(standing, key)
            if standing is HOLDER and key[1] < first[1]:
                keys[standing] = key
        return keys

    def pop(self, key: QueueKey) -> Letter:
        """Return a queue's next letter; the queue then waits until all others had their turn."""
        self._queues.move_to_end(key)
        return self._take(key)

    def _take(self, key: QueueKey, newest: bool = False) -> Letter:
        queue = self._queues[key]
        letter = queue.pop() if newest else queue.popleft()
        if not queue:
            del self._queues[key]
        self.length -= 1
        return letter

    def forget_published(self) -> int:
        """Drop published commands, to which nobody expects a reply; return their number."""
        gone = len(self._queues.pop((PUBLISHED, True), ()))
        self.length -= gone
        return gone


Read = Callable[[Request], Message | None]


def _nobody_waits(_: Letter) -> None:
    """Drop a message without room; it is counted."""


class CommandQueue:
    """Emergencies in every other turn, then the holder alternating with all others.

    The holder's next message waits for one message of others at most, for two messages where one
    of the holder's own is being worked on, and for four while emergencies come.

    Args:
        clock: The run's clock.
        service: Function that returns the time that the next message takes [s].
        handle: Callback for each letter when its processing is done.
        latest_wins: Keep only the newest waiting command, as a subscriber that drains its
            socket before it works does.
        limit: Maximum number of queued messages of the holder, and of emergencies.
        read: Function that reads a request on arrival; None: it was refused, and takes no time.
            Without this function only emergencies are read, and the rest is queued as bytes.
        standing: Current standing of a message's sender.
        driven: Predicate: True while somebody drives the robot, so that other senders must leave it
            time.
        refuse: Callback for each letter that does not fit.

    Attributes:
        service: Service time; may be replaced at any time.
        latest_wins: True to keep only the newest command; may be changed at any time.
        flow: Source of published commands, if it can be paused: a full inbox pauses it until
            half of the inbox is done. Commands of other sources are dropped.
    """

    def __init__(
        self,
        clock: Clock,
        service: Callable[[], float],
        handle: Callable[[Letter], object],
        latest_wins: bool,
        limit: int = LIMIT,
        read: Read | None = None,
        standing: StandingOf = lambda _: HOLDER,
        driven: Callable[[], bool] = lambda: False,
        refuse: Callable[[Letter], object] = _nobody_waits,
    ) -> None:
        self._clock = clock
        self.service = service
        self._handle = handle
        self.latest_wins = latest_wins
        self._limit = limit
        self._read = read
        self._standing = standing
        self._driven = driven
        self._refuse = refuse
        self.flow: Flow | None = None
        self._paused = self._busy = self._waking = self._was_urgent = False
        self._emergencies: list[Letter] = []
        self._waiting = FairQueue(limit, standing)
        self._last = HOLDER
        self._turns = [DVA, OTHER]
        self._rested = -math.inf  # end of the strangers' pause [s]
        self.longest = self.superseded = self.overflowed = 0

    def __len__(self) -> int:
        return len(self._emergencies) + self._waiting.length

    @property
    def hears_the_dva(self) -> bool:
        """True if a message that claims to be the DVA's waits, or is being worked on."""
        at_work = self._busy and self._last is DVA
        return at_work or self._waiting.has(DVA)

    def request(self, request: Request) -> None:
        """Queue a request whose sender waits for the reply."""
        data = request.data
        message = None
        # A cheap look at the bytes, so that a flood of emergencies is refused before it is parsed.
        looks_urgent = b"<EmergencyMsg" in data
        if looks_urgent and not self._has_room(request.peer):
            self._turn_away(Letter(data, self._clock.now, request))
            return
        if self._read is not None:
            message = self._read(request)
            if message is None:
                return
            urgent = isinstance(message.body, Emergency)
            moves = isinstance(message.body, SetTeleOp)
        else:
            urgent = looks_urgent and _is_emergency(data)
            moves = b"<SetTeleOp>" in data
        self._put(_make_letter(data, self._clock.now, request, message, moves), urgent)

    def _has_room(self, peer: Hashable) -> bool:
        """Return True with room for one more emergency; those that wait stop the robot as well."""
        of_peer = sum(letter.peer == peer for letter in self._emergencies)
        return of_peer < PER_CONNECTION and len(self._emergencies) < self._limit

    def published(self, data: bytes, message: Message | None = None) -> None:
        """Take a published command, which needs no reply."""
        if self.latest_wins:
            self.superseded += self.forget_published()
        self._put(_make_letter(data, self._clock.now, None, message, True))
        waiting = self._waiting
        limit = self._limit
        is_full = waiting.length >= limit and waiting.count(holders=True) >= limit
        if is_full and self.flow is not None:
            self._paused = True
            self.flow.pause()

    def forget_published(self) -> int:
        """Drop the waiting published commands; return their number."""
        return self._waiting.forget_published()

    def _put(self, letter: Letter, urgent: bool = False) -> None:
        """Add a letter; one of the holder in an idle inbox is processed at once."""
        idle = not (self._busy or urgent or self._emergencies or self._waiting.length)
        if idle and self._standing(letter) is HOLDER:
            self._last = HOLDER
            self._was_urgent = False
            self.longest = self.longest or 1
            if self._begin([letter]):
                self._work()
            return
        if urgent:
            self._emergencies.append(letter)
        else:
            gone = self._waiting.put(letter)
            if gone is not None:
                self._turn_away(gone)
        length = len(self._emergencies) if urgent else self._waiting.length
        if length > self.longest:
            self.longest = length
        if not self._busy:
            self._work()

    def _turn_away(self, letter: Letter) -> None:
        self.overflowed += 1
        self._refuse(letter)

    def _work(self) -> None:
        """Process the next letters; if processing takes no time, all that wait."""
        while letters := self._next():
            if not self._begin(letters):
                return
        self._busy = False

    def _begin(self, letters: list[Letter]) -> bool:
        """Begin to process letters; return True if that took no time and is done."""
        self._busy = True
        if (
            self._paused
            and self.flow is not None
            and self._waiting.count(holders=True) <= self._limit // 2
        ):
            self._paused = False
            self.flow.resume()
        duration = self.service()
        if duration > 0.0:
            if self._last is OTHER and not self._was_urgent:
                self._rested = self._clock.now + (1.0 + REST) * duration
            self._clock.call_after(duration, self._done, letters)
            return False
        self._finish(letters)
        return True

    def _next(self) -> list[Letter]:
        """Return all emergencies together, unless it is the turn of another message."""
        if not (self._emergencies or self._waiting.length):
            self._was_urgent = False
            return []
        held_up = self._emergencies and not self._was_urgent
        letter = None if held_up else self._next_of_others()
        self._was_urgent = letter is None and bool(self._emergencies)
        return self._emergencies if letter is None else [letter]

    def _next_of_others(self) -> Letter | None:
        """Return one of the holder's after each other; the DVA and strangers take turns."""
        if not self._waiting.length:
            return None
        keys = self._waiting.next_queues()
        turns = self._turns
        for standing in (*turns, HOLDER) if self._last is HOLDER else (HOLDER, *turns):
            if standing not in keys or (standing is OTHER and self._others_rest()):
                continue
            self._last = standing
            if standing is not HOLDER:
                self._turns = [*(other for other in turns if other is not standing), standing]
            return self._waiting.pop(keys[standing])
        return None

    def _others_rest(self) -> bool:
        """Return True if strangers have to wait although the queue is otherwise empty.

        Right after a message of the holder there is most time until its next one.
        """
        behind_holder = self._busy and self._last is HOLDER
        until = self._rested + (0.0 if behind_holder else AFTER_HOLDER)
        if self._clock.now >= until - TICK or not self._driven():
            return False
        if not self._waking:
            self._waking = True
            self._clock.call_at(self._rested + AFTER_HOLDER, self._wake)
        return True

    def _wake(self) -> None:
        self._waking = False
        if not self._busy:
            self._work()

    def _finish(self, letters: list[Letter]) -> None:
        """Finish processing, including emergencies that arrived meanwhile."""
        # The same list: emergencies that arrived during the processing are in it, and answered.
        if letters is self._emergencies:
            self._emergencies = []
        for letter in letters:
            self._handle(letter)

    def _done(self, letters: list[Letter]) -> None:
        self._finish(letters)
        self._work()


def _is_emergency(data: bytes) -> bool:
    message = decode_if_valid(data)
    return message is not None and isinstance(message.body, Emergency)


BLOCK = 256  # random numbers drawn at once


class ServiceLaw(Config):
    """A law of service times.

    Attributes:
        law: `constant`, `exponential`, `lognormal` or `gamma`.
        mean_s: Mean service time of all messages but the first.
        cv: Standard deviation over mean; of a lognormal or gamma law only.
        first_s: Service time of the first message (a cold start); by default as the others.
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
        """Draw `count` service times [s], shape `(count,)`."""
        if self.law == "exponential":
            return self.mean_s * rng.standard_exponential(count)
        if self.cv is None:
            return np.full(count, self.mean_s)
        if self.law == "gamma":
            shape = self.cv**-2
            return self.mean_s / shape * rng.standard_gamma(shape, count)
        spread = math.sqrt(math.log1p(self.cv**2))
        # The shift by half the variance of the logarithm keeps the mean at `mean_s`.
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
    """Return the mean service time of all messages but the first [s]."""
    return service.mean_s if isinstance(service, ServiceLaw) else service


def service_times(service: float | ServiceLaw, rng: np.random.Generator) -> Callable[[], float]:
    """Return a generator of service times, one for each message [s]."""
    if isinstance(service, ServiceLaw):
        return _draws(service, rng).__next__
    return lambda: service


def _draws(law: ServiceLaw, rng: np.random.Generator) -> Iterator[float]:
    if law.first_s is not None:
        yield law.first_s
    while True:
        yield from law.sample(rng, BLOCK).tolist()
