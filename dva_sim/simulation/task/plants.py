"""Controlled systems: cursors by place or by velocity, a slow arm, a vehicle.

A vehicle is a unicycle that follows speed and turn rate with one time constant, as the drive of
the robot does within its limits of acceleration; contacts are not modelled: walls are crossed
and counted.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from dva_sim.agents.population import Person
from dva_sim.kernel.streams import Streams
from dva_sim.simulation.task.delays import slow_noise

Pair = tuple[float, float]


def remaining_share(lag: float, dt: float) -> float:
    """Return the share of a first-order lag [s] that a step [s] leaves."""
    return math.exp(-dt / lag) if lag > 0.0 else 0.0


def draw_motor_noise(person: Person, streams: Streams, dt: float) -> Iterator[Pair]:
    """Yield the motor noise of a trial, as a share of what the hand does, step by step."""
    keep = remaining_share(person.hand_lag, dt)
    share = person.motor_noise
    first, second = (slow_noise(streams.fresh(f"hand/{axis}"), keep) for axis in "xy")
    for x, y in zip(first, second, strict=True):
        yield share * x, share * y


def shaken(x: float, y: float, noise: Iterator[Pair]) -> Pair:
    """Return the motion of a hand that means (x, y): off by a share of it, in any direction."""
    nx, ny = next(noise)
    size = math.hypot(x, y)
    return x + size * nx, y + size * ny


def clamped(value: float, limit: float) -> float:
    """Return the value within +-limit."""
    return -limit if value < -limit else limit if value > limit else value


def lagged(value: float, target: float, dt: float, lag: float) -> float:
    """Return a step of a first-order lag [s], exact for a constant target."""
    return target if lag <= 0.0 else target + (value - target) * math.exp(-dt / lag)


class Cursor:
    """A point on a plane that follows a velocity.

    Args:
        lag: Time constant with which its velocity follows the command [s].
        top: Speed along each axis at most [m/s].

    Attributes:
        x: [m]
        y: [m]
        vx: [m/s]
        vy: [m/s]
    """

    def __init__(self, lag: float = 0.0, top: float = math.inf) -> None:
        self.x = self.y = self.vx = self.vy = 0.0
        self._lag = lag
        self._top = top
        self._dt = 0.0
        self._keep = 0.0

    def step(self, vx: float, vy: float, dt: float) -> None:
        """Let `dt` [s] pass under a command [m/s]."""
        if dt != self._dt:
            self._dt = dt
            self._keep = math.exp(-dt / self._lag) if self._lag > 0.0 else 0.0
        top = self._top
        keep = self._keep
        vx = -top if vx < -top else top if vx > top else vx
        vy = -top if vy < -top else top if vy > top else vy
        self.vx = vx = vx + (self.vx - vx) * keep
        self.vy = vy = vy + (self.vy - vy) * keep
        self.x += vx * dt
        self.y += vy * dt


class Unicycle:
    """A vehicle that goes where it points.

    Args:
        lag: Time constant of speed and turn rate [s].
        top_speed: Largest speed, never in reverse [m/s].
        top_turn: Largest turn rate, either way [rad/s].

    Attributes:
        x: [m]
        y: [m]
        heading: [rad]
        speed: [m/s]
        turn_rate: [rad/s]
    """

    def __init__(self, lag: float, top_speed: float, top_turn: float) -> None:
        self.x = self.y = self.heading = self.speed = self.turn_rate = 0.0
        self._lag = lag
        self._top_speed = top_speed
        self._top_turn = top_turn

    def step(self, speed: float, turn_rate: float, dt: float) -> None:
        """Let `dt` [s] pass under a command [m/s, rad/s]; the heading is taken in mid-step."""
        speed = min(max(speed, 0.0), self._top_speed)
        turn_rate = min(max(turn_rate, -self._top_turn), self._top_turn)
        self.speed = lagged(self.speed, speed, dt, self._lag)
        self.turn_rate = lagged(self.turn_rate, turn_rate, dt, self._lag)
        middle = self.heading + 0.5 * dt * self.turn_rate
        self.x += self.speed * math.cos(middle) * dt
        self.y += self.speed * math.sin(middle) * dt
        self.heading += self.turn_rate * dt
