"""Plug-in classes by name: shipped, in a file, or from an installed package."""

from __future__ import annotations

import copy
import hashlib
import inspect
import math
import sys
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import Any, Final, Generic, TypeVar

from dva_sim.kernel import resources
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.retired import import_now
from dva_sim.kernel.suggestions import hint, unknown

T = TypeVar("T")
A = TypeVar("A")

FAILURES: Final = (Exception, SystemExit)  # errors of a plug-in: they must not end the program

LIMIT_TOLERANCE: Final = 0.02  # excess over a limit that counts as rounding, as a share of it


@dataclass(frozen=True)
class Plugins(Generic[T]):
    """One kind of plug-in.

    Attributes:
        kind: Name of the kind, such as `policy`.
        base: Base class.
        shipped: Shipped classes, by name.
        folder: Folder that is searched last, such as `agents/policies`.
        group: Group of entry points of installed packages, such as `dva_sim.policies`.
        key: Configuration key that names a plug-in, such as `dispatch.policy`.
        needs: Method that a class must define, as error messages write it.
        public: Module that users import `base` from.
        hidden: Shipped names that a configuration cannot use.
        finish: Wrapper of a user's plug-in, such as one that enforces limits.
    """

    kind: str
    base: type[T]
    shipped: Mapping[str, Callable[..., T]]
    folder: str
    group: str
    key: str
    needs: str
    public: str
    hidden: frozenset[str] = frozenset()
    finish: Callable[[T], T] | None = None

    def known(self) -> list[str]:
        """Return the names of shipped and installed plug-ins that a configuration can use.

        Names of files are not among them.
        """
        shipped = self.shipped.keys() - self.hidden
        return sorted(shipped | {entry.name for entry in self.installed()})

    def installed(self) -> list[EntryPoint]:
        """Return the plug-ins that installed packages offer."""
        return sorted(entry_points(group=self.group), key=lambda entry: entry.name)

    def files(self) -> list[Path]:
        """Return files in `folder`, whose classes can be named without their path."""
        paths = [path for root in resources.roots() for path in (root / self.folder).glob("*.py")]
        return sorted({path.resolve(): None for path in paths})

    def load(
        self,
        name: str | Callable[..., T],
        options: Mapping[str, Any] | None = None,
        base: Path | None = None,
    ) -> Callable[..., T]:
        """Return a factory for the plug-in of a name, with its options applied.

        Args:
            name: Name as for `find`.
            options: Further keyword arguments of its constructor.
            base: Folder as for `find`.

        Raises:
            ConfigError: as by `find`; a bad option is reported later by the factory.
        """
        factory = self.find(name, base)
        kept_options = dict(options or {})
        word = name_plugin(name)
        finish = None if factory in self.shipped.values() else self.finish

        def made(*arguments: Any) -> T:
            options_of_one = copy.deepcopy(
                kept_options
            )  # changes by one plug-in must not reach the next
            one = self.make(word, factory, options_of_one, *arguments)
            return one if finish is None else self.ask(word, partial(finish, one))

        return made

    def find(self, name: str | Callable[..., T], base: Path | None = None) -> Callable[..., T]:
        """Return the class that a name means.

        Args:
            name: Shipped name, class in a file such as `mine.py:Mine`, or entry point of an
                installed package; or the class itself.
            base: Folder in which a file is searched first, before the working folder and
                `folder`.

        Raises:
            ConfigError: the name is unknown, its file or package cannot be loaded, or it is not
                a plug-in of this kind.
        """
        if not isinstance(name, str):
            return self._right_class(name_plugin(name), name) if isinstance(name, type) else name
        return self.shipped.get(name) or self._from_file(name, base) or self._installed(name)

    def located(self, name: str, base: Path | None = None) -> str:
        """Return the name; that of a class in a file gets the file's full path, see `find`.

        Raises:
            ConfigError: the file does not exist.
        """
        file, colon, class_name = name.rpartition(":")
        if not colon or not file.endswith(".py"):
            return name
        return f"{self._find_file(name, file, base)}:{class_name}"

    def make(
        self, name: str, factory: Callable[..., T], options: Mapping[str, Any], *arguments: Any
    ) -> T:
        """Make a plug-in of a loaded class, from its options and its fixed arguments.

        Raises:
            ConfigError: an option is unknown or invalid, or the constructor fails.
        """
        self._check_options(name, factory, options, len(arguments))
        return self.ask(name, lambda: factory(*arguments, **options))

    def ask(self, name: str, what: Callable[[], A]) -> A:
        """Call code of a loaded plug-in, and report its errors.

        Raises:
            ConfigError: the code fails or tries to exit the program.
        """
        try:
            return what()
        except ConfigError as error:
            raise ConfigError(f"{self.kind} {name!r}: {error}") from None
        except FAILURES as error:
            problem = f"{self.kind} {name!r} cannot be made: {error_text(error)}"
            raise ConfigError(problem) from error

    def _check_options(
        self, name: str, factory: Callable[..., T], options: Mapping[str, Any], positional: int
    ) -> None:
        if not options:
            return
        parameters = list(inspect.signature(factory).parameters.values())[positional:]
        if any(p.kind is p.VAR_KEYWORD for p in parameters):
            return
        parameters_named = [
            p.name for p in parameters if p.kind not in (p.POSITIONAL_ONLY, p.VAR_POSITIONAL)
        ]
        for option in options:
            if option not in parameters_named:
                suggestion = hint(option, parameters_named) if parameters_named else "it has none"
                raise ConfigError(f"{self.kind} {name!r} has no option {option!r}; {suggestion}")

    # --- files -------------------------------------------------------------------------

    def _from_file(self, name: str, base: Path | None) -> type[T] | None:
        """Return the class for `file.py:Class`; None if the name has another form."""
        file, colon, class_name = name.rpartition(":")
        if not colon and name.endswith(".py"):
            raise ConfigError(f"{self.kind} {name!r} should name a class too, as {name}:Mine")
        if not colon or not file.endswith(".py"):
            return None
        path = self._find_file(name, file, base)
        module = _run(path, self.kind)
        plugin = vars(module).get(class_name)
        if plugin is None:
            classes = [c for c in vars(module).values() if isinstance(c, type)]
            class_names = [c.__name__ for c in classes if c.__module__ == module.__name__]
            suggestion = hint(class_name, class_names, "classes")
            problem = f"there is no class {class_name!r} in {path}; {suggestion}"
            raise ConfigError(f"{self.kind} {name!r}: {problem}")
        return self._right_class(name, plugin)

    def _find_file(self, name: str, file: str, base: Path | None) -> Path:
        folders = [] if base is None else [base]
        for root in resources.roots():
            folders += [root, root / self.folder]
        for folder in folders:
            if resources.is_file(folder / file):
                return (folder / file).resolve()
        near = ", ".join(dict.fromkeys(str(folder) for folder in [base or Path.cwd(), Path.cwd()]))
        problem = f"file {file!r} not found; looked in {near} and {self.folder}"
        raise ConfigError(f"{self.kind} {name!r}: {problem}")

    # --- packages ----------------------------------------------------------------------

    def _installed(self, name: str) -> type[T]:
        """Return the class that an installed package offers under a name."""
        offers = {entry.name: entry for entry in self.installed()}
        if name not in offers:
            problem = unknown(self.kind, name, self.known())
            more = "" if problem.endswith("?") else "; or a file: mine.py:Mine"
            raise ConfigError(problem + more)
        try:
            plugin = offers[name].load()
        except FAILURES as error:
            problem = f"{offers[name].value} cannot be loaded: {error_text(error)}"
            raise ConfigError(f"{self.kind} {name!r}: {problem}") from error
        return self._right_class(name, plugin)

    def _right_class(self, name: str, plugin: Any) -> type[T]:
        base = self.base
        if not (isinstance(plugin, type) and issubclass(plugin, base)):
            expected = f"should be a class derived from {self.public}"
            raise ConfigError(f"{self.kind} {name!r} is not a {self.kind}; {expected}")
        method = self.needs.partition("(")[0]
        if getattr(plugin, method) is getattr(base, method):
            raise ConfigError(f"{self.kind} {name!r} has no {self.needs}; should define it")
        return plugin


