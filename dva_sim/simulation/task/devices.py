"""Input devices: from the velocity that a person wants to the command of the machine.

A practised person knows the device, so the hand aims at what would give the wanted velocity. It
follows with a first-order lag and with signal-dependent noise, whose size is a share of what it
does, and which lasts about as long as the hand takes to follow; a tilted device adds tremor and
what the accelerometer does to it.

References:
    C. M. Harris, D. M. Wolpert: Signal-dependent noise determines motor planning. Nature 394,
    1998.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable

from typing_extensions import override

from dva_sim.agents.population import Person
from dva_sim.agents.tilt.accelerometer import GRAVITY, Accelerometer, load_part
from dva_sim.agents.tilt.filters import load_guarded_filter
from dva_sim.agents.tilt.hand import MAX_SPEED, Hand
from dva_sim.kernel.streams import Streams
from dva_sim.simulation.task.plants import Pair, clamped, draw_motor_noise, remaining_share, shaken
from dva_sim.simulation.task.scenario import DeviceConfig

HAND_SPEED = 1.0  # highest speed of a hand that moves a mouse [m/s]; assumed
CALIBRATING = 20  # samples of a calibration


class HandDevice(ABC):
    """Interface of every device in a trial.

    Attributes:
        top: The fastest cursor that it can ask for [m/s].
        period: Between two readings [s].
        is_place: True if the cursor follows the hand's position; otherwise its speed follows the
            deflection.
        failures: Number of missing or invalid values of a user's filter.
    """

    top: float
    period: float
    is_place = False
    failures = 0

    def __init__(self, config: DeviceConfig, rate_hz: float) -> None:
        self._gain = config.gain
        self.period = 1.0 / rate_hz
        self._aim = self._last = (0.0, 0.0)

    def aim(self, vx: float, vy: float) -> None:
        """Aim at this velocity of the cursor [m/s] from now on."""
        self._aim = vx / self._gain, vy / self._gain

    def command(self, reading: Pair | None, dt: float) -> Pair:
        """Return the machine's velocity [m/s] for a step, given what has arrived, if anything."""
        gain = self._gain
        x, y = self._last
        if self.is_place:
            if reading is None:
                return 0.0, 0.0
            self._last = reading
            return gain * (reading[0] - x) / dt, gain * (reading[1] - y) / dt
        if reading is not None:
            self._last = gain * reading[0], gain * reading[1]
        return self._last

    def move(self, dt: float) -> None:  # noqa: B027
        """Let `dt` [s] pass for the hand."""

    @abstractmethod
    def reading(self) -> Pair:
        """Return the current reading of the device."""

    def farthest(self) -> dict[str, float]:
        """Return the greatest distance of the hand from rest, as a column; nothing without rest."""
        return {}


class Mouse(HandDevice):
    """The hand's place is the cursor's."""

    is_place = True

    def __init__(self, config: DeviceConfig, person: Person, streams: Streams, dt: float) -> None:
        super().__init__(config, config.rate_hz)
        self.top = HAND_SPEED * config.gain
        self._keep = remaining_share(person.hand_lag, dt)
        self._noise = draw_motor_noise(person, streams, dt)
        self._velocity = self._place = (0.0, 0.0)

    @override
    def move(self, dt: float) -> None:
        ax, ay = self._aim
        vx, vy = self._velocity
        x, y = self._place
        keep = self._keep
        vx = ax + (vx - ax) * keep
        vy = ay + (vy - ay) * keep
        self._velocity = vx, vy
        nx, ny = shaken(vx, vy, self._noise)
        self._place = x + nx * dt, y + ny * dt

    @override
    def reading(self) -> Pair:
        return self._place


class Joystick(HandDevice):
    """The deflection is the velocity; both axes spring back to the middle."""

    def __init__(self, config: DeviceConfig, person: Person, streams: Streams, dt: float) -> None:
        super().__init__(config, config.rate_hz)
        self.top = config.gain
        self._keep = remaining_share(person.hand_lag, dt)
        self._noise = draw_motor_noise(person, streams, dt)
        self._hand = self._shown = (0.0, 0.0)
        self._most = 0.0

    @override
    def aim(self, vx: float, vy: float) -> None:
        self._aim = clamped(vx / self.top, 1.0), clamped(vy / self.top, 1.0)

    @override
    def move(self, dt: float) -> None:
        ax, ay = self._aim
        x, y = self._hand
        keep = self._keep
        x = ax + (x - ax) * keep
        y = ay + (y - ay) * keep
        self._hand = x, y
        x, y = shaken(x, y, self._noise)
        x = clamped(x, 1.0)
        y = clamped(y, 1.0)
        self._shown = x, y
        self._most = max(self._most, abs(x), abs(y))

    @override
    def reading(self) -> Pair:
        return self._shown

    @override
    def farthest(self) -> dict[str, float]:
        # The largest deflection, in shares of a full one.
        return {"deflection_max": self._most}


