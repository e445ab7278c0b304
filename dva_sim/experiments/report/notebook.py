"""Results of runs and studies that `dva_sim` functions return, with their notebook display."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dva_sim.experiments.results.results import Frame, frame_of, plain
from dva_sim.experiments.results.results import Results as ResultsData
from dva_sim.kernel.suggestions import listed
from dva_sim.simulation.full import Recording
from dva_sim.simulation.measures.episodes import track_rows
from dva_sim.simulation.models import AnyScenario, Tables, model_for

if TYPE_CHECKING:
    from dva_sim.experiments.analysis.answer import Answer
    from dva_sim.experiments.report.summary import Reading


@dataclass(frozen=True)
class Episode:
    """One run of one scenario.

    Attributes:
        seed: Random seed.
        tables: Its rows as columns, by table: `runs`, `events`, ...
    """

    scenario: AnyScenario
    seed: int
    tables: dict[str, Frame]

    @property
    def warnings(self) -> list[str]:
        """Contradictory settings of the scenario, one sentence each."""
        return model_for(self.scenario).contradictions(self.scenario)

    @property
    def measures(self) -> dict[str, Any]:
        """The one row of the table of runs."""
        return {name: values.tolist()[0] for name, values in self.tables["runs"].items()}

    def __repr__(self) -> str:
        """Return the summary of measures and tables."""
        values = {name: plain(value) for name, value in self.measures.items()}
        some = listed(f"{name} {value}" for name, value in values.items() if value)
        tables = ", ".join(f"{name} ({table.rows})" for name, table in self.tables.items())
        head = f"Episode of a {self.scenario.model} scenario, seed {self.seed}"
        return "\n".join((head, f"measures: {some}", f"tables: {tables}"))

    def _repr_html_(self) -> str:
        meaning = {c.name: c.meaning for c in model_for(self.scenario).columns["runs"]}
        rows = [
            f"<tr><td>{escape(name)}</td><td>{escape(plain(value))}</td>"
            f"<td>{escape(meaning.get(name, ''))}</td></tr>"
            for name, value in self.measures.items()
        ]
        return f"<table>{''.join(rows)}</table>"


def episode_of(
    scenario: AnyScenario, seed: int, tables: Tables, recording: object = None
) -> Episode:
    """Return a run by its tables.

    If what is kept of it is a recording, everybody's track is one more.
    """
    tracks = {"tracks": track_rows(recording)} if isinstance(recording, Recording) else {}
    made = {name: frame_of(rows) for name, rows in (tables | tracks).items()}
    return Episode(scenario, seed, made)


class Results(ResultsData):
    """Results of a study: its tables, answer and report."""

    _offers = "answer, failures, machine, report()"

    @cached_property
    def reading(self) -> Reading:
        """Reading of the runs, in words and tables."""
        from dva_sim.experiments.report.summary import Reading  # late: start-up

        return Reading(self)

    @property
    def answer(self) -> Answer:
        """The answer to the question in words, with its interval, and what must be known of it."""
        return self.reading.answer

    def report(self) -> Path:
        """Make `report.html` and `figures/` in the folder.

        Raises:
            DvaSimError: the disk is full or refuses to be written.
        """
        from dva_sim.experiments.report.report import write_report  # late: start-up

        return write_report(self.folder)

    def _repr_html_(self) -> str:
        """Return the notebook display: question, answer and number of runs."""
        depends = (f"{about}: {words}" for about, words in self.answer.depends.items())
        notes = "".join(f"<p>{escape(note)}</p>" for note in (*depends, *self.answer.notes))
        failed = f", {len(self.failures)} failed" if self.failures else ""
        runs = f"<p>{self.runs.rows} runs{failed}, in {escape(str(self.folder))}</p>"
        lead = f"<p><b>{escape(self.answer.lead)}</b></p>"
        return f"<h3>{escape(self.question)}</h3>{lead}{notes}{runs}"
