"""Study files: created from a template, and read with a command's changes.

`--set`, and the keys `quick` and `full` of a study, change keys of the study or of its scenarios.
Settings come as the `key=value` pairs of the command line, or as Python has them.
"""

from __future__ import annotations

import copy
import dataclasses
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel

from dva_sim.experiments.study import validation
from dva_sim.experiments.study.cell_grid import cells
from dva_sim.experiments.study.designs import all_factors, read_table
from dva_sim.experiments.study.registration import settled
from dva_sim.experiments.study.study import FOLDER, SIZES, Study, Version
from dva_sim.kernel import resources
from dva_sim.kernel.config import Config, meant, validate
from dva_sim.kernel.config_overrides import blame, parse_changes, set_by
from dva_sim.kernel.errors import ConfigError, DvaSimError
from dva_sim.kernel.streams import derive_seed
from dva_sim.kernel.suggestions import either, hint
from dva_sim.kernel.yaml_files import Document, KeyPath, load_yaml, parse_scalar, read_text
from dva_sim.simulation.models import MODELS, model_of
from dva_sim.simulation.scenario import load as load_scenario


@dataclass(frozen=True)
class Changed:
    """A study's data with some keys changed.

    Attributes:
        data: Data as a file would hold it.
        changes: Keys of the scenarios, which hold in every part.
        touched: Paths of the changed keys.
    """

    data: dict[str, Any]
    changes: dict[str, Any]
    touched: tuple[KeyPath, ...]

    def holds(self, path: KeyPath) -> bool:
        """Return True if the value at `path` is unchanged."""
        return not any(path[: len(t)] == t for t in self.touched)


def change(
    before: Changed,
    pairs: Mapping[str, Any],
    model: type[BaseModel],
    scenarios: Sequence[type[BaseModel]],
) -> Changed:
    """Change some keys.

    A key of the study (`seed`, `factors.pattern`) changes the study. Any other is one of the
    scenario; if it is a factor, its value or list of values takes the place of its levels.

    Args:
        before: Data to change.
        pairs: New values by dotted key.
        model: The keys of a study.
        scenarios: The keys of the scenarios that there are.

    Raises:
        ConfigError: a key that neither the study nor any scenario has.
    """
    data = copy.deepcopy(before.data)
    changes = dict(before.changes)
    touched = [*before.touched]
    factors = data.setdefault("factors", {})
    for key, value in pairs.items():
        first = key.partition(".")[0]
        if key not in factors and first not in model.model_fields:
            if not any(first in scenario.model_fields for scenario in scenarios):
                hint = meant(tuple(key.split(".")), value, model, *scenarios)
                raise ConfigError(f"unknown key {key!r}; {hint}")
            changes[key] = value
            continue
        path = ("factors", key) if key in factors else _path(data, key, model)
        is_level = path[0] == "factors" and len(path) == 2 and not isinstance(value, list)
        _put(data, path, [value] if is_level else value)
        touched.append(path)
    return Changed(data, changes, tuple(touched))


def _path(data: Any, key: str, kind: Any) -> tuple[str, ...]:
    """Resolve a dotted key of the study to its path, by the types along it.

    Raises:
        ConfigError: it leads through what is not there, or to what holds no keys.
    """
    path: tuple[str, ...] = ()
    while key:
        kind = _bare(kind)
        mapping = data if isinstance(data, dict) else {}
        if isinstance(kind, type(BaseModel)):
            step = key.partition(".")[0]
            field = kind.model_fields.get(step)
            kind = field.annotation if field is not None else None
        elif get_origin(kind) is dict:
            kind = _bare(get_args(kind)[1])
            has_keys = get_origin(kind) is dict or isinstance(kind, type(BaseModel))
            step = _entry(mapping, key) if has_keys else key
        else:
            raise ConfigError(f"{'.'.join(path)!r} has no keys, so no {key!r}")
        path = (*path, step)
        key = key[len(step) + 1 :]
        data = mapping.get(step)
    return path


def _bare(kind: Any) -> Any:
    """Return a type without what may be said of it besides, and without its None."""
    while get_origin(kind) in (Annotated, Union, UnionType):
        kind = get_args(kind)[0]
    return kind


