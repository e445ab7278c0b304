"""A phone in a hand: a chain of stages from the desired motion to commands.

The way is the dissertation's: wanted -> the reading to tilt to (`Mapping.tilt_for`) -> `Hand` ->
`Accelerometer` -> `Calibration` -> `Filter` -> `Mapping.command` -> a rule for when it is sent.
`PhoneProfile` holds all that a study can change; `Trail` carries along how old the pictures are
that a command rests on.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Final

import numpy as np
from typing_extensions import override

from dva_sim.agents.population import Person
from dva_sim.agents.tilt.accelerometer import Accelerometer, load_part
from dva_sim.agents.tilt.app import TIE, TiltApp, TiltCommand, Trail, calibrated
from dva_sim.agents.tilt.calibration import SPEED_PER_LEVEL, Reading
from dva_sim.agents.tilt.filters import load_filter
from dva_sim.agents.tilt.hand import Hand
from dva_sim.agents.tilt.mappings import limited, load_mapping
from dva_sim.agents.tilt.profile import PhoneProfile

__all__ = ["Phone", "PhoneProfile", "TiltCommand", "Trail", "try_phone"]

SURELY: Final = -1.0  # design: level to which a person tilts in order to stand


class Phone(TiltApp):
    """A phone, its app, and the hand that holds it.

    Samples are made when somebody looks, for all the time since: the same numbers as sample by
    sample, without an event for each. What comes of a sample, and of a batch, depends on when it
    was due, never on when somebody looked.

    A practised person knows the reading that gives a command. With a mapping that integrates the
    person also reads the display, a perceptual delay late, and closes the gap to what is wanted
    in so long a time that the crossover times the delay from display to display is `margin`.

    Args:
        profile: Phone and app.
        holder: Person who holds the phone.
        rng: Random generator of this run.
        own: Random generator of this person's copy of the phone and its calibration, the same in
            all runs; by default that of this run.

    Attributes:
        hand_lag: Mean time by which a command follows the hand's goal [s]. The hand is moved from
            sample to sample, so this is less than the time constant.
        shown: The command on the display: level, turn [deg/s].
        samples: Number of samples in the batches of this drive.
        values: Number of batches.

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
        self._accelerometer = Accelerometer(
            load_part(profile.accelerometer),
            of_part,
            own,
            rate_hz=profile.sample_rate_hz,
            jitter=profile.sample_jitter,
            warming=profile.warming_k,
        )
        self._hand = Hand(
            holder.hand_lag,
            of_hand,
            motor_noise=holder.motor_noise,
            tremor=math.radians(profile.tremor_deg),
            max_tilt=math.radians(profile.max_tilt_deg),
            max_speed=math.radians(profile.max_tilt_speed_deg_s),
            tremor_width=profile.tremor_width_hz,
        )
        self._interval = self._accelerometer.interval
        period = self._accelerometer.period
        decay = math.exp(-period / holder.hand_lag) if holder.hand_lag > 0.0 else 0.0
        x, y, z = profile.reference_mps2
        dx, dy = own.normal(0.0, profile.reference_error_mps2, 2).tolist()
        offset = self._accelerometer.offset
        # The reference is the reading at rest, in roughly the intended position.
        reference = x + offset[0] + dx, y + offset[1] + dy, z + offset[2]
        super().__init__(profile, reference, period, decay)
        self._felt = calibrated(profile, profile.reference_mps2)
        self._rest = self._felt.pose(0.0, 0.0)
        self._within = self._time_to_close(holder)
        self._late = round(holder.perceptual_delay / period)
        keep = 0.0 if profile.ideal else decay
        self.hand_lag = period * keep / (1.0 - keep)
        self.pick_up(0.0)

    def _time_to_close(self, holder: Person) -> float:
        """Return the time in which a gap on the display is closed [s]."""
        if self._batch is not None:
            held = min(self._app.max_delay, self._batch * self._period)
        else:
            probe = self._make_filter()
            for _ in range(200):
                probe.add((0.0, 0.0))
            held = (probe.age + 0.5) * self._period
        return (holder.perceptual_delay + holder.hand_lag + held) / holder.margin

    # --- requests ---------------------------------------------------------------------

    def pick_up(self, now: float) -> None:
        """Begin a drive: the hand is at rest, the app starts with nothing in its filter."""
        super().pick_up(now)
        self._accelerometer.begin_session()
        self._hand.rest()
        self._wanted = (0.0, 0.0)
        self._aim = (0.0, 0.0)
        self._perceived = deque([self.shown], maxlen=self._late + 1)
        self._step = self._interval()
        self._sample_at = now + self._step

    def ask(
        self, now: float, speed: float, turn_rate: float, captured: float | None = None
    ) -> None:
        """Set what the person wants from `now` on: speed [m/s], turn rate [rad/s].

        A person who wants to stand tilts a level beyond the reference, to be sure. When the
        picture behind it was `captured` [s] is carried along for the recorder; now, if none was.
        """
        self._advance(now)
        self._trail.follow(now if captured is None else captured)
        level, turn = limited(speed / SPEED_PER_LEVEL, math.degrees(turn_rate))
        self._wanted = level or SURELY, turn
        if not self._watches:
            self._aim = self._aim_at(self.shown)

    @override
    def look(self, now: float) -> TiltCommand | None:
        # An ideal phone sends the desired command.
        if self._ideal:
            self.shown = limited(*self._wanted)
            self._stems_from = now
            self._captured = self._trail.asked
        return super().look(now)

    @property
    def _next_sample(self) -> float:
        return self._sample_at

    # --- simulation ------------------------------------------------------------------

    def _advance(self, now: float) -> None:
        """Advance by all samples and values that were due."""
        end = now + TIE
        if (self._sample_at > end and self._due > end) or self._ideal:
            return
        if self._held:
            self._miss_until(end)
            return
        if self._queue:
            self._work_off(now)
            if self._queue:  # later samples wait for their turn
                return
        while True:
            due = self._due + TIE
            self._sample_until(due if due < end else end)
            if self._fresh == self._batch:
                self._take_value(self._sampled_at)
            elif self._due > end or (self._on_sample and self._sample_at > end):
                return
            elif self._on_sample:
                self._sample_until(self._sample_at)
                self._take_value(self._sampled_at)
            else:
                self._take_value(self._due)

    def _sample_until(self, end: float) -> None:
        """Take samples that are due, or until a batch is complete: hand, calibration, filter."""
        step = self._hand.step
        sample = self._accelerometer.sample
        interval = self._interval
        read = self._read
        add = self._filter.add
        watches = self._watches
        batch = self._batch
        rest_pitch, rest_roll = self._rest
        pitch, roll = self._aim
        at = self._sample_at
        dt = self._step
        fresh = self._fresh
        while at <= end and fresh != batch:
            if watches:
                pitch, roll = self._aim_at(self._perceived[0])
            tilt, lean = step(pitch, roll, dt)
            x, y, z = sample(rest_pitch + tilt, rest_roll + lean)
            add(read(x, y, z))
            fresh += 1
            if watches:
                self._watch(dt)
            self._sampled_at = at
            dt = interval()
            at += dt
        if fresh != self._fresh:
            self._trail.sample(fresh - self._fresh, self._decay)
        self._sample_at = at
        self._step = dt
        self._fresh = fresh

    def _miss_until(self, end: float) -> None:
        """Skip samples while a request is open: the hand moves, but the app is blocked."""
        rest_pitch, rest_roll = self._rest
        while self._sample_at <= end:
            if self._watches:
                self._aim = self._aim_at(self._perceived[0])
                self._perceived.append(self.shown)
            tilt, lean = self._hand.step(*self._aim, self._step)
            acceleration = self._accelerometer.sample(rest_pitch + tilt, rest_roll + lean)
            self._miss(self._sample_at, self._read(*acceleration))
            self._step = self._interval()
            self._sample_at += self._step

    def _watch(self, dt: float) -> None:
        """Show the display to the person, too."""
        super()._watch(dt)
        self._perceived.append(self.shown)

    def _aim_at(self, perceived: Reading) -> Reading:
        """Return angles away from rest that the hand aims at [rad]."""
        reading = self._mapping.tilt_for(self._wanted, perceived, self._within)
        pitch, roll = self._felt.pose(*reading)
        return pitch - self._rest[0], roll - self._rest[1]


def try_phone(profile: PhoneProfile) -> None:
    """Load all plug-ins of a profile, and make each once to check it.

    Raises:
        ConfigError: a part, a filter or a mapping that cannot be had, or an option of them.
    """
    load_part(profile.accelerometer)
    load_filter(profile.filter, profile.filter_options)(1.0 / profile.sample_rate_hz)
    load_mapping(profile.mapping, profile.mapping_options)()
