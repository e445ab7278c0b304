"""A DVA that is killed and restarted from its memory, and a disk that may be full."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from pathlib import Path

from dva_sim.core.store import Store
from dva_sim.network.virtual_network import VirtualNetwork
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.stage import DVA


class Killed(BaseException):
    """The process of the DVA ends here; nothing of what it was about to do happens."""


class DvaLives:
    """Kills and restarts the DVA of a run, and fills the disk that its memory is on.

    Args:
        file: Its memory.
        down: Called with True when it is killed, and with False when it is back.

    Attributes:
        memory: Memory since the last restart.
        kills: Number of kills.
        full: Number of faults that keep the disk full now.
        lost: Time for which the last life could write nothing before it was killed [s].
    """

    def __init__(self, file: Path, down: Callable[[bool], object]) -> None:
        self._down = down
        self._file, self.kills, self.full, self.lost = file, 0, 0, 0.0
        self._wrote_at = 0.0
        self._run: Run | None = None
        self._away, self._is_away = 0.0, False
        self._writes_left: int | None = None
        self.memory = self._opened()

    def _opened(self) -> Store:
        self._writes_left, memory = None, Store(self._file)
        memory.between_writes = self._between_writes
        return memory

    def _between_writes(self) -> None:
        """Fail as the disk does, or end the process."""
        if self._writes_left is not None:
            self._writes_left -= 1
            if self._writes_left < 0:
                raise Killed
        if self.full:
            raise sqlite3.OperationalError("database or disk is full")
        if self._run is not None:
            self._wrote_at = self._run.clock.now

    def begin(self, run: Run) -> None:
        """Take over the DVA of a run that was made with this memory."""
        self._run = run

    def kill(self, away: float) -> None:
        """Kill it now; it is back after so many seconds."""
        run = self._run
        assert run is not None
        if self._is_away:
            return
        self.kills, self._is_away = self.kills + 1, True
        self.lost = run.clock.now - self._wrote_at if self.full else 0.0
        assert isinstance(run.network, VirtualNetwork)
        run.network.leave(DVA)
        run.dva.crash()
        self._down(True)
        run.clock.call_after(away, self._back)

    def kill_at_write(self, number: int, away: float) -> None:
        """Kill it at one of its next writes; nothing of that write remains."""
        self._writes_left, self._away = number, away

    def survive(self, until: float) -> None:
        """Let time pass, through any death in the midst of a write."""
        run = self._run
        assert run is not None
        while True:
            try:
                run.clock.run(until)
            except Killed:
                self.kill(self._away)
            else:
                return

    def _back(self) -> None:
        run = self._run
        assert run is not None
        self._is_away = False
        self.memory = self._opened()
        run.start_dva(self.memory)
        assert isinstance(run.network, VirtualNetwork)
        run.network.come_back(DVA)
        self._down(False)
