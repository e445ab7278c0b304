"""The counts of an emulated link, in words and as a table.

Words go to the standard error: the standard output is that of the two commands.
"""

from __future__ import annotations

import csv
import io
import math
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from rich.console import Console
from rich.markup import escape

from dva_sim.cli.console import print_lines
from dva_sim.kernel.errors import ConfigError, DvaSimError
from dva_sim.kernel.resources import refuse_to_replace
from dva_sim.kernel.whole_files import write_whole
from dva_sim.network.emulator.report import LATE_S, DirectionReport, LinkReport

_WAYS: Final = {"near to far": "up", "far to near": "down"}
_MEANINGS: Final = {
    "direction": ("", "from which end to which"),
    "offered_packets": ("", "packets that entered the link"),
    "passed_packets": ("", "packets that came out; the rest was lost, or inside at the end"),
    "passed_bytes": ("B", "bytes of these, with all headers"),
    "lost_by_chance": ("", "packets lost by `loss`, in bursts or not, or as recorded"),
    "lost_in_queue": ("", "packets that found the queue full"),
    "lost_in_outage": ("", "packets that met an outage or a partition"),
    "waited_p50_s": ("s", "median of the time from entering the link to coming out"),
    "waited_p95_s": ("s", "95th percentile of it"),
    "waited_max_s": ("s", "longest of these times"),
    "late_p50_s": ("s", "median lateness of the emulator, in both directions"),
    "late_p99_s": ("s", "99th percentile of it"),
    "late_max_s": ("s", "longest lateness"),
    "overrun_packets": ("", "packets lost because the emulator was too slow, both directions"),
    "disturbed": ("", f"late_p99_s is above {LATE_S:g} s, or packets were overrun"),
    "seed": ("", "random seed of losses and jitter"),
}

_DECIMALS: Final = 6

_Text = Callable[[LinkReport, int], str]


def tell(line: str) -> None:
    """Print a line for people, as soon as there is something to say."""
    print_lines([escape(line)], Console(stderr=True, highlight=False))


def in_words(report: LinkReport, names: Sequence[str] = tuple(_WAYS)) -> list[str]:
    """Describe in lines the fate of the packets, and how punctual the emulator was.

    Args:
        report: The counts.
        names: Words for the way from the near end to the far one, and back.
    """
    ways = zip(names, _WAYS.values(), strict=True)
    lines = [f"{name}: {_packets(getattr(report, direction))}" for name, direction in ways]
    late = _milliseconds(p50=report.late_p50_s, p99=report.late_p99_s, max=report.late_max_s)
    lines.append(f"emulator late by: {late}")
    return [*lines, f"warning: {_disturbed(report)}"] if report.is_disturbed else lines


def _packets(counts: DirectionReport) -> str:
    lost = counts.lost_by_chance + counts.lost_in_queue + counts.lost_in_outage
    causes = (
        f"chance {counts.lost_by_chance}, queue {counts.lost_in_queue}, "
        f"outage {counts.lost_in_outage}"
    )
    waited = _milliseconds(
        p50=counts.waited_p50_s, p95=counts.waited_p95_s, max=counts.waited_max_s
    )
    passed = f"{counts.passed_packets} packets ({counts.passed_bytes} bytes) passed"
    return f"{passed}, {lost} lost ({causes}), waited: {waited}"


def _milliseconds(**durations: float) -> str:
    if any(map(math.isnan, durations.values())):
        return "no packets"
    return ", ".join(f"{name} {1e3 * value:.1f} ms" for name, value in durations.items())


def _disturbed(report: LinkReport) -> str:
    if report.overrun_packets:
        return f"disturbed: the emulator was too slow for {report.overrun_packets} packets"
    late = 1e3 * report.late_p99_s
    most = 1e3 * LATE_S
    return f"disturbed: the emulator's p99 of {late:.1f} ms is above {most:g} ms"


def files_of(out: Path | None, overwrite: bool) -> Mapping[Path, _Text]:
    """Return the files that hold the counts, each with what makes its text.

    Raises:
        ConfigError: they cannot be called so, or are there already.
        OSError: there is no such folder and it cannot be made, or it takes no files.
    """
    if out is None:
        return {}
    files: dict[Path, _Text] = {out: _table}
    if out.suffix != ".csv" or out.is_dir():
        if out.suffix and not out.is_dir():
            raise ConfigError(f"{out} should end in .csv; a folder for the table has no ending")
        if out.is_file():
            raise ConfigError(f"{out} is a file; give a folder, or a name that ends in .csv")
        files = {out / "link.csv": _table, out / "columns.csv": _dictionary}
    refuse_to_replace(files, overwrite)
    folder = next(iter(files)).parent
    folder.mkdir(parents=True, exist_ok=True)
    tempfile.TemporaryFile(dir=folder).close()  # else a long run would end with nothing kept
    return files


def keep(path: Path, text: str) -> None:
    """Write a file whole or not at all.

    Raises:
        DvaSimError: the disk is full or refuses to be written.
    """
    try:
        write_whole(path, text)
    except OSError as error:
        raise DvaSimError(f"{path} cannot be written: {error.strerror}") from None


def _table(report: LinkReport, seed: int) -> str:
    """Return a row for each direction; the lateness of the emulator is that of both."""
    whole = {"disturbed": report.is_disturbed, "seed": seed}
    rows = []
    for name, direction in _WAYS.items():
        row = {**asdict(report), **asdict(getattr(report, direction)), **whole, "direction": name}
        rows.append([_cell(row[column]) for column in _MEANINGS])
    return _csv([list(_MEANINGS), *rows])


def _dictionary(report: LinkReport, seed: int) -> str:
    lines = [("link", name, *meaning) for name, meaning in _MEANINGS.items()]
    return _csv([("table", "column", "unit", "meaning"), *lines])


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return "" if math.isnan(value) else f"{round(value, _DECIMALS)}"
    return str(value).lower() if isinstance(value, bool) else str(value)


def _csv(rows: Iterable[Iterable[str]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()
