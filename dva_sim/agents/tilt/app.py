"""The phone's app: samples of an accelerometer go in with their times, commands come out.

Calibration -> filter -> mapping -> a rule for when something is sent. The app is the same for all
who tilt the phone: a simulated hand, a person whose input is turned into tilt, or a real phone that
tells what its own part measures.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Final, NamedTuple

from dva_sim.agents.tilt.accelerometer import Triple
from dva_sim.agents.tilt.calibration import SPEED_PER_LEVEL, Calibration, Reading
from dva_sim.agents.tilt.filters import BATCH, Filter, load_guarded_filter
from dva_sim.agents.tilt.mappings import limited, load_guarded_mapping
from dva_sim.agents.tilt.profile import PhoneProfile
from dva_sim.kernel.makers import maker

TIE: Final = 1e-9  # design: moments nearer than this are the same [s]
_TICK: Final = 1e-6  # design: tolerance for rounded clock times [s]


def calibrated(profile: PhoneProfile, reference: Triple) -> Calibration:
    """Return the app's calibration by a reference pose: x, y, z [m/s^2]."""
    return Calibration(
        reference,
        speed_step=profile.speed_step_mps2,
        turn_step=profile.turn_step_mps2,
        max_delay=profile.max_delay_s,
    )


class TiltCommand(NamedTuple):
    """Command of the phone.

    Attributes:
        speed: [m/s]
        turn_rate: [rad/s]
        sample_age: Mean age of the information in the reading that the command was made of:
            from the samples that the filter holds, each with its weight in the value, to now [s].
            It contains each delay of the phone once: waiting for the next sample, the filter, and
            how long its value has stood. The lag of the hand is before it, the mapping after it.
        captured: Mean capture time of the pictures behind it [s]; for the recorder.
    """

    speed: float
    turn_rate: float
    sample_age: float
    captured: float


_make_command = maker(TiltCommand)


class Trail:
    """Carries the capture time of pictures through the same filters as the tilt.

    The hand averages what it is asked to do, and the filter averages what the hand does. The
    same hand and the same filter, given capture times in place of tilts, answer when the
    pictures behind a command were captured, on average: as old as a signal that rises steadily
    comes out of both. It is for the recorder alone, and touches no command.

    Args:
        make_filter: Function that makes another filter like the phone's.
    """

    def __init__(self, make_filter: Callable[[], Filter]) -> None:
        self._make_filter = make_filter
        self.begin(0.0)

    def begin(self, now: float) -> None:
        """Begin a drive; until a picture is followed, the tilt counts as based on `now`."""
        self._filter = self._make_filter()
        # Since the beginning, as empty slots of a filter hold a zero.
        self._begun = now
        self._asked = 0.0
        self._hand = 0.0

    def follow(self, captured: float) -> None:
        """Let the hand follow a command based on a picture captured at that time [s]."""
        self._asked = captured - self._begun

    def move(self, decay: float) -> float:
        """Return the hand moves by a sample that the filter does not take.

        What it would take of it.
        """
        self._hand = self._asked + (self._hand - self._asked) * decay
        return self._hand

    def take(self, hand: float) -> None:
        """Let the filter take the sample."""
        self._filter.add((hand, hand))

    def sample(self, count: int, decay: float) -> None:
        """Take `count` samples; from each to the next the hand keeps the share `decay`."""
        target = self._asked
        hand = self._hand
        add = self._filter.add
        for _ in range(count):
            hand = target + (hand - target) * decay
            add((hand, hand))
        self._hand = hand

    def captured(self) -> float:
        """Return when the pictures behind the filter's value were captured, on average [s]."""
        return self._begun + self._filter.value()[0]

    @property
    def age(self) -> float:
        """Mean age of what the filter's value is made of, in samples: of the value taken last."""
        return self._filter.age

    @property
    def asked(self) -> float:
        """Capture time of the picture that is followed now [s]."""
        return self._begun + self._asked


