"""CURVE keys of the devices, in a folder: identities on an encrypted network.

`public/` holds a file for each device and goes to every machine; `secret/` goes nowhere but to
the machine that runs the device. The files have the form of ZeroMQ certificates.
"""

from __future__ import annotations

import os
import re
import stat
import struct
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

import zmq
from zmq.utils import z85

from dva_sim.kernel.errors import ConfigError

_ID = re.compile(r"[A-Za-z0-9][A-Za-z0-9:._-]{0,63}")
_NO_KEYS = "contains no keys: there is no public/*.key"
_KEY_LENGTH = 40  # 32 bytes in the letters of Z85
_PUBLIC_NOTE = "Public key of a device: give it to every machine."
_SECRET_NOTE = "SECRET key of a device: it stays on the machine that runs the device."


class KeyRing:
    """The keys in a folder: public keys of all devices, secret keys of one's own.

    Public keys are read at once, and again by `refresh`. Secret ones are read when asked for, so
    that those of others may be missing.

    Args:
        folder: Folder written by `create_keys`.

    Raises:
        ConfigError: there are none, or a file is broken or contradicts another.
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)
        if not self.folder.is_dir():
            hint = f"there is no such folder; make keys with: dva-sim keys {self.folder} NAME..."
            raise ConfigError(hint, self.folder)
        self._public: dict[str, bytes] = {}
        self._owners: dict[bytes, str] = {}
        self._pairs: dict[str, tuple[bytes, bytes]] = {}
        self._files: dict[Path, tuple[str, bytes]] = {}  # what each holds
        self._seen = self._look()
        for file in sorted(self._seen):
            self._files[file] = _read_public(file)
            self._add(file)
        if not self._public:
            raise ConfigError(_NO_KEYS, self.folder)

    def refresh(self) -> set[str]:
        """Read the public keys again if files have changed.

        A file that cannot be read, as it is just being written, counts as before and is tried
        again; of two that contradict each other the first by name counts. A folder that is not
        there, or cannot be read, changes nothing: a disk that is away must not lock everybody out.

        Returns:
            The devices whose key is gone, new or another.
        """
        try:
            versions = self._look()
        except ConfigError:
            return set()
        if versions == self._seen:
            return set()
        before = self._public
        files = dict[Path, tuple[str, bytes]]()
        for file in sorted(versions):
            key = self._files.get(file)
            if key is None or versions[file] != self._seen.get(file):
                try:
                    key = _read_public(file)
                except ConfigError:
                    del versions[file]
            if key is not None:
                files[file] = key
        self._files = files
        self._seen = versions
        self._public = {}
        self._owners = {}
        for file in files:
            with suppress(ConfigError):
                self._add(file)
        devices = before.keys() | self._public.keys()
        return {d for d in devices if before.get(d) != self._public.get(d)}

    def _look(self) -> dict[Path, tuple[int, int]]:
        """Return the time of change and the size of each public file."""
        folder = self.folder / "public"
        files = dict[Path, tuple[int, int]]()
        try:
            for entry in os.scandir(folder):
                if entry.name.endswith(".key"):
                    about = entry.stat()
                    files[folder / entry.name] = about.st_mtime_ns, about.st_size
        except FileNotFoundError as error:
            if Path(error.filename or folder) == folder:
                raise ConfigError(_NO_KEYS, self.folder) from None
        except OSError as error:
            raise ConfigError(f"cannot be read: {error.strerror}", folder) from error
        return files

    @property
    def devices(self) -> list[str]:
        """The ids of all devices whose public key is known."""
        return sorted(self._public)

    def public(self, device: str) -> bytes:
        """Return the public key of a device.

        Raises:
            ConfigError: it is not in the folder.
        """
        try:
            return self._public[device]
        except KeyError:
            raise ConfigError(f"there is no public key of {device}", self.folder) from None

    def pair(self, device: str) -> tuple[bytes, bytes]:
        """Return the public and the secret key of a device.

        Raises:
            ConfigError: one is missing or broken, they do not match, or others may read the
                secret. That is refused, as ssh does: a warning would scroll by, and a key that
                others could read must be taken for lost.
        """
        if device not in self._pairs:
            public = self.public(device)
            file = _secret_file(self.folder, device)
            _check_private(file, device)
            id_, other_public, secret = _read_secret(file)
            if id_ != device:
                raise ConfigError(f"is the key of {id_}, not of {device}", file)
            if other_public != public:
                where = f"public/{_stem(device)}.key"
                raise ConfigError(f"does not match {where}: one of them is outdated", file)
            self._pairs[device] = public, secret
        return self._pairs[device]

    def owner(self, public_key: bytes) -> str | None:
        """Return the device that has this public key, given as 32 bytes or as 40 letters."""
        key = public_key if len(public_key) == _KEY_LENGTH else z85.encode(public_key)
        return self._owners.get(key)

    def _add(self, file: Path) -> None:
        device, public = self._files[file]
        if device in self._public:
            raise ConfigError(f"is another key of {device}, which already has one", file)
        if public in self._owners:
            raise ConfigError(f"{device} and {self._owners[public]} have the same key", file)
        self._public[device] = public
        self._owners[public] = device


def create_keys(folder: str | Path, ids: Iterable[str]) -> list[str]:
    """Make a pair of keys for each device that has none, and say for which.

    Existing keys stay as they are. A device with a public key only is left alone, too: its secret
    is on another machine.

    Args:
        folder: Folder for the keys; created if missing.
        ids: The devices, by their ids on the wire.

    Raises:
        ConfigError: an id cannot be one, the folder cannot be written, or a file is broken.
    """
    folder = Path(folder)
    ids = list(ids)
    _require_curve()
    for device in ids:
        if not _ID.fullmatch(device):
            raise ConfigError(
                f"{device!r} cannot be the id of a device: letters, digits and :._- make one"
            )
    try:
        (folder / "public").mkdir(parents=True, exist_ok=True)
        (folder / "secret").mkdir(mode=0o700, exist_ok=True)
        return [device for device in ids if _create(folder, device)]
    except OSError as error:
        raise ConfigError(f"cannot be written: {error.strerror}", error.filename) from error


def _create(folder: Path, device: str) -> bool:
    """Create missing files; return True if a new pair was needed."""
    public_file = folder / "public" / f"{_stem(device)}.key"
    secret_file = _secret_file(folder, device)
    if public_file.exists():
        _check_owner(public_file, device, _read_public(public_file)[0])
        return False
    if secret_file.exists():  # an interruption came between the two files
        owner, public, _ = _read_secret(secret_file)
        _check_owner(secret_file, device, owner)
        _write(public_file, 0o644, _text(_PUBLIC_NOTE, device, public))
        return False
    public, secret = zmq.curve_keypair()
    _write(secret_file, 0o600, _text(_SECRET_NOTE, device, public, secret))
    _write(public_file, 0o644, _text(_PUBLIC_NOTE, device, public))
    return True


def _write(file: Path, mode: int, text: str) -> None:
    """Write a new file that has its mode from the first moment on."""
    descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
    with os.fdopen(descriptor, "w", encoding="ascii") as out:
        out.write(text)


def _text(note: str, device: str, public: bytes, secret: bytes | None = None) -> str:
    lines = [f"# {note}", "metadata", f'    id = "{device}"', "curve"]
    lines.append(f'    public-key = "{public.decode()}"')
    if secret is not None:
        lines.append(f'    secret-key = "{secret.decode()}"')
    return "\n".join(lines) + "\n"


def _read_public(file: Path) -> tuple[str, bytes]:
    fields = _fields(file)
    if "secret-key" in fields:
        raise ConfigError("contains a secret key, but public files are shared", file)
    return _field(fields, "id", file), _key(fields, "public-key", file)


def _read_secret(file: Path) -> tuple[str, bytes, bytes]:
    fields = _fields(file)
    public = _key(fields, "public-key", file)
    secret = _key(fields, "secret-key", file)
    if zmq.curve_public(secret) != public:
        raise ConfigError("is broken: its public-key and secret-key do not match", file)
    return _field(fields, "id", file), public, secret


def _fields(file: Path) -> dict[str, str]:
    """Return the `name = "value"` lines of a file; a key may hold `=` and `#`."""
    _require_curve()
    try:
        lines = file.read_text(encoding="ascii").splitlines()
    except OSError as error:
        raise ConfigError(f"cannot be read: {error.strerror}", file) from error
    except UnicodeDecodeError as error:
        raise ConfigError("is broken: it is not plain text", file) from error
    pairs = (line.partition("=") for line in lines if not line.lstrip().startswith("#"))
    return {name.strip(): value.strip().strip("\"'") for name, _, value in pairs}


def _field(fields: dict[str, str], name: str, file: Path) -> str:
    value = fields.get(name)
    if not value:
        raise ConfigError(f'is broken: it has no line {name} = "..."', file)
    return value


def _key(fields: dict[str, str], name: str, file: Path) -> bytes:
    key = _field(fields, name, file).encode()
    try:
        if len(key) == _KEY_LENGTH and len(z85.decode(key)) == 32:
            return key
    except (KeyError, ValueError, struct.error):
        pass
    raise ConfigError(f"is broken: its {name} is not a key of {_KEY_LENGTH} letters", file)


def _check_private(file: Path, device: str) -> None:
    """Refuse a secret that others may read; on Windows the mode says nothing."""
    try:
        mode = stat.S_IMODE(file.stat().st_mode)
    except FileNotFoundError:
        raise ConfigError(f"there is no secret key of {device}", file) from None
    except OSError as error:
        raise ConfigError(f"cannot be read: {error.strerror}", file) from error
    if os.name == "posix" and mode & 0o077:
        raise ConfigError(f"others may read this secret; fix it with: chmod 600 {file}", file)


def _check_owner(file: Path, device: str, owner: str) -> None:
    if owner != device:
        raise ConfigError(f"belongs to {owner}; {device} would have the same file", file)


def _stem(device: str) -> str:
    """Return the id as a file name: not every file system takes a colon."""
    return device.replace(":", "-")


def _secret_file(folder: Path, device: str) -> Path:
    return folder / "secret" / f"{_stem(device)}.key_secret"


def _require_curve() -> None:
    if not zmq.has("curve"):
        raise ConfigError("this build of ZeroMQ cannot encrypt (no CURVE); install pyzmq by pip")
