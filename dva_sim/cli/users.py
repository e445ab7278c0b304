"""The commands about the users of a console, who log in with a name and a password."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from dva_sim.options.forms import OptionForm, argument
from dva_sim.serving.users import ROLES, UserFile

_Name = Annotated[str, argument("Name of the user.", "NAME")]
_File = Annotated[Path, OptionForm("File of the users.", metavar="USERS.json")]
_USUAL = Path("users.json")
_ROLE = OptionForm("What the user may do.", metavar="|".join(ROLES), words=ROLES)


def add(name: _Name, role: Annotated[str, _ROLE] = "drive", file: _File = _USUAL) -> None:
    """Add a user, and ask for the password.

    The file keeps an Argon2 hash of the password, and is readable for you alone. Where the input is
    no terminal, its first line is the password.

    Examples:
        dva-sim users add ana --role supervise  # asks for the password
        dva-sim console hands-on --users users.json  # ana may log in there
    """
    users = UserFile(file)
    users.add(name, role, _password())
    print(f"{name} is added to {file}, and may {role}")


def change(
    name: _Name,
    role: Annotated[str | None, _ROLE] = None,
    password: Annotated[bool, OptionForm("Ask for a new password.")] = False,
    file: _File = _USUAL,
) -> None:
    """Change the role or the password of a user.

    A user who is logged in has the new role at once.

    Examples:
        dva-sim users change ana --role dispatch  # sends others from now on
        dva-sim users change ana --password  # asks for a new one
    """
    users = UserFile(file)
    users.find(name)
    users.change(name, role=role, password=_password() if password else None)
    print(f"{name} may {users.find(name).role}")


def remove(name: _Name, file: _File = _USUAL) -> None:
    """Remove a user, whose login ends.

    Examples:
        dva-sim users remove ana  # from users.json
    """
    UserFile(file).remove(name)
    print(f"{name} is removed from {file}")


def lock(name: _Name, file: _File = _USUAL) -> None:
    """Lock a user out, whose login ends.

    Examples:
        dva-sim users lock ana  # until dva-sim users unlock ana
    """
    UserFile(file).change(name, locked=True)
    print(f"{name} is locked")


def unlock(name: _Name, file: _File = _USUAL) -> None:
    """Let a user log in again.

    Examples:
        dva-sim users unlock ana  # after dva-sim users lock ana
    """
    UserFile(file).change(name, locked=False)
    print(f"{name} may log in again")


def list_(file: _File = _USUAL) -> None:
    """List the users of a file, with their roles.

    Examples:
        dva-sim users list --file night-shift.json  # of another file
    """
    users = UserFile(file).users.values()
    for user in users:
        print(f"{user.name}: {user.role}{', locked' if user.locked else ''}")
    if not users:
        print(f"{file} has no users")


def _password() -> str:
    if sys.stdin.isatty():
        return str(typer.prompt("Password", hide_input=True, confirmation_prompt=True))
    return sys.stdin.readline().rstrip("\r\n")
