"""Which key somebody meant: one beside it, one elsewhere in the file, or one by another name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel

from dva_sim.guesses import either, guess, listed, plain_name

Path = tuple[str | int, ...]

_DEPTH = 4  # of keys in keys
_MEANT = 3  # keys of one name that are told
_UNITS = {
    "s": "seconds",
    "m": "metres",
    "mps": "metres per second",
    "hz": "hertz",
    "bps": "bits per second",
    "bytes": "bytes",
    "deg": "degrees",
    "rad": "radians",
}


@dataclass(frozen=True)
class AlsoCalled:
    """Names that people try for a key, beside the key itself: `Annotated[int, AlsoCalled("n")]`."""

    names: tuple[str, ...]

    def __init__(self, *names: str) -> None:
        object.__setattr__(self, "names", names)


def meant(path: Path, value: Any, *models: Any) -> str:
    """What to write instead of an unknown key: `did you mean 'x'?`, or what there is.

    Args:
        path: The key as it was given.
        value: What it was given.
        models: What the file may be; the first has the place of the key.
    """
    given, here = str(path[-1]), fields_at(models[0], path[:-1])
    known = {} if isinstance(value, Mapping) else _every_name(models)
    exact = [key for name, key in known.items() if plain_name(name) == plain_name(_dotted(path))]
    if exact:
        return _ask(given, exact)
    beside = {name: name for name in here} | {
        other: name for name, info in here.items() for other in _others(info)
    }
    near = guess(given, beside)
    if near is not None:
        return _ask(given, [beside[near]])
    found = _elsewhere(path, known)
    if found:
        return _ask(given, found)
    return f"known here: {listed(sorted(here), most=24)}" if here else ""


def keys_of(model: Any) -> dict[str, tuple[str, ...]]:
    """Every dotted key of a model, and what else people call it."""
    return {key: _others(info) for key, info in _walk(model, "", _DEPTH)}


def fields_at(model: Any, path: Path) -> Mapping[str, Any]:
    """The fields of the model that stands at `path` inside `model`, by name."""
    for step in path:
        if isinstance(step, int):
            continue
        info = _fields(model).get(step)
        if info is not None:  # else a key that the user chose, inside a mapping to models
            model = model_in(info.annotation)
    return _fields(model)


def model_in(annotation: Any) -> Any:
    """The first pydantic model inside an annotation such as `tuple[Event, ...] | None`."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for inner in getattr(annotation, "__args__", ()):
        found = model_in(inner)
        if found is not None:
            return found
    return None


def _every_name(models: tuple[Any, ...]) -> dict[str, str]:
    """All dotted keys by their names, and by what else they are called."""
    known: dict[str, str] = {}
    for key, others in (item for model in models for item in keys_of(model).items()):
        for name in (key, *others):
            known.setdefault(name, key)
    return known


def _elsewhere(path: Path, known: Mapping[str, str]) -> list[str]:
    """Keys in other places that are called so, or else the one most like it."""
    last = plain_name(str(path[-1]))
    names = {name: plain_name(name.rpartition(".")[2]) for name in known}
    near = last if last in names.values() else guess(last, names.values())
    same = list(dict.fromkeys(known[name] for name, end in names.items() if end == near))
    least = min((key.count(".") for key in same), default=0)
    return [key for key in same if key.count(".") == least][:_MEANT]


def _dotted(path: Path) -> str:
    return ".".join(map(str, path))


def _ask(given: str, keys: list[str]) -> str:
    """The keys that may be meant, with their unit where another one was given."""
    unit, other = keys[0].rpartition("_")[2], given.rpartition("_")[2]
    told = f" (in {_UNITS[unit]})" if unit in _UNITS and other != unit else ""
    return f"did you mean {either(map(repr, keys))}?{told}"


def _walk(model: Any, above: str, depth: int) -> Iterator[tuple[str, Any]]:
    for name, info in _fields(model).items():
        yield f"{above}{name}", info
        inner = model_in(info.annotation)
        if inner is not None and depth > 1:
            step = ".0" if "tuple" in str(info.annotation) else ""
            yield from _walk(inner, f"{above}{name}{step}.", depth - 1)


def _fields(model: Any) -> dict[str, Any]:
    """Of a model, with those of what it takes its other keys from."""
    further = getattr(model, "further_keys", None)
    fields: dict[str, Any] = dict(getattr(model, "model_fields", {}))
    return fields | (dict(further().model_fields) if further is not None else {})


def _others(info: Any) -> tuple[str, ...]:
    return tuple(n for m in info.metadata if isinstance(m, AlsoCalled) for n in m.names)
