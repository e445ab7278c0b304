"""A phone in a hand: what is wanted goes in, commands come out, by a chain of small stages.

The way is the dissertation's: wanted -> the reading to tilt to (`Mapping.tilt_for`) -> `Hand` ->
`Accelerometer` -> `Calibration` -> `Filter` -> `Mapping.command` -> a rule for when it is sent.
`PhoneProfile` holds all that a study can change; `Trail` carries along how old the pictures are
that a command rests on.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Annotated, Any, Final, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from dva_sim.agents.population import Person
from dva_sim.agents.tilt.accelerometer import (
    GRAVITY,
    Accelerometer,
    NonNegative,
    Positive,
    Triple,
    load_part,
)
from dva_sim.agents.tilt.calibration import SPEED_PER_LEVEL, Calibration, Reading
from dva_sim.agents.tilt.filters import BATCH, Filter, load_filter, load_guarded_filter
from dva_sim.agents.tilt.hand import Hand
from dva_sim.agents.tilt.mappings import limited, load_guarded_mapping, load_mapping
from dva_sim.kernel.config import Config, Key


class PhoneProfile(Config):
    """A phone, how it is held, and how its app reads, filters, maps and sends.

    Attributes:
        accelerometer: Name of a part, or a file with one.
        sample_rate_hz: Samples per second that the app gets.
        sample_jitter: Standard deviation of the time of a sample, as a share of the time between
            two.
        tremor_deg: Of the hand, as apparent tilt, standard deviation.
        max_tilt_deg: Farthest that the hand tilts the phone away from rest.
        max_tilt_speed_deg_s: Fastest that it does.
        reference_mps2: x, y, z of the pose that means nothing: speed zero, straight on.
        reference_error_mps2: How far off that pose was when the owner calibrated, standard
            deviation of x and y; the offset of the part itself is calibrated away.
        speed_step_mps2: Acceleration along the tilt axis for one level of speed.
        turn_step_mps2: Acceleration across it for one degree per second of turn.
        filter: By name, or a class in a file, `mine.py:Mine`.
        filter_options: Of the filter, such as `{window: 9}` of the median.
        mapping: By name, or a class in a file.
        mapping_options: Of the mapping, such as `{gain: 2}`.
        send: `on_change` sends what differs from the last one sent when 20 samples have come or
            `max_delay_s` has passed; `keep_alive` sends at the wanted rate always.
        max_delay_s: Longest time between two looks at the filter (`on_change`), and between two
            values of a filter that works in batches.
        ideal: What the person wants becomes the command at once: a reference, not a phone.
    """

    description: str = ""
    accelerometer: str = "mpu6050"
    sample_rate_hz: Annotated[float, Field(gt=0, le=1000)] = 34.0
    sample_jitter: Annotated[float, Field(ge=0, le=0.3)] = 0.1
    tremor_deg: NonNegative = 0.25
    max_tilt_deg: Annotated[float, Field(gt=0, le=80)] = 45.0
    max_tilt_speed_deg_s: Positive = 200.0
    reference_mps2: Triple = (0.0, 0.0, GRAVITY)
    reference_error_mps2: NonNegative = 0.08
    speed_step_mps2: Positive = 0.35
    turn_step_mps2: Positive = 0.12
    filter: Annotated[str, Key("filter")] = "median"
    filter_options: Annotated[
        dict[str, Any],
        Key(inner={"time_constant_s": Key("time constant of the filter", stated=False)}),
    ] = Field(default_factory=dict)
    mapping: Annotated[str, Key("mapping")] = "absolute"
    mapping_options: Annotated[dict[str, Any], Key(inner={"gain": Key("gain of the phone")})] = (
        Field(default_factory=dict)
    )
    send: Annotated[Literal["on_change", "keep_alive"], Key("sending")] = "keep_alive"
    max_delay_s: Annotated[
        float, Field(gt=0, le=10), Key("longest time between two values of the phone", stated=False)
    ] = 0.5
    ideal: bool = False

    @model_validator(mode="after")
    def _reference_is_gravity(self) -> PhoneProfile:
        size = sum(part * part for part in self.reference_mps2) ** 0.5
        if not 0.8 * GRAVITY < size < 1.2 * GRAVITY:
            raise ValueError(f"reference_mps2 should be about {GRAVITY:g} m/s^2 long, not {size:g}")
        if self.reference_mps2[2] <= 0.0:
            raise ValueError("reference_mps2 should have z above 0: the screen looks up")
        return self


class Trail:
    """Takes the time at which a picture was captured the way that the tilt takes.

    The hand averages what it is asked to do, and the filter averages what the hand does. The
    same hand and the same filter, given capture times in place of tilts, answer when the
    pictures behind a command were captured, on average: as old as a signal that rises steadily
    comes out of both. It is for the recorder alone, and touches no command.

    Args:
        make_filter: Makes another filter like the phone's.
    """

    def __init__(self, make_filter: Callable[[], Filter]) -> None:
        self._make_filter = make_filter
        self.begin(0.0)

    def begin(self, now: float) -> None:
        """A drive begins; what is behind the tilt until a picture is followed counts from now."""
        self._filter = self._make_filter()
        # Since the beginning, as empty slots of a filter hold a zero.
        self._begun, self._asked, self._hand = now, 0.0, 0.0

    def follow(self, captured: float) -> None:
        """From now on the hand follows what a picture captured at that time [s] led to."""
        self._asked = captured - self._begun

    def sample(self, count: int, decay: float) -> None:
        """So many samples; from each to the next the hand keeps the share `decay`."""
        asked, hand, add = self._asked, self._hand, self._filter.add
        for _ in range(count):
            hand = asked + (hand - asked) * decay
            add((hand, hand))
        self._hand = hand

    def captured(self) -> float:
        """When the pictures behind the filter's value were captured, on average [s]."""
        return self._begun + self._filter.value()[0]

    @property
    def age(self) -> float:
        """Mean age of what the filter's value is made of, in samples: of the value taken last."""
        return self._filter.age

    @property
    def asked(self) -> float:
        """When the picture was captured that is followed now [s]."""
        return self._begun + self._asked


