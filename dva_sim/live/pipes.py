"""Pipes that carry the lines of a live run's parts, each read by a thread."""

from __future__ import annotations

import fcntl
import os
import threading
from collections.abc import Callable
from contextlib import suppress

from dva_sim.live.judging import LiveJudge

PIPE_BYTES = 1024 * 1024  # capacity of a pipe


class Inlets:
    """Pipes that parts write lines into, each read by a thread.

    Args:
        keep: Callback that keeps whole lines; None: they are not kept.
        judge: Callback that judges whole lines; None: they are not judged.
        also: Further callback for whole lines, called last; optional.
    """

    def __init__(
        self,
        keep: Callable[[bytes], object] | None = None,
        judge: LiveJudge | None = None,
        also: Callable[[bytes], object] | None = None,
    ) -> None:
        self._takers = (keep, judge)
        self._also = also
        self._threads: list[threading.Thread] = []

    def inlet(self) -> int:
        """Return the writing end of a new pipe; the caller closes it."""
        reads, writes = os.pipe()
        with suppress(OSError):
            fcntl.fcntl(writes, fcntl.F_SETPIPE_SZ, PIPE_BYTES)
        number = len(self._threads)
        if (judge := self._takers[1]) is not None:
            judge.joins(number)
        thread = threading.Thread(target=self._take, args=(number, reads), daemon=True)
        self._threads.append(thread)
        thread.start()
        return writes

    def _take(self, number: int, reads: int) -> None:
        """Pass on whole lines until the part has ended, even by a crash."""
        unfinished = b""
        keep, judge = self._takers
        while data := os.read(reads, 1 << 18):
            lines, _, unfinished = (unfinished + data).rpartition(b"\n")
            if lines and keep is not None:
                keep(lines + b"\n")
            if lines and judge is not None:
                judge.hear(number, lines.split(b"\n"))
            if lines and self._also is not None:
                self._also(lines)
        os.close(reads)
        if judge is not None:
            judge.leaves(number)

    def join(self) -> None:
        """Wait until all parts have ended."""
        for thread in self._threads:
            thread.join()
