"""Answers that nobody measured on persons: theory, the dissertation's app, standards.

Delayed loops on their own: where they become unstable, and what a prediction makes of one. The
strategies close the loops themselves, stepped in time; theory is only what they are compared with.
Who steers is the person in the middle of the population, but for the limits that keep it from
unstable loops: those are far away.

The dissertation's filter on its own: how old its values are, and how it freezes and ratchets. The
app takes the value when 20 samples have come or the longest delay has passed, and what it takes
stands until the next time. Samples come evenly; the filters are those of the phone.

Fires, alarms, walkers, plumes and helpers are asked for the numbers of standards and textbooks.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from dva_sim.agents.observation import Observation
from dva_sim.agents.operator.strategies.base import PointView, Strategy
from dva_sim.agents.operator.strategies.cursor import Sighting
from dva_sim.agents.operator.strategies.predictor import Predictor
from dva_sim.agents.operator.strategies.pursuit import Pursuit
from dva_sim.agents.people.profiles import GuardProfile, Walker
from dva_sim.agents.population import Person, Population, median_person
from dva_sim.agents.route_following import NEAREST_LOOK, Reach, Route, View
from dva_sim.agents.tilt.filters import BATCH, Filter, load_filter
from dva_sim.kernel import resources
from dva_sim.kernel.config import validate
from dva_sim.kernel.streams import Streams
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.simulation.shift import scenario as timed
from dva_sim.simulation.shift import simulate_timed
from dva_sim.worlds.hazards import GROWTH_S, Fire, make_hazard
from dva_sim.worlds.hazards.detectors import CoAlarm
from dva_sim.worlds.hazards.fire import FULL_GROWTH_KW
from dva_sim.worlds.hazards.gas_plume import sigma_y

STEPS = 200  # of time in a delay
SMITH_STEPS = 500  # the same under a Smith predictor
DELAYS = 80  # a run lasts so many of them
BISECTIONS = 14
_FAR = 1e6  # a limit that is never reached
LIMITLESS = Reach(speed=_FAR, turn_rate=_FAR)

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
    """A cursor that a strategy brings to its target by the crossover law, seen a delay of 1 late.

    What is seen holds for a step, so half a step more would pass on average; the mean of two
    neighbouring frames takes that off.
    """
    dt, strategy = 1.0 / STEPS, Strategy(_person(gain_delay), LIMITLESS)
    frames = deque([1.0] * (STEPS + 1), maxlen=STEPS + 1)
    place, places = 1.0, []
    for step in range(DELAYS * STEPS):
        x = 0.5 * (frames[0] + frames[1])
        place += strategy.point(PointView(step * dt, _cursor(x, 0.0), 1.0))[0] * dt
        frames.append(place)
        places.append(place)
    return places


def pure_pursuit(speed_delay: float) -> list[float]:
    """A robot that `Pursuit` drives along a straight line, seen 1 s late.

    The look-ahead is the nearest that there is.

    Args:
        speed_delay: Speed x delay over look-ahead.

    Returns:
        Distance from the line, signed, step by step [m].
    """
    dt, speed = 1.0 / STEPS, speed_delay * NEAREST_LOOK
    pursuit = Pursuit(replace(_person(), caution=_FAR), Reach(speed, _FAR))
    route = Route(np.array([[0.0, 0.0], [2.0 * DELAYS, 0.0]]))
    x, y, heading = 1.0, 1e-3, 0.0
    frames, errors = deque([(x, y, heading)] * STEPS, maxlen=STEPS), []
    for step in range(DELAYS * STEPS):
        seen = Observation(0, *frames[0], 0.0, 0.0, ())
        wanted = pursuit.drive(route, View(step * dt, seen, 1.0), 0.0)
        middle = heading + 0.5 * wanted.turn_rate * dt
        x, y = x + wanted.speed * math.cos(middle) * dt, y + wanted.speed * math.sin(middle) * dt
        heading += wanted.turn_rate * dt
        frames.append((x, y, heading))
        errors.append(y)
    return errors


def smith_response(gain: float, delay: float, end: float) -> list[float]:
    """Where a cursor that `Predictor` steers is, step by step after a target appears 1 m away.

    The predictor adds to what is seen what was asked for since and cannot be seen yet, so the
    loop is closed on the present: y(t) = 1 - exp(-gain (t - delay)) from the delay on.

    Args:
        gain: Of the person [1/s].
        delay: Between a command and its effect [s]; a step is a part of it, see `SMITH_STEPS`.
        end: [s]
    """
    dt = delay / SMITH_STEPS
    predictor = Predictor(_person(gain), LIMITLESS)
    on_the_way = deque([0.0] * SMITH_STEPS, maxlen=SMITH_STEPS)
    place, places = 0.0, []
    for step in range(round(end / dt)):
        velocity, _ = predictor.point(PointView(step * dt, _cursor(place, 1.0), delay))
        place += on_the_way[0] * dt
        on_the_way.append(velocity)
        places.append(place)
    return places


def _person(gain: float = 1.0) -> Person:
    """A person of that gain [1/s] in a loop that no margin keeps stable."""
    return replace(median_person(Population()), pointing=gain, margin=_FAR, pace=1.0)


def _cursor(x: float, target: float) -> Sighting:
    """A cursor on a line, and a target that stands still [m]."""
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


Values = dict[str, float]

RATE = 34.0  # samples per second: 17 in 500 ms, as its tablet managed
COPY, IN_PLACE = "median20-copy", "median20-inplace"
STEP_LOOK = 0.2  # [s]
STEP_LEVELS = [2.0] * 102 + [8.0] * 102 + [2.0] * 204  # 3 s, 3 s, 6 s
BATCHES = 20_000  # of noise


def ages() -> Values:
    """Mean age of the command in force, with a longest delay of 0.5 s [s].

    The input rises steadily, so what is in force tells from when it is. `clean`: the median over
    the fresh samples alone. `stale`: over the whole buffer, 3 of whose 20 slots are not fresh.
    """
    fresh = round(0.5 * RATE)
    clean = load_filter("median", {"window": fresh})(1.0 / RATE)
    stale = load_filter(COPY)(1.0 / RATE)
    return {"clean": _mean_age(clean, 0.5), "stale": _mean_age(stale, 0.5)}


def steps() -> Values:
    """What the two variants make of a level of 2, then 8, then 2, with a longest delay of 0.2 s."""
    copy, in_place = step_outputs(COPY), step_outputs(IN_PLACE)
    return {"copy": max(copy), "rises": max(in_place), "never-returns": in_place[-1]}


def step_outputs(name: str) -> list[float]:
    """What a filter makes of that, look by look, `STEP_LOOK` apart."""
    return _outputs(load_filter(name)(1.0 / RATE), STEP_LEVELS, STEP_LOOK)


def smoothing(seed: int) -> Values:
    """Standard deviation of white noise behind a median of 20 fresh samples, before it being 1."""
    noise = Streams(seed).fresh("noise").normal(size=BATCHES * BATCH)
    outputs = _outputs(load_filter(COPY)(1.0 / RATE), noise.tolist(), BATCH / RATE)
    return {"ratio": float(np.std(outputs))}


def _mean_age(filter_: Filter, longest: float) -> float:
    """On a ramp of one per second, over whole periods between two looks [s]."""
    samples = [n / RATE for n in range(1, round(40 * RATE) + 1)]
    values, period = _outputs(filter_, samples, longest), _period(longest)
    taken = [period * (look + 1) for look in range(len(values))]
    old = [then + 0.5 * period - value for then, value in zip(taken, values, strict=True)]
    return float(np.mean(old[5:]))


def _outputs(filter_: Filter, samples: list[float], longest: float) -> list[float]:
    """The value at each look at the filter."""
    values, due, looks = [], 0, 1
    while due < len(samples):
        end = int(looks * _period(longest) * RATE + 1e-9)
        for sample in samples[due:end]:
            filter_.add((sample, 0.0))
        values.append(filter_.value()[0])
        due, looks = end, looks + 1
    return values


def _period(longest: float) -> float:
    """Between two looks [s]."""
    return min(longest, BATCH / RATE)


Floats = NDArray[np.float64]

PERSONS = 20_000
HELP = "outside-help"
HELP_S = 2.4e7  # simulated of it: some 6600 calls of each kind
LATEST = 8 * 3600.0  # no alarm within a shift is none [s]
PPM = (30, 50, 100, 300)


def fires() -> Values:
    """When each class of fire has grown to 1055 kW [s]."""
    times = np.arange(0.0, 700.0, 0.05)
    found = {}
    for growth in GROWTH_S:
        fire = make_hazard("fire", (0.0, 0.0), 0.0, growth=growth)
        assert isinstance(fire, Fire)
        heat = np.array([fire.heat_release(float(t)) for t in times])
        found[growth] = float(times[np.argmax(heat >= FULL_GROWTH_KW * (1.0 - 1e-9))])
    return found


def helpers(seed: int) -> Values:
    """The times within which nine in ten turn out, and arrive [s].

    Turnout to a fire is that of the guards, to a patient that of an ambulance, which drives.
    """
    document = load_yaml(resources.find(HELP, "experiments/scenarios"))
    recording = simulate_timed(timed.build(document, {"horizon_s": HELP_S}), seed)
    row, names = recording.columns, recording.streams
    came = np.isfinite(row["arrived"])
    assigned, departed, arrived = (
        np.asarray(row[name][came], dtype=float) for name in ("assigned", "departed", "arrived")
    )
    turnout, travel = departed - assigned, arrived - departed
    stream = np.asarray(names)[row["stream"][came].astype(int)]
    rng, guard = Streams(seed).fresh("guards"), _guard()
    guards = np.array([Walker.draw(guard, rng).mobilisation for _ in range(PERSONS)])
    return {
        "turnout-fire": _nine_in_ten(guards),
        "turnout-ems": _nine_in_ten(turnout[stream == "patients"]),
        "travel": _nine_in_ten(travel),
    }


def alarms() -> Values:
    """When a carbon monoxide alarm sounds in air of so many ppm [min]; never: infinite."""
    return {str(ppm): _alarm_time(float(ppm)) / 60.0 for ppm in PPM}


def walkers(seed: int) -> Values:
    """Mean and standard deviation of the free walking speed of guards [m/s]."""
    rng, guard = Streams(seed).fresh("walkers"), _guard()
    speeds = [Walker.draw(guard, rng).speed for _ in range(PERSONS)]
    return {"mean": float(np.mean(speeds)), "sd": float(np.std(speeds, ddof=1))}


def plumes() -> Values:
    """Width of a plume 1 km downwind by stability class [m]."""
    return {stability: sigma_y(stability, 1000.0) for stability in "ABCDEF"}


def _guard() -> GuardProfile:
    document = load_yaml(resources.find("guard", "agents/people"))
    return validate(GuardProfile, document.data, document.error)


def _nine_in_ten(times: Floats) -> float:
    return float(np.quantile(times, 0.9))


def _alarm_time(ppm: float) -> float:
    alarm, dt = CoAlarm(), 1.0
    steps = round(LATEST / dt)
    return next(((n + 1) * dt for n in range(steps) if alarm.add(ppm, dt)), np.inf)


SMITH = 4.0, 0.5, 1.5  # gain [1/s], delay [s] and time of the look at it [s]

EXACT: dict[str, Callable[[int], Values]] = {
    "S1": lambda seed: {"critical": critical(integrator, 1.0, 2.2)},
    "S2": lambda seed: {"critical": critical(pure_pursuit, 0.3, 0.8)},
    "S3": lambda seed: {"response": smith_response(*SMITH)[-1]},
    "S4": lambda seed: ages(),
    "S5": lambda seed: steps(),
    "S6": smoothing,
    "S16": lambda seed: fires(),
    "S16b": helpers,
    "S16c": lambda seed: alarms(),
    "S16d": walkers,
    "S16e": lambda seed: plumes(),
}
"""How each exact check is simulated, given the seed of all luck."""
