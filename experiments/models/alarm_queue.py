"""An example of an own model: alarms wait for guards, without any place or way.

Copy this file, change it, name it in a scenario: `model: alarm_queue.py:AlarmQueue`.
`dva-sim check model alarm_queue.py:AlarmQueue` tells whether it keeps what every model promises.

With exponential services this is the queue M/M/c, whose mean wait Erlang's C formula gives.
"""

from typing import Annotated

from pydantic import Field

from dva_sim.kernel.config import Key
from dva_sim.kernel.measure import Measure
from dva_sim.kernel.streams import Streams
from dva_sim.simulation.models import Model, OwnScenario


class AlarmScenario(OwnScenario):
    """Keys of a run.

    Attributes:
        guards: Number of guards.
        between_s: Mean time from one alarm to the next.
        service_s: Mean time that a guard needs for one.
        alarms: Number of alarms in a run.
    """

    guards: Annotated[int, Field(ge=1, le=100), Key("guards")] = 2
    between_s: Annotated[float, Field(gt=0), Key("mean time between alarms")] = 100.0
    service_s: Annotated[float, Field(gt=0), Key("mean service time")] = 120.0
    alarms: Annotated[int, Field(ge=1, le=100_000)] = 2000


COLUMNS = {
    "runs": (
        Measure("wait_mean_s", "time from an alarm until a guard sets out, mean"),
        Measure("wait_p95_s", "percentile 95 of this time"),
        Measure("busy_share", "share of the time that guards are at work, mean over guards"),
        Measure("simulated_s", "virtual time simulated"),
    ),
    "alarms": (
        Measure("t_alarm_s", "when it came"),
        Measure("wait_s", "until a guard set out"),
        Measure("service_s", "that the guard needed"),
    ),
}


class AlarmQueue(Model):
    """Alarms come at random and wait for the guard who is free first."""

    scenario = AlarmScenario
    columns = COLUMNS

    def complete(self, scenario, error):
        """Refuse a team whose queue would grow without end."""
        load = scenario.service_s / (scenario.between_s * scenario.guards)
        if load >= 1:
            raise error(f"the guards have {load:.2f} times the work they can do", ("guards",))
        return scenario

    def simulate(self, scenario, seed):
        """One row for each alarm, in order."""
        streams = Streams(seed)
        times = streams["alarms"].exponential(scenario.between_s, scenario.alarms).cumsum()
        services = streams["services"].exponential(scenario.service_s, scenario.alarms)
        free, rows = [0.0] * scenario.guards, []
        for time, service in zip(times.tolist(), services.tolist(), strict=True):
            begins = max(time, min(free))
            free[free.index(min(free))] = begins + service
            rows.append({"t_alarm_s": time, "wait_s": begins - time, "service_s": service})
        return {"alarms": rows, "guards": scenario.guards, "until": max(free)}

    def rows(self, recording, with_tracks=False):
        """The one row of the run, and its alarms."""
        alarms, until = recording["alarms"], recording["until"]
        waits = sorted(alarm["wait_s"] for alarm in alarms)
        busy = sum(alarm["service_s"] for alarm in alarms)
        run = {
            "wait_mean_s": sum(waits) / len(waits),
            "wait_p95_s": waits[int(0.95 * (len(waits) - 1))],
            "busy_share": busy / (recording["guards"] * until),
            "simulated_s": until,
        }
        return {"runs": [run], "alarms": alarms}
