"""A console's world in virtual time that keeps a recording."""

import os
from pathlib import Path

from helpers.console.simulated_phone import PhonePage

from dva_sim.console.world.world import TIDY
from dva_sim.live.kept_facts import keep_run
from dva_sim.live.recording import Keeper, LiveRecorder
from dva_sim.serving.pipes import PipeEnd


class RecordedPage:
    """A page whose world is recorded from its start.

    Args:
        page: The page.
        path: File of the recording.
    """

    def __init__(self, page: PhonePage, path: Path) -> None:
        world = page.world
        self._keeper = Keeper(path, world.scenario, world.seed)
        self._outlet = PipeEnd(os.dup(inlet := self._keeper.inlet()))
        os.close(inlet)
        world.recorder.kept = LiveRecorder(world.clock, self._outlet)
        world.recorder.kept.is_own = world.is_ours
        keep_run(world.run, world.recorder.kept)
        world.clock.every(TIDY, world.recorder.tidy)

    def finish(self) -> None:
        """Write the recording."""
        self._outlet.close()
        assert self._keeper.finish() is None