def _entry(mapping: Mapping[str, Any], key: str) -> str:
    """Return the name in a mapping that a dotted key begins with.

    The whole key may be a new name.
    """
    names = [name for name in mapping if key == name or key.startswith(f"{name}.")]
    if not names and "." in key:
        first = key.partition(".")[0]
        raise ConfigError(f"no {first!r} in the study to change; {hint(first, mapping, 'there')}")
    return max(names, key=len, default=key)


def _put(data: dict[str, Any], path: tuple[str, ...], value: Any) -> None:
    for step in path[:-1]:
        if not isinstance(data.get(step), dict):
            data[step] = {}
        data = data[step]
    data[path[-1]] = value


Settings = Mapping[str, Any] | Iterable[str]


def pairs_of(settings: Settings, seed: int | None = None) -> list[str]:
    """Return settings, and the seed if one is given, as on the command line.

    Raises:
        ConfigError: a value that no file could hold.
    """
    seeds = [] if seed is None else [f"seed={seed}"]
    if not isinstance(settings, Mapping):
        return [*settings, *seeds]
    return [*(f"{key}={_as_text(key, value)}" for key, value in settings.items()), *seeds]


def _as_text(key: str, value: Any) -> str:
    """Return a value as YAML: plain words where possible, otherwise JSON."""
    if isinstance(value, str | Path) and parse_scalar(str(value)) == str(value):
        return str(value)
    try:
        return json.dumps(value, default=_plain)
    except (TypeError, ValueError):
        raise ConfigError(f"set: {key} cannot be {value!r}") from None


