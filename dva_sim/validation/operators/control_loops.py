"""Delayed loops on their own: their stability limit, and the effect of a prediction on it.

The strategies close the loops themselves, stepped in time; theory is only what they are compared
with. The person who steers is the one in the middle of the population, but for the limits that
keep it from unstable loops: those are far away.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from dva_sim.agents.observation import Observation
from dva_sim.agents.operator.strategies.base import PointView, Strategy
from dva_sim.agents.operator.strategies.cursor import Sighting
from dva_sim.agents.operator.strategies.predictor import Predictor
from dva_sim.agents.operator.strategies.pursuit import Pursuit
from dva_sim.agents.population import Person, Population, median_person
from dva_sim.agents.route_following import Reach, Route, View

STEPS = 200  # number of time steps in a delay
SMITH_STEPS = 500  # the same under a Smith predictor
DELAYS = 80  # duration of a run, in delays
BISECTIONS = 14
_NO_LIMIT = 1e6  # a limit that is never reached
LIMITLESS = Reach(speed=_NO_LIMIT, turn_rate=_NO_LIMIT)

Loop = Callable[[float], Sequence[float]]


def critical(loop: Loop, low: float, high: float) -> float:
    """Return the parameter at which the errors of a loop neither grow nor die away, by bisection.

    Args:
        loop: Plays the loop.
        low: A parameter with which they die away.
        high: A parameter with which they grow.

    Raises:
        ValueError: they do not.
    """
    if grows(loop(low)) or not grows(loop(high)):
        raise ValueError(f"the loop should be stable at {low:g} and unstable at {high:g}")
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if grows(loop(middle)) else (middle, high)
    return 0.5 * (low + high)


def grows(errors: Sequence[float]) -> bool:
    """Return True if the last eighth swings farther than the second; the first is the start."""
    swings = np.abs(np.asarray(errors))
    eighth = len(swings) // 8
    return bool(swings[-eighth:].max() > swings[eighth : 2 * eighth].max())


def integrator(gain_delay: float) -> list[float]:
    """Return a cursor brought to its target by the crossover law, seen a delay of 1 late.

    What is seen holds for a step, so half a step more would pass on average; the mean of two
    neighbouring frames takes that off.
    """
    dt = 1.0 / STEPS
    strategy = Strategy(_person(gain_delay), LIMITLESS)
    frames = deque([1.0] * (STEPS + 1), maxlen=STEPS + 1)
    position = 1.0
    places = []
    for step in range(DELAYS * STEPS):
        x = 0.5 * (frames[0] + frames[1])
        position += strategy.point(PointView(step * dt, _cursor(x, 0.0), 1.0))[0] * dt
        frames.append(position)
        places.append(position)
    return places


def pure_pursuit(speed_delay: float) -> list[float]:
    """Return a robot that `Pursuit` drives along a straight line, seen 1 s late.

    The look-ahead is the nearest that there is.

    Args:
        speed_delay: Speed x delay over look-ahead.

    Returns:
        Distance from the line, signed, step by step [m].
    """
    person = replace(_person(), caution=_NO_LIMIT)
    dt = 1.0 / STEPS
    speed = speed_delay * person.habits.steering.nearest_look_m
    pursuit = Pursuit(person, Reach(speed, _NO_LIMIT))
    route = Route(np.array([[0.0, 0.0], [2.0 * DELAYS, 0.0]]))
    x = 1.0
    y = 1e-3
    heading = 0.0
    frames = deque([(x, y, heading)] * STEPS, maxlen=STEPS)
    errors = []
    for step in range(DELAYS * STEPS):
        seen = Observation(0, *frames[0], speed=0.0, turn_rate=0.0, hazards=())
        intent = pursuit.drive(route, View(step * dt, seen, 1.0), 0.0)
        middle = heading + 0.5 * intent.turn_rate * dt
        x = x + intent.speed * math.cos(middle) * dt
        y = y + intent.speed * math.sin(middle) * dt
        heading += intent.turn_rate * dt
        frames.append((x, y, heading))
        errors.append(y)
    return errors


def smith_response(gain: float, delay: float, end: float) -> list[float]:
    """Return positions of a cursor steered by `Predictor` after a target appears 1 m away.

    The predictor adds to what is seen what was asked for since and cannot be seen yet, so the
    loop is closed on the present: y(t) = 1 - exp(-gain (t - delay)) from the delay on.

    Args:
        gain: Gain of the person [1/s].
        delay: Delay from a command to its effect [s], divided into `SMITH_STEPS`.
        end: [s]
    """
    dt = delay / SMITH_STEPS
    predictor = Predictor(_person(gain), LIMITLESS)
    on_the_way = deque([0.0] * SMITH_STEPS, maxlen=SMITH_STEPS)
    position = 0.0
    places = []
    for step in range(round(end / dt)):
        velocity, _ = predictor.point(PointView(step * dt, _cursor(position, 1.0), delay))
        position += on_the_way[0] * dt
        on_the_way.append(velocity)
        places.append(position)
    return places


def _person(gain: float = 1.0) -> Person:
    """Return a person of that gain [1/s] in a loop that no margin keeps stable."""
    return replace(median_person(Population()), pointing=gain, margin=_NO_LIMIT, pace=1.0)


def _cursor(x: float, target: float) -> Sighting:
    """Return a cursor on a line, and a target that stands still [m]."""
    return Sighting(
        tick=0,
        x=x,
        y=0.0,
        vx=0.0,
        vy=0.0,
        target_x=target,
        target_y=0.0,
        target_vx=0.0,
        target_vy=0.0,
        tolerance=0.0,
    )
