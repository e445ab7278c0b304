"""One figure of a report: what it is called, when it applies, how it is drawn."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures.style import Drawn, Numbers, finish

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dva_sim.experiments.report.summary import Reading


class ReportFigure(ABC):
    """A figure is drawn wherever its tables and columns are there, in the look of the report.

    `dva-sim check figure mine.py:Mine` tries what all figures promise: the same results give the
    same bytes; every number that is drawn stands in the CSV beside the figure; words are legible,
    colours are the palette's; what was not measured is left out and makes no error; nothing stays
    open and nothing is changed.

    Attributes:
        name: Of its files, in small letters, digits and underscores.
        title: What is seen, in a line; a drawing may have a title that tells more.
        tables: Tables that the results must hold.
        columns: Columns of the table `runs` of which some run of the answer's part must have a
            number.
        pages: Kinds of reports that it belongs to, `driving`, `shift` or `transport`; all of them
            where none is named.
        has_panels: Whether it has a panel for each setting of the factors that are neither lines
            nor along x; the report then says which factors those are.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    tables: ClassVar[tuple[str, ...]] = ("runs",)
    columns: ClassVar[tuple[str, ...]] = ()
    pages: ClassVar[tuple[str, ...]] = ()
    has_panels: ClassVar[bool] = False

    def applies(self, view: StudyView, reading: Reading) -> bool:
        """Whether the results hold what is drawn: its page, its tables and its columns."""
        if self.pages and reading.page.name not in self.pages:
            return False
        return all(map(reading.table, self.tables)) and all(map(view.part.has, self.columns))

    @abstractmethod
    def draw(self, view: StudyView, reading: Reading) -> Drawn | None:
        """Draw it.

        Args:
            view: The part that the answer speaks of: its lines, what runs along x, its panels.
            reading: All else that the results hold: `reading.table("events")`, `reading.finding`,
                `reading.scenario_of(part)`.

        Returns:
            What `finish` gives; None where there is nothing to be seen.
        """

    def finish(
        self,
        figure: Figure,
        caption: str,
        numbers: Numbers,
        *,
        title: str = "",
        reads: Sequence[str] = (),
    ) -> Drawn:
        """The finished figure, as vectors and pixels, with nothing that changes day by day.

        Args:
            figure: As drawn, of `panels`.
            caption: How to read it.
            numbers: What was drawn, for the CSV.
            title: What is seen, if more can be said than the figure's own title does.
            reads: What else must be known to read it, in sentences that other figures share.
        """
        return finish(figure, self.name, title or self.title, caption, numbers=numbers, reads=reads)
