"""A dask scheduler and its workers as processes of their own, on free ports of this machine."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

from helpers.paths import PYTHON_PATH
from helpers.processes.patience import becomes

_QUIET = {"DASK_DISTRIBUTED__LOGGING__DISTRIBUTED": "critical"}


class DaskCluster:
    """Processes that share a folder; all are gone when the block ends."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._started = folder, 0
        file = folder / "scheduler.json"
        words = ["--port", "0", "--no-dashboard", "--scheduler-file", str(file)]
        self.scheduler = self._start("dask_scheduler", *words)
        self.address = str(json.loads(self._text_of(file))["address"])
        self.workers: list[subprocess.Popen[bytes]] = []

    def add_worker(self, cwd: Path | None = None) -> None:
        """One process that runs one chunk at a time and is not started again if it dies."""
        words = ["--no-nanny", "--nthreads", "1", "--no-dashboard", "--local-directory"]
        words += [str(self._folder), self.address]
        self.workers.append(self._start("dask_worker", *words, cwd=cwd))

    def _start(self, what: str, *words: str, cwd: Path | None = None) -> subprocess.Popen[bytes]:
        path = PYTHON_PATH
        self._started += 1
        with (self._folder / f"{what}-{self._started}.log").open("wb") as log:
            return subprocess.Popen(
                [sys.executable, "-m", f"distributed.cli.{what}", "--host", "127.0.0.1", *words],
                stdout=log,
                stderr=log,
                cwd=cwd or self._folder,
                env={**os.environ, "PYTHONPATH": path, **_QUIET},
            )

    def _text_of(self, file: Path) -> str:
        """Content of a file that the scheduler writes once it listens."""
        try:
            assert becomes(lambda: self.scheduler.poll() is not None or _is_whole(file))
            assert self.scheduler.poll() is None, "the scheduler has ended"
        except BaseException:
            self.scheduler.kill()
            self.scheduler.wait()
            raise
        return file.read_text()

    def __enter__(self) -> DaskCluster:
        return self

    def __exit__(self, *_: object) -> None:
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()


def _is_whole(file: Path) -> bool:
    return file.exists() and file.read_text().endswith("}")
