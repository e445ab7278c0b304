"""What holds of the modules of the program, whatever is in them."""

import ast
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest
from helpers.paths import ROOT

PACKAGE = ROOT / "dva_sim"
MODULES = {
    ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__"): path
    for path in sorted(PACKAGE.rglob("*.py"))
}
MOST_LINES = 600

# One meaning for each public class, but for these.
SHARED_NAMES = {
    "Relocation": "a policy's advice, and the message of the protocol that carries it",
    "Results": "what a folder holds, and the same with what can be concluded from it",
}


def imports_of(nodes: Iterable[ast.AST]) -> Iterator[str]:
    """Every module of ours that these statements import."""
    for node in nodes:
        if isinstance(node, ast.ImportFrom) and node.module in MODULES:
            for name in node.names:
                whole = f"{node.module}.{name.name}"
                yield whole if whole in MODULES else node.module
        elif isinstance(node, ast.Import):
            yield from (name.name for name in node.names if name.name in MODULES)


@cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def late_in(path: Path) -> list[ast.ImportFrom]:
    """The imports of ours inside functions and below conditions."""
    if not re.search(r"^ +(from|import) dva_sim", path.read_text(encoding="utf-8"), re.MULTILINE):
        return []
    inner = [node for node in ast.walk(tree_of(path)) if isinstance(node, ast.ImportFrom)]
    return [node for node in inner if node.col_offset and set(imports_of([node]))]


@cache
def imported_early() -> dict[str, set[str]]:
    """What each module imports when it is imported."""
    return {name: set(imports_of(tree_of(path).body)) for name, path in MODULES.items()}


@pytest.mark.system
def test_no_module_is_part_of_a_circle_of_imports():
    early = imported_early()
    graph = {name: {*early[name], *imports_of(late_in(path))} for name, path in MODULES.items()}
    graph = {name: imported - {name} for name, imported in graph.items()}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        raise AssertionError(" -> ".join(error.args[1])) from None


def test_a_late_import_is_for_start_up_and_says_so():
    """One of what is loaded by then anyway would save nothing."""
    early, late = imported_early(), []
    for name, path in MODULES.items():
        lines = path.read_text(encoding="utf-8").splitlines()
        typing = for_types(path) if late_in(path) else set()
        late += [
            (name, node, lines[node.lineno - 1]) for node in late_in(path) if node not in typing
        ]
    unmarked = [f"{name}:{node.lineno}" for name, node, line in late if MARK not in line]
    assert unmarked == []
    assert late
    in_vain = [
        f"{name}:{node.lineno} {target}"
        for name, node, _ in late
        for target in imports_of([node])
        if target in loaded_with(name, early)
    ]
    assert in_vain == []


MARK = "# late: start-up"


def for_types(path: Path) -> set[ast.AST]:
    """All that stands below `if TYPE_CHECKING`."""
    return {
        inner
        for node in ast.walk(tree_of(path))
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
        for inner in ast.walk(node)
    }


def loaded_with(name: str, early: dict[str, set[str]]) -> set[str]:
    """All modules that are there once one is imported, the packages they lie in among them."""
    known, open_ = {name}, [name]
    while open_:
        for module in (*early[open_[-1]], open_.pop().rpartition(".")[0]):
            if module in MODULES and module not in known:
                known.add(module)
                open_.append(module)
    return known


def test_the_web_process_serves_without_what_simulates():
    """Else each console costs as much memory again, and a second more until it is there."""
    loaded = loaded_with("dva_sim.console.web.__main__", imported_early())
    assert "dva_sim.recordings.audit_log" in loaded
    assert {name for name in loaded if name.startswith(SIMULATES)} == set()


SIMULATES = tuple(f"dva_sim.{room}." for room in ("agents", "core", "network", "simulation"))


def test_no_module_is_longer_than_600_lines():
    long = {
        name: len(path.read_text(encoding="utf-8").splitlines()) for name, path in MODULES.items()
    }
    assert {name: lines for name, lines in long.items() if lines > MOST_LINES} == {}


def test_a_public_class_name_means_one_thing():
    homes = defaultdict(list)
    for name, path in MODULES.items():
        for node in tree_of(path).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                homes[node.name].append(name)
    assert {name for name, rooms in homes.items() if len(rooms) > 1} == set(SHARED_NAMES)


def test_each_package_says_what_it_is():
    for name, path in MODULES.items():
        if path.name == "__init__.py":
            assert ast.get_docstring(tree_of(path)), name
