"""Report page for studies of dispatch: texts and tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from dva_sim.experiments.analysis.answer import Answer, Finding
from dva_sim.experiments.analysis.run_grid import Factor, RunGrid, Table
from dva_sim.experiments.analysis.shift_effects import BEST, Shifts, is_dispatch, pooled
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.answer_sentences import answer
from dva_sim.experiments.report.cell_table import CellTable, Summary, cell_table
from dva_sim.experiments.report.model_page import ModelPage, correlated
from dva_sim.experiments.report.prose import paragraphs, sentence
from dva_sim.kernel.wording import listing, number, percent
from dva_sim.simulation.timed.simulation import CHECKED_OF_SHIFTS

SUMMARIES: tuple[Summary, ...] = (
    ("on_scene_share", "on scene by T", np.mean, percent),
    ("confirmation_mean_s", "time to confirmation [s]", np.mean, number),
    ("confirmed_share", "confirmed", np.mean, percent),
    ("refuted_share", "cleared", np.mean, percent),
    ("escalated_share", "escalated unseen", np.mean, percent),
    ("escalated_later_share", "escalated after confirmation", np.mean, percent),
    ("expired_share", "expired", np.mean, percent),
    ("open_share", "open", np.mean, percent),
    ("contained_share", "true ones contained", np.mean, percent),
    ("containment_mean_s", "time to containment [s]", np.mean, number),
    ("exposure_s", "exposure [s/event]", np.mean, number),
    ("exposure_look_s", "in finding out [s/event]", np.mean, number),
    ("exposure_max_s_per_h", "most exposed person [s/h]", np.mean, number),
    ("robot_share", "by robot", np.mean, percent),
    ("use_of_guards", "guards busy", np.mean, percent),
    ("use_of_robots", "robots busy", np.mean, percent),
    ("use_of_operators", "operators busy", np.mean, percent),
    ("evenness_of_guards", "evenness, guards", np.mean, number),
    ("evenness_of_robots", "evenness, robots", np.mean, number),
    ("zone_ratio", "worst zone / best", np.mean, number),
    ("bound_mean_s", "fresh unit at every base [s]", np.mean, number),
    ("beats_bound_share", "sooner than that", np.mean, percent),
    ("preempted", "redirected", np.mean, number),
    ("relocated", "relocated", np.mean, number),
    ("overruled", "overruled", np.mean, number),
    ("policy_failed", "policy failed", np.sum, number),
    ("violations", "violations", np.sum, number),
)


PERCENTILES = (50, 90, 95)
BOUND = "the best of fresh units that stand ready at every base and station"


class ShiftPage(ModelPage):
    """Report page that compares policies on shifts, one line each."""

    name: ClassVar[str] = "shift"
    cluster: ClassVar[str] = "shift"
    summaries: ClassVar[tuple[Summary, ...]] = SUMMARIES
    has_support: ClassVar[bool] = False
    assumed: ClassVar[tuple[str, ...]] = ()
    ends_by_event: ClassVar[bool] = False

    def __init__(self, view: StudyView, events: Table | None = None) -> None:
        super().__init__(view)
        self.shifts = Shifts(view, events)

    @classmethod
    def fits(cls, view: StudyView) -> bool:
        """Return True if the study compares policies."""
        return is_dispatch(view)

    def worded(self, finding: Finding) -> Finding:
        """Return the finding along the load of people, where that is known."""
        loads = [round(load, 2) for load in self.shifts.loads if load is not None]
        if len(loads) == len(self.shifts.stops):
            finding = replace(finding, over="load", levels=tuple(loads))
        return replace(finding, cluster="shift")

    def answer(self, finding: Finding | None) -> Answer:
        """Return the declared contrast, then its cost, and the best policy."""
        if finding is None:
            return Answer(
                "No contrast was declared that could answer the question; figures show the runs.",
                notes=_notes(self.shifts),
            )
        worded_answer = answer(self.worded(finding))
        price = {"In return": _price(finding, self.shifts)} if self.shifts.can_spare else {}
        notes = [*_notes(self.shifts), *worded_answer.notes]
        return replace(worded_answer, depends=worded_answer.depends | price, notes=notes)

    def cells(self, part: RunGrid) -> CellTable | None:
        """Return the table of the answer's part, with percentiles over all its events."""
        return _cells(self.shifts) if part.name == self.view.part.name else None

    def conditions(
        self,
        scenarios: Mapping[str, Mapping[str, Any]],
        factors: Sequence[Factor],
        changed: Sequence[str],
    ) -> list[tuple[str, list[str]]]:
        """Return conditions common to all policies, part by part."""
        parts = list(scenarios.values())
        if not parts:
            return []
        return [
            ("ground", [_ground(s) for s in parts]),
            ("team", [_team(s) for s in parts]),
            ("operators", [str(s.get("operators", {}).get("count", 0)) for s in parts]),
            ("alarms", [_alarms(s) for s in parts]),
            ("containment by a person", [_rule(s, "containment", "no") for s in parts]),
            ("escalated after waiting", [_rule(s, "escalate_after_s", "never") for s in parts]),
            (
                "reports merged within",
                [_rule(s, "merge_distance_m", "8 m on a site") for s in parts],
            ),
            ("warm-up", [f"{s.get('warm_up_s', 0):g} s" for s in parts]),
            ("horizon", [f"{s.get('horizon_s', 0):g} s" for s in parts]),
        ]

    def method(self, correlation: float | None) -> list[str] | None:
        """Describe how shifts were simulated, followed and compared."""

        shifts = self.shifts
        facts = {"follow": f"{shifts.follow:g} s", "correlated": correlated(correlation)}
        return paragraphs("method_shift", **facts, bound=BOUND, checked=CHECKED_OF_SHIFTS)


