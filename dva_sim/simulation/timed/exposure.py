"""Exposure: time of a guard within the danger radius of the event it is sent to.

Only that event counts, and the way still to go stands for the distance: the last metres lead
straight there. On the scene the guard is within the radius until it leaves or the danger is
over. Who stands by keeps outside.
"""

from __future__ import annotations

from dva_sim.simulation.timed.incidents import Incident

HALVINGS = 30


def approach(incident: Incident, start: float, left: float, speed: float, until: float) -> float:
    """Time within the danger radius on the way there, or on a part of it [s].

    The radius grows while the way shrinks, so the border is crossed once.

    Args:
        incident: Destination.
        start: Departure time [s].
        left: Distance left at departure [m].
        speed: [m/s]
        until: End of the approach or of its part [s].
    """

    def inside(now: float) -> bool:
        return left - speed * (now - start) < incident.danger_radius(now)

    if until <= start or not inside(until):
        return 0.0
    if inside(start):
        return until - start
    outside = start
    within = until
    for _ in range(HALVINGS):
        middle = 0.5 * (outside + within)
        outside, within = (outside, middle) if inside(middle) else (middle, within)
    return until - within


def on_scene(incident: Incident, start: float, until: float) -> float:
    """Return the exposure at the place of an incident, between two moments [s]."""
    if not incident.true or until <= start:
        return 0.0
    return max(0.0, min(until, incident.over) - start)


def leaving(incident: Incident, now: float, speed: float) -> float:
    """Time to get out of the danger radius again [s]."""
    return incident.danger_radius(now) / speed
