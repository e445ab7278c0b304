"""Exact answers by name: formulas of queues, priorities, units with preferences, and geometry."""

from __future__ import annotations

from collections.abc import Callable

from dva_sim.validation.dispatch.exact.geometry import (
    assignment,
    sqm,
    square_centre,
    square_nearest,
)
from dva_sim.validation.dispatch.exact.hypercube import (
    cobham,
    fan_out,
    finite_source,
    hypercube,
    priorities,
)
from dva_sim.validation.dispatch.exact.queues import (
    DurationLaw,
    Measures,
    erlang_a,
    erlang_b,
    erlang_c,
    gm1,
    mg1,
    mgcc,
    mmc,
    mmck,
    tandem,
)

__all__ = [
    "FORMULAS",
    "DurationLaw",
    "Measures",
    "assignment",
    "cobham",
    "erlang_a",
    "erlang_b",
    "erlang_c",
    "fan_out",
    "finite_source",
    "gm1",
    "hypercube",
    "mg1",
    "mgcc",
    "mmc",
    "mmck",
    "priorities",
    "sqm",
    "square_centre",
    "square_nearest",
    "tandem",
]


FORMULAS: dict[str, Callable[..., Measures]] = {
    "mmc": mmc,
    "mgcc": mgcc,
    "mmck": mmck,
    "mg1": mg1,
    "gm1": gm1,
    "erlang_a": erlang_a,
    "tandem": tandem,
    "priorities": priorities,
    "cobham": cobham,
    "hypercube": hypercube,
    "finite_source": finite_source,
    "fan_out": fan_out,
    "square_centre": square_centre,
    "square_nearest": square_nearest,
    "sqm": sqm,
    "assignment": assignment,
}
