"""Lines that are told to pages, by their kinds."""

from __future__ import annotations

from typing import Final

from dva_sim.serving.pipes import LineKinds

KINDS: Final = LineKinds(
    newest=frozenset({"pos", "seat", "rows", "hazards", "events", "devices", "told"}),
    kept=frozenset({"scene", "shelf", "done", "bye"}),
    first_dropped=frozenset({"log"}),  # whose numbers tell what is missing
)
