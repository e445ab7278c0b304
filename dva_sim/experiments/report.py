"""One page that answers a study: self-contained, and the same bytes whenever it is made again."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dva_sim.experiments import statistics
from dva_sim.experiments.answer import Answer, answer
from dva_sim.experiments.asking import REPEATS
from dva_sim.experiments.cells import CellTable, cell_table
from dva_sim.experiments.conditions import conditions, timeout_remark
from dva_sim.experiments.dispatch import figures as dispatch_figures
from dva_sim.experiments.dispatch import page as dispatch_page
from dva_sim.experiments.dispatch.shifts import Shifts, is_dispatch
from dva_sim.experiments.effects import Part, Table, View, as_floats
from dva_sim.experiments.figures import Drawn, draw_all
from dva_sim.experiments.labels import factor_name, is_in_file, level_name, listing, setting
from dva_sim.experiments.predictions import judge_all
from dva_sim.experiments.reading import factors_of, finding_of, keys_of, possible_values, view_of
from dva_sim.experiments.results import Results
from dva_sim.experiments.robustness import Robustness, robustness_of, sentences
from dva_sim.experiments.support import support_of_part
from dva_sim.experiments.transports import figures as transport_figures
from dva_sim.experiments.transports import page as transport_page
from dva_sim.experiments.tuning import tuned_table, tuning_warning
from dva_sim.experiments.variance import spread_table

if TYPE_CHECKING:
    import jinja2

_OPTIONAL = ("events", "tracks")
_MOST_ERRORS = 3
_FEWEST_PAIRS = 4  # of which a correlation says anything


def write_report(folder: Path) -> Path:
    """Make `report.html` and `figures/` from the tables in a results folder.

    Raises:
        ConfigError: the folder holds no results.
    """
    results = Results.load(folder)
    runs = results.table("runs") if results.has("runs") else {}
    view = _view(results, runs) if runs else None
    drawn = _draw(view, results) if view else []
    _write_figures(results.folder / "figures", drawn)
    report = results.folder / "report.html"
    report.write_text(_page(results, runs, view, drawn), encoding="utf-8", newline="\n")
    return report


def _view(results: Results, runs: Table) -> View | None:
    """How the study is read, with its extrapolations known."""
    view = view_of(results.study, runs)
    if view is None:
        return None
    scenario = _scenario_of(results, view.part.name)
    support = support_of_part(view.part, scenario)
    possible = possible_values(view.measure, scenario)
    return replace(view, outside=support.outside if support else None, possible=possible)


def _scenario_of(results: Results, part: str) -> Mapping[str, Any]:
    found: Mapping[str, Any] = results.manifest.get("scenarios", {}).get(part, {})
    return found


def _draw(view: View, results: Results) -> list[Drawn]:
    tables = {name: results.table(name) for name in _OPTIONAL if results.has(name)}
    if shifts := _shifts(view, results):
        return dispatch_figures.draw_all(shifts)
    if transport_figures.is_contest(view):
        return transport_figures.draw_all(view)
    scenario = _scenario_of(results, view.part.name)
    return draw_all(view, tables, scenario, _robustness(view, results))


def _robustness(view: View | None, results: Results) -> Robustness | None:
    """The answer under other models of the persons, where it was repeated."""
    finding = finding_of(view) if view is not None else None
    if view is None or finding is None or not results.has(REPEATS):
        return None
    scenario = _scenario_of(results, view.part.name)
    return robustness_of(results.study, results.table(REPEATS), view, finding, scenario)


def _shifts(view: View | None, results: Results) -> Shifts | None:
    """The runs as shifts, where a study compares policies of dispatch on them."""
    if view is None or not is_dispatch(view):
        return None
    return Shifts(view, results.table("events") if results.has("events") else None)


def _write_figures(folder: Path, drawn: list[Drawn]) -> None:
    folder.mkdir(exist_ok=True)
    for figure in drawn:
        (folder / f"{figure.name}.svg").write_bytes(figure.svg)
        (folder / f"{figure.name}.png").write_bytes(figure.png)


def _page(results: Results, runs: Table, view: View | None, drawn: list[Drawn]) -> str:
    """Fill the template."""
    manifest, study = results.manifest, results.study
    factors = factors_of(study)
    scenarios = manifest.get("scenarios", {})
    shifts = _shifts(view, results)
    return _template().render(
        question=study.get("question", "A study without a question"),
        changes=[_as_words(change) for change in manifest.get("set", [])],
        answer=_answer(view, shifts),
        predictions=judge_all(study, view),
        robustness=_words_of(_robustness(view, results)),
        warnings=_warnings(results, runs),
        parts=list(scenarios),
        conditions=(
            dispatch_page.conditions(scenarios, keys_of(study))
            if shifts
            else conditions(scenarios, keys_of(study), _changed(study))
        ),
        timeout_remark=timeout_remark(scenarios, study),
        factors=[_levels(f.name, f.levels) for f in factors],
        treatments=_treatments(study),
        figures=drawn,
        tables=_tables(results, runs, view, shifts),
        spread=spread_table(view) if view else None,
        tuned=tuned_table(manifest),
        persons=study.get("persons"),
        replications=study.get("replications"),
        correlation=_pair_correlation(view),
        has_reference=any(part.get("reference") for part in study.get("parts", {}).values()),
        may_miss="confirmed" in runs,
        is_task=any(s.get("model") == "task" for s in scenarios.values()),
        method=_method(view, shifts),
        manifest=json.dumps(manifest, indent=2, sort_keys=True, ensure_ascii=False),
    )


def _template() -> jinja2.Template:
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("dva_sim.experiments"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters["data_uri"] = _data_uri
    return environment.get_template("report.html.j2")


def _words_of(robustness: Robustness | None) -> list[str]:
    return sentences(robustness) if robustness else []


def _tables(
    results: Results, runs: Table, view: View | None, shifts: Shifts | None
) -> list[CellTable]:
    """A table of cells for each part that has runs."""
    if view is None:
        return []
    names = dict.fromkeys(str(name) for name in runs["part"])
    parts = [Part(runs, name, factors_of(results.study)) for name in names]
    return [_cells(part, view, shifts, results) for part in parts if len(part)]


def _cells(part: Part, view: View, shifts: Shifts | None, results: Results) -> CellTable:
    if transport_figures.is_contest(view):
        return cell_table(part, view.measure, transport_page.SUMMARIES)
    if shifts is None:
        support = support_of_part(part, _scenario_of(results, part.name))
        possible = possible_values(view.measure, _scenario_of(results, part.name))
        return cell_table(part, view.measure, support=support, possible=possible)
    if part.name == view.part.name:
        return dispatch_page.cells(shifts)
    return cell_table(part, view.measure, dispatch_page.SUMMARIES)


def _answer(view: View | None, shifts: Shifts | None) -> Answer:
    if view is None:
        return Answer("No run was completed, so there is nothing to answer with.")
    finding = finding_of(view)
    if shifts is not None:
        return dispatch_page.answer_of(finding, shifts)
    if finding is not None:
        return answer(finding)
    return Answer(
        "The contrast that would answer the question was not declared or not run; "
        "the figures and the table show what was."
    )


def _warnings(results: Results, runs: Table) -> list[str]:
    """What a reader must see before anything else."""
    found = []
    if failures := results.failures:
        errors = dict.fromkeys(str(failure.get("error")) for failure in failures)
        shown = "; ".join(list(errors)[:_MOST_ERRORS])
        found.append(f"Runs that failed and are missing below: {len(failures)} ({shown}).")
    broken = int((as_floats(runs["violations"]) > 0).sum()) if "violations" in runs else 0
    if broken:
        found.append(f"Safety invariants were broken in {broken} runs.")
    if tuning := tuning_warning(results.manifest):
        found.append(tuning)
    return found


def _method(view: View | None, shifts: Shifts | None) -> list[str]:
    """Remarks where the usual ones do not fit."""
    if shifts is not None:
        return dispatch_page.method(shifts, _pair_correlation(view))
    if transport_figures.is_contest(view):
        return transport_page.method(_pair_correlation(view))
    return []


def _levels(name: str, levels: tuple[Any, ...]) -> tuple[str, str]:
    return factor_name(name), listing([_in_full(name, level) for level in levels])


def _in_full(name: str, level: Any) -> str:
    """A level with the file it is from, if it is a class in one."""
    file = f" ({level.rpartition(':')[0]})" if is_in_file(level) else ""
    return level_name(name, level) + file


def _changed(study: Mapping[str, Any]) -> list[str]:
    """Scenario keys that the study's parts set themselves."""
    parts = study.get("parts", {}).values()
    return list(dict.fromkeys(key for part in parts for key in part.get("changes") or {}))


def _treatments(study: Mapping[str, Any]) -> list[tuple[str, str]]:
    """What each named level changes."""
    return [
        (level_name(factor, level), setting(changes) or "nothing")
        for factor, named in study.get("treatments", {}).items()
        for level, changes in named.items()
    ]


def _as_words(change: Any) -> str:
    """One `--set`, however the manifest keeps it."""
    return change if isinstance(change, str) else "=".join(str(word) for word in change)


def _pair_correlation(view: View | None) -> float | None:
    """How alike the two sides of the contrast are, run by run, at the last stop."""
    if view is None or view.contrast is None:
        return None
    grid = view.part.grid(view.measure)
    first, second = (view.curve(grid, view.panels[0], level)[-1] for level in view.contrast)
    both = np.isfinite(first) & np.isfinite(second)
    if both.sum() < _FEWEST_PAIRS:
        return None
    correlation = statistics.pair_correlation(first[both], second[both])
    return correlation if np.isfinite(correlation) else None


def _data_uri(svg: bytes) -> str:
    return f"data:image/svg+xml;base64,{base64.b64encode(svg).decode()}"
