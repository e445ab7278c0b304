"""Read YAML 1.2 and check it against a pydantic model; mistakes are told by line and column."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, ValidationError
from pydantic_core import CoreSchema
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from dva_sim.errors import ConfigError
from dva_sim.wording import first_mistake

Path_ = tuple[str | int, ...]
M = TypeVar("M", bound=BaseModel)
Fail = Callable[[str, Path_], ConfigError]
"""Makes the error for a problem at a key path."""


def _make_strict(schema: Any) -> None:
    """Let no number in a schema be read from something else; lists and paths may be."""
    if isinstance(schema, dict):
        if schema.get("type") in ("int", "float", "bool"):
            schema["strict"] = True
        for key in schema.keys() - {"default", "metadata"}:
            _make_strict(schema[key])
    elif isinstance(schema, list | tuple):
        for inner in schema:
            _make_strict(inner)


class Config(BaseModel):
    """Base of all configuration: unknown keys are mistakes, values do not change.

    Numbers are numbers: neither `true` nor `"2"` is one, and `2.0` is no whole number.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    def __repr_args__(self) -> Iterator[tuple[str | None, Any]]:
        """What is otherwise than by default, so that a whole scenario fits a screen."""
        fields = type(self).model_fields
        for name, value in super().__repr_args__():
            info = fields.get(name or "")
            if info is None or value != info.get_default(call_default_factory=True):
                yield name, value

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """The schema of the model, with its numbers and truth values strict."""
        schema = handler(source)
        _make_strict(schema)
        return schema


MOST_VALUES = 20_000  # in one file


@dataclass(frozen=True)
class Document:
    """A parsed file: plain data, and the place of every key.

    Attributes:
        data: Plain dictionaries, lists and scalars.
        file: Where it was read.
        places: Line and column (from 1) of each key path.
    """

    data: dict[str, Any]
    file: Path
    places: Mapping[Path_, tuple[int, int]] = field(default_factory=dict)

    def error(self, problem: str, path: Path_ = ()) -> ConfigError:
        """The mistake at `path`, or at its nearest ancestor with a known place."""
        while path and path not in self.places:
            path = path[:-1]
        line, column = self.places.get(path, (None, None))
        return ConfigError(problem, self.file, line, column)


def read_text(path: Path) -> str:
    """The text of a file in UTF-8.

    Raises:
        ConfigError: unreadable, or a byte that such a text cannot have, with its place.
    """
    try:
        data = path.read_bytes()
        return data.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except OSError as error:
        raise ConfigError(f"cannot be read: {error.strerror}", path) from error
    except UnicodeDecodeError as error:
        before = data[: error.start].decode("utf-8", "replace")
        line, column = before.count("\n") + 1, len(before) - (before.rfind("\n") + 1) + 1
        raise ConfigError("is not text in UTF-8", path, line, column) from error


def load_yaml(path: str | Path) -> Document:
    """Read a mapping from a YAML file.

    Raises:
        ConfigError: unreadable, not YAML, a key twice, or not a mapping.
    """
    path = Path(path)
    text = read_text(path)
    try:
        tree = YAML(typ="rt", pure=True).load(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        problem = (error.problem or "is not valid YAML").split("\n")[0]
        line, column = (mark.line + 1, mark.column + 1) if mark else (None, None)
        raise ConfigError(problem, path, line, column) from error
    except YAMLError as error:
        raise ConfigError(f"is not valid YAML: {str(error).splitlines()[0]}", path) from error
    except RecursionError:
        raise ConfigError("is nested too deeply", path) from None
    except ValueError as error:  # such as the date 2001-13-32, or a number of 5000 digits
        raise ConfigError(f"has a value that cannot be read: {error}", path) from error
    if not isinstance(tree, CommentedMap):
        raise ConfigError("should be a mapping of keys to values", path, 1, 1)
    places: dict[Path_, tuple[int, int]] = {(): (1, 1)}
    try:
        data = _plain(tree, (), places)
    except _TooMuchError as error:
        raise ConfigError(str(error), path) from None
    except RecursionError:
        raise ConfigError("is nested too deeply", path) from None
    assert isinstance(data, dict)
    return Document(data, path, places)


class _TooMuchError(ValueError):
    """A few aliases of aliases can stand for more values than any memory holds."""


def _plain(node: Any, path: Path_, places: dict[Path_, tuple[int, int]]) -> Any:
    """Plain data without ruamel's types; records the place of every key on the way."""
    if len(places) > MOST_VALUES:
        raise _TooMuchError(f"has more than {MOST_VALUES} values, aliases counted")
    if isinstance(node, CommentedMap):
        out = {}
        for key, value in node.items():
            line, column = node.lc.key(key)
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
    for kind in (int, float, str):
        if isinstance(node, kind):
            return kind(node)
    return node


def parse_scalar(text: str) -> Any:
    """What `text` would be as a value in YAML: `--set seed=3` gives the number 3."""
    try:
        return _plain(YAML(typ="safe", pure=True).load(text), (), {})
    except (YAMLError, ValueError, RecursionError) as error:
        raise ConfigError(f"value {text[:80]!r} is not valid YAML") from error


def validate(
    model: type[M],
    data: Mapping[str, Any],
    error: Fail | None = None,
) -> M:
    """Build `model` from `data`.

    Args:
        model: The pydantic model.
        data: Plain data.
        error: Makes the error for a problem at a key path; normally `Document.error`.

    Raises:
        ConfigError: the first mistake, with the key and what would be right.
    """
    try:
        return model.model_validate(data)
    except ValidationError as problems:
        text, path = first_mistake(model, data, problems.errors(include_url=False))
        raise (error or _unplaced)(text, path) from None


def _unplaced(problem: str, path: Path_) -> ConfigError:
    return ConfigError(problem)
