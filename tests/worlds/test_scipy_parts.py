"""Functions of SciPy without the rest of their packages, which is there when somebody asks."""

import subprocess
import sys

import pytest

HEAVY = ("numpy.f2py.f2py2e", "numpy.testing._private", "scipy.special", "scipy.linalg")


def told_by(program: str) -> str:
    """What a program says in a process of its own, where nothing has been loaded before."""
    program = f"import sys\nfrom dva_sim.worlds import scipy_parts\n{program}"
    return subprocess.check_output([sys.executable, "-c", program], text=True).strip()


def test_what_is_not_used_is_not_loaded():
    assert told_by(f"print(sys.modules.keys() & set({HEAVY}))") == "set()"


@pytest.mark.system
def test_a_package_gives_all_its_names_afterwards():
    found = told_by(
        "import numpy\n"
        "from scipy import ndimage\n"
        "from scipy.sparse.csgraph import connected_components, dijkstra\n"
        "same = ndimage.label is scipy_parts.label and dijkstra is scipy_parts.dijkstra\n"
        "both = numpy.f2py.get_include(), numpy.testing.assert_equal(1, 1)\n"
        "print(same, ndimage.median_filter([1, 9, 1], 3).tolist())"
    )
    assert found == "True [1, 1, 1]"
