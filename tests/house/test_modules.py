"""Rules for all modules of the program."""

import ast
import re
import tomllib
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from itertools import chain
from pathlib import Path

import pytest
from helpers.paths import ROOT

PACKAGE = ROOT / "dva_sim"
MODULES = {
    ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__"): path
    for path in sorted(PACKAGE.rglob("*.py"))
}

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
def nodes_of(path: Path) -> list[ast.AST]:
    return list(ast.walk(tree_of(path)))


@cache
def late_in(path: Path) -> list[ast.ImportFrom]:
    """The imports of ours inside functions and below conditions."""
    if not re.search(r"^ +(from|import) dva_sim", path.read_text(encoding="utf-8"), re.MULTILINE):
        return []
    inner = [node for node in nodes_of(path) if isinstance(node, ast.ImportFrom)]
    return [node for node in inner if node.col_offset and set(imports_of([node]))]


@cache
def imported_early() -> dict[str, set[str]]:
    """Imports that each module makes when it is imported."""
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


# --- what no module does ---------------------------------------------------------------
CONTRACTS = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
FLOORS = {
    room: floor
    for floor, rooms in enumerate(reversed(CONTRACTS["contracts"][0]["layers"]))
    for room in rooms.split(" | ")
}
MOST_ARGUMENTS = 6
VARIADIC = {"_columns", "_new", "add_row", "attrgetter", "call_at", "chain", "pack"}
"""Functions that take any number of arguments of one kind, or pass them on."""


def faults_of(node: ast.AST, room: str) -> Iterator[str]:
    """Faults of a statement or expression, in its room."""
    if isinstance(node, ast.Import):
        yield from _faults_of_import([each.name for each in node.names])
    elif isinstance(node, ast.ImportFrom) and not node.level:
        yield from _faults_of_import([f"{node.module}.{each.name}" for each in node.names])
    elif isinstance(node, ast.Assign | ast.Delete):
        for target in map(ast.unparse, node.targets):
            # The file of a user gets a name of its own there, as importlib's page shows it.
            if re.match(r"(sys\.)?modules\[", target) and target != "sys.modules[unique]":
                yield f"stands in for a module: {target}"
    elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
        if node.value.id == "ast" and node.attr != "literal_eval":
            yield f"reads source: ast.{node.attr}"
        if node.value.id == "sys" and node.attr in ("meta_path", "path_hooks"):
            yield f"takes part in imports of others: sys.{node.attr}"
    elif isinstance(node, ast.Subscript):
        if re.fullmatch(r"(sys\.)?modules\['__main__'\]", ast.unparse(node)):
            yield "meddles with the script of a user"
    elif isinstance(node, ast.Call):
        yield from _faults_of_call(node)
    elif isinstance(node, ast.Constant) and isinstance(node.value, str):
        named = re.findall(r"^dva_sim\.(\w+)(?:[\w.]*:\w+|\.[\w.]*)?$", node.value)
        if room in FLOORS and any(FLOORS.get(each, -1) > FLOORS[room] for each in named):
            yield f"names a room above it: {node.value}"


def _faults_of_import(names: Iterable[str]) -> Iterator[str]:
    for name in names:
        package, *rest = name.split(".")
        if package != "dva_sim" and any(re.match(r"_(?!_)", part) for part in rest):
            yield f"is private: {name}"
        if package == "ast" and rest:
            yield f"reads source: {name}"


def _faults_of_call(call: ast.Call) -> Iterator[str]:
    called, given = _called(call), _by_place(call)
    if called == "set_threshold":
        yield "sets when garbage is looked for"
    if given > MOST_ARGUMENTS and called not in VARIADIC:
        yield f"may exchange arguments: {called} with {given} by their place"


def _called(call: ast.Call) -> str:
    return getattr(call.func, "attr", getattr(call.func, "id", ""))


def _by_place(call: ast.Call) -> int:
    given = 0
    for each in call.args:
        spread = isinstance(each, ast.Starred) and isinstance(each.value, ast.Tuple | ast.List)
        given += len(each.value.elts) if spread else 1
    return given


