"""Policies by name: the shipped ones, a class in a file of the user, or an installed package's."""

from __future__ import annotations

import hashlib
import inspect
import sys
import traceback
from collections.abc import Callable, Mapping
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import Any, Final

from dva_sim import resources
from dva_sim.core.dispatch.auction import Auction
from dva_sim.core.dispatch.coverage import Coverage
from dva_sim.core.dispatch.greedy import MinEta, NearestIdle, Preference, RandomChoice
from dva_sim.core.dispatch.optimal import BatchOptimal, OperatorAware
from dva_sim.core.dispatch.oracle import Oracle
from dva_sim.core.dispatch.situation import Policy
from dva_sim.core.dispatch.team import HazardTeam
from dva_sim.core.dispatch.urgency import Preemptive, PriorityEta
from dva_sim.errors import ConfigError

GROUP: Final = "dva_sim.policies"
FOLDER: Final = "agents/policies"

POLICIES: dict[str, Callable[..., Policy]] = {
    "auction": Auction,
    "batch_optimal": BatchOptimal,
    "coverage": Coverage,
    "hazard_team": HazardTeam,
    "min_eta": MinEta,
    "nearest_idle": NearestIdle,
    "operator_aware": OperatorAware,
    "oracle": Oracle,
    "preemptive": Preemptive,
    "preference": Preference,
    "priority_eta": PriorityEta,
    "random": RandomChoice,
}


def known_policies() -> list[str]:
    """Names that a configuration can use: shipped and installed ones; files come on top."""
    shipped = POLICIES.keys() - {"oracle"}  # that one needs to know the future
    return sorted(shipped | {entry.name for entry in entry_points(group=GROUP)})


def load_policy(
    name: str, options: Mapping[str, Any] | None = None, base: Path | None = None
) -> Policy:
    """Make the policy that `name` means.

    Args:
        name: A shipped policy such as `min_eta`, a class in a file such as `mine.py:Mine`, or
            the name under which an installed package offers one (entry point, `dva_sim.policies`).
        options: Keyword arguments of its constructor.
        base: Folder that a file is looked for in first; then the working folder, and
            `agents/policies`.

    Raises:
        ConfigError: there is none of that name, its file or package cannot be loaded, it is not
            a policy, or an option is unknown or bad. The line says what would be right.
    """
    factory = POLICIES.get(name) or _from_file(name, base) or _installed(name)
    return _make(name, factory, dict(options or {}))


def _make(name: str, factory: Callable[..., Policy], options: dict[str, Any]) -> Policy:
    _check_options(name, factory, options)
    try:
        return factory(**options)
    except ConfigError as error:
        raise ConfigError(f"policy {name!r}: {error}") from None
    except Exception as error:
        raise ConfigError(f"policy {name!r} cannot be made: {_said(error)}") from error


def _check_options(name: str, factory: Callable[..., Policy], options: dict[str, Any]) -> None:
    parameters = inspect.signature(factory).parameters.values()
    if any(p.kind is p.VAR_KEYWORD for p in parameters):
        return
    known = [p.name for p in parameters if p.kind not in (p.POSITIONAL_ONLY, p.VAR_POSITIONAL)]
    for option in options:
        if option not in known:
            there = f"known: {', '.join(known)}" if known else "it has none"
            raise ConfigError(f"policy {name!r} has no option {option!r}; {there}")


# --- files -----------------------------------------------------------------------------


def _from_file(name: str, base: Path | None) -> type[Policy] | None:
    """The class that `file.py:Class` means; None if the name is not of that form."""
    file, colon, wanted = name.rpartition(":")
    if not colon and name.endswith(".py"):
        raise ConfigError(f"policy {name!r} should name a class too, as {name}:Mine")
    if not colon or not file.endswith(".py"):
        return None
    path = _find(name, file, base)
    found = vars(_run(path)).get(wanted)
    if found is None:
        raise ConfigError(f"policy {name!r}: there is no class {wanted!r} in {path}")
    return _policy_class(name, found)


def _find(name: str, file: str, base: Path | None) -> Path:
    folders = [] if base is None else [base]
    for root in resources.roots():
        folders += [root, root / FOLDER]
    for folder in folders:
        if (folder / file).is_file():
            return (folder / file).resolve()
    near = ", ".join(dict.fromkeys(str(folder) for folder in [base or Path.cwd(), Path.cwd()]))
    raise ConfigError(f"policy {name!r}: file {file!r} not found; looked in {near} and {FOLDER}")


def _run(path: Path) -> ModuleType:
    """Run a file as a module of its own name, so that two files named alike do not meet."""
    unique = f"dva_sim_policy_{hashlib.sha256(bytes(path)).hexdigest()[:16]}"
    module = ModuleType(unique)
    module.__file__ = str(path)
    sys.modules[unique] = module  # dataclasses look their module up there
    try:
        exec(compile(path.read_bytes(), str(path), "exec"), vars(module))
    except SyntaxError as error:
        raise ConfigError(f"is not valid Python: {error.msg}", path, error.lineno) from None
    except OSError as error:
        raise ConfigError(f"cannot be read: {error.strerror or error}", path) from None
    except (Exception, SystemExit) as error:
        raise ConfigError(f"cannot be loaded: {_said(error)}", path, _line(error, path)) from error
    return module


def _line(error: BaseException, path: Path) -> int | None:
    """The last line of the file that the error came through."""
    frames = traceback.extract_tb(error.__traceback__)
    lines = [frame.lineno for frame in frames if frame.filename == str(path)]
    return lines[-1] if lines else None


# --- packages --------------------------------------------------------------------------


def _installed(name: str) -> type[Policy]:
    """The class that an installed package offers under a name."""
    offers = {entry.name: entry for entry in entry_points(group=GROUP)}
    if name not in offers:
        known = ", ".join(sorted({*POLICIES, *offers} - {"oracle"}))
        raise ConfigError(f"policy {name!r} is unknown; known: {known}; or a file: mine.py:Mine")
    return _policy_class(name, _offered(name, offers[name]))


def _offered(name: str, entry: EntryPoint) -> Any:
    try:
        return entry.load()
    except Exception as error:
        problem = f"{entry.value} cannot be loaded: {_said(error)}"
        raise ConfigError(f"policy {name!r}: {problem}") from error


def _policy_class(name: str, found: Any) -> type[Policy]:
    if not (isinstance(found, type) and issubclass(found, Policy)):
        wanted = "should be a class derived from dva_sim.core.dispatch.Policy"
        raise ConfigError(f"policy {name!r} is not a policy; {wanted}")
    if found.advise is Policy.advise:
        raise ConfigError(f"policy {name!r} has no advise(situation, rng); should define it")
    return found


def _said(error: BaseException) -> str:
    """An error in one line."""
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text}" if text else type(error).__name__
