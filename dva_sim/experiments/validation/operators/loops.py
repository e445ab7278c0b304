"""Delayed loops on their own: where they become unstable, and what a prediction makes of one.

The loops are closed with the project's own laws and geometry and stepped in time; theory is only
what they are compared with.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from dva_sim.agents.operator.person import Population, median_person
from dva_sim.agents.operator.strategies.cursor import Sighting, towards
from dva_sim.agents.steering import Route

STEPS = 200  # of time in a delay
SMITH_STEPS = 2000  # the same under a Smith predictor
DELAYS = 80  # a run lasts so many of them
BISECTIONS = 14

Loop = Callable[[float], Sequence[float]]
"""What a loop does with a parameter: the error at each step."""


def critical(loop: Loop, low: float, high: float) -> float:
    """The parameter at which the errors of a loop neither grow nor die away, by bisection.

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
    """Whether the last eighth swings farther than the second; the first is the start."""
    swings = np.abs(np.asarray(errors))
    eighth = len(swings) // 8
    return bool(swings[-eighth:].max() > swings[eighth : 2 * eighth].max())


def integrator(gain_delay: float) -> list[float]:
    """A cursor brought to its target by the law of all strategies, seen a delay of 1 late.

    What is seen holds for a step, so half a step more would pass on average; the mean of two
    neighbouring frames takes that off.
    """
    dt, person = 1.0 / STEPS, median_person(Population())
    person = replace(person, pointing=gain_delay, margin=math.inf)
    frames = deque([1.0] * (STEPS + 1), maxlen=STEPS + 1)
    place, places = 1.0, []
    for _ in range(DELAYS * STEPS):
        x = 0.5 * (frames[0] + frames[1])
        seen = Sighting(0, x, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        place += towards(seen, 1.0, person, math.inf)[0] * dt
        frames.append(place)
        places.append(place)
    return places


def pure_pursuit(speed_delay: float) -> list[float]:
    """A robot that pursues a point a look-ahead of 1 m ahead on a straight line, seen 1 s late.

    Args:
        speed_delay: Speed x delay over look-ahead: as both are one, the speed [m/s].

    Returns:
        Distance from the line, signed, step by step [m].
    """
    dt, speed = 1.0 / STEPS, speed_delay
    route = Route(np.array([[0.0, 0.0], [2.0 * DELAYS, 0.0]]))
    x, y, heading = 1.0, 1e-3, 0.0
    frames, errors = deque([(x, y, heading)] * STEPS, maxlen=STEPS), []
    for _ in range(DELAYS * STEPS):
        ahead = route.ahead(*frames[0], 1.0)
        turn = speed * 2.0 * math.sin(ahead.bearing) / ahead.distance
        middle = heading + 0.5 * turn * dt
        x, y = x + speed * math.cos(middle) * dt, y + speed * math.sin(middle) * dt
        heading += turn * dt
        frames.append((x, y, heading))
        errors.append(y)
    return errors


def linear_pursuit(speed_delay: float) -> list[float]:
    """The same for small errors: heading' = -2 v/L (y/L + heading), y' = v heading."""
    dt, speed = 1.0 / STEPS, speed_delay
    y, heading, errors = 1e-3, 0.0, []
    frames = deque([(y, heading)] * STEPS, maxlen=STEPS)
    for _ in range(DELAYS * STEPS):
        seen_y, seen_heading = frames[0]
        turn = -2.0 * speed * (seen_y + seen_heading)
        y += speed * (heading + 0.5 * turn * dt) * dt
        heading += turn * dt
        frames.append((y, heading))
        errors.append(y)
    return errors


def smith_response(gain: float, delay: float, end: float) -> list[float]:
    """Where an integrator under a Smith predictor is, step by step after a unit step is asked for.

    The predictor adds to what is seen what was asked for since and cannot be seen yet, so the
    loop is closed on the present: y(t) = 1 - exp(-gain (t - delay)) from the delay on.

    Args:
        gain: [1/s]
        delay: Between a command and its effect [s]; a step is a part of it, see `SMITH_STEPS`.
        end: [s]
    """
    dt = delay / SMITH_STEPS
    on_the_way = deque([0.0] * SMITH_STEPS, maxlen=SMITH_STEPS)
    place, coming, places = 0.0, 0.0, []
    for _ in range(round(end / dt)):
        command = gain * (1.0 - (place + coming))
        arriving = on_the_way[0]
        on_the_way.append(command)
        place += arriving * dt
        coming += (command - arriving) * dt
        places.append(place)
    return places