class Tilt(HandDevice):
    """A tilted device: roll is along x, pitch along y; a subclass says what a tilt means.

    The device is calibrated at rest before each trial, so that of the part's offset only the
    drift within the trial is left.
    """

    def __init__(self, config: DeviceConfig, person: Person, streams: Streams, dt: float) -> None:
        part = load_part(config.accelerometer)
        rate = min(config.rate_hz, part.rate_hz)
        super().__init__(config, rate)
        self._limit = math.radians(config.limit_deg)
        # Noise is a share of what the hand does, and a tilt that is a place is only held.
        noise = 0.0 if self.is_place else person.motor_noise
        self._hand = Hand(
            person.hand_lag, streams.fresh("hand"), motor_noise=noise, max_tilt=self._limit
        )
        self._sensor = Accelerometer(part, streams.fresh("accelerometer"), rate_hz=rate)
        self._filter = load_guarded_filter(config.filter, config.filter_options)(self.period)
        rest = [self._measured(0.0, 0.0) for _ in range(CALIBRATING)]
        self._rest = sum(r for r, _ in rest) / CALIBRATING, sum(p for _, p in rest) / CALIBRATING
        self._most = 0.0

    @override
    def reading(self) -> Pair:
        # One more sample, filtered.
        pitch, roll = self._hand.step(self._aim[1], self._aim[0], self.period)
        self._most = max(self._most, abs(pitch), abs(roll))
        x, y = self._measured(pitch, roll)
        self._filter.add((x - self._rest[0], y - self._rest[1]))
        value = self._filter.value()
        self.failures = self._filter.failures
        return value

    @override
    def farthest(self) -> dict[str, float]:
        # The largest tilt about either axis [rad].
        return {"tilt_max_rad": self._most}

    def _measured(self, pitch: float, roll: float) -> Pair:
        """Roll and pitch as the accelerometer tells them [rad]."""
        ax, ay, az = self._sensor.sample(pitch, roll)
        return math.atan2(ay, az), math.asin(clamped(ax / GRAVITY, 1.0))


class TiltVelocity(Tilt):
    """The tilt is the cursor's velocity."""

    def __init__(self, config: DeviceConfig, person: Person, streams: Streams, dt: float) -> None:
        super().__init__(config, person, streams, dt)
        self.top = self._gain * self._limit


class TiltPosition(Tilt):
    """The tilt is the cursor's place, so that the hand aims at a tilt that moves."""

    is_place = True

    def __init__(self, config: DeviceConfig, person: Person, streams: Streams, dt: float) -> None:
        super().__init__(config, person, streams, dt)
        self.top = self._gain * MAX_SPEED
        self._noise = draw_motor_noise(person, streams, dt)
        self._rate = 0.0, 0.0

    @override
    def aim(self, vx: float, vy: float) -> None:
        self._rate = vx / self._gain, vy / self._gain

    @override
    def move(self, dt: float) -> None:
        limit = self._limit
        x, y = self._aim
        vx, vy = shaken(*self._rate, self._noise)
        self._aim = clamped(x + vx * dt, limit), clamped(y + vy * dt, limit)


KINDS: dict[str, Callable[[DeviceConfig, Person, Streams, float], HandDevice]] = {
    "mouse": Mouse,
    "tilt_position": TiltPosition,
    "tilt_velocity": TiltVelocity,
    "joystick": Joystick,
}


def make_device(config: DeviceConfig, person: Person, streams: Streams, dt: float) -> HandDevice:
    """Return the device of a trial, in a person's hand.

    Args:
        config: Kind of device, and its gain.
        person: Person who holds it.
        streams: Random streams of the trial.
        dt: The trial's step [s].
    """
    return KINDS[config.kind](config, person, streams, dt)