class Guard:
    """Guard of a plug-in in a run: counts its failures, after which the caller does without it.

    Attributes:
        failures: Number of missing or invalid answers.
        first_failure: First failure, in one line.
    """

    failures: int
    first_failure: str

    def _answer(self, ask: Callable[..., Any], *arguments: Any) -> tuple[float, float] | None:
        """Return two finite numbers, or None."""
        try:
            first, second = ask(*arguments)
            if math.isfinite(first) and math.isfinite(second):
                return float(first), float(second)
            self._count(f"answers {first!r}, {second!r}")
        except FAILURES as error:
            self._count(error_text(error))
        return None

    def _clamp(self, what: str, value: float, least: float, most: float) -> float:
        """Clamp a value to its limits; count a violation beyond rounding."""
        if not least - LIMIT_TOLERANCE * most <= value <= most + LIMIT_TOLERANCE * most:
            self._count(f"{what} {value:.3g}; allowed is {least:.3g} to {most:.3g}")
        return min(max(value, least), most)

    def _count(self, problem: str) -> None:
        self.failures += 1
        self.first_failure = self.first_failure or problem


def name_plugin(name: object) -> str:
    """Return the name of a plug-in in messages."""
    return name if isinstance(name, str) else getattr(name, "__qualname__", repr(name))


def error_text(error: BaseException) -> str:
    """Return an error in one line."""
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text}{import_now(error)}" if text else type(error).__name__


def _run(path: Path, kind: str) -> ModuleType:
    """Run a file as a module with a unique name, so that files of the same name do not clash."""
    unique = f"dva_sim_{kind}_{hashlib.sha256(bytes(path)).hexdigest()[:16]}"
    module = ModuleType(unique)
    module.__file__ = str(path)
    sys.modules[unique] = module  # dataclasses look up their module here
    try:
        exec(compile(path.read_bytes(), str(path), "exec"), vars(module))
    except SyntaxError as error:
        raise ConfigError(f"is not valid Python: {error.msg}", path, error.lineno) from None
    except OSError as error:
        raise ConfigError(f"cannot be read: {error.strerror or error}", path) from None
    except FAILURES as error:
        raise ConfigError(
            f"cannot be loaded: {error_text(error)}", path, _line(error, path)
        ) from error
    return module


def _line(error: BaseException, path: Path) -> int | None:
    """Return the last line of the file in the error's traceback; None if there is none."""
    frames = traceback.extract_tb(error.__traceback__)
    lines = [frame.lineno for frame in frames if frame.filename == str(path)]
    return lines[-1] if lines else None
