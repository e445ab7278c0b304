"""A policy of one's own: robots look, guards deal with what the robots have found."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dva_sim.core.dispatch import Advice, Assignment, Policy, Situation


class Stages(Policy):
    """Two kinds of work, each with its own queue: first come, first served in both."""

    def advise(self, situation: Situation, rng: np.random.Generator) -> Sequence[Advice]:
        """Give each task, oldest first, to somebody idle of the kind that does it."""
        idle: dict[str, list[int]] = {"robot": [], "guard": []}
        for place, who in enumerate(situation.responders):
            if who.engaged is None:
                idle[who.kind].append(place)
        del idle["robot"][situation.operators :]
        ready = [(t.waiting_since, place) for place, t in enumerate(situation.tasks) if t.due]
        advice = []
        for _, place in sorted(ready):
            stage = situation.tasks[place].stage
            team = idle["robot" if stage == "confirm" else "guard"]
            if team:
                advice.append(Assignment(place, team.pop(0)))
        return advice
