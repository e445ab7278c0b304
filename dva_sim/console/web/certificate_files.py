"""Certificate files: in the user's data folder, unreadable for others."""

from __future__ import annotations

import os
import socket
import sys
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

from dva_sim.console.web.certificates import (
    Hosts,
    Signed,
    authority_fault,
    leaf_fault,
    new_authority,
    new_leaf,
)
from dva_sim.console.web.phones import NoCertificate

AUTHORITY = "authority.pem"
LEAF = "console.pem"


class KeptCertificates(NamedTuple):
    """Certificates in use.

    Attributes:
        authority: Authority that a phone is asked to trust.
        leaf: File with key and certificate of this machine.
        notices: Certificates made or renewed, and the reasons, a line each.
    """

    authority: Signed
    leaf: Path
    notices: tuple[str, ...]


def data_folder() -> Path:
    """Return the folder of this user's data of the program, as the system has it."""
    folder = os.environ.get("XDG_DATA_HOME", "")
    home = Path("~").expanduser()
    if Path(folder).is_absolute():
        return Path(folder) / "dva-sim"
    if sys.platform == "darwin":
        return home / "Library" / "Application Support" / "dva-sim"
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", home)) / "dva-sim"
    return home / ".local" / "share" / "dva-sim"


def certificates(folder: Path, hosts: Hosts, now: datetime | None = None) -> KeptCertificates:
    """Return the authority and certificate for these hosts: those that are kept, or new ones.

    Args:
        folder: Folder of the certificates.
        hosts: Under what this machine is reached.
        now: Else the time of the clock.

    Raises:
        NoCertificate: the folder cannot be written.
    """
    now = now or datetime.now(UTC)
    reports: list[str] = []
    try:
        _private(folder)
        authority = _read(folder / AUTHORITY, reports)
        fault = authority_fault(authority, hosts, now) if authority else ""
        if authority is None or fault:
            _renewed("authority", fault, reports, "phones have to trust the new one once")
            authority = new_authority(socket.gethostname(), hosts, now)
            _write(folder / AUTHORITY, authority)
        leaf = _read(folder / LEAF, reports)
        fault = leaf_fault(leaf, authority, hosts, now) if leaf else ""
        if leaf is None or fault:
            _renewed("certificate", fault, reports)
            _write(folder / LEAF, new_leaf(authority, hosts, now))
    except OSError as error:
        raise NoCertificate(
            f"no certificate can be kept in {folder}: {error.strerror or error}"
        ) from error
    return KeptCertificates(authority, folder / LEAF, tuple(reports))


def _private(folder: Path) -> None:
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    folder.chmod(0o700)


def _read(path: Path, notices: list[str]) -> Signed | None:
    """Read a file; None if there is none, or no valid contents."""
    try:
        data = path.read_bytes()
        path.chmod(0o600)
    except FileNotFoundError:
        return None
    try:
        return Signed.read(data)
    except (ValueError, TypeError):
        notices.append(f"{path.name} is broken, and replaced")
        return None


def _renewed(what: str, fault: str, notices: list[str], more: str = "") -> None:
    if fault:
        notices.append(f"the {what} for phones is replaced: {fault}{'; ' + more if more else ''}")


def _write(path: Path, signed: Signed) -> None:
    """Write all of it or nothing, readable by its owner alone from the first byte on."""
    beside = path.with_suffix(f".{os.getpid()}")
    with suppress(FileNotFoundError):
        beside.unlink()
    number = os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with os.fdopen(number, "wb") as file:
        file.write(signed.pem)
    beside.replace(path)
