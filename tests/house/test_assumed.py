"""No assumed number about people hides in code: it is a key with a band, or names its source."""

import ast
import io
import re
import tokenize

import pytest
from helpers.paths import ROOT

from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.simulation.scenario.assumptions import all_assumptions

AGENTS = ROOT / "dva_sim" / "agents"
ROOMS = ["control_room", "operator", "people", "tilt", "."]
FILES = sorted(
    path
    for room in ROOMS
    for path in ((AGENTS / room).rglob("*.py") if room != "." else AGENTS.glob("*.py"))
)
MARK = re.compile(r"\b(source|design):\s+\S", re.IGNORECASE)
"""`source: Jin`: somebody measured or prescribed it. `design: why`: a choice of the program."""


def unexplained(source: str) -> list[str]:
    """Names of constants of modules and classes that hold a number and do not say where from."""
    comments = {
        token.start[0]: token.string
        for token in tokenize.generate_tokens(io.StringIO(source).readline)
        if token.type == tokenize.COMMENT
    }
    tree = ast.parse(source)
    bodies = [tree.body, *(node.body for node in tree.body if isinstance(node, ast.ClassDef))]
    return [
        name
        for body in bodies
        for node, after in zip(body, [*body[1:], None], strict=True)
        for name in _constants(node)
        if not MARK.search(_text_of(node, after, comments))
    ]


def _constants(node: ast.stmt) -> list[str]:
    if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
        return []
    targets = node.targets if isinstance(node, ast.Assign) else [node.target]
    names = [each.id for target in targets for each in ast.walk(target) if hasattr(each, "id")]
    is_number = any(
        isinstance(each, ast.Constant)
        and isinstance(each.value, int | float)
        and not isinstance(each.value, bool)
        for each in ast.walk(node.value)
    )
    return [name for name in names if is_number and name.isupper()]


def _text_of(node: ast.stmt, after: ast.stmt | None, comments: dict[int, str]) -> str:
    assert node.end_lineno is not None
    reports = [comments.get(line, "") for line in range(node.lineno, node.end_lineno + 1)]
    if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant):
        reports.append(str(after.value.value))
    return " ".join(reports)


def test_every_number_about_people_is_a_key_or_says_where_it_is_from():
    assert len(FILES) > 20
    found = {str(path.relative_to(AGENTS)): unexplained(path.read_text()) for path in FILES}
    assert {name: names for name, names in found.items() if names} == {}


@pytest.mark.parametrize(
    ("source", "names"),
    [
        ("PATIENCE = 3.0  # [s]", ["PATIENCE"]),
        ("ASKED, STILL = 0.05, 0.02  # assumed", ["ASKED", "STILL"]),
        ("FAR: Final = math.radians(45.0)", ["FAR"]),
        ("class A:\n    DELAY = -0.1\n", ["DELAY"]),
        ('WAIT = 2\n"""How long."""', ["WAIT"]),
        ("TIME = 0.37  # source: Salvucci 2006", []),
        ('STEP = 0.1\n"""Design: the resolution of a guess."""', []),
        ('IDS = "a", "b"', []),
        ("def f(x=2.0):\n    y = 3.0", []),
    ],
)
def test_a_number_without_a_source_is_found(source, names):
    assert unexplained(source) == names


def test_every_default_lies_within_its_band_and_no_key_is_listed_twice():
    listed = all_assumptions()
    assert len(listed) == len({each.key for each in listed}) > 110
    for each in listed:
        assert each.low <= each.default <= each.high, each
        assert 0 <= each.low < each.high, each
        assert len(each.why) > 10, each


def test_a_trait_has_one_band():
    """Repeats of an answer draw traits from a file of bands, which users may edit."""
    data = load_yaml(ROOT / "agents" / "people" / "operators-bands.yaml").data
    bands = {f"operator.traits.{name}": tuple(band) for name, band in data["bands"].items()}
    listed = {each.key: (each.low, each.high) for each in all_assumptions()}
    shared = listed.keys() & bands.keys()
    assert len(shared) >= 3
    assert {key: listed[key] for key in shared} == {key: bands[key] for key in shared}
