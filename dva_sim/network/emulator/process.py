"""An emulated link in a process of its own, for programs that are started at its ends."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
from contextlib import suppress
from types import TracebackType
from typing import Any

from typing_extensions import override

from dva_sim.network.emulator import enter, holder
from dva_sim.network.emulator.forwarder import FAR, NEAR
from dva_sim.network.emulator.linux_calls import FAR_END, NEAR_END
from dva_sim.network.emulator.needs import NEEDS, EmulatorError
from dva_sim.network.emulator.report import LinkReport
from dva_sim.network.link import LinkConfig
from dva_sim.serving.processes import Child, ChildFailed, end_all

ADDRESSES = {NEAR: NEAR_END.address, FAR: FAR_END.address}
_VARIABLES = {f"DVA_LINK_{end.upper()}": address for end, address in ADDRESSES.items()}
_SPACES = 3  # a user namespace, and a network namespace for each end
_KILLED_WITHIN_S = 10.0  # time for the kernel to end all processes of a program
_PATIENCE_S = 30.0  # time for the link to come up, and for its report


class LinkEnded(ChildFailed):
    """The process of an emulated link has ended by itself."""


class LinkedChild(Child):
    """A program at one end of an emulated link, and all that it has started (`enter`)."""

    @override
    def kill(self) -> None:
        """End all of it at once; when it has ended, nothing of it is left."""
        if self.poll() is None:
            self.send_signal(enter.KILL_ALL)
            with suppress(subprocess.TimeoutExpired):
                self.wait(_KILLED_WITHIN_S)
        super().kill()  # not of any use unless the machine is so busy that patience has ended


class LinkProcess:
    """An emulated link: a forwarder between two network namespaces.

    The link's process ends with this one, however this one ends, and the namespaces with it.

    Args:
        config: Both directions.
        seed: Random seed of losses and jitter.
        rootless: Take a user namespace also where root could do without.

    Raises:
        EmulatorError: it cannot be set up here; the line says what is missing.
    """

    def __init__(self, config: LinkConfig, seed: int, rootless: bool = False) -> None:
        if sys.platform != "linux":
            raise EmulatorError(f"the emulated link {NEEDS}; this is {sys.platform}")
        self._channel, far_socket = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._channel.settimeout(_PATIENCE_S)
        self._spaces: list[int] = []
        numbers = [str(os.getpid()), str(far_socket.fileno())]
        with far_socket:
            self._process = Child(
                "the emulated link",
                # -P: a file of the user that is called like a module of Python is not imported.
                [sys.executable, "-P", "-m", "dva_sim.network.emulator.start", *numbers],
                self._channel.close,
                pass_fds=(far_socket.fileno(),),
            )
        try:
            job = {"link": config.model_dump(mode="json"), "seed": seed, "rootless": rootless}
            self._channel.send(json.dumps(job).encode())
            try:
                data, self._spaces, *_ = socket.recv_fds(self._channel, 1 << 16, _SPACES)
            except OSError:
                data = b""
            if not data:
                raise EmulatorError(self._process.why())
            problem = json.loads(data).get("problem")
            if problem is not None:
                raise EmulatorError(f"the emulated link {NEEDS}; here {problem}")
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> LinkProcess:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        self.close()

    def fileno(self) -> int:
        """Return the file descriptor that becomes readable when the link ends by itself."""
        return self._channel.fileno()

    def begin(self) -> None:
        """Let the link's time begin now: the moment that outages and recordings count from."""
        self._send(holder.BEGIN)

    def start(
        self,
        end: str,
        words: list[str],
        name: str = "",
        keeps_errors: bool = False,
        **options: Any,
    ) -> LinkedChild:
        """Start a program at one end; it ends with this process, and all that it started with it.

        Args:
            end: `near` or `far`.
            words: Its command line.
            name: See `Child`; empty: the end at which it is.
            keeps_errors: See `Child`; False: they go where this process's go.
            options: See `subprocess.Popen`.
        """
        *user, near, far = self._spaces
        spaces = user[0] if user else None, near if end == NEAR else far
        files = [space for space in spaces if space is not None]
        options["pass_fds"] = (*options.get("pass_fds", ()), *files)
        options["env"] = {**options.get("env", os.environ), **_VARIABLES}
        called = enter.words_of(*spaces, words)
        return LinkedChild(
            name or f"the {end} program", called, keeps_errors=keeps_errors, **options
        )

    def report(self) -> LinkReport:
        """End the link, and count what became of its packets.

        Raises:
            LinkEnded: it has ended by itself.
        """
        self._send(holder.END)
        with suppress(OSError):
            data = self._channel.recv(1 << 16)
            if data:
                return LinkReport.from_json(data.decode())
        raise self.ended()

    @property
    def has_ended(self) -> bool:
        """True if it has ended by itself."""
        return self._process.poll() is not None

    def ended(self) -> LinkEnded:
        """Make the error of a link that has ended by itself."""
        return LinkEnded(self._process.why())

    def close(self) -> None:
        """End the link; programs at its ends hear nothing of each other from now on."""
        end_all([self._process], 0.0)
        while self._spaces:
            os.close(self._spaces.pop())

    def _send(self, word: bytes) -> None:
        with suppress(OSError):  # it has ended, which the next look at it shows
            self._channel.send(word)
