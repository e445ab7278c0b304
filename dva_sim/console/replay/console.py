"""A recording, or those of a study, in the browser: from the start to Ctrl-C."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from dva_sim.cameras.children import ChildFailed
from dva_sim.console.pages.page_options import PageOptions
from dva_sim.console.pages.processes import ConsoleProcesses
from dva_sim.console.replay.player import Player, playing
from dva_sim.console.replay.recorded_run import RecordedRun
from dva_sim.console.replay.shelf import Shelf
from dva_sim.live.process import ending_when_asked
from dva_sim.live.recorded_lines import readable
from dva_sim.recordings.reading import read_recording

Say = Callable[[str], object]


@dataclass(frozen=True, kw_only=True)
class ReplayOptions(PageOptions):
    """Options of a replay: recording, and address of its page.

    Attributes:
        file: A recording, or the lines of a run that was killed; None: those of `results`.
        results: Folder of a study whose recordings can be chosen.
    """

    file: Path | None = None
    results: Path | None = None

    def player(self) -> Player:
        """Return the player.

        Raises:
            DvaSimError: there is no such recording, or none at all.
        """
        shelf = None if self.results is None else Shelf(self.results)
        if self.file is None:
            return Player(None, shelf)
        with readable(self.file) as file:
            return Player(RecordedRun(read_recording(file), self.file.name), shelf)


def show_replay(options: ReplayOptions, say: Say) -> None:
    """Show it until Ctrl-C, SIGTERM, or the end of the web process.

    Args:
        options: Recording and addresses.
        say: Prints a line.

    Raises:
        DvaSimError: there is no such recording, or none at all.
        ChildFailed: the web process could not begin, or has ended by itself.
    """
    processes = ConsoleProcesses(options, say)
    with (
        playing(options.player()) as player,
        ending_when_asked(player.clock, supervised=False) as ending,
    ):
        report = None if player.shelf is None else player.shelf.report
        try:
            processes.start(player, player.take, report, player.audit.path)
            if not ending.is_asked:
                player.clock.go()
                player.clock.run()
            player.tell({"k": "bye", "t": 0, "why": "the console was ended"})
        finally:
            processes.end()
    if processes.failed:
        raise ChildFailed(processes.failed)
