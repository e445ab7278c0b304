"""The page of samples: valid messages by name, and the fault of each invalid one."""

from __future__ import annotations

import csv

from generators.markdown import ROOT, code, prose, table
from generators.markdown import page as page_of

SAMPLES = ROOT / "protocol/samples"
_HEAD = """\
`protocol/samples` holds messages to accept and messages to refuse. Try them on an implementation of
your own, or print the verdict of this one with `dva-sim check FILE`."""


def page() -> str:
    """Return the page in Markdown."""
    valid = sorted(path.name for path in (SAMPLES / "valid").glob("*.xml"))
    with (SAMPLES / "invalid.csv").open(encoding="utf-8") as file:
        faults = [
            [code(row["sample"]), code(row["message"]), prose(row["fault"]), row["found by"]]
            for row in csv.DictReader(file)
        ]
    return page_of(
        "Samples",
        _HEAD,
        "## Invalid",
        "An XML parser finds some faults, the schema `dva.xsd` others. Only a receiver that obeys "
        "the [rules](protocol.md#what-a-receiver-checks) finds the rest.",
        table(["sample", "message", "fault", "found by"], faults),
        "## Valid",
        ", ".join(map(code, valid)) + ".",
    )
