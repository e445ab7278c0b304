"""What the shell may complete a word to: names that there are. Nothing heavy is imported for it."""

from __future__ import annotations

from collections.abc import Callable

Completer = Callable[[str], list[str]]


def names_in(*folders: str) -> Completer:
    """Completes the names of files in some folders, wherever those lie."""

    def complete(incomplete: str) -> list[str]:
        from dva_sim.kernel.resources import available

        found = [
            f"{'tasks/' if folder.endswith('/tasks') else ''}{name}"
            for folder in folders
            for name in available(folder)
        ]
        return sorted(name for name in found if name.startswith(incomplete))

    return complete


def one_of(*words: str) -> Completer:
    """Completes one of some words."""
    return lambda incomplete: [word for word in words if word.startswith(incomplete)]


STUDIES = names_in("experiments")
SCENARIOS = names_in("experiments/scenarios", "experiments/scenarios/tasks")
SITES = names_in("worlds")
