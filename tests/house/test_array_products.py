"""Products of arrays: a library rounds them by processor, so no run's bytes may depend on one."""

import ast

import pytest
from helpers.paths import ROOT

ROOMS = ("agents", "core", "kernel", "network", "simulation/full", "worlds")
PRODUCTS = {"convolve", "correlate", "dot", "inner", "matmul", "norm", "tensordot", "vdot"}
ALLOWED = {
    "agents/operator/delay_estimation.py": "estimates a delay to a grid of steps",
    "core/dispatch/coverage.py": "gains of posts, of which the largest is chosen",
    "worlds/camera/surfaces.py": "draws pictures, which nobody simulated looks at",
    "worlds/compartments.py": "areas of a site, the same in all its runs",
    "worlds/lidar.py": "sides of bodies; a sensor rounds the distances",
    "worlds/line_of_sight.py": "signs alone",
    "worlds/planning.py": "numbers of cells alone",
}
"""Files with a product, and why its last digit decides nothing."""


def is_product(node: ast.AST) -> bool:
    if isinstance(node, ast.BinOp | ast.AugAssign):
        return isinstance(node.op, ast.MatMult)
    return (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and node.func.attr in PRODUCTS
    )


@pytest.mark.parametrize("room", ROOMS)
def test_products_of_arrays_stand_only_where_their_last_digit_decides_nothing(room):
    folder = ROOT / "dva_sim" / room
    files = {
        path.relative_to(ROOT / "dva_sim").as_posix()
        for path in folder.rglob("*.py")
        if any(map(is_product, ast.walk(ast.parse(path.read_text(encoding="utf-8")))))
    }
    assert files == {file for file in ALLOWED if file.startswith(f"{room}/")}


def test_a_product_is_seen():
    for text in ("a @ b", "np.dot(a, b)", "a.dot(b)", "a @= b", "np.convolve(a, b)"):
        assert any(map(is_product, ast.walk(ast.parse(text)))), text