def _cells(shifts: Shifts) -> CellTable:
    """Return every cell of the part the answer speaks of, with percentiles over all its events.

    Percentiles are pooled: the mean of the shifts' own would leave out the shifts that do not
    reach them, which are the worst. Panels of which the answer does not speak have a dash.
    """
    part = shifts.view.part
    table = cell_table(part, shifts.view.measure, SUMMARIES)
    if shifts.events is None:
        return table
    places = [table.heads.index(head) for _, head, _, _ in SUMMARIES if head in table.heads]
    at = min(places, default=len(table.heads))
    dashes = ["–" for _ in PERCENTILES]
    rows = []
    for setting, row in zip(part.settings(), table.rows, strict=True):
        is_shown = shifts.view.panels[0].items() <= setting.items()
        percentiles = (
            _percentiles(shifts.events.rows_at(setting), shifts.follow) if is_shown else dashes
        )
        rows.append([*row[:at], *percentiles, *row[at:]])
    heads = [f"response, p{q} [s]" for q in PERCENTILES]
    return replace(table, heads=[*table.heads[:at], *heads, *table.heads[at:]], rows=rows)


def _percentiles(events: Table, follow: float) -> list[str]:
    """Return percentiles of one cell."""
    values = pooled(events, [q / 100 for q in PERCENTILES], follow)[0]
    over = f"> {follow:g}"
    return [over if np.isposinf(value) else number(float(value)) for value in values]


# --- the answer ------------------------------------------------------------------------------
def _price(finding: Finding, shifts: Shifts) -> str:
    """Give the same contrast in exposure: the other side of the trade-off."""
    first = str(finding.first)
    second = str(finding.second)
    base = shifts.means("exposure_look_s")[shifts.policies.index(second)]
    bands = shifts.against("exposure_look_s", second)
    row = shifts.policies.index(first)
    shape = (len(shifts.policies), -1)
    mean, low, high = (x.reshape(shape)[row] for x in (bands.mean, bands.low, bands.high))
    prices = [
        f"{number(m)} s ({number(a)} to {number(b)}; {second}: {number(z)} s) at {title}"
        for m, a, b, z, title in zip(mean, low, high, base, shifts.titles, strict=True)
    ]
    return sentence("in_return", first=first, prices=prices)


