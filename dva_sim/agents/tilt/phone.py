"""From the tilt of a hand to the command that is sent.

The way is the dissertation's: accelerometer, calibration (reference, speed step, radius
step), filter, clamping, and a rule for when a value is worth a message.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import islice
from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field

from dva_sim.agents.tilt.filters import BATCH, FILTERS
from dva_sim.agents.tilt.trail import Trail
from dva_sim.config import Config

LEVELS = 10  # speed levels of the phone; one is SPEED_PER_LEVEL
SPEED_PER_LEVEL = 0.05  # [m/s]
MAX_TURN_DEG = 30.0
TREMOR_HZ = 9.5  # middle of the 8-12 Hz band of physiological hand tremor

NonNegative = Annotated[float, Field(ge=0)]


class PhoneProfile(Config):
    """A phone and how its app sends.

    Attributes:
        sample_rate_hz: Accelerometer samples per second.
        noise_mps2: White noise of the sensor, standard deviation.
        bias_mps2: Constant error per person and axis, standard deviation.
        tremor_mps2: Amplitude of hand tremor.
        speed_step_mps2: Acceleration along the tilt axis for one level of speed.
        turn_step_mps2: Acceleration across it for one degree per second of turn.
        filter: Name of the filter.
        send: `on_change` sends a value that differs from the last one sent when a batch is
            full or `max_delay_s` has passed; `keep_alive` sends at the wanted rate always.
        max_delay_s: Longest time between two looks at the filter (`on_change` only).
        ideal: The hand's intent becomes the command at once: a reference, not a phone.
    """

    description: str = ""
    sample_rate_hz: Annotated[float, Field(gt=0, le=1000)] = 34.0
    noise_mps2: NonNegative = 0.05
    bias_mps2: NonNegative = 0.08
    tremor_mps2: NonNegative = 0.06
    speed_step_mps2: Annotated[float, Field(gt=0)] = 0.35
    turn_step_mps2: Annotated[float, Field(gt=0)] = 0.12
    filter: Literal["median20-copy", "median20-inplace", "median5", "none"] = "median5"
    send: Literal["on_change", "keep_alive"] = "keep_alive"
    max_delay_s: Annotated[float, Field(gt=0, le=10)] = 0.5
    ideal: bool = False


class TiltCommand(NamedTuple):
    """What the phone sends.

    Attributes:
        speed: [m/s]
        turn_rate: [rad/s]
        sample_age: Mean age of the samples behind it when it was made [s].
        captured: When the pictures behind it were captured, on average [s]; for the recorder.
    """

    speed: float
    turn_rate: float
    sample_age: float
    captured: float


class Phone:
    """A hand holding a phone.

    The hand follows what it is asked to do with a first-order lag. Samples are made when
    the app looks, for all the time since it last looked: the same numbers as sample by
    sample, without an event for each.

    Args:
        profile: Phone and app.
        hand_lag: Time constant of the hand [s].
        rng: Luck of this phone.

    Attributes:
        hand_lag: Time constant with which a command follows what is asked [s].
    """

    def __init__(self, profile: PhoneProfile, hand_lag: float, rng: np.random.Generator) -> None:
        self._profile = profile
        self._filter = FILTERS[profile.filter]()
        self._trail = Trail(FILTERS[profile.filter])
        self.hand_lag = 0.0 if profile.ideal else hand_lag
        self._period = 1.0 / profile.sample_rate_hz
        self._decay = math.exp(-self._period / hand_lag) if hand_lag > 0 else 0.0
        self._noise = _axis_noise(profile, rng)
        self._asked = (0.0, 0.0)
        self._hand = (0.0, 0.0)
        self._samples_taken = 0
        self._last_key: tuple[int, int] | None = None

    def ask(
        self, now: float, speed: float, turn_rate: float, captured: float | None = None
    ) -> None:
        """What the person wants from `now` on: speed [m/s], turn rate [rad/s].

        A person who wants to stand tilts a level beyond the reference, to be sure. When the
        picture behind it was `captured` [s] is carried along for the recorder; now, if none was.
        """
        self._sample_until(now)
        self._trail.follow(now if captured is None else captured)
        level = speed / SPEED_PER_LEVEL if speed > 0 else -1.0
        self._asked = level, math.degrees(turn_rate)

    def next_look(self, now: float, rate_hz: float) -> float:
        """When the app next considers sending [s]: its period, or when a batch is complete."""
        if self._profile.send == "keep_alive":
            return now + 1.0 / rate_hz
        return now + min(self._profile.max_delay_s, BATCH * self._period)

    def pick_up(self, now: float) -> None:
        """Begin a drive: the hand is level, the filter keeps what it held."""
        self._samples_taken = int(now * self._profile.sample_rate_hz)
        self._last_key = None
        self._asked = self._hand = (0.0, 0.0)
        self._trail.begin(now)

    def look(self, now: float) -> TiltCommand | None:
        """The command to send at `now`, or None if there is nothing new to say."""
        self._sample_until(now)
        age = 0.0 if self._profile.ideal else 0.5 * self._filter.span * self._period
        level, turn = self._asked if self._profile.ideal else self._filter.value()
        captured = self._trail.asked if self._profile.ideal else self._trail.captured()
        level = min(max(level, 0.0), float(LEVELS))
        turn = min(max(turn, -MAX_TURN_DEG), MAX_TURN_DEG)
        key = round(level), int(turn)
        if self._profile.send == "on_change" and key == self._last_key:
            return None
        self._last_key = key
        return TiltCommand(level * SPEED_PER_LEVEL, math.radians(turn), age, captured)

    @property
    def keeps_alive(self) -> bool:
        """Whether the newest value is sent at every chance, changed or not."""
        return self._profile.send == "keep_alive"

    def _sample_until(self, now: float) -> None:
        due = int(now * self._profile.sample_rate_hz + 1e-9)
        new = due - self._samples_taken
        if self._profile.ideal or new <= 0:
            return
        (asked_level, asked_turn), (level, turn), decay = self._asked, self._hand, self._decay
        add = self._filter.add
        for noise_level, noise_turn in islice(self._noise, new):
            level = asked_level + (level - asked_level) * decay
            turn = asked_turn + (turn - asked_turn) * decay
            add((level + noise_level, turn + noise_turn))
        self._hand = level, turn
        self._trail.sample(new, decay)
        self._samples_taken = due


def _axis_noise(profile: PhoneProfile, rng: np.random.Generator) -> Iterator[list[float]]:
    """Error of each sample in (levels, deg/s): bias, white noise and tremor, drawn in blocks."""
    scale = np.array([1 / profile.speed_step_mps2, 1 / profile.turn_step_mps2])
    bias = rng.normal(0.0, 1.0, 2) * profile.bias_mps2
    phase = rng.uniform(0.0, 2 * math.pi, 2)
    start, block = 0, 512
    while True:
        angle = 2 * math.pi * TREMOR_HZ / profile.sample_rate_hz * np.arange(start, start + block)
        tremor = profile.tremor_mps2 * np.sin(angle[:, None] + phase)
        white = rng.normal(0.0, 1.0, (block, 2)) * profile.noise_mps2
        yield from ((bias + white + tremor) * scale).tolist()
        start += block
