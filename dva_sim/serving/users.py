"""Users of a console: a file with each one's role and the Argon2 hash of the password.

References:
    RFC 9106 (2021), Argon2: the parameters are its second recommended option, the default of
    the library.
"""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import either
from dva_sim.kernel.whole_files import whole

ROLES: Final = ("look", "phone", "drive", "dispatch", "supervise")
MIN_LETTERS: Final = 8  # minimum characters of a password
MAX_LETTERS: Final = 200  # maximum characters of a password, as hashing takes time
MAX_USERS: Final = 1000
MAX_BYTES: Final = 1 << 20
_NAME: Final = re.compile(r"\w[\w .-]{0,39}")
# An attempt to log in takes the memory and the time that the hash asks for.
_HASH: Final = re.compile(
    r"\$argon2id\$v=19\$m=\d{1,6},t=\d,p=\d{1,2}\$[\w+/]{11,64}\$[\w+/]{16,128}", re.ASCII
)


@dataclass(frozen=True)
class User:
    """A user of a console.

    Attributes:
        name: Name, as it appears in logs and the audit log.
        role: One of `ROLES`.
        password: Argon2 hash of the password.
        locked: True if the user may not log in.
    """

    name: str
    role: str
    password: str
    locked: bool = False


def hash_password(password: str) -> str:
    """Return the Argon2 hash of a new password.

    Raises:
        ConfigError: it is too short or too long.
    """
    from argon2 import PasswordHasher  # late: start-up

    if not MIN_LETTERS <= len(password) <= MAX_LETTERS:
        raise ConfigError(f"a password should have {MIN_LETTERS} to {MAX_LETTERS} characters")
    return PasswordHasher().hash(password)


def is_password_of(user: User | None, password: str) -> bool:
    """Return True if a password is the user's; None takes as long, and returns False."""
    from argon2 import PasswordHasher  # late: start-up
    from argon2.exceptions import InvalidHashError, VerificationError  # late: start-up

    password_hash = user.password if user is not None else _DUMMY_HASH
    try:
        PasswordHasher().verify(password_hash, password[:MAX_LETTERS])
    except (VerificationError, InvalidHashError):
        return False
    return user is not None


# Hash of a random password, checked for unknown names so that timing does not reveal which exist.
_DUMMY_HASH: Final = (
    "$argon2id$v=19$m=65536,t=3,p=4$jdlNni01KYGLybqoucCjCQ"
    "$CwjhY/taxjJLGiTf9xCvTjKSgtipxeFTwAwGKkwf/Hw"
)


class UserFile:
    """The users in a file.

    Args:
        path: The file; one that does not exist has no users.

    Raises:
        ConfigError: it cannot be read, or is not a file of users.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.users: dict[str, User] = {}
        if path.exists():
            self.users = {user.name: user for user in _read(path)}

    def add(self, name: str, role: str, password: str) -> None:
        """Add a user.

        Raises:
            ConfigError: the name is invalid or taken, or the role or password is invalid.
        """
        if not _NAME.fullmatch(name):
            problem = "a name should have 1 to 40 letters, digits, spaces, dots or hyphens"
            raise ConfigError(f"{problem}, and begin with a letter or digit")
        if name in self.users:
            raise ConfigError(f"there is a user {name!r} already; change that one", self.path)
        if len(self.users) >= MAX_USERS:
            raise ConfigError(f"there are {MAX_USERS} users already", self.path)
        self._put(User(name, _role(role), hash_password(password)))

    def change(
        self,
        name: str,
        *,
        role: str | None = None,
        password: str | None = None,
        locked: bool | None = None,
    ) -> None:
        """Change a user; None keeps a value.

        Raises:
            ConfigError: there is no such user, or a new value is invalid.
        """
        user = self.find(name)
        changes: dict[str, Any] = {}
        if role is not None:
            changes["role"] = _role(role)
        if password is not None:
            changes["password"] = hash_password(password)
        if locked is not None:
            changes["locked"] = locked
        self._put(replace(user, **changes))

    def remove(self, name: str) -> None:
        """Remove a user.

        Raises:
            ConfigError: there is no such user.
        """
        del self.users[self.find(name).name]
        self._write()

    def find(self, name: str) -> User:
        """Return a user.

        Raises:
            ConfigError: there is no user of that name.
        """
        if name not in self.users:
            raise ConfigError(f"there is no user {name!r}", self.path)
        return self.users[name]

    def _put(self, user: User) -> None:
        self.users[user.name] = user
        self._write()

    def _write(self) -> None:
        content = {"users": [asdict(user) for user in self.users.values()]}
        try:
            with whole(self.path) as part:
                part.touch(0o600)  # private before it has content
                part.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
        except OSError as error:
            raise ConfigError(f"cannot be written: {error.strerror}", self.path) from None


def _role(role: str) -> str:
    if role not in ROLES:
        raise ConfigError(f"there is no role {role!r}; use {either(ROLES)}")
    return role


def _read(path: Path) -> Collection[User]:
    try:
        if path.stat().st_size > MAX_BYTES:
            raise ConfigError("is too long for a file of users", path)
        document = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"cannot be read: {error.strerror}", path) from None
    except (ValueError, RecursionError):
        raise ConfigError("is no file of users: it is not JSON", path) from None
    entries = document.get("users") if isinstance(document, dict) else None
    if not isinstance(entries, list):
        raise ConfigError("is no file of users: it has no list `users`", path)
    users = [_user(entry, path) for entry in entries[:MAX_USERS]]
    if len({user.name for user in users}) < len(users):
        raise ConfigError("is no file of users: two have the same name", path)
    return users


def _user(entry: object, path: Path) -> User:
    if isinstance(entry, Mapping) and entry.keys() <= {"name", "role", "password", "locked"}:
        name, role, password = (entry.get(key) for key in ("name", "role", "password"))
        locked = entry.get("locked", False)
        is_named = isinstance(name, str) and _NAME.fullmatch(name) is not None
        is_hash = isinstance(password, str) and _HASH.fullmatch(password) is not None
        if is_named and role in ROLES and is_hash and isinstance(locked, bool):
            return User(str(name), str(role), str(password), locked)
    problem = "an entry should have name, role, and password as the hash that we made"
    raise ConfigError(f"is no file of users: {problem}", path)
