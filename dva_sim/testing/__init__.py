"""Checks of plug-ins and files, for `dva-sim check` and for users' own tests.

Each `check_...` takes a name (`mine.py:Mine`, a shipped or an installed one) or a class, and
options; it returns an `Outcome`, or raises `BrokenPromises`, an `AssertionError`. The room may
import all but `cli` and `api`; begin reading at `kinds`, or at the policies.

    from dva_sim.testing import check_policy

    def test_my_policy_keeps_its_promises():
        check_policy("mine.py:Mine", {"step": 2})
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from dva_sim.testing.promises import TRIALS

if TYPE_CHECKING:
    from dva_sim.testing.hazards import check_hazard as check_hazard
    from dva_sim.testing.measures import check_measure as check_measure
    from dva_sim.testing.operators import check_operator as check_operator
    from dva_sim.testing.patterns import check_pattern as check_pattern
    from dva_sim.testing.policies import check_policy as check_policy
    from dva_sim.testing.promises import BrokenPromises as BrokenPromises
    from dva_sim.testing.promises import Outcome as Outcome
    from dva_sim.testing.robots import check_robot as check_robot
    from dva_sim.testing.tilt import check_filter as check_filter
    from dva_sim.testing.tilt import check_mapping as check_mapping
    from dva_sim.testing.transports import check_transport as check_transport

_PLACES = {"BrokenPromises": "promises", "Outcome": "promises"}


def __getattr__(name: str) -> Any:
    """Load a name at its first use: each kind needs other rooms."""
    trial = TRIALS.get(name.removeprefix("check_"))
    if trial is not None and name == f"check_{trial.kind}":
        return trial.load_check()
    if name in _PLACES:
        return getattr(import_module(f"{__name__}.{_PLACES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *_PLACES, *(f"check_{kind}" for kind in TRIALS)})