def _plain(value: Any) -> Any:
    """Return numbers and arrays of numpy, and paths, as JSON can hold them."""
    if isinstance(value, Path):
        return str(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is not a number, word, list or mapping")


TEMPLATE = Path(__file__).parent / "templates" / "study.yaml"


def write_study(name: str) -> Path:
    """Write a new study.

    Args:
        name: Its name, or the path of its file.

    Returns:
        Its file.

    Raises:
        ConfigError: there is such a file already, or it has no name.
        DvaSimError: it cannot be written.
    """
    plain = name.removesuffix(".yaml").removesuffix(".yml")
    if not Path(plain).name.strip("."):
        raise ConfigError(f"{name!r} cannot be the name of a study; give a name such as 'mine'")
    path = Path(name if name != plain else f"{name}.yaml")
    try:
        with path.open("x", encoding="utf-8", newline="\n") as file:
            file.write(TEMPLATE.read_text(encoding="utf-8"))
    except FileExistsError:
        raise ConfigError(f"{path} already exists; give another name") from None
    except OSError as error:
        raise DvaSimError(f"{path} cannot be written: {error.strerror}") from None
    return path


def load_study(
    name: str | Path,
    settings: Iterable[str] = (),
    *,
    version: Version | None = None,
    pilot: int | None = None,
) -> Study:
    """Read a study by name or path.

    Args:
        name: The study.
        settings: `key=value` pairs. A key of the study (`seed=2`, `factors.pattern=[req-rep]`)
            changes the study. Any other key is one of the scenario and holds in every part; if
            it is a factor, its value or list of values takes the place of the factor's levels.
        version: The small or the larger version, by the study's key `quick` or `full`.
        pilot: Only so many persons, with random seeds that the study itself never uses.

    Raises:
        ConfigError: not found, not valid, or changes that make no sense.
    """
    document = load_yaml(resources.find(str(name), FOLDER, is_asked=True))
    study, data = _in_version(document, version)
    usual = study.usual
    if settings := tuple(settings):
        study = _with_settings(data, document, settings)
    study._version = version
    study._usual = usual
    if pilot is not None:
        study = _piloted(study, pilot)
    return settled(study)


def _in_version(document: Document, version: Version | None) -> tuple[Study, Changed]:
    """Return the study as its file says, or one of its versions; all of them are judged."""
    written = Changed(document.data, {}, ())
    study = _built(written, document)
    factors = {name: list(levels) for name, levels in study.factors.items()}
    size = {"persons": study.persons, "replications": study.replications, "factors": factors}
    study._usual = {"name": study.file.stem} | size
    made = {name: _version_of(study, written, document, name) for name in study.versions}
    if version is None:
        return study, written
    if version not in made:
        files = resources.available(FOLDER).items()
        names = either([name for name, file in files if f"\n{version}:" in read_text(file)])
        raise document.error(f"has no {SIZES[version]} version: no key {version!r}; {names} have")
    return made[version]


def _version_of(
    study: Study, written: Changed, document: Document, version: Version
) -> tuple[Study, Changed]:
    """Return a version, and its keys.

    Claims about what the small version leaves out are left out.
    """
    try:
        data = change(written, getattr(study, version), Study, _scenarios_of(written, document))
        made = _built(data, document, may_lose=version == "quick")
        if study.answer is not None and not _is_answered(made, data):
            _built(data, document)  # which tells why it cannot be answered
        made._usual = study.usual
        return made, data
    except ConfigError as error:
        named = [
            key
            for key in getattr(study, version)
            if key.rpartition(".")[2] in error.problem
            or any(repr(step) in error.problem for step in key.split("."))
        ]
        problem = f"in the {SIZES[version]} version: {error.problem}"
        raise study.error(problem, (version, *named[:1])) from None


def _is_answered(study: Study, data: Changed) -> bool:
    """Return True if the study has the very contrast that its keys declare."""
    declared = (data.data.get("answer") or {}).get("contrast", ())
    return study.answer is not None and study.answer.contrast == tuple(declared)


def _with_settings(data: Changed, document: Document, settings: tuple[str, ...]) -> Study:
    """Return the study changed by `--set`; claims about levels that are gone are gone, too."""
    changes = parse_changes(settings)
    scenarios = _scenarios_of(data, document)

    def make(some: Mapping[str, Any]) -> Study:
        return _built(change(data, some, Study, scenarios), document, may_lose=True)

    try:
        study = make(changes)
    except ConfigError as error:
        raise set_by(settings, blame(error, changes, make, document)) from None
    study._settings = settings
    return study


def _scenarios_of(data: Changed, document: Document) -> list[type[Config]]:
    """Return the kinds of scenarios that the parts have; all kinds where one cannot be read."""
    try:
        named = [part["scenario"] for part in data.data["parts"].values()]
        files = [load_scenario(name, base=document.file.parent) for name in named]
        return list({model_of(file).scenario: None for file in files})
    except (ConfigError, LookupError, TypeError, AttributeError):
        return [model.scenario for model in MODELS.values()]


def _piloted(study: Study, persons: int) -> Study:
    """Return a pilot with its own random numbers, so that it reveals nothing of the study."""
    if persons < 1:
        raise ConfigError(f"a pilot should have at least 1 person, not {persons}")
    seed = derive_seed(study.seed, "pilot")
    pilot = study.model_copy(update={"persons": persons, "seed": seed, "stop": None})
    pilot._pilot = persons
    for problem, _ in validation.of_size(pilot):
        raise ConfigError(f"a pilot of {persons} persons: {problem}")
    return pilot


def _built(data: Changed, document: Document, may_lose: bool = False) -> Study:
    """Return the study, if it makes sense.

    Args:
        data: Its keys.
        document: Its file.
        may_lose: True if claims about missing factors or levels are dropped instead of rejected.
    """
    study = validate(Study, data.data, document.error)
    study._document = dataclasses.replace(
        document, places={p: at for p, at in document.places.items() if data.holds(p)}
    )
    study._changes = data.changes
    study._table = _table_of(study)
    _tell_first(study, validation.of_design(study))
    factors = all_factors(study.design, study.factors, study.listed_rows)
    study = study.model_copy(update={"factors": factors})
    _tell_first(study, validation.of_factors(study))
    if may_lose:
        # A claim that is made in the same breath is a mistake and no loss.
        _tell_first(study, (f for f in validation.of_claims(study) if not data.holds(f[1])))
        lost = validation.lost_claims(study)
        study = validation.kept_claims(study)
        study._lost = tuple(lost)
    elif wrong := next(validation.of_claims(study), None):
        # A claim may be right about a factor or level that is misspelt where it is declared.
        cells(validation.kept_claims(study))
        raise study.error(*wrong)
    _tell_first(study, validation.of_stop(study))
    return study


def _table_of(study: Study) -> Document | None:
    """Return the rows of the file that the design names; None if it names none."""
    if study.design is None or study.design.csv is None:
        return None
    try:
        path = resources.find(study.design.csv, FOLDER, suffix=".csv", base=study.folder)
    except ConfigError as error:
        problem = error.problem.replace("file ", "file of rows ", 1)
        raise study.error(problem, ("design", "csv")) from None
    return read_table(path)


def _tell_first(study: Study, problems: Iterable[validation.Problem]) -> None:
    for problem, path in problems:
        raise study.error(problem, path)