MOST_ALIKE = 4
OF_PLUGINS = {"accelerations"}
"""Methods that users' classes define: only the positions of their arguments are known."""
ALIKE = {
    "number": r"float|int|bool",
    "text": r"str|Literal\[.*",
    "array": r"NDArray\b.*|Floats|Ints|Integers|Flags",
    "callable": r"Callable\b.*",
}


def kinds_of(arguments: Iterable[ast.expr | None]) -> list[str]:
    """Kinds of values, by their annotations, of which a type check lets one pass for another."""
    plain = [ast.unparse(each or ast.Constant(0)).removesuffix(" | None") for each in arguments]
    return [
        next((kind for kind, words in ALIKE.items() if re.fullmatch(words, each)), each)
        for each in plain
    ]


def signatures(nodes: Iterable[ast.AST]) -> dict[str, list[list[str]]]:
    """Kinds of the arguments of all functions and classes, by the names that they are called by."""
    found, others = defaultdict(list), []
    for scope in nodes:
        of_class, body = isinstance(scope, ast.ClassDef), getattr(scope, "body", ())
        fields = []
        for node in body if isinstance(body, list) else ():
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                own = any(ast.unparse(each) == "staticmethod" for each in node.decorator_list)
                given = [*node.args.posonlyargs, *node.args.args][of_class and not own :]
                made = of_class and node.name in ("__init__", "__new__")
                kinds = kinds_of(argument.annotation for argument in given)
                found[scope.name if made else node.name].append(kinds)
            elif isinstance(node, ast.AnnAssign) and of_class:
                fields.append(node.annotation)
            elif isinstance(node, ast.Assign) and re.match(r"maker\(", ast.unparse(node.value)):
                others.append((ast.unparse(node.targets[0]), ast.unparse(node.value.args[0])))
        if fields:
            found[scope.name].append(kinds_of(fields))
    for name, kind in others:
        found[name] += found[kind.rpartition(".")[2]]
    return found


def exchangeable(nodes: Iterable[ast.AST], known: dict[str, list[list[str]]]) -> list[str]:
    """Calls with more arguments of one kind by their place than anybody can tell apart."""
    return [
        f"{_called(call)} with {count} {kind} by their place"
        for call in nodes
        if isinstance(call, ast.Call)
        and _by_place(call) > MOST_ALIKE
        and _called(call) not in OF_PLUGINS
        for kinds in known.get(_called(call), ())
        if len(kinds) >= _by_place(call)
        for kind, count in Counter(kinds[: _by_place(call)]).items()
        if count > MOST_ALIKE
    ]


OF_TUPLES = {"_asdict", "_fields", "_make", "_replace"}
DOCUMENTED = {"_Element", "_ElementTree", "_exit", "_repr_html_"}
"""Names without another spelling: of lxml, of `os`, of pandas."""


def read_of_others(nodes: Iterable[ast.AST]) -> set[str]:
    """Private names that are read or set of something else, and which none of ours has."""
    own, others = set(), set()
    for node in nodes:
        if isinstance(node, ast.Attribute):
            if node.attr.startswith("_") and not node.attr.startswith("__"):
                is_own = isinstance(node.value, ast.Name) and node.value.id in ("self", "cls")
                is_of_base = ast.unparse(node.value) == "super()"
                (own if is_own or is_of_base else others).add(node.attr)
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            own.add(node.name)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            own.add(node.id)
    return others - own - OF_TUPLES - DOCUMENTED


def test_no_module_does_what_none_should():
    found = {}
    for name, path in MODULES.items():
        room = name.split(".")[1] if "." in name else ""
        faults = [fault for node in nodes_of(path) for fault in faults_of(node, room)]
        if faults:
            found[name] = faults
    assert found == {"dva_sim.kernel.rare_collection": ["sets when garbage is looked for"]}
    assert read_of_others(chain.from_iterable(map(nodes_of, MODULES.values()))) == set()


