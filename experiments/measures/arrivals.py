"""Measures of whether somebody came, for runs in which the DVA may die before it hears of an event.

The measures of a run count events that the DVA knew of; these count all that were noticed. Who
confirms an event has come: where no arrival was heard of, as in an outage, the confirmation counts.
"""

import math

from dva_sim.kernel.measure import Measure
from dva_sim.simulation.run_measures import RunMeasure


def waits(recording):
    """Yield from each notice to somebody on scene [s]; None where nobody came."""
    for number, incident in enumerate(recording.incidents):
        if incident.detected < recording.scenario.horizon_s:
            event = recording.event_of(number)
            times = {} if event is None else event.times
            came = times.get("arrived", times.get("confirmed"))
            yield None if came is None else came - incident.detected


class NoticedResponse(RunMeasure):
    """Mean time from the notice of an event to somebody on scene; the horizon where nobody came."""

    about = Measure(
        "noticed_response_mean_s",
        "notice by a detector or caller to somebody on scene, mean; the horizon where never",
        title="restricted mean time from notice to response",
    )

    def of(self, recording):
        """Return the mean [s]; None without events."""
        horizon = recording.scenario.horizon_s
        all_waits = [horizon if wait is None else wait for wait in waits(recording)]
        return math.fsum(all_waits) / len(all_waits) if all_waits else None


class Unattended(RunMeasure):
    """Share of the noticed events to which nobody came before the end of the run."""

    about = Measure(
        "unattended_share",
        "share of the noticed events to which nobody came",
        title="share of events unattended",
        low=0,
        high=1,
    )

    def of(self, recording):
        """Return the share; None without events."""
        all_waits = list(waits(recording))
        return all_waits.count(None) / len(all_waits) if all_waits else None
