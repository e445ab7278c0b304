"""Some functions of SciPy, without most of what their packages load: that costs 0.2 s.

Loaded late itself: many processes need none of it.
"""

from collections.abc import Callable
from importlib.util import find_spec, module_from_spec
from sys import modules
from threading import RLock
from typing import Any


def put_off(package: str) -> None:
    """Run a package's own code only when somebody asks it for one of its names.

    Its modules can be loaded before that, and who uses the package notices no difference.
    """
    spec = None if package in modules else find_spec(package)
    if spec is None or spec.loader is None:
        return
    module, load, lock = module_from_spec(spec), spec.loader.exec_module, RLock()
    waiting: list[Callable[[Any], None]] = [load]

    def rest(name: str) -> Any:
        if name.startswith("_") and not name.endswith("__"):  # a module, which is found without
            raise AttributeError(name)
        with lock:
            if waiting:
                waiting.pop()(module)
            if name not in vars(module):
                raise AttributeError(f"module {package!r} has no attribute {name!r}")
            return vars(module)[name]

    vars(module)["__getattr__"] = rest
    modules[package] = module
    parent, _, name = package.rpartition(".")
    setattr(modules[parent], name, module)


# SciPy copies all of NumPy's names, which loads its tools for Fortran and for tests.
for _package in ("numpy.f2py", "numpy.testing", "scipy.ndimage", "scipy.sparse.csgraph"):
    put_off(_package)

from scipy.ndimage._measurements import label  # noqa: E402
from scipy.ndimage._morphology import distance_transform_edt  # noqa: E402
from scipy.sparse import csr_array  # noqa: E402
from scipy.sparse.csgraph._shortest_path import dijkstra  # noqa: E402

__all__ = ["csr_array", "dijkstra", "distance_transform_edt", "label"]
