"""Registration: what a confirmatory run will be, fixed before anything of it is run."""

from __future__ import annotations

from dva_sim.experiments.study import Study


def settled(study: Study) -> Study:
    """The study with the status that its registration, or what was changed, gives it."""
    return study
