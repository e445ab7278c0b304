"""A recording, or those of a study, in the browser: from the start to Ctrl-C."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from dva_sim.console.pages.processes import ConsoleProcesses
from dva_sim.console.replay.player import Player, playing
from dva_sim.console.replay.recorded_run import RecordedRun
from dva_sim.console.replay.shelf import Shelf
from dva_sim.live.process import ending_when_asked
from dva_sim.live.recorded_lines import readable
from dva_sim.options.runs import PageOptions
from dva_sim.recordings.reading import read_recording
from dva_sim.serving.processes import ChildFailed

Say = Callable[[str], object]


def player_of(file: Path | None, results: Path | None) -> Player:
    """Return the player.

    Args:
        file: A recording, or the lines of a run that was killed; None: those of `results`.
        results: Folder of a study whose recordings can be chosen.

    Raises:
        DvaSimError: there is no such recording, or none at all.
    """
    shelf = None if results is None else Shelf(results)
    if file is None:
        return Player(None, shelf)
    with readable(file) as recording:
        return Player(RecordedRun(read_recording(recording), file.name), shelf)


def show_replay(
    options: PageOptions, say: Say, *, file: Path | None = None, results: Path | None = None
) -> None:
    """Show it until Ctrl-C, SIGTERM, SIGHUP, or the end of the web process.

    Args:
        options: Address of its page.
        say: Prints a line.
        file: See `player_of`.
        results: See `player_of`.

    Raises:
        DvaSimError: there is no such recording, or none at all.
        ChildFailed: the web process could not begin, or has ended by itself.
    """
    processes = ConsoleProcesses(options, say)
    with (
        playing(player_of(file, results)) as player,
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
