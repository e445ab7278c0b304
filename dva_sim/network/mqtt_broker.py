"""A mosquitto of this program's own, and paho-mqtt clients of MQTT 5."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import time
from contextlib import suppress
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Final, Literal

from dva_sim.kernel.errors import DvaSimError
from dva_sim.network.emulator.linux_calls import die_with_parent

if TYPE_CHECKING:
    from paho.mqtt.client import Client

_SYSTEM: Final = os.pathsep.join(
    (os.environ.get("PATH", os.defpath), "/usr/local/sbin", "/usr/sbin")
)
# Where Debian puts it is not on the path of everybody.
PROGRAM: Final = shutil.which("mosquitto", path=_SYSTEM) or "mosquitto"
_PATIENCE: Final = 10.0  # until it listens [s]
_AGAIN: Final = 0.02  # between two looks whether it does [s]


class BrokerError(DvaSimError):
    """A broker that could not begin."""


class Broker:
    """A mosquitto that listens at one address alone, and ends with this process.

    Its files have no names: nothing is left behind, whatever ends it. It stays root, which inside a
    user namespace is nobody else's: there it could not become another user.

    Args:
        address: IPv4 address of this machine.
        port: Port.
        nodelay: True to send small messages at once (TCP_NODELAY).
        settings: More lines of its configuration.
        rules: Its access control list; empty: anybody may send and read everything.

    Raises:
        BrokerError: it cannot be started.
    """

    def __init__(
        self, address: str, port: int, *, nodelay: bool, settings: str = "", rules: str = ""
    ) -> None:
        self._place = address, port
        self._refuse_taken_port()
        self._log = TemporaryFile()  # noqa: SIM115 - closed with the broker
        lists = _nameless("rules", rules)
        configuration = _nameless(
            "configuration",
            f"listener {port} {address}\nallow_anonymous true\nuser root\nlog_dest stderr\n"
            f"log_type error\nset_tcp_nodelay {str(nodelay).lower()}\n{settings}"
            + (f"acl_file /proc/self/fd/{lists}\n" if rules else ""),
        )
        me = os.getpid()
        try:
            self._process = subprocess.Popen(
                [PROGRAM, "-c", f"/proc/self/fd/{configuration}"],
                stdin=subprocess.DEVNULL,
                stderr=self._log,
                pass_fds=(configuration, lists),
                start_new_session=True,  # Ctrl-C is for this process, which ends it
                preexec_fn=lambda: die_with_parent(me),
            )
        except OSError as error:
            raise BrokerError(f"{PROGRAM} cannot be started: {error.strerror}") from None
        finally:
            os.close(configuration)
            os.close(lists)

    def _refuse_taken_port(self) -> None:
        """Say so now: who waits for the broker would take another program for it."""
        with socket.socket() as one:
            one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                one.bind(self._place)
            except OSError as error:
                raise BrokerError(f"{PROGRAM} cannot listen at {self}: {error.strerror}") from None

    def __str__(self) -> str:
        return ":".join(map(str, self._place))

    @property
    def pid(self) -> int:
        """Its process."""
        return self._process.pid

    @property
    def has_ended(self) -> bool:
        """Return True if it has ended by itself."""
        return self._process.poll() is not None

    def wait(self) -> None:
        """Wait until it listens.

        Raises:
            BrokerError: it does not.
        """
        until = time.monotonic() + _PATIENCE
        while not self.has_ended and time.monotonic() < until:
            with suppress(OSError), socket.create_connection(self._place, _PATIENCE):
                return
            time.sleep(_AGAIN)
        self._log.seek(0)
        output = self._log.read().decode(errors="replace").strip().splitlines()
        self.close()
        raise BrokerError(f"{PROGRAM} does not listen at {self}: {(output or ['no reason'])[-1]}")

    def close(self) -> None:
        """End it."""
        self._process.kill()
        self._process.wait()
        self._log.close()


def new_client(name: str, nodelay: bool, kind: Literal["tcp", "unix"] = "tcp") -> Client:
    """Return a client of MQTT 5 that tries every second to connect, and to connect again.

    Args:
        name: Client id; empty: the broker gives one.
        nodelay: True to send small messages at once (TCP_NODELAY).
        kind: Kind of connection; `unix` is a socket of the file system, with its path as host.
    """
    from paho.mqtt.client import Client, MQTTv5  # late: an extra
    from paho.mqtt.enums import CallbackAPIVersion

    client = Client(CallbackAPIVersion.VERSION2, name, protocol=MQTTv5, transport=kind)
    if nodelay and kind == "tcp":
        client.on_socket_open = lambda _, __, opened: opened.setsockopt(
            socket.IPPROTO_TCP, socket.TCP_NODELAY, 1
        )
    client.reconnect_delay_set(1, 1)
    return client


def _nameless(name: str, text: str) -> int:
    """Return the open file, of this process alone, with a text."""
    file = os.memfd_create(name)
    os.fchmod(file, 0o600)
    os.write(file, text.encode())
    return file