SURELY: Final = -1.0  # the level that a person tilts to who wants to stand
_TIE: Final = 1e-9  # moments nearer than this are the same [s]
_TICK: Final = 1e-6  # who looks by a clock that rounds may come so much too soon [s]


class TiltCommand(NamedTuple):
    """What the phone sends.

    Attributes:
        speed: [m/s]
        turn_rate: [rad/s]
        sample_age: Mean age of the information in the reading that the command was made of:
            from the samples that the filter holds, each with its weight in the value, to now [s].
            All that the phone delays is in it once: waiting for the next sample, the filter, and
            how long its value has stood. The lag of the hand is before it, the mapping after it.
        captured: When the pictures behind it were captured, on average [s]; for the recorder.
    """

    speed: float
    turn_rate: float
    sample_age: float
    captured: float


class Phone:
    """A phone, its app, and the hand that holds it.

    Samples are made when somebody looks, for all the time since: the same numbers as sample by
    sample, without an event for each. What comes of a sample, and of a batch, depends on when it
    was due, never on when somebody looked.

    A practised person knows the reading that gives a command. With a mapping that integrates the
    person also reads the display, a perceptual delay late, and closes the gap to what is wanted
    in so long a time that the crossover times the delay from display to display is `margin`.

    Args:
        profile: Phone and app.
        holder: Who holds it.
        rng: Luck of this run.
        own: Luck of this person's copy of the phone and its calibration, the same in all runs;
            if not given, of this run.

    Attributes:
        hand_lag: By how much the hand makes a command follow later what is asked, on average [s].
            The hand is moved from sample to sample, so that it is less than the time constant.
        shown: The command on the display: level, turn [deg/s].
        samples: How many were in the batches of this drive.
        values: How many batches there were.

    Raises:
        ConfigError: the part, the filter or the mapping cannot be had.
    """

    def __init__(
        self,
        profile: PhoneProfile,
        holder: Person,
        rng: np.random.Generator,
        own: np.random.Generator | None = None,
    ) -> None:
        of_hand, of_part, spare = rng.spawn(3)
        own = own or spare
        self._profile = profile
        self._accelerometer = Accelerometer(
            load_part(profile.accelerometer),
            of_part,
            own,
            rate_hz=profile.sample_rate_hz,
            jitter=profile.sample_jitter,
        )
        self._hand = Hand(
            holder.hand_lag,
            of_hand,
            motor_noise=holder.motor_noise,
            tremor=math.radians(profile.tremor_deg),
            max_tilt=math.radians(profile.max_tilt_deg),
            max_speed=math.radians(profile.max_tilt_speed_deg_s),
        )
        self._interval = self._accelerometer.interval
        self._period = period = self._accelerometer.period
        self._calibrate(own)
        filters = load_guarded_filter(profile.filter, profile.filter_options)
        self._make_filter: Callable[[], Filter] = lambda: filters(period)
        self._batch = self._make_filter().batch
        self._mapping = load_guarded_mapping(profile.mapping, profile.mapping_options)
        self._watches = self._mapping.integrates
        self._within = self._time_to_close(holder)
        self._late = round(holder.perceptual_delay / period)
        self._trail = Trail(self._make_filter)
        self._decay = math.exp(-period / holder.hand_lag) if holder.hand_lag > 0.0 else 0.0
        keep = 0.0 if profile.ideal else self._decay
        self.hand_lag = period * keep / (1.0 - keep)
        self.pick_up(0.0)

    def _calibrate(self, own: np.random.Generator) -> None:
        """The owner held the phone as meant, roughly; what it then measured is the reference."""
        profile, offset = self._profile, self._accelerometer.offset
        x, y, z = profile.reference_mps2
        dx, dy = own.normal(0.0, profile.reference_error_mps2, 2).tolist()
        calibrated = partial(
            Calibration,
            speed_step=profile.speed_step_mps2,
            turn_step=profile.turn_step_mps2,
            max_delay=profile.max_delay_s,
        )
        self._app = calibrated((x + offset[0] + dx, y + offset[1] + dy, z + offset[2]))
        self._felt = calibrated(profile.reference_mps2)
        self._rest = self._felt.pose(0.0, 0.0)

    def _time_to_close(self, holder: Person) -> float:
        """In what time a gap on the display is closed [s]."""
        if self._batch is not None:
            held = min(self._app.max_delay, self._batch * self._period)
        else:
            probe = self._make_filter()
            for _ in range(200):
                probe.add((0.0, 0.0))
            held = (probe.age + 0.5) * self._period
        return (holder.perceptual_delay + holder.hand_lag + held) / holder.margin

    # --- what others ask ---------------------------------------------------------------

    def pick_up(self, now: float) -> None:
        """Begin a drive: the hand is at rest, the app starts with nothing in its filter."""
        self._accelerometer.begin_session()
        self._hand.rest()
        self._mapping.begin()
        self._filter = self._make_filter()
        self._trail.begin(now)
        self._wanted = self.shown = (0.0, 0.0)
        self.samples = self.values = 0
        self._aim = 0.0, 0.0
        self._perceived = deque([self.shown], maxlen=self._late + 1)
        self._last_key: tuple[int, int] | None = None
        self._step = self._interval()
        self._sample_at = now + self._step
        self._fresh = 0
        self._taken_at = self._stems_from = self._sampled_at = self._captured = now
        self._due = math.inf if self._batch is None else now + self._app.max_delay

    def ask(
        self, now: float, speed: float, turn_rate: float, captured: float | None = None
    ) -> None:
        """What the person wants from `now` on: speed [m/s], turn rate [rad/s].

        A person who wants to stand tilts a level beyond the reference, to be sure. When the
        picture behind it was `captured` [s] is carried along for the recorder; now, if none was.
        """
        self._advance(now)
        self._trail.follow(now if captured is None else captured)
        level, turn = limited(speed / SPEED_PER_LEVEL, math.degrees(turn_rate))
        self._wanted = level or SURELY, turn
        if not self._watches:
            self._aim = self._aim_at(self.shown)

    def next_look(self, now: float, rate_hz: float) -> float:
        """When the app next considers sending [s]: its period, or when a batch is complete."""
        if self.keeps_alive:
            return now + 1.0 / rate_hz
        if self._batch is None or self._profile.ideal:
            return now + min(self._app.max_delay, BATCH * self._period)
        self._advance(now)
        complete = self._sample_at + (self._batch - self._fresh - 1) * self._period
        return min(math.ceil((self._due - _TIE / 2) / _TICK) * _TICK, complete + _TICK)

    def look(self, now: float) -> TiltCommand | None:
        """The command to send at `now`, or None if there is nothing new to say."""
        self._advance(now)
        if self._profile.ideal:
            self.shown = limited(*self._wanted)
            self._stems_from, self._captured = now, self._trail.asked
        elif self._batch is None:
            if not self._watches:
                self.shown = self._mapping.command(*self._filter.value(), 0.0)
            self._captured = self._trail.captured()
            self._stems_from = self._sampled_at - self._trail.age * self._period
        level, turn = self.shown
        key = round(level), int(turn)
        if key == self._last_key and not self.keeps_alive:
            return None
        self._last_key = key
        age = now - self._stems_from
        return TiltCommand(level * SPEED_PER_LEVEL, math.radians(turn), age, self._captured)

    @property
    def keeps_alive(self) -> bool:
        """Whether the newest value is sent at every chance, changed or not."""
        return self._profile.send == "keep_alive"

    @property
    def failures(self) -> int:
        """How often in this drive a user's filter or mapping gave no answer that is one."""
        return self._filter.failures + self._mapping.failures

    @property
    def first_failure(self) -> str:
        """What was wrong with it first, in a line."""
        return self._filter.first_failure or self._mapping.first_failure

    # --- what happens meanwhile --------------------------------------------------------

    def _advance(self, now: float) -> None:
        """All samples and values that were due."""
        end = now + _TIE
        if (self._sample_at > end and self._due > end) or self._profile.ideal:
            return
        while True:
            self._sample_until(min(end, self._due + _TIE))
            if self._fresh == self._batch:
                self._take_value(self._sampled_at)
            elif self._due <= end:
                self._take_value(self._due)
            else:
                return

    def _sample_until(self, end: float) -> None:
        """Samples that are due, or until a batch is complete: hand, part, calibration, filter."""
        step, sample, interval = self._hand.step, self._accelerometer.sample, self._interval
        read, add, watches, batch = self._app.reading, self._filter.add, self._watches, self._batch
        (rest_pitch, rest_roll), (pitch, roll) = self._rest, self._aim
        at, dt, fresh = self._sample_at, self._step, self._fresh
        while at <= end and fresh != batch:
            if watches:
                pitch, roll = self._aim_at(self._perceived[0])
            tilt, lean = step(pitch, roll, dt)
            x, y, z = sample(rest_pitch + tilt, rest_roll + lean)
            add(read(x, y, z))
            fresh += 1
            if watches:
                self._watch(dt)
            self._sampled_at, dt = at, interval()
            at += dt
        if fresh != self._fresh:
            self._trail.sample(fresh - self._fresh, self._decay)
        self._sample_at, self._step, self._fresh = at, dt, fresh

    def _watch(self, dt: float) -> None:
        """What the display shows after a sample."""
        if self._batch is None:
            self.shown = self._mapping.command(*self._filter.value(), dt)
        self._perceived.append(self.shown)

    def _take_value(self, at: float) -> None:
        """A batch is complete, or its time is over."""
        self.samples, self.values = self.samples + self._fresh, self.values + 1
        reading = self._filter.value()
        self._stems_from = self._sampled_at - self._filter.age * self._period
        self._captured = self._trail.captured()
        self.shown = self._mapping.command(*reading, at - self._taken_at)
        self._taken_at, self._due, self._fresh = at, at + self._app.max_delay, 0

    def _aim_at(self, perceived: Reading) -> Reading:
        """Angles away from rest that the hand aims at [rad]."""
        reading = self._mapping.tilt_for(self._wanted, perceived, self._within)
        pitch, roll = self._felt.pose(*reading)
        return pitch - self._rest[0], roll - self._rest[1]


def try_phone(profile: PhoneProfile) -> None:
    """Load all that a profile names, and make it once.

    Raises:
        ConfigError: a part, a filter or a mapping that cannot be had, or an option of them.
    """
    load_part(profile.accelerometer)
    load_filter(profile.filter, profile.filter_options)(1.0 / profile.sample_rate_hz)
    load_mapping(profile.mapping, profile.mapping_options)()
