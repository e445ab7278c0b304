"""A real phone at the console: how it is calibrated, and what comes of the samples it sends.

On the wire it is a device of the modelled network, as that of any operator. Its samples go through
the app that simulated phones run, at the times at which they were taken.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable

from dva_sim.agents.operator.held_robot import HeldRobot
from dva_sim.agents.operator.person_at_console import PersonAgent
from dva_sim.agents.tilt import PhoneClock, PhoneProfile, TiltSources
from dva_sim.agents.tilt.accelerometer import Triple
from dva_sim.agents.tilt.calibration import SPEED_PER_LEVEL
from dva_sim.agents.tilt.device_axes import to_tilt_axes
from dva_sim.console.phones.phone_input import PhoneSettings, Samples
from dva_sim.console.wire.seats import PhoneIdentityShown, PhoneShown
from dva_sim.network.realtime import PacedClock
from dva_sim.recordings.motion import MotionApp, MotionSample, MotionWriter

USUAL_HZ = 60.0  # of a phone's browser, until its own rate is known
RATED_BY = 64  # samples, by which the rate is told
MIN_RATED = 8
FRESH_FOR_S = 1.0  # the sample rate is shown until the newest sample is this old [s]
MAX_GAP = 10**6  # of what is counted as lost at once


class PhoneSeat:
    """One phone, from the first word of its page on.

    Args:
        clock: The run's.
        profile: The profile that settings lead to.
        given_hz: Sampling rate of a stick [Hz].
        attempts: Number of attempts per command before the link counts as lost.

    Attributes:
        person: Device on the network; None before it registers.
        operator: The console's own operator who tilts it, and needs no registration.
        registered: True once the DVA has registered it.
        settings: Calibration.
        orientation: Orientation of its screen [deg].
        tilt: Makes the commands of the drive that goes on, or else the readings of its screen.
        samples: Number of samples received.
        lost: Number of samples missing, by their numbers.
        motion: File of its motion, if its person agrees.
    """

    def __init__(
        self,
        clock: PacedClock,
        profile: Callable[[PhoneSettings], PhoneProfile],
        given_hz: float,
        attempts: int,
    ) -> None:
        self._clock = clock
        self._profile_of = profile
        self._given_hz = given_hz
        self._attempts = attempts
        self.person: PersonAgent | None = None
        self.operator: PersonAgent | None = None
        self.registered = False
        self.settings = PhoneSettings()
        self.orientation = 0
        self._profile = profile(self.settings)
        self.samples = self.lost = 0
        self.motion: MotionWriter | None = None
        self._times = PhoneClock()
        self._stamps: deque[float] = deque(maxlen=RATED_BY)
        self._next = 0
        self._at = 0.0
        self._came = -math.inf
        self._newest: Triple | None = None
        self.tilt = self.new_tilt()

    @property
    def driven(self) -> HeldRobot | None:
        """The robot that is driven with it."""
        return next((each for each in self._held if each.is_driven), None)

    def holds(self, robot: str) -> bool:
        """Return True if a robot is in its hands, by its id."""
        return any(held.robot == robot for held in self._held)

    @property
    def _held(self) -> list[HeldRobot]:
        who = self.person or self.operator
        return [] if who is None else list(who.robots.values())

    def lend(self, operator: PersonAgent | None) -> None:
        """Lend the phone to an operator of the console, or to nobody any more."""
        if operator is self.operator:
            return
        if self.operator is not None:
            self.operator.steer_by(None)
        if operator is not None:
            operator.steer_by(self.new_tilt)
        self.operator = operator

    @property
    def tilts(self) -> bool:
        """True if it is steered by tilt, and not by a stick on its screen."""
        return self.tilt.is_tilted

    # --- what it is told ---------------------------------------------------------------------

    def calibrate(self, settings: PhoneSettings) -> None:
        """Calibrate the phone, from the next drive on.

        Raises:
            ConfigError: no phone could.
        """
        self._profile = self._profile_of(settings)
        self.settings = settings
        self._show_again()

    def new_tilt(self) -> TiltSources:
        """Return what makes the commands of the next drive."""
        settings = self.settings
        reference = to_tilt_axes(settings.reference, self.orientation, settings.ios)
        period = 1.0 / (self.rate_hz or USUAL_HZ)
        self.tilt = TiltSources(self._profile, reference, period, self._given_hz)
        self.tilt.pick_up(self._clock.now)
        self._note_app(period)
        return self.tilt

    def keep(self, motion: MotionWriter | None) -> None:
        """Write its motion down from the next calibration on, or no longer."""
        if self.motion is not None:
            self.motion.close()
        self.motion = motion

    def _note_app(self, period: float) -> None:
        if self.motion is not None:
            now = self._clock.now
            settings = self.settings
            app = MotionApp(now, period, settings.reference, settings.ios, self._profile)
            self.motion.app(app)

    def turn(self, orientation: int) -> None:
        """Turn its screen."""
        if orientation != self.orientation:
            self.orientation = orientation
            self._show_again()

    def _show_again(self) -> None:
        if self.driven is None:
            self.new_tilt()

    def take(self, samples: Samples, came: float) -> bool:
        """Take samples; return True if one of them is new.

        Args:
            samples: New samples.
            came: Arrival time, real time [s].
        """
        fresh = [
            pair for pair in zip(samples.at, samples.xyz, strict=True) if not self._is_old(pair[0])
        ]
        self._count(samples, len(fresh))
        if not fresh:
            return False
        reports = [at for at, _ in fresh]
        times = self._times.times_of(reports, came)
        for by_phone, taken, (_, xyz) in zip(reports, times, fresh, strict=True):
            self._take_one(by_phone, came - taken, xyz)
        self._stamps.extend(reports)
        self._came = came
        driven = self.driven
        if driven is not None and self.tilts:
            driven.tilted(samples.first + len(samples.at) - 1, self._at)
        return True

    def _take_one(self, stamp: float, age: float, xyz: Triple) -> None:
        """Take a sample of such an age in real time [s]: as old here, times the pace."""
        now = self._clock.now
        self._at = max(self._at, now - age * self._clock.factor)
        self._newest = to_tilt_axes(xyz, self.orientation, self.settings.ios)
        self.tilt.sample(self._at, self._newest)
        if self.motion is not None:
            self.motion.sample(MotionSample(stamp, now, self._at, xyz, self.orientation))

    def _is_old(self, stamp: float) -> bool:
        return self._times.is_old(stamp)

    def _count(self, samples: Samples, fresh: int) -> None:
        gap = samples.first - self._next
        if self.samples and gap > 0:
            self.lost += min(gap, MAX_GAP)
        self.samples += fresh
        self._next = samples.first + len(samples.at)
        if self._stamps and samples.at[-1] < self._stamps[-1]:
            self._stamps.clear()

    # --- what it tells -----------------------------------------------------------------------

    @property
    def rate_hz(self) -> float | None:
        """Samples per second by the phone's own clock; None: too few are known."""
        if len(self._stamps) < MIN_RATED:
            return None
        return (len(self._stamps) - 1) / (self._stamps[-1] - self._stamps[0])

    def line(self, now: float) -> PhoneShown:
        """Return the phone's part of a seat's line.

        Args:
            now: Real time [s].
        """
        settings = self.settings
        (level, turn) = (0.0, 0.0) if self.driven is None else self.tilt.shown
        held = next(iter(self._held), None)
        profile = self._profile
        rate = self.rate_hz
        fresh = rate is not None and now - self._came < FRESH_FOR_S
        return {
            **self.identity(),
            "registered": self.registered,
            "device": None if held is None else held.robot,
            "level": None if held is None or not held.session else held.level,
            "calibrated": settings.calibrated,
            "pipeline": settings.pipeline,
            "filter": profile.filter,
            "mapping": profile.mapping,
            "radius_deg": int(turn),
            "speed_mps": round(level * SPEED_PER_LEVEL, 3),
            "reading": self._reading(),
            "sensor_hz": round(rate, 1) if rate is not None and fresh else None,
            "samples": self.samples,
            "samples_lost": self.lost,
            "attempts": self._attempts,
        }

    def identity(self) -> PhoneIdentityShown:
        """Return its identity on the wire."""
        device = None if self.person is None else self.person.device
        return {
            "id": "" if device is None else device.id_tag,
            "label": "" if device is None else device.label,
            "address": "" if device is None else device.address,
        }

    def _reading(self) -> list[float] | None:
        if self._newest is None:
            return None
        level, turn = self.tilt.reading(self._newest)
        return [round(level, 2), round(turn, 1)]
