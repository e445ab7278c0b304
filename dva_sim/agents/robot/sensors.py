"""Sensors of a robot: their values, their faults, and their subscribers.

A sensor samples at its own rate for all subscribers. A published value is the true value after a
first-order lag, noise, the limits of the range, and the resolution, in this order. The noise of a
sample is keyed by the sensor and the number of the sample: reading one sensor, or reading it more
often, changes no other value. A sensor with a lag is switched on by its first subscriber, shows the
true value at once, and follows from then on.

A *lost* sensor gives no values; a *stuck* one repeats its last values for ever.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from dva_sim.agents.device import AgentDevice
from dva_sim.kernel.config import Config
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import unknown
from dva_sim.protocol import messages as m
from dva_sim.protocol.errors import ProtocolError
from dva_sim.worlds.bodies import RobotBody
from dva_sim.worlds.hazards import Conditions
from dva_sim.worlds.lidar import Lidar
from dva_sim.worlds.physics import World

LEASE = 60.0  # a subscription that is not renewed ends by itself after this [s]
MAX_SUBSCRIPTIONS = 64  # maximum subscriptions at one robot
FASTEST = 20.0  # highest rate of a subscription [Hz]
SLOWEST = 0.02  # lowest rate of a subscription [Hz]


@dataclass(frozen=True)
class SensorPort:
    """A sensor.

    Attributes:
        unit: Unit of its values.
        read: Function that returns its 1 to 360 values at a time [s], or none if it is lost.
        fastest: Highest rate of values [Hz].
        lags: True if a value depends on earlier ones: then the sensor samples all the time while
            it has a subscriber, however low the subscriber's rate.
    """

    unit: str
    read: Callable[[float], tuple[float, ...]]
    fastest: float = FASTEST
    lags: bool = False


def sensor_topic(sensor: str, subscriber: str) -> str:
    """Return the topic of the values of a sensor for one subscriber."""
    return f"sensor/{sensor}/{subscriber}|"


@dataclass
class _Subscribed:
    """Subscription: its period [s], its end [s], and when the next value is due [s]."""

    period: float
    until: float
    due: float


class SensorSubscriptions:
    """Publishes the values of a robot's sensors to those who subscribed.

    Args:
        device: The robot.
        sensors: Sensors by name.
        tick: The robot's own clock [ms], at a time [s].
        may_read: Predicate: True if a device, by its id, may read a sensor, by its name, now.
    """

    def __init__(
        self,
        device: AgentDevice,
        sensors: Mapping[str, SensorPort],
        tick: Callable[[float], int],
        may_read: Callable[[str, str], bool],
    ) -> None:
        self._device = device
        self._sensors = sensors
        self._tick_of = tick
        self._may_read = may_read
        self._subscribed: dict[tuple[str, str], _Subscribed] = {}
        self._ticking = False

    def subscribe(self, subscriber: str, wish: m.DevSub) -> tuple[int, str]:
        """Begin, renew, change or end a subscription; return reply code and reason."""
        key = wish.sensor, subscriber
        now = self._device.clock.now
        if wish.frequency == 0.0:
            self._subscribed.pop(key, None)
            return m.OK, ""
        fastest = min(self._sensors[wish.sensor].fastest, FASTEST)
        if not SLOWEST <= wish.frequency <= fastest:
            return m.NOT_SUPPORTED, f"a value is given {SLOWEST:g} to {fastest:g} times a second"
        self._forget(now)
        subscription = self._subscribed.get(key)
        if subscription is None and len(self._subscribed) >= MAX_SUBSCRIPTIONS:
            return m.BUSY, f"{MAX_SUBSCRIPTIONS} subscriptions are all that this robot serves"
        period = 1.0 / wish.frequency
        due = now if subscription is None else min(subscription.due, now + period)
        self._subscribed[key] = _Subscribed(period, now + LEASE, due)
        if not self._ticking:
            self._ticking = True
            self._device.clock.every(1.0 / FASTEST, self._tick)
        return m.OK, ""

    def end_all(self) -> None:
        """End all subscriptions, as after a restart."""
        self._subscribed.clear()

    def _forget(self, now: float) -> None:
        """End subscriptions that were not renewed, or whose permission has ended in any way."""
        for (sensor, subscriber), subscription in list(self._subscribed.items()):
            if subscription.until < now or not self._may_read(subscriber, sensor):
                del self._subscribed[sensor, subscriber]

    def _tick(self) -> bool:
        """Publish values that are due. One timer serves all, so requests cannot fill the clock."""
        now = self._device.clock.now
        self._forget(now)
        for sensor in dict.fromkeys(sensor for sensor, _ in self._subscribed):
            if self._sensors[sensor].lags:
                self._sensors[sensor].read(now)
        for (sensor, subscriber), subscription in self._subscribed.items():
            if now >= subscription.due - 1e-9:
                subscription.due = max(subscription.due + subscription.period, now)
                self._publish(sensor, subscriber, now)
        self._ticking = bool(self._subscribed)
        return self._ticking

    def _publish(self, sensor: str, subscriber: str, now: float) -> None:
        port = self._sensors[sensor]
        values = port.read(now)
        if not values:
            return
        body = m.SensorValue(sensor, values, port.unit, self._tick_of(now))
        try:
            self._device.publish(sensor_topic(sensor, subscriber), body, to=subscriber)
        except ProtocolError:
            self._device.recorder.counters["sensor values that no message holds"] += 1


Floats = NDArray[np.float64]
Values = tuple[float, ...]
Source = Callable[[float], Values]
StreamsByName = Callable[[str], np.random.Generator]

BLOCK = 64  # number of samples whose noise is drawn at once
NonNegative = Annotated[float, Field(ge=0)]
Positive = Annotated[float, Field(gt=0)]


class SensorKind(NamedTuple):
    """Kind of sensor with its default properties; the numbers are assumed.

    Attributes:
        unit: Unit of its values.
        noise: Standard deviation.
        resolution: Smallest step.
        low: Least value that it shows.
        high: Greatest value that it shows.
        lag: Time constant [s].
    """

    unit: str
    noise: float
    resolution: float
    low: float
    high: float
    lag: float = 0.0


KINDS = {
    "lidar": SensorKind("m", 0.02, 0.001, 0.0, 99.999),
    "temperature": SensorKind("degC", 0.3, 0.1, -40.0, 1000.0, lag=5.0),
    "smoke": SensorKind("1/m", 0.01, 0.001, 0.0, 20.0, lag=2.0),
    "gas": SensorKind("1", 0.0005, 0.0001, 0.0, 1.0, lag=10.0),
    "heat_flux": SensorKind("kW/m2", 0.02, 0.01, 0.0, 200.0, lag=0.5),
    "water": SensorKind("m", 0.005, 0.001, 0.0, 10.0),
    "battery": SensorKind("1", 0.002, 0.001, 0.0, 1.0),
}


class FaultConfig(Config):
    """A fault of a sensor, at a fixed or random time.

    Attributes:
        kind: `lost`: no values from then on. `stuck`: the last values for ever.
        at_s: Time of the fault.
        mean_time_s: Mean of the time until then, which is exponential.
    """

    kind: Literal["lost", "stuck"]
    at_s: NonNegative | None = None
    mean_time_s: Positive | None = None

    @model_validator(mode="after")
    def _one_of_them(self) -> FaultConfig:
        if (self.at_s is None) == (self.mean_time_s is None):
            raise ValueError("a fault needs either at_s or mean_time_s")
        return self

    def time(self, streams: np.random.Generator) -> float:
        """Return when it happens [s]."""
        if self.mean_time_s is not None:
            return float(streams.exponential(self.mean_time_s))
        return self.at_s or 0.0


class SensorConfig(Config):
    """A sensor of a robot; missing values are those of its kind (`KINDS`).

    Attributes:
        name: Name of the kind.
        rate_hz: Sampling rate, and so the highest rate of values.
        noise: Standard deviation, in the unit of its values.
        resolution: Smallest step of its values.
        low: Least value that it shows.
        high: Greatest value that it shows.
        lag_s: Time constant.
        faults: Faults; the first one that happens stays.
    """

    name: str
    rate_hz: Annotated[float, Field(gt=0, le=FASTEST)] = 10.0
    noise: NonNegative | None = None
    resolution: Positive | None = None
    low: float | None = None
    high: float | None = None
    lag_s: NonNegative | None = None
    faults: tuple[FaultConfig, ...] = ()

    @field_validator("name")
    @classmethod
    def _is_known(cls, name: str) -> str:
        if name not in KINDS:
            raise ValueError(unknown("sensor", name, KINDS))
        return name

    @model_validator(mode="after")
    def _low_is_below_high(self) -> SensorConfig:
        kind = self.as_kind()
        if kind.low >= kind.high:
            raise ValueError(f"low {kind.low:g} of {self.name} is not below high {kind.high:g}")
        return self

    def as_kind(self) -> SensorKind:
        """Return the kind of sensor with the properties set here."""
        usual = KINDS[self.name]
        settings = (self.noise, self.resolution, self.low, self.high, self.lag_s)
        pairs = zip(settings, usual[1:], strict=True)
        return SensorKind(
            usual.unit, *(default if value is None else value for value, default in pairs)
        )


class RobotSensor:
    """One sensor of one robot.

    Args:
        config: Properties of the sensor.
        source: True value at a time [s].
        streams: Random streams of its own, by purpose.
    """

    def __init__(self, config: SensorConfig, source: Source, streams: StreamsByName) -> None:
        self.kind = config.as_kind()
        self._rate = config.rate_hz
        self._source = source
        self._streams = streams
        times = {fault.kind: math.inf for fault in config.faults}
        for number, fault in enumerate(config.faults):
            when = fault.time(streams(f"fault {number}"))
            times[fault.kind] = min(times[fault.kind], when)
        self._lost_at = times.get("lost", math.inf)
        self._stuck_at = times.get("stuck", math.inf)
        self._sample = -1
        self._shown = Values()
        self._lagged = np.empty(0)
        self._time = -math.inf
        self._noise: tuple[int, Floats] = -1, np.empty(0)

    def read(self, now: float) -> Values:
        """Return its newest sample; nothing if it is lost.

        Args:
            now: Time [s], never less than before.
        """
        if now >= self._lost_at:
            return ()
        # The margin keeps a read at the very time of a sample from rounding to the one before.
        sample = math.floor(now * self._rate + 1e-6)
        if sample == self._sample or (now >= self._stuck_at and self._shown):
            return self._shown
        self._sample = sample
        sample_values = self._follow(np.array(self._source(now)), now)
        if self.kind.noise > 0.0:
            sample_values = sample_values + self.kind.noise * self._normals(
                sample, len(sample_values)
            )
        kind = self.kind
        digits = max(0, math.ceil(-math.log10(kind.resolution)))
        stepped = np.round(np.clip(sample_values, kind.low, kind.high) / kind.resolution)
        self._shown = tuple((stepped * kind.resolution).round(digits).tolist())
        return self._shown

    def _follow(self, truth: Floats, now: float) -> Floats:
        """Return the lagged value; exact if the true value is constant between samples."""
        if self.kind.lag <= 0.0:
            return truth
        if len(self._lagged) != len(truth):
            self._lagged = truth
        share = math.exp(-(now - self._time) / self.kind.lag)
        self._lagged = truth + share * (self._lagged - truth)
        self._time = now
        return self._lagged

    def _normals(self, sample: int, count: int) -> Floats:
        """Return the standard normal numbers for one sample, shape `(count,)`."""
        block, index = divmod(sample, BLOCK)
        if self._noise[0] != block or self._noise[1].shape[1] != count:
            self._noise = block, self._streams(f"noise {block}").normal(size=(BLOCK, count))
        return np.asarray(self._noise[1][index])


class Around(Protocol):
    """Conditions at a place: the hazards of a run."""

    def at(self, x: float, y: float, time: float) -> Conditions:
        """Return the conditions at a point [m] and time [s]."""


def sources_of(
    world: World, body: RobotBody, around: Around, lidar: Lidar, charge: Callable[[], float]
) -> dict[str, Source]:
    """Return the true value of each kind of sensor where the robot is.

    Args:
        world: The physics.
        body: The robot's own.
        around: Conditions caused by the hazards.
        lidar: Lidar, which casts rays only if it has a subscriber.
        charge: Share of the battery's charge that is left.
    """

    def in_air(what: Callable[[Conditions], float]) -> Source:
        def source(now: float) -> Values:
            world.advance_to(now)
            return (what(around.at(body.x, body.y, now)),)

        return source

    def ranges(now: float) -> Values:
        world.advance_to(now)
        return tuple(lidar.read(body).tolist())

    return {
        "lidar": ranges,
        "temperature": in_air(lambda c: c.temperature),
        "smoke": in_air(lambda c: c.extinction),
        "gas": in_air(lambda c: c.gas),
        "heat_flux": in_air(lambda c: c.heat_flux),
        "water": in_air(lambda c: c.water),
        "battery": lambda now: (charge(),),
    }


def make_ports(
    configs: Iterable[SensorConfig], sources: Mapping[str, Source], streams: StreamsByName
) -> dict[str, SensorPort]:
    """Return the sensors of a robot, ready to be subscribed to.

    Args:
        configs: Sensors to make.
        sources: Sources of true values, by name.
        streams: Random stream from its beginning, by name; the same name gives the same stream.

    Raises:
        ConfigError: two sensors of one name.
    """
    ports: dict[str, SensorPort] = {}
    for config in configs:
        name = config.name
        if name in ports:
            raise ConfigError(f"sensor {name!r} appears twice")
        sensor = RobotSensor(config, sources[name], _own(streams, name))
        lags = sensor.kind.lag > 0.0
        ports[name] = SensorPort(sensor.kind.unit, sensor.read, config.rate_hz, lags)
    return ports


def _own(streams: StreamsByName, name: str) -> StreamsByName:
    return lambda what: streams(f"{name}/{what}")
