"""Output and exit code of `check` and `schema`."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from dva_sim.kernel.config_overrides import parse_changes
from dva_sim.kernel.errors import ConfigError, ExitCode, error_line
from dva_sim.kernel.labels import visible
from dva_sim.protocol.mistakes import READ_BYTES, check_message
from dva_sim.testing.files import FileVerdict, NotReadError, check_file, schema_text
from dva_sim.testing.promises import TRIALS, CheckedKind, error_with_line, tried

STDIN: Final = "-"
LINK: Final = "link"
OFFER: Final = "a relay of TCP over the loopback can take its place for measurements without loss"
QUIET: Final = "run as root for real-time priority, or use an idle machine"
VALID = ExitCode.OK
NOT_JUDGED = ExitCode.NOT_JUDGED
INVALID = ExitCode.DOES_NOT_HOLD
NOT_READ = ExitCode.MISTAKE
WORDS: Final = {
    VALID: "valid",
    NOT_JUDGED: "not judged",
    INVALID: "invalid",
    NOT_READ: "not read",
}
"""Words for the results; the last one that any file has is that of all."""
_SHOWN: Final = 50  # maximum problems shown of one file


def check(names: Sequence[str], options: Sequence[str] = ()) -> ExitCode:
    """Tell of each file whether it is valid, and if not, why; how it ended.

    Args:
        names: Paths of files; or a word of `TRIALS`, such as `policy`, and names of such; or
            `link` alone, the emulated one. A file of that name is `./policy`.
        options: `key=value` pairs for what is tried.

    Raises:
        ConfigError: none is named, or options are given for files.
        EmulatorError: there is no emulated link here.
    """
    if names and names[0] == LINK:
        return _check_link(names[1:], options)
    if names and names[0] in TRIALS:
        return _try_all(names[0], names[1:], parse_changes(options))
    if options:
        tried = ", ".join(trial.many for trial in TRIALS.values())
        raise ConfigError(f"--set is for {tried}: dva-sim check policy NAME --set key=value")
    return _sum_up("file", "files", [_check_one(name) for name in names])


def _check_link(names: Sequence[str], options: Sequence[str]) -> ExitCode:
    """Measure the emulated link; there is but one.

    Raises:
        EmulatorError: there is none here: why, and what there is instead.
    """
    from dva_sim.network.emulator.needs import EmulatorError  # late: start-up
    from dva_sim.validation.network.real_side import cell, self_check  # late: start-up

    if names or options:
        raise ConfigError("check link takes no names or options")
    if why := cell.why_no_packets():
        raise EmulatorError(f"{why}; {OFFER}")
    findings = self_check.check_link()
    for finding in findings:
        print(finding)
    if all(finding.passed for finding in findings):
        return ExitCode.OK
    print(f"Occasional lateness comes from a busy processor: {QUIET}.")
    return ExitCode.DOES_NOT_HOLD


def _try_all(kind: str, names: Sequence[str], options: Mapping[str, Any]) -> ExitCode:
    trial = TRIALS[kind]
    if not names:
        available = ", ".join(trial.known())
        raise ConfigError(f"check {kind}: name one: mine.py:Mine, or one of {available}")
    return _sum_up(kind, trial.many, [_try(kind, trial, name, options) for name in names])


def _try(kind: str, trial: CheckedKind, name: str, options: Mapping[str, Any]) -> ExitCode:
    """Try a plug-in and print the outcome."""
    try:
        outcome = tried(trial.load_check(), name, options)
    except ConfigError as error:
        _say(f"{name}: {error}")
        return INVALID
    except SystemExit as error:
        _say(f"{name}: {kind}: invalid, ends the program: {error_with_line(error)}")
        return INVALID
    for text in outcome.broken:
        _say(f"{name}: {text}")
    for text in outcome.warnings:
        _say(f"{name}: warning: {text}")
    word = f"invalid, breaks {len(outcome.broken)} of its promises" if outcome.broken else "valid"
    _say(f"{name}: {kind}: {word}; {trial.ways(outcome)}")
    return INVALID if outcome.broken else VALID


def _sum_up(one: str, many: str, codes: Sequence[ExitCode]) -> ExitCode:
    count = Counter(codes)
    counts = ", ".join(f"{count[code]} {word}" for code, word in WORDS.items() if count[code])
    print(f"{len(codes)} {one if len(codes) == 1 else many}: {counts}")
    return max(codes, key=list(WORDS).index, default=VALID)


def print_schema(kind: str) -> None:
    """Print a schema without wrapping, so that it can be redirected into a file."""
    sys.stdout.write(schema_text(kind))


def _check_one(name: str) -> ExitCode:
    try:
        verdict = _judge(name)
    except NotReadError as error:
        print(error_line(f"{name}: {error}"), file=sys.stderr)
        return NOT_READ
    for problem in verdict.problems[:_SHOWN]:
        where = _near(problem.file) if problem.file else name
        _say(f"{where}:{problem.line}:{problem.column}: {problem.text}")
    number = len(verdict.problems)
    broken = verdict.broken
    for doubt in verdict.doubts:
        _say(f"{name}: warning: {doubt}")
    for rule in verdict.rules:
        _say(f"{name}: {rule}")
    if not number and not broken:
        words = filter(None, (verdict.unjudged, verdict.note))
        code = NOT_JUDGED if verdict.unjudged else VALID
        _say("; ".join((f"{name}: {verdict.kind}: {WORDS[code]}", *words)))
        return code
    more = f", the first {_SHOWN} shown" if number > _SHOWN else ""
    faults = [f"{number} problem{'s'[: number > 1]}{more}"] if number else []
    faults += [f"breaks {broken} safety rule{'s'[: broken > 1]}"] if broken else []
    _say(f"{name}: {verdict.kind}: invalid, {', '.join(faults)}")
    return INVALID


def _judge(name: str) -> FileVerdict:
    if name == STDIN:
        return FileVerdict("message", check_message(sys.stdin.buffer.read(READ_BYTES)))
    return check_file(Path(name))


def _near(file: str) -> str:
    """Return a path as one would write it here."""
    here = Path.cwd()
    return str(Path(file).relative_to(here)) if Path(file).is_relative_to(here) else file


def _say(text: str) -> None:
    """Say it in one line, whatever a file or its name holds."""
    print(visible(text))
