"""A study to begin with: commented, valid and quick as it stands."""

from __future__ import annotations

from pathlib import Path

from dva_sim.errors import ConfigError, DvaSimError

TEMPLATE = Path(__file__).parent / "templates" / "study.yaml"


def write_study(name: str) -> Path:
    """Write a new study.

    Args:
        name: Its name, or the path of its file.

    Returns:
        Its file.

    Raises:
        ConfigError: there is such a file already.
        DvaSimError: it cannot be written.
    """
    path = Path(name if name.endswith((".yaml", ".yml")) else f"{name}.yaml")
    try:
        with path.open("x", encoding="utf-8", newline="\n") as file:
            file.write(TEMPLATE.read_text(encoding="utf-8"))
    except FileExistsError:
        raise ConfigError(f"{path} is there already; give another name") from None
    except OSError as error:
        raise DvaSimError(f"{path} cannot be written: {error.strerror}") from None
    return path


def told(path: Path) -> str:
    """What can be done with a new study."""
    steps = [
        f"dva-sim {step}" for step in (f"check {path}", f"run {path} --dry-run", f"run {path}")
    ]
    return "\n  ".join([f"Wrote {path}. It runs as it stands:", *steps])