def _notes(shifts: Shifts) -> list[str]:
    titles = list(enumerate(shifts.titles))
    has_contained = shifts.view.part.has("contained_share")
    return paragraphs(
        "notes_shift",
        quickest=[(title, *_quickest(shifts, stop)) for stop, title in titles],
        twins=_twins(shifts),
        follow=f"{shifts.follow:g} s",
        contained=[_contained(shifts, *each) for each in titles] if has_contained else [],
        progress=[p for each in titles if shifts.target and (p := _progress(shifts, *each))],
        is_oracle=shifts.target == BEST,
        bound=BOUND,
        is_by_load=shifts.loads[0] is not None,
        calibrated=shifts.calibrated,
    )


def _quickest(shifts: Shifts, stop: int) -> tuple[str, float, list[str]]:
    """Return the policy of the least mean response at a load, that response, and its equals."""
    response = shifts.means("response_mean_s")
    candidates = [i for i, p in enumerate(shifts.policies) if p != BEST]
    best = min(candidates, key=lambda i: np.nan_to_num(response[i, stop], nan=np.inf))
    bands = shifts.against("response_mean_s", shifts.policies[best])
    low = bands.low.reshape(response.shape)[:, stop]
    equal = [shifts.policies[i] for i in candidates if i != best and not low[i] > 0]
    return shifts.policies[best], float(response[best, stop]), equal


def _twins(shifts: Shifts) -> list[str]:
    """Return policies that came to the very same response in every shift at every load."""
    response = shifts.of("response_mean_s")
    groups: dict[bytes, list[str]] = {}
    for index, policy in enumerate(shifts.policies):
        groups.setdefault(response[:, index].tobytes(), []).append(policy)
    return [listing(names) for names in groups.values() if len(names) > 1]


def _contained(shifts: Shifts, stop: int, title: str) -> str:
    """Compare the containment of the fastest policy with that of the best at containing."""
    share = shifts.means("contained_share")[:, stop]
    fastest = int(shifts.means("response_mean_s")[:, stop].argmin())
    chosen = dict.fromkeys([fastest, int(share.argmax())])
    words = [f"{percent(float(share[i]))} under {shifts.policies[i]}" for i in chosen]
    return f"at {title} {listing(words)}"


def _progress(shifts: Shifts, stop: int, title: str) -> str:
    """Return `89 % at load 0.31 (min_eta, 24 to 154 %)`: the best policy's share of the way.

    Nothing where no policy has a share: all shifts of one that it is measured by have failed.
    """
    bands = shifts.progress(stop)
    if np.isnan(bands.mean).all():
        return ""
    best = int(np.nanargmax(bands.mean))
    low, high = (100 * float(edge[best]) for edge in (bands.low, bands.high))
    name = shifts.travellers[best]
    return f"{100 * bands.mean[best]:.0f} % at {title} ({name}, {low:.0f} to {high:.0f} %)"


# --- the rest of the page ----------------------------------------------------------------------
def _ground(scenario: Mapping[str, Any]) -> str:
    site = scenario.get("site")
    area = scenario.get("area")
    if site:
        return str(site.get("name"))
    return f"{area['width_m']:g} m x {area['height_m']:g} m" if area else "nowhere in particular"


def _team(scenario: Mapping[str, Any]) -> str:
    groups = scenario.get("responders", [])
    kinds = {k: [g for g in groups if g.get("kind", "guard") == k] for k in ("guard", "robot")}
    counts = {
        k: sum(g.get("count", 1) for g in groups_of_kind) for k, groups_of_kind in kinds.items()
    }
    words = [f"{n} {kind}{'s' if n > 1 else ''}" for kind, n in counts.items() if n]
    return listing(words)


def _alarms(scenario: Mapping[str, Any]) -> str:
    """Return events per hour and share of false ones, at intensity 1."""
    streams = [s for s in scenario.get("demand", []) if (s.get("between") or {}).get("mean_s")]
    rates = [3600.0 / s["between"]["mean_s"] for s in streams]
    if not rates:
        return "–"
    false = sum(r * s.get("false_share", 0.0) for r, s in zip(rates, streams, strict=True))
    return f"{sum(rates):.3g} per hour times intensity, {percent(false / sum(rates))} false"


def _rule(scenario: Mapping[str, Any], key: str, nothing: str) -> str:
    value = scenario.get("dispatch", {}).get(key)
    if isinstance(value, bool):
        return "yes" if value else nothing
    if value is None:
        return nothing
    return f"{value:g} {key.rpartition('_')[2]}"
