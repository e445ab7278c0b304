"""Read YAML 1.2 as plain data, with line and column of every key for error messages."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path, PureWindowsPath
from typing import Any, Final, NamedTuple

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq, TaggedScalar
from ruamel.yaml.constructor import ConstructorError, RoundTripConstructor
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from dva_sim.kernel import resources
from dva_sim.kernel.errors import ConfigError

Place = tuple[int | None, int | None]


class Slip(NamedTuple):
    """Translation of a message of ruamel; and whether its context began at the mistake."""

    theirs: str
    ours: str
    is_at_begin: bool = False


_WORDS: Final = (
    Slip(r"mapping values are not allowed here",
         "a second colon on the line, or a key indented differently from its neighbours; "
         "quote text that contains a colon"),
    Slip(r"expected ',' or '([\]}])'", "a bracket is not closed: {0} is missing", True),
    Slip(r"found character '\\t'", "a tab; indent with spaces"),
    Slip(r"found character '(.)' that cannot start any token",
         "a value cannot begin with {0}; put it in quotes"),
    Slip(r"found unexpected (?:end of stream|document separator)", "a quote is not closed", True),
    Slip(r"found duplicate key \"?(.*?)\"? with value", "key {0!r} appears twice"),
    Slip(r"found undefined alias '(.*)'", "*{0} refers to nothing; quote text that begins with *"),
    Slip(r"could not find expected ':'", "a key without a colon and a value", True),
    Slip(r"found unknown escape character '(.)'",
         "\\{0} means nothing within double quotes; use single ones"),
    Slip(r"expected <block end>, but found '(?:-|<block sequence start>)'",
         "a list item indented differently from its neighbours"),
    Slip(r"expected <block end>",
         "indented differently from its neighbours, or text after a value"),
    Slip(r"but found another document", "a second document; give each a file of its own"),
    Slip(r"(?:block )?sequence entries are not allowed", "a list item begins on a line of its own"),
    Slip(r"expected (?:'<document start>'|<document start>)", "text after the end of the document"),
    Slip(r"found unhashable key", "a key is text or a number, not a list or a mapping"),
)  # fmt: skip
_THEIRS: Final = r"(found|expected|could|but|did|while) "  # messages of ruamel's own
_SIGNS: Final = {
    "'<stream end>'": "the end of the file",
    "<block end>": "the end of a block",
    "'<scalar>'": "a value",
    "'?'": "?",
}


def in_words(error: Any) -> tuple[str, Place]:
    """Return the problem in words, with its line and column, counted from 1.

    Args:
        error: Exception raised by ruamel, with its marks.
    """
    problem = str(error.problem or "").split("\n")[0]
    for entry in _WORDS:
        if match := re.search(entry.theirs, problem):
            mark = error.context_mark if entry.is_at_begin else None
            return entry.ours.format(*match.groups()), _place(mark or error.problem_mark)
    for sign, word in _SIGNS.items():
        problem = problem.replace(sign, word)
    if not problem or re.match(_THEIRS, problem):
        problem = f"is not valid YAML: {problem}".removesuffix(": ")
    return problem, _place(error.problem_mark or error.context_mark)


def _place(mark: Any) -> Place:
    return (mark.line + 1, mark.column + 1) if mark else (None, None)


KeyPath = tuple[str | int, ...]
SUFFIXES = (".yaml", ".yml")
MAX_VALUES = 20_000  # maximum values in one file


@dataclass(frozen=True)
class Document:
    """A parsed file: plain data, with the line and column of every key.

    Attributes:
        data: Plain dictionaries, lists and scalars.
        file: File that was read.
        places: Line and column (from 1) of each key path.
    """

    data: dict[str, Any]
    file: Path
    places: Mapping[KeyPath, tuple[int, int]] = field(default_factory=dict)

    def error(self, problem: str, path: KeyPath = ()) -> ConfigError:
        """Return the mistake at `path`, or at its nearest ancestor with a known place."""
        while path and path not in self.places:
            path = path[:-1]
        line, column = self.places.get(path, (None, None))
        return ConfigError(problem, self.file, line, column)


def read_text(path: Path) -> str:
    """Return the text of a file in UTF-8.

    Raises:
        ConfigError: it cannot be read, or is not UTF-8.
    """
    try:
        data = path.read_bytes()
        return data.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except OSError as error:
        raise ConfigError(f"cannot be read: {error.strerror}", path) from error
    except UnicodeDecodeError as error:
        before = data[: error.start].decode("utf-8", "replace")
        line = before.count("\n") + 1
        column = len(before) - (before.rfind("\n") + 1) + 1
        raise ConfigError("is not text in UTF-8", path, line, column) from error


def load_yaml(path: str | Path) -> Document:
    """Read a mapping from a YAML file.

    Raises:
        ConfigError: it cannot be read, is not YAML or a mapping, or repeats a key.
    """
    path = Path(path)
    text = read_text(path)
    try:
        data, places = _read(text)
    except MarkedYAMLError as error:
        problem, (line, column) = in_words(error)
        raise ConfigError(problem, path, line, column) from error
    except YAMLError as error:
        raise ConfigError(f"is not valid YAML: {str(error).splitlines()[0]}", path) from error
    except RecursionError:
        raise ConfigError("is nested too deeply", path) from None
    except _TooMuchError as error:
        raise ConfigError(str(error), path) from None
    except ValueError as error:  # such as the date 2001-13-32, or a number of 5000 digits
        raise ConfigError(f"has a value that cannot be read: {error}", path) from error
    if not isinstance(data, dict):
        raise ConfigError("should be a mapping of keys to values", path, 1, 1)
    return Document(deepcopy(data), path, places)


def with_named_files(path: Path) -> list[Path]:
    """Return a file and, if it is a YAML document, the files beside it that it names."""
    if path.suffix not in SUFFIXES:
        return [path]
    try:
        data = load_yaml(path).data
    except ConfigError:  # not a document, so it names no files
        return [path]
    names = [file_in(text) for text in texts_in(data) if "." in text]
    files = (file for name in names for file in (path.parent / name, beside(path, name)))
    return [path, *dict.fromkeys(filter(resources.is_file, files))]


def beside(path: Path, name: str) -> Path:
    """Return the file in the folder of `path` with the file name of another path, `name`."""
    return path.parent / PureWindowsPath(name).name


def file_in(name: str) -> str:
    """Return the file in a name, which may name a class in it: `file.py:Class`."""
    return name.rpartition(":")[0] if ".py:" in name else name


def texts_in(data: object) -> Iterator[str]:
    """Yield every text in plain data, except keys."""
    if isinstance(data, str):
        yield data
    elif isinstance(data, Mapping | list):
        for value in data.values() if isinstance(data, Mapping) else data:
            yield from texts_in(value)


@lru_cache(maxsize=64)
def _read(text: str) -> tuple[Any, Mapping[KeyPath, tuple[int, int]]]:
    """Return the plain data and its places.

    Cached, as each cell of a study reads the same scenario.
    """
    places: dict[KeyPath, tuple[int, int]] = {(): (1, 1)}
    return _plain(_reader().load(text), (), places), places


_OWN = "tag:yaml.org,2002:"
_VALUES = frozenset(
    f"{_OWN}{kind}"
    for kind in ("str", "int", "float", "bool", "null", "map", "seq", "timestamp", "merge")
)


class _PlainKinds(RoundTripConstructor):
    """Constructor of text, numbers, truth values, lists and mappings only.

    Otherwise a tag such as `!!python/object` would create objects that later code does not expect.
    """

    def construct_object(self, node: Any, deep: bool = False) -> Any:
        """Return the value of a node."""
        if str(node.tag) not in _VALUES:
            tag = str(node.tag).replace(_OWN, "!!")[:64]
            problem = f"{tag} makes no value that is known here; write the value without it"
            raise ConstructorError(problem=problem, problem_mark=node.start_mark)
        try:
            return super().construct_object(node, deep)
        except (ValueError, KeyError, IndexError, TypeError) as error:
            # Such as the date 2001-13-32, a number of 5000 digits, or `!!bool maybe`.
            problem = f"has a value that cannot be read: {error}"
            raise ConstructorError(problem=problem, problem_mark=node.start_mark) from error


def _reader() -> YAML:
    """Return a reader of YAML with its places."""
    reader = YAML(typ="rt", pure=True)
    reader.Constructor = _PlainKinds
    return reader


class _TooMuchError(ValueError):
    """Excess of values: nested aliases can expand to more than memory can hold."""


def _plain(node: Any, path: KeyPath, places: dict[KeyPath, tuple[int, int]]) -> Any:
    """Return the data without ruamel's types, and record the place of every key."""
    if len(places) > MAX_VALUES:
        raise _TooMuchError(f"has more than {MAX_VALUES} values, aliases counted")
    if isinstance(node, CommentedMap):
        out = {}
        for key, value in node.items():
            line, column, *_ = (node.lc.data or {}).get(key, (node.lc.line, node.lc.col))
            places[(*path, str(key))] = (line + 1, column + 1)
            out[str(key)] = _plain(value, (*path, str(key)), places)
        return out
    if isinstance(node, CommentedSeq):
        for index in range(len(node)):
            line, column = node.lc.item(index)
            places[(*path, index)] = (line + 1, column + 1)
        return [_plain(value, (*path, index), places) for index, value in enumerate(node)]
    if isinstance(node, bool) or node is None:
        return node
    if isinstance(node, TaggedScalar):
        return str(node.value)
    for kind in (int, float, str):
        if isinstance(node, kind):
            return kind(node)
    return node


def parse_scalar(text: str) -> Any:
    """Parse `text` as a YAML scalar: `--set seed=3` gives the number 3."""
    try:
        return _plain(YAML(typ="safe", pure=True).load(text), (), {})
    except (YAMLError, ValueError, RecursionError) as error:
        raise ConfigError(f"value {text[:80]!r} is not valid YAML") from error
