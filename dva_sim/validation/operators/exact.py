"""Answers that no task is needed for: theory, the dissertation's app, standards, turnout.

Fires, alarms, walkers, plumes and helpers are asked for the numbers of standards, textbooks and
services.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from dva_sim.agents.people.profiles import GuardProfile, Walker
from dva_sim.kernel import resources
from dva_sim.kernel.config import validate
from dva_sim.kernel.streams import Streams
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.simulation.timed import scenario as timed
from dva_sim.simulation.timed import simulate_timed
from dva_sim.validation.operators.app_filters import ages, smoothing, steps
from dva_sim.validation.operators.control_loops import (
    critical,
    integrator,
    pure_pursuit,
    smith_response,
)
from dva_sim.worlds.hazards import GROWTH_S, Fire, make_hazard
from dva_sim.worlds.hazards.detectors import CoAlarm
from dva_sim.worlds.hazards.fire import FULL_GROWTH_KW
from dva_sim.worlds.hazards.gas_plume import sigma_y

"""Response of a loop to a parameter: the error at each step."""


Values = dict[str, float]


Floats = NDArray[np.float64]

PERSONS = 20_000
HELP = "outside-help"
HELP_S = 2.4e7  # simulated time of the helpers [s]: about 6600 calls of each kind
LATEST = 8 * 3600.0  # time after which an alarm counts as missing: a shift [s]
PPM = (30, 50, 100, 300)


def fires() -> Values:
    """Return times at which each class of fire reaches 1055 kW [s]."""
    times = np.arange(0.0, 700.0, 0.05)
    times_s = {}
    for growth in GROWTH_S:
        fire = make_hazard("fire", (0.0, 0.0), 0.0, growth=growth)
        assert isinstance(fire, Fire)
        heat = np.array([fire.heat_release(float(t)) for t in times])
        times_s[growth] = float(times[np.argmax(heat >= FULL_GROWTH_KW * (1.0 - 1e-9))])
    return times_s


def helpers(seed: int) -> Values:
    """Return the times within which nine in ten turn out, and arrive [s].

    Turnout to a fire is that of the guards, to a patient that of an ambulance, which drives.
    """
    document = load_yaml(resources.find(HELP, "experiments/scenarios"))
    recording = simulate_timed(timed.build(document, {"horizon_s": HELP_S}), seed)
    row = recording.columns
    names = recording.streams
    came = np.isfinite(row["arrived"])
    assigned, departed, arrived = (
        np.asarray(row[name][came], dtype=float) for name in ("assigned", "departed", "arrived")
    )
    setting_out = departed - assigned
    travel = arrived - departed
    stream = np.asarray(names)[row["stream"][came].astype(int)]
    return {
        "turnout-fire": _nine_in_ten(_guards_turnout(seed)),
        "turnout-ems": _nine_in_ten(setting_out[stream == "patients"]),
        "travel": _nine_in_ten(travel),
    }


def turnout(seed: int) -> Values:
    """Return the median and the 90th percentile of the turnout of guards [s]."""
    times = _guards_turnout(seed)
    return {"median": float(np.median(times)), "ninth": _nine_in_ten(times)}


def _guards_turnout(seed: int) -> Floats:
    rng = Streams(seed).fresh("guards")
    guard = guard_profile()
    return np.array([Walker.draw(guard, rng).mobilisation for _ in range(PERSONS)])


def alarms() -> Values:
    """Return times at which a carbon monoxide alarm sounds, by ppm [min]; infinite if never."""
    return {str(ppm): _alarm_time(float(ppm)) / 60.0 for ppm in PPM}


def walkers(seed: int) -> Values:
    """Mean and standard deviation of the free walking speed of guards [m/s]."""
    rng = Streams(seed).fresh("walkers")
    guard = guard_profile()
    speeds = [Walker.draw(guard, rng).speed for _ in range(PERSONS)]
    return {"mean": float(np.mean(speeds)), "sd": float(np.std(speeds, ddof=1))}


def plumes() -> Values:
    """Return the width of a plume 1 km downwind by stability class [m]."""
    return {stability: sigma_y(stability, 1000.0) for stability in "ABCDEF"}


def guard_profile() -> GuardProfile:
    """Return the guards of the validation."""
    document = load_yaml(resources.find("guard", "agents/people"))
    return validate(GuardProfile, document.data, document.error)


def _nine_in_ten(times: Floats) -> float:
    return float(np.quantile(times, 0.9))


def _alarm_time(ppm: float) -> float:
    alarm = CoAlarm()
    dt = 1.0
    steps = round(LATEST / dt)
    return next(((n + 1) * dt for n in range(steps) if alarm.add(ppm, dt)), np.inf)


SMITH = 4.0, 0.5, 1.5  # gain [1/s], delay [s] and time of the look at it [s]

MODEL_CHECKS: dict[str, Callable[[int], Values]] = {
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
    "I1": turnout,
    "I2": turnout,
}
"""Simulation of each check that needs no persons at work, given the random seed."""
