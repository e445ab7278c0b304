"""Configurations with changed keys, such as by `--set`; errors name the change at fault."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from dva_sim.kernel.config import Fail, M, validate
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.yaml_files import Document, parse_scalar

_SHOWN = 80  # maximum characters shown of a setting


def parse_changes(pairs: Iterable[str]) -> dict[str, Any]:
    """Return `key=value` pairs, as given on the command line, as a mapping.

    Raises:
        ConfigError: a pair without `=`, or a value that is not YAML.
    """
    changes = {}
    for pair in pairs:
        key, equals, value = pair.partition("=")
        if not equals or not key.strip():
            raise ConfigError(f"--set {pair!r} should be key=value, such as seed=2")
        try:
            changes[key.strip()] = parse_scalar(value)
        except ConfigError as error:
            raise ConfigError(f"--set {_cut(pair)}: {error.problem}") from None
    return changes


def build(
    model: type[M],
    source: Document | Mapping[str, Any],
    changes: Mapping[str, Any] | None,
    complete: Callable[[M, Fail], M],
    locate: Callable[[dict[str, Any], Sequence[Path]], object] = lambda data, folders: None,
) -> M:
    """Build a configuration with some keys changed.

    Args:
        model: Class of the configuration.
        source: A document or plain data.
        changes: New values by dotted key; a number chooses an item of a list.
        complete: Function that checks what the model alone cannot, and adds derived values.
        locate: Function that resolves the files named by the data, in the given folders.

    Raises:
        ConfigError: an unknown key, a wrong type, a value out of range, or what `complete` finds.
            It has a line if the file is at fault, and keys if changes are at fault.
    """

    document = source if isinstance(source, Document) else None
    fail = (lambda problem, _: ConfigError(problem)) if document is None else document.error

    def make(some: Mapping[str, Any]) -> M:
        data = copy.deepcopy(dict(document.data if document else source))  # type: ignore[arg-type]
        for key, value in some.items():
            set_key(data, key, copy.deepcopy(value))  # a later key may change a part of it
        locate(data, [document.file.parent] if document else [])
        return complete(validate(model, data, fail), fail)

    try:
        return make(changes or {})
    except ConfigError as error:
        raise blame(error, changes or {}, make, source) from None


def blame(
    error: ConfigError,
    changes: Mapping[str, Any],
    make: Callable[[Mapping[str, Any]], object],
    source: Document | Mapping[str, Any] | None = None,
) -> ConfigError:
    """Attribute a mistake to the changes that cause it; drop its line if the file is valid.

    Args:
        error: Mistake of all changes together.
        changes: New values by dotted key.
        make: Function that builds the result from some of the changes; raises `ConfigError`.
        source: The file that is changed.
    """

    def mistake(some: Mapping[str, Any]) -> ConfigError | None:
        try:
            make(some)
        except ConfigError as error:
            return error
        return None

    if not changes or mistake({}) is not None:
        return error
    without = {k: mistake({o: v for o, v in changes.items() if o != k}) for k in changes}
    keys = [key for key, rest in without.items() if rest is None]
    if not keys:  # several mistakes, or a combination of keys
        keys = [key for key, rest in without.items() if rest and rest.problem != error.problem]
    is_here = isinstance(source, Document) and error.file == str(source.file)
    place = (None, None, None) if is_here else (error.file, error.line, error.column)
    return ConfigError(error.problem, *place, tuple(keys) or tuple(changes))


def set_by(pairs: Sequence[str], error: ConfigError) -> ConfigError:
    """Return a mistake in changes as an error that quotes their `--set key=value`."""
    pair_by_key = {pair.partition("=")[0].strip(): pair for pair in pairs}
    if error.file is not None or not error.keys:
        return error
    text = ", ".join(f"--set {_cut(pair_by_key[key])}" for key in error.keys)
    return ConfigError(f"{text}: {error.problem.removeprefix(f'{error.keys[0]}: ')}")


def _cut(pair: str) -> str:
    return pair if len(pair) <= _SHOWN else f"{pair[:_SHOWN]}..."


def set_key(data: dict[str, Any], key: str, value: Any) -> None:
    """Change one value by dotted key, creating missing mappings.

    Raises:
        ConfigError: a part of the key names something that is not there, or holds no keys.
    """
    node: Any = data
    above = ""
    names = key.split(".")
    for depth, name in enumerate(names, 1):
        place: Any = _place_in(node, name, above, key)
        if depth == len(names):
            node[place] = value
        else:
            node = node[place] if isinstance(node, list) else node.setdefault(place, {})
            above = name


def _place_in(node: Any, name: str, above: str, key: str) -> str | int:
    """Resolve one part of a dotted key: a key of a mapping, or an item of a list."""
    if isinstance(node, dict):
        return name
    if not isinstance(node, list):
        raise ConfigError(f"unknown key {key!r}: {above!r} has no keys")
    if not name.isdigit() or int(name) >= len(node):
        raise ConfigError(f"unknown key {key!r}: {above!r} has items 0 to {len(node) - 1}")
    return int(name)
