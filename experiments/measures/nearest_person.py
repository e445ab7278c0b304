"""An example of an own measure: copy this file, change it, name it in a study:

    measures: [nearest_person.py:NearestPerson]

`dva-sim check measure nearest_person.py:NearestPerson` tells whether it keeps what every measure
promises.
"""

import math

from dva_sim.kernel.measure import Measure
from dva_sim.simulation.run_measures import RunMeasure


class NearestPerson(RunMeasure):
    """Smallest distance between a robot and a person on foot, at the sampled times."""

    about = Measure(
        "nearest_person_m",
        "least distance between the middles of a robot and of somebody on foot",
        title="nearest that a robot came to a person",
        better="large",
    )

    def of(self, recording):
        """Return the least distance [m]; None without robots or people."""
        tracks = recording.recorder.tracks
        robots = {name for name in tracks if name.startswith("robot")}
        on_foot = {}
        for name in tracks.keys() - robots:
            for point in tracks[name]:
                on_foot.setdefault(point.time, []).append((point.x, point.y))
        gaps = [
            math.dist((point.x, point.y), place)
            for name in robots
            for point in tracks[name]
            for place in on_foot.get(point.time, ())
        ]
        return min(gaps, default=None)
