"""The page of counterparts of our messages in ROS, Open-RMF and VDA 5050."""

from __future__ import annotations

import csv
from itertools import groupby

from generators.markdown import ROOT, prose, table
from generators.markdown import page as page_of

FILE = ROOT / "protocol/correspondences.csv"
_OTHERS = ("ROS", "Open-RMF", "VDA 5050")
_HEAD = """\
Counterparts of our messages in `geometry_msgs`, `nav_msgs` and `sensor_msgs` of ROS 1 and 2, in
`rmf_task_msgs` and `rmf_fleet_msgs` of Open-RMF, and in VDA 5050 version 3. A dash means that there
is none. Speed is in m/s and turn rate in rad/s, counter-clockwise positive, as in REP 103.

An event is not a task: one event becomes a task to confirm it, perhaps by a robot, and one to
contain it, by a person. Sessions, confirmed grants and people as responders have no counterpart.
Traffic schedules, lifts, doors and loads exist there and not here."""


def page() -> str:
    """Return the page in Markdown."""
    with FILE.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    blocks = [_HEAD]
    for subject, members in groupby(rows, lambda row: row["subject"]):
        blocks += [f"## {subject}", _table(list(members))]
    return page_of("ROS, Open-RMF and VDA 5050", *blocks)


def _table(rows: list[dict[str, str]]) -> str:
    """Return a table of those of the others that have any counterpart."""
    others = [name for name in _OTHERS if any(row[name] for row in rows)]
    cells = ([prose(row["ours"]), *(prose(row[name]) or "–" for name in others)] for row in rows)
    return table(["ours", *others], cells)