@pytest.mark.parametrize(
    "read", ["self._pool._processes", "env._eid", "pool()._queue", "param._made"]
)
def test_a_private_name_that_none_of_ours_has_is_found_where_it_is_read(read):
    own = "class Own:\n    def _mine(self): self._kept = other._kept, other._mine(), os._exit\n"
    assert read_of_others(ast.walk(ast.parse(own))) == set()
    for use in (read, f"{read} = 1"):
        assert read_of_others(ast.walk(ast.parse(own + use))) == {read.rpartition(".")[2]}


@pytest.mark.parametrize(
    ("source", "fault"),
    [
        ("from scipy.ndimage._measurements import label", "private"),
        ("import pymunk._chipmunk_cffi", "private"),
        ("def f():\n    from typer.main import _main", "private"),
        ("sys.modules['scipy'] = stand_in", "stands in"),
        ("from sys import modules\nmodules[package] = module", "stands in"),
        ("del sys.modules['numpy']", "stands in"),
        ("sys.meta_path.append(finder)", "imports of others"),
        ("main = vars(sys.modules['__main__'])", "script of a user"),
        ("import ast\nast.parse(text)", "reads source"),
        ("from ast import parse", "reads source"),
        ("class A:\n    teller = 'dva_sim.cli.stories:tell_any'", "above"),
        ("page = 'dva_sim.experiments.report.shift_page:ShiftPage'", "above"),
        ("import_module('dva_sim.api')", "above"),
        ("Band(mean, low, high, lowest, highest, critical, count)", "exchange"),
        ("Band(*(mean, low, high, lowest), highest, critical, count)", "exchange"),
        ("gc.set_threshold(50_000)", "garbage"),
    ],
)
def test_what_none_should_do_is_found_where_it_is_done(source, fault):
    (found,) = [f for node in ast.walk(ast.parse(source)) for f in faults_of(node, "simulation")]
    assert fault in found


def test_no_call_has_many_arguments_of_one_kind_by_their_place():
    nodes = list(chain.from_iterable(map(nodes_of, MODULES.values())))
    assert exchangeable(nodes, signatures(nodes)) == []


@pytest.mark.parametrize(
    ("call", "is_fault"),
    [
        ("drive(1, 2.0, True, 3, 4.0)", True),
        ("drive(1, 2.0, True, 3, dt=4.0)", False),
        ("self._drive.drive(*(1, 2.0), True, 3, 4.0)", True),
        ("Place('a', 1, 2, 3, 4, 5)", True),
        ("make_place('a', 1, 2, 3, 4, 5)", True),
        ("Place('a', 1, 2, 3, 4, z=5)", False),
        ("Named('a', 'b', 'c', 'd', 'e')", True),
        ("Named('a', 'b', 1, 'd', 'e')", True),
        ("mixed(1, 'a', 2, 'b', [], 3)", False),
    ],
)
def test_many_arguments_of_one_kind_are_found(call, is_fault):
    known = """
def drive(speed: float, turn: float, held: bool, tick: int, dt: float | None): ...
def mixed(a: int, b: str, c: float, d: str, e: list[str], f: float): ...
class Place(NamedTuple):
    name: str
    x: float
    y: float
    vx: float
    vy: float
    z: float = 0.0
make_place = maker(Place)
class Named:
    def __init__(self, a: str, b: str | None, c: Literal["x"], d: str, e: str): ...
"""
    found = exchangeable(ast.walk(ast.parse(call)), signatures(ast.walk(ast.parse(known))))
    assert bool(found) is is_fault


def test_what_looks_alike_is_no_fault():
    source = """
from __future__ import annotations
import dva_sim.cli
level = ast.literal_eval(word)
sys.modules[unique] = module
rooms = ["dva_sim.kernel.errors", "see dva_sim.cli for more"]
Band(mean, low, high, lowest, highest=highest, critical=critical, count=count)
table.add_row(a, b, c, d, e, f, g)
"""
    assert [f for node in ast.walk(ast.parse(source)) for f in faults_of(node, "simulation")] == []
