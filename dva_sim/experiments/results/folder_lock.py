"""One writer at a time in a results folder, by a lock that the operating system releases.

The lock belongs to the process, not to the file: when a process ends, however it does, the kernel
releases its lock, and the file that is left blocks nobody.

Between machines the lock holds where the file system passes it on: NFS does if its server runs a
lock manager (version 4 always). Where locks are not supported at all, nobody is refused; the
journal of a study still keeps each run once.
"""

from __future__ import annotations

import fcntl
import os
import shlex
import socket
import sys
import time
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Final, Self

from dva_sim.kernel.errors import ConfigError, DvaSimError

LOCK: Final = ".lock"
_LONGEST: Final = 120  # characters of a command


class FolderInUse(DvaSimError):
    """Another process writes into the folder."""


class FolderLock:
    """The right to write into a results folder, until it is closed or the process ends.

    Args:
        folder: The folder; it is made if need be.

    Raises:
        FolderInUse: another process has it; the message says which.
        ConfigError: it is a file.
        DvaSimError: it cannot be written.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / LOCK
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._file: int | None = self._taken()
        except (FileExistsError, NotADirectoryError):
            raise ConfigError(f"{folder} is a file; give a folder for the results") from None
        except OSError as error:
            raise DvaSimError(f"{folder} cannot be written: {error.strerror}") from None

    def _taken(self) -> int:
        """Return the open file, locked; opened again if its last owner removed it meanwhile."""
        while True:
            file = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o666)
            try:
                if _locked(file, self._path) and not _is(file, self._path):
                    os.close(file)
                    continue
                with suppress(OSError):  # a full disk: the lock holds without its text
                    os.truncate(file, 0)
                    os.write(file, _myself().encode())
            except BaseException:
                os.close(file)
                raise
            return file

    def close(self) -> None:
        """Let others write into the folder."""
        if self._file is not None:
            file = self._file
            self._file = None
            with suppress(OSError):
                self._path.unlink()
            os.close(file)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        at: TracebackType | None,
    ) -> None:
        self.close()


def _locked(file: int, path: Path) -> bool:
    """Lock an open file; False where the file system has no locks.

    Raises:
        FolderInUse: another process has the lock.
    """
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        owner = os.pread(file, 4096, 0).decode(errors="replace").strip() or "another process"
        raise FolderInUse(
            f"{path.parent} is being written by {owner}; let it end first, or give another folder"
        ) from None
    except OSError:
        return False
    return True


def _is(file: int, path: Path) -> bool:
    """Return True if a path still refers to an open file."""
    try:
        return os.path.samestat(os.fstat(file), path.stat())
    except FileNotFoundError:
        return False


def _myself() -> str:
    command = shlex.join([Path(sys.argv[0]).name or "python", *sys.argv[1:]])
    if len(command) > _LONGEST:
        command = f"{command[:_LONGEST]}..."
    since = time.strftime("%Y-%m-%d %H:%M:%S")
    return f"process {os.getpid()} on {socket.gethostname()} since {since} ({command})"
