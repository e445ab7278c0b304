"""A study to begin with: commented, valid and quick as it stands."""

from __future__ import annotations

import shlex
from pathlib import Path

from dva_sim.kernel.errors import ConfigError, DvaSimError

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
        raise ConfigError(f"{name!r} is no name for a study; give one such as 'mine'")
    path = Path(name if name != plain else f"{name}.yaml")
    try:
        with path.open("x", encoding="utf-8", newline="\n") as file:
            file.write(TEMPLATE.read_text(encoding="utf-8"))
    except FileExistsError:
        raise ConfigError(f"{path} is there already; give another name") from None
    except OSError as error:
        raise DvaSimError(f"{path} cannot be written: {error.strerror}") from None
    return path


def told(path: Path) -> str:
    """What to do next with a new study."""
    steps = (
        ("check", "finds mistakes"),
        ("run --dry-run", "how many runs that is, and how long they take"),
        ("register", "fixes its hypotheses, so that the run confirms or refutes them"),
        ("run", "makes the runs and the report"),
    )
    commands = [" ".join(["dva-sim", *_with_file(step, path)]) for step, _ in steps]
    width = max(map(len, commands))
    lines = [f"  {c:{width}}  # {why}" for c, (_, why) in zip(commands, steps, strict=True)]
    ready = f"Wrote {path}. It works as it stands; its comments say what can be changed. Next:"
    return "\n".join([ready, *lines])


def _with_file(step: str, path: Path) -> list[str]:
    """The words of a command, the file behind the first."""
    verb, *options = step.split()
    return [verb, shlex.quote(str(path)), *options]
