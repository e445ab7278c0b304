"""What `check` and `schema` print, and the exit code they end with."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final

from dva_sim.checking.files import NotReadError, Verdict, check_file
from dva_sim.checking.messages import READ_BYTES, check_message
from dva_sim.checking.promises import Outcome
from dva_sim.checking.schemas import schema_text
from dva_sim.config import parse_changes
from dva_sim.errors import ConfigError

STDIN: Final = "-"
POLICY, ROBOT = "policy", "robot"  # as the first name: what follows are such, not files
VALID, INVALID, NOT_READ = 0, 1, 2  # exit codes; the highest of all files counts
_SHOWN: Final = 50  # problems of one file


def check(names: Sequence[str], options: Sequence[str] = ()) -> int:
    """Tell of each file whether it is valid, and if not, why; the exit code.

    Args:
        names: Paths of files; or the word `policy` or `robot`, and names of such. A file of that
            name is `./policy`.
        options: `key=value` pairs for the policies, or for the motors of the robots.

    Raises:
        ConfigError: none is named, or options are given for files.
    """
    if names and names[0] == POLICY:
        return _check_policies(names[1:], parse_changes(options))
    if names and names[0] == ROBOT:
        return _check_robots(names[1:], parse_changes(options))
    if options:
        problem = "--set is for policies and robots"
        raise ConfigError(f"{problem}: dva-sim check policy NAME --set key=value")
    return _sum_up("file", [_check_one(name) for name in names])


def _check_policies(names: Sequence[str], options: Mapping[str, Any]) -> int:
    from dva_sim.core.dispatch import known_policies

    if not names:
        known = ", ".join(known_policies())
        raise ConfigError(f"check policy: which one? mine.py:Mine, or one of {known}")
    return _sum_up("policy", [_check_policy(name, options) for name in names])


def _check_policy(name: str, options: Mapping[str, Any]) -> int:
    from dva_sim.checking.policies import try_policy
    from dva_sim.core.dispatch import load_policy

    def ways(outcome: Outcome) -> str:
        slowest = f"slowest decision {1000 * outcome.slowest:.1f} ms"
        return f"{outcome.tries} situations, {slowest}"

    return _tell(name, "policy", lambda: try_policy(partial(load_policy, name, options)), ways)


def _check_robots(names: Sequence[str], options: Mapping[str, Any]) -> int:
    from dva_sim.resources import available

    if not names:
        known = ", ".join(sorted(available("agents/robots")))
        raise ConfigError(f"check robot: which one? mine.py:Mine, or one of {known}")
    return _sum_up("robot", [_check_robot(name, options) for name in names])


def _check_robot(name: str, options: Mapping[str, Any]) -> int:
    """A profile; or motors in a file, in the body that a profile has if it says nothing else."""
    from dva_sim.agents.profile import RobotProfile, load_robot
    from dva_sim.checking.robots import try_robot

    def trial() -> Outcome:
        bare = ".py" in name
        profile = RobotProfile(drive=name) if bare else load_robot(name)
        changed = profile.model_copy(update={"options": {**profile.options, **options}})
        return try_robot(changed.drive_spec())

    def ways(outcome: Outcome) -> str:
        return f"{outcome.tries} drives, {1e6 * outcome.slowest:.0f} microseconds a tick"

    return _tell(name, "robot", trial, ways)


def _tell(
    name: str, kind: str, trial: Callable[[], Outcome], ways: Callable[[Outcome], str]
) -> int:
    """Try something and say what came of it."""
    try:
        outcome = trial()
    except ConfigError as error:
        _say(f"{name}: {error}")
        return INVALID
    for text in outcome.broken:
        _say(f"{name}: {text}")
    for text in outcome.warnings:
        _say(f"{name}: warning: {text}")
    word = f"invalid, breaks {len(outcome.broken)} of its promises" if outcome.broken else "valid"
    _say(f"{name}: {kind}: {word}; {ways(outcome)}")
    return INVALID if outcome.broken else VALID


def _sum_up(what: str, codes: Sequence[int]) -> int:
    count = Counter(codes)
    words = {VALID: "valid", INVALID: "invalid", NOT_READ: "not read"}
    many = {"file": "files", "policy": "policies", "robot": "robots"}[what]
    found = ", ".join(f"{count[code]} {word}" for code, word in words.items() if count[code])
    print(f"{len(codes)} {what if len(codes) == 1 else many}: {found}")
    return max(codes, default=VALID)


def print_schema(kind: str) -> None:
    """Print a schema as it is, so that it can be written into a file."""
    sys.stdout.write(schema_text(kind))


def _check_one(name: str) -> int:
    try:
        verdict = _judge(name)
    except NotReadError as error:
        _say(f"{name}: {error}")
        return NOT_READ
    for problem in verdict.problems[:_SHOWN]:
        where = _near(problem.file) if problem.file else name
        _say(f"{where}:{problem.line}:{problem.column}: {problem.text}")
    number = len(verdict.problems)
    if not number:
        _say(f"{name}: {verdict.kind}: valid")
        return VALID
    more = f", the first {_SHOWN} shown" if number > _SHOWN else ""
    _say(f"{name}: {verdict.kind}: invalid, {number} problem{'s'[: number > 1]}{more}")
    return INVALID


def _judge(name: str) -> Verdict:
    if name == STDIN:
        return Verdict("message", check_message(sys.stdin.buffer.read(READ_BYTES)))
    return check_file(Path(name))


def _near(file: str) -> str:
    """A path as one would write it here."""
    here = Path.cwd()
    return str(Path(file).relative_to(here)) if Path(file).is_relative_to(here) else file


def _say(text: str) -> None:
    """One line stays one line, whatever a file or its name holds."""
    escaped = (c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
    print("".join(escaped))