class TiltApp:
    """An app of a phone. The effect of a sample depends only on its time, not on when it is read.

    Args:
        profile: Settings of reading, filter, mapping and sending.
        reference: Reading of the part in the neutral pose: x, y, z [m/s^2].
        period: Mean time between two samples [s].
        decay: The share of the way to what is asked that the hand still has to go, from one
            sample to the next: 0 if samples are what was asked.

    Attributes:
        keeps_alive: True if the newest value is sent at every chance, changed or not.
        waits: True if it sends from within the call that takes a sample, and so does nothing else
            until a request is answered; see `hold`.
        shown: The command on the display: level, turn [deg/s].
        samples: Number of samples in the batches of this drive.
        values: Number of batches.

    Raises:
        ConfigError: the filter or the mapping cannot be had.
    """

    def __init__(
        self, profile: PhoneProfile, reference: Triple, period: float, decay: float = 0.0
    ) -> None:
        self._profile = profile
        self._period = period
        self._decay = decay
        self._ideal = profile.ideal
        self.keeps_alive = profile.send == "keep_alive"
        self.waits = profile.while_open != "take"
        self._queues = profile.while_open == "queue"
        self._on_sample = profile.values_at == "sample"
        self._app = calibrated(profile, reference)
        reading = self._app.reading
        before = profile.limits == "before_filter"
        self._read = (lambda x, y, z: limited(*reading(x, y, z))) if before else reading
        filters = load_guarded_filter(profile.filter, profile.filter_options)
        self._make_filter: Callable[[], Filter] = partial(filters, period)
        self._batch = self._make_filter().batch
        self._mapping = load_guarded_mapping(profile.mapping, profile.mapping_options)
        self._watches = self._mapping.integrates
        self._trail = Trail(self._make_filter)

    def pick_up(self, now: float) -> None:
        """Begin a drive: the app starts with nothing in its filter."""
        self._mapping.begin()
        self._filter = self._make_filter()
        self._trail.begin(now)
        self.shown: Reading = (0.0, 0.0)
        self.samples = self.values = 0
        self._last_key: tuple[int, int] | None = None
        self._fresh = 0
        self._held = False
        self._queue: deque[tuple[float, Reading, float]] = deque()
        self._heard_at = now
        self._taken_at = self._stems_from = self._sampled_at = self._captured = now
        self._due = math.inf if self._batch is None else now + self._app.max_delay

    def sample(self, at: float, acceleration: Triple) -> None:
        """Take in a reading at a time [s], never before an earlier one: x, y, z [m/s^2]."""
        self.take_values(at - 2 * TIE)
        self._heard_at = at
        reading = self._read(*acceleration)
        if self._held:
            self._miss(at, reading)
            return
        self._trail.sample(1, self._decay)
        self._take_sample(at, reading)
        if self._fresh == self._batch or (self._on_sample and at >= self._due - TIE):
            self._take_value(at)

    def take_values(self, now: float) -> None:
        """Take values that were due although no batch was complete."""
        while self._due <= now + TIE and not (self._on_sample or self._held):
            self._take_value(self._due)

    def hold(self) -> None:
        """Hold a request open: until `release`, no sample is looked at.

        The founding document sends from within the call that takes a sample (figure 5.8). What
        becomes of the samples meanwhile it does not say: they are dropped, or they queue and are
        worked off in their order.
        """
        self._held = True

    def release(self, now: float) -> None:
        """Release the answered request: the time to the next value counts from here."""
        self._advance(now)
        self._held = False
        self._due = math.inf if self._batch is None else now + self._app.max_delay

    def followed(self, captured: float) -> None:
        """Attribute samples to a picture captured at that time [s], from now on."""
        self._trail.follow(captured)

    def next_look(self, now: float, rate_hz: float) -> float:
        """Return when the app next considers sending [s]: its period, or a complete batch."""
        if self.keeps_alive:
            return now + 1.0 / rate_hz
        if self._batch is None or self._ideal:
            return now + min(self._app.max_delay, BATCH * self._period)
        self._advance(now)
        coming = self._next_sample
        due = self._due
        if self._on_sample and math.isfinite(due):
            due = coming + max(0, math.ceil((due - TIE - coming) / self._period)) * self._period
        complete = coming + (self._batch - self._fresh - 1) * self._period
        return min(math.ceil((due - TIE / 2) / _TICK) * _TICK, complete + _TICK)

    def look(self, now: float) -> TiltCommand | None:
        """Return the command to send at `now`, or None if there is nothing new to say."""
        self._advance(now)
        command = self._command(now)
        while command is None and self._queue and not self._held:
            self._work_off(now)
            command = self._command(now)
        return command

    def _command(self, now: float) -> TiltCommand | None:
        if self._on_sample and self._batch is not None and not self.values:
            return None  # as published, no command is sent before the first value
        if not self._ideal and self._batch is None:
            if not self._watches:
                level, turn = self._filter.value()
                self.shown = self._mapping.command(level, turn, 0.0)
            self._captured = self._trail.captured()
            self._stems_from = self._sampled_at - self._trail.age * self._period
        level, turn = self.shown
        if not self.keeps_alive:
            key = round(level), int(turn)
            if key == self._last_key:
                return None
            self._last_key = key
        age = now - self._stems_from
        speed = level * SPEED_PER_LEVEL
        return _make_command(speed, math.radians(turn), age, self._captured)

    @property
    def failures(self) -> int:
        """Number of invalid answers of a user's filter or mapping in this drive."""
        return self._filter.failures + self._mapping.failures

    @property
    def first_failure(self) -> str:
        """Description of the first invalid answer, in a line."""
        return self._filter.first_failure or self._mapping.first_failure

    @property
    def _next_sample(self) -> float:
        """Time of the next expected sample [s]."""
        return self._heard_at + self._period

    def _advance(self, now: float) -> None:
        """Process all samples that are due."""
        if self._queue and not self._held:
            self._work_off(now)
        self.take_values(now)

    def _take_sample(self, at: float, reading: Reading) -> None:
        """Put a sample of that time [s] into the filter."""
        self._filter.add(reading)
        self._fresh += 1
        passed = at - self._sampled_at
        self._sampled_at = at
        if self._watches:
            self._watch(passed)

    def _miss(self, at: float, reading: Reading) -> None:
        """Skip a sample that arrives while a request is open."""
        hand = self._trail.move(self._decay)
        if self._queues:
            self._queue.append((at, reading, hand))

    def _work_off(self, now: float) -> None:
        """Take samples that have queued, at once and in their order, up to the next value."""
        while self._queue:
            at, reading, hand = self._queue.popleft()
            self._trail.take(hand)
            self._take_sample(at, reading)
            if self._fresh == self._batch or now >= self._due - TIE:
                self._take_value(now)
                return

    def _watch(self, dt: float) -> None:
        """Update the display after a sample."""
        if self._batch is None:
            self.shown = self._mapping.command(*self._filter.value(), dt)

    def _take_value(self, at: float) -> None:
        """Take the value of a complete batch, or of one whose time is over."""
        self.samples += self._fresh
        self.values += 1
        reading = self._filter.value()
        self._stems_from = self._sampled_at - self._filter.age * self._period
        self._captured = self._trail.captured()
        # A real phone's samples may come after the moment until which a value stood.
        self.shown = self._mapping.command(*reading, max(0.0, at - self._taken_at))
        self._taken_at = at
        self._due = at + self._app.max_delay
        self._fresh = 0
