"""Checks for contradictions between a study's keys, made before anything runs."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence

from dva_sim.experiments.study.designs import MAX_CELLS, MAX_POINTS, MAX_RUNS, keys_of
from dva_sim.experiments.study.factor_levels import factors_in_rows, path_in_design, runs_of, size
from dva_sim.experiments.study.parts import (
    ANSWER,
    DESIGN,
    POINT,
    REPEATS,
    STRATEGY,
    TUNED,
    TUNING,
    UNTUNED,
    Contrast,
    Level,
    MapRule,
    Prediction,
    refuse_keys_of_the_design,
)
from dva_sim.experiments.study.study import Study
from dva_sim.kernel.suggestions import hint
from dva_sim.kernel.yaml_files import KeyPath
from dva_sim.simulation.models import measured_names

SAME_LEVEL_TOLERANCE = 1e-9  # relative difference of two levels that are meant as one
Problem = tuple[str, KeyPath]
"""Description of a problem, and the key it is reported at."""


def of_design(study: Study) -> Iterator[Problem]:
    """Yield rows that do not fit together, and factors that are there twice."""
    design = study.design
    for name in (POINT,) if POINT in study.factors else ():
        yield f"{name!r} numbers the rows of a design; call the factor otherwise", ("factors", name)
    if design is None:
        return
    yield from _faults_of_zip(study, design.zip or ())
    yield from _faults_of_rows(study.listed_rows)
    for key in keys_of(design, study.listed_rows):
        if key in study.factors:
            yield f"{key!r} is varied by the design already", ("factors", key)
    for key in design.ranges:
        if key in study.treatments or key == TUNING:
            yield f"{key!r} has names for levels, so it has no range", ("design", "ranges", key)
    if study.robustness is not None:
        yield "robustness needs all levels with each other: a study without 'design'", (REPEATS,)


def _faults_of_zip(study: Study, names: Sequence[str]) -> Iterator[Problem]:
    for index, name in enumerate(names):
        path = ("design", "zip", index)
        if name not in study.factors:
            yield f"{name!r} is not a factor; {hint(name, study.factors, 'factors')}", path
        elif name in names[:index]:
            yield f"{name!r} appears twice", path
        elif names[0] in study.factors:
            expected = len(study.factors[names[0]])
            count = len(study.factors[name])
            if count != expected:
                yield f"{name!r} should have {expected} levels as {names[0]!r}, not {count}", path


def _faults_of_rows(rows: Sequence[Mapping[str, Level]]) -> Iterator[Problem]:
    first: dict[tuple[Level, ...], int] = {}
    for index, row in enumerate(rows):
        path = ("design", "rows", index)
        if not row:
            yield "row should name a level of each factor", path
        if row.keys() != rows[0].keys():
            odd = sorted(row.keys() ^ rows[0].keys())
            yield f"row should name the same factors as the first, but for {', '.join(odd)}", path
            return
        same = first.setdefault(tuple(row[key] for key in rows[0]), index)
        if same != index:
            yield f"row {index + 1} is row {same + 1} again", path


def of_factors(study: Study) -> Iterator[Problem]:
    """Names of treatments that do not exist, keys that two factors set, tuning without a rule."""
    setters: dict[str, str] = {}
    listed = keys_of(study.design, study.listed_rows)
    for factor in dict.fromkeys([*study.factors, *listed]):
        levels = _levels_of(study, factor)
        yield from _faults_of_numbers(study, factor, levels)
        named = study.treatments.get(factor)
        if named is not None:
            yield from _faults_of_name(study, factor)
            for level in (level for level in levels if level not in named):
                suggestion = hint(str(level), named, "named")
                yield f"{level!r} is not a treatment; {suggestion}", _place(study, factor, level)
        keys = {key for changes in (named or {}).values() for key in changes} or {factor}
        for key in keys if factor != TUNING else ():
            if setters.setdefault(key, factor) != factor:
                yield f"{key!r} is set by two factors", _place(study, factor)
            for other in (k for k, owner in setters.items() if owner != factor and _nests(k, key)):
                text = (
                    f"{key!r} and {other!r} of {setters[other]!r} undo each other; name their keys"
                )
                yield text, _place(study, factor)
    for key in study.changes:
        if setters.get(key) in listed:
            yield f"{key!r} is varied by the design; change 'design'", ("design",)
    try:
        refuse_keys_of_the_design(study.changes)
    except ValueError as error:
        yield str(error), ()
    yield from _faults_of_tuning(study)
    yield from of_size(study)


def _nests(key: str, other: str) -> bool:
    """Return True if one dotted key lies below the other."""
    short, long = sorted((key, other), key=len)
    return long.startswith(f"{short}.")


def _faults_of_numbers(study: Study, factor: str, levels: Sequence[Level]) -> Iterator[Problem]:
    """Levels that differ by rounding alone, as `numpy.arange` makes them, would share no row."""
    numbers = {n for n in levels if isinstance(n, int | float) and not isinstance(n, bool)}
    for low, high in itertools.pairwise(sorted(numbers)):
        if math.isclose(low, high, rel_tol=SAME_LEVEL_TOLERANCE):
            text = f"{low!r} and {high!r} are one level of {factor!r}, written twice"
            yield text, _place(study, factor, high)


def _faults_of_name(study: Study, factor: str) -> Iterator[Problem]:
    """Yield treatments named like another column: each is a column of every table."""
    if factor in DESIGN or factor in measured_names() or factor == TUNING:
        what = "the design" if factor in DESIGN else "what is measured"
        what = "the tuning" if factor == TUNING else f"a column of {what}"
        yield f"a treatment cannot be called {factor!r}: {what} is", ("treatments", factor)


def of_size(study: Study) -> Iterator[Problem]:
    """Yield a slip in a grid, or in how many persons there are, would take years to run."""
    count = size(study)
    has_points = POINT in study.factors
    most = MAX_POINTS if has_points else MAX_CELLS
    if count > most:
        how = "points or levels" if has_points else "levels, or draw points with 'design'"
        problem = f"a part would have {count:,} cells, more than {most:,}; have fewer {how}"
        yield problem, ("design",) if has_points else ("factors",)
    elif (runs := runs_of(study)) > MAX_RUNS:
        key = "most_persons" if study.most_persons > study.persons else "persons"
        is_trials = study.replications > study.most_persons
        path: KeyPath = ("stop", key) if key == "most_persons" else (key,)
        problem = f"there would be {runs:,} runs, more than {MAX_RUNS:,}"
        fewer = "have fewer persons, replications or levels"
        yield f"{problem}; {fewer}", ("replications",) if is_trials else path


def _levels_of(study: Study, factor: str) -> Sequence[Level]:
    """Return the levels of a factor, declared or in rows; none for a range."""
    listed = [row[factor] for row in study.listed_rows if factor in row]
    return study.factors.get(factor, tuple(listed))


def _place(study: Study, factor: str, level: Level = None) -> KeyPath:
    return path_in_design(study, factor, level) or ("factors", factor)


def _faults_of_tuning(study: Study) -> Iterator[Problem]:
    levels = study.factors.get(TUNING, ())
    tuning = study.tuning
    if TUNING in study.factors and tuning is None:
        yield "the factor 'tuning' needs a rule: the key 'tuning'", ("factors", TUNING)
    for level in (level for level in levels if level not in (UNTUNED, TUNED)):
        yield f"{level!r} is not a level of 'tuning': untuned, tuned", ("factors", TUNING)
    if tuning is None:
        return
    if tuning.seed == study.seed:
        problem = "tuning needs a random seed of its own, for other persons than the study's"
        yield problem, ("tuning", "seed")
    yield from _fault_of_part(study, ("tuning", "part"), tuning.part)
    for name in tuning.by:
        yield from _fault_of_level(study, ("tuning", "by"), name, ())
    yield from _faults_of_places(study, ("tuning", "at"), tuning.at)


def of_claims(study: Study) -> Iterator[Problem]:
    """Yield problems of declarations about factors and levels that the study lacks."""
    yield from of_answer(study)
    yield from of_robustness(study)
    yield from of_map(study)
    if study.covariates and study.answer is None:
        yield "the answer is adjusted for covariates; declare one", ("covariates",)
    for name, comparison in study.comparisons.items():
        yield from _faults_of_contrast(study, comparison, ("comparisons", name))
    for name in study.hypotheses:
        yield from _faults_of_hypothesis(study, name)
    if study.predictions and study.answer is None:
        if any(p.direction for p in study.predictions):
            yield "a prediction is judged against the answer; declare one", ("predictions",)
        return
    for index, prediction in enumerate(study.predictions):
        yield from _faults_of_prediction(study, prediction, ("predictions", index))


def kept_claims(study: Study) -> Study:
    """Return the study without declarations about parts, factors or levels that it no longer has.

    An answer without its levels takes the two that its factor has left, if it has two. Predictions
    stay; each is reported as not run.
    """
    lost: dict[str, object] = {}
    lost["map"] = _kept_map(study)
    lost["answer"] = answer = _kept_answer(study)
    if answer is None or any(of_robustness(study.model_copy(update={"answer": answer}))):
        lost["robustness"] = None
    if answer is None:
        lost["covariates"] = ()
    if answer != study.answer:
        lost["predictions"] = tuple(_of_answer_as_declared(study))
    lost["comparisons"] = {
        name: comparison
        for name, comparison in study.comparisons.items()
        if not any(_faults_of_contrast(study, comparison, ()))
    }
    rest = study.model_copy(update=lost)
    hypotheses = {
        name: claim
        for name, claim in rest.hypotheses.items()
        if not any(_faults_of_hypothesis(rest, name))
        and (answer == study.answer or claim.comparison != ANSWER)
    }
    return rest.model_copy(update={"hypotheses": hypotheses})


def _kept_answer(study: Study) -> Contrast | None:
    """Return the answer; without its levels, that of the two levels that its factor still has."""
    answer = study.answer
    if answer is None or not any(of_answer(study)):
        return answer
    left = study.factors.get(answer.factor, ())
    if len(left) != len(answer.contrast):
        return None
    changed = answer.model_copy(update={"contrast": left})
    return None if any(of_answer(study.model_copy(update={"answer": changed}))) else changed


def _of_answer_as_declared(study: Study) -> Iterator[Prediction]:
    """Yield the predictions with the answer's declared contrast named in each that relies on it."""
    for prediction in study.predictions:
        relies = prediction.direction is not None and prediction.contrast is None
        if study.answer is None or not relies:
            yield prediction
        else:
            named = {"factor": study.answer.factor, "contrast": study.answer.contrast}
            yield prediction.model_copy(update=named)


def _kept_map(study: Study) -> MapRule | None:
    """Return the map without notes about levels that the study no longer has."""
    if study.map is None:
        return None
    gone = {path[-1] for _, path in of_map(study) if path[:2] == ("map", "notes")}
    notes = {level: text for level, text in study.map.notes.items() if level not in gone}
    changed = study.map.model_copy(update={"notes": notes})
    return None if any(of_map(study.model_copy(update={"map": changed}))) else changed


def lost_claims(study: Study) -> list[str]:
    """Return claims that the changed factors or levels no longer allow, one sentence each."""
    smaller = kept_claims(study)
    lost = [f"{_fate_of_answer(smaller)}: {problem}" for problem, _ in of_answer(study)][:1]
    for what, declared, left in (
        ("comparison", study.comparisons, smaller.comparisons),
        ("hypothesis", study.hypotheses, smaller.hypotheses),
    ):
        lost += [f"{what} {name!r} is left out" for name in declared if name not in left]
    if study.map is not None and smaller.map is None:
        lost.append("the map will not be drawn")
    return lost


def _fate_of_answer(smaller: Study) -> str:
    if smaller.answer is None:
        return "the answer will not be computed"
    first, second = smaller.answer.contrast
    return f"the answer compares {smaller.answer.factor} {first} with {second}, the only two left"


def of_answer(study: Study) -> Iterator[Problem]:
    """Yield reasons why the declared contrast cannot be computed."""
    if study.answer is not None:
        yield from _faults_of_contrast(study, study.answer, (ANSWER,))


def _faults_of_contrast(study: Study, contrast: Contrast, path: KeyPath) -> Iterator[Problem]:
    yield from _fault_of_part(study, (*path, "part"), contrast.part)
    yield from _fault_of_level(study, (*path, "factor"), contrast.factor, ())
    if contrast.factor in study.factors:
        yield from _fault_of_level(study, (*path, "contrast"), contrast.factor, contrast.contrast)
    ranges = study.design.ranges if study.design is not None else {}
    if contrast.over is not None and contrast.over not in ranges:
        yield from _fault_of_level(study, (*path, "over"), contrast.over, ())
    yield from _faults_of_places(study, (*path, "within"), contrast.within)
    if contrast.contrast[0] == contrast.contrast[1]:
        yield "contrast compares a level with itself", (*path, "contrast")
    if contrast.over is None or path != (ANSWER,):
        # The levels of all other factors have to be given, or what is meant is open.
        named = {contrast.factor, contrast.over, *contrast.within, *factors_in_rows(study)}
        for name, levels in study.factors.items():
            if len(levels) > 1 and name not in named:
                yield f"should run over {name!r} or be within a level of it", path


def _faults_of_hypothesis(study: Study, name: str) -> Iterator[Problem]:
    hypothesis = study.hypotheses[name]
    path = ("hypotheses", name)
    yield from _fault_of_comparison(study, (*path, "comparison"), hypothesis.comparison)
    if (contrast := study.contrasts.get(hypothesis.comparison)) is None:
        return
    yield from _faults_of_places(study, (*path, "at"), hypothesis.at)
    if contrast.factor in hypothesis.at:
        yield f"{contrast.factor!r} is what is compared", (*path, "at", contrast.factor)


def of_stop(study: Study) -> Iterator[Problem]:
    """Yield reasons why a stopping rule cannot be applied."""
    stop = study.stop
    if stop is None:
        return
    if stop.comparison == ANSWER and study.answer is None and study.lost:
        why = "; leave out what 'stop' waits for: --set stop=null"
        yield f"{study.lost[0]}{why}", ("stop", "comparison")
    elif stop.comparison is not None:
        yield from _fault_of_comparison(study, ("stop", "comparison"), stop.comparison)
    if stop.part is not None:
        yield from _fault_of_part(study, ("stop", "part"), stop.part)
    if stop.most_persons < study.persons:
        problem = f"most_persons should be at least the first batch, persons: {study.persons}"
        yield problem, ("stop", "most_persons")


def _faults_of_prediction(study: Study, prediction: Prediction, path: KeyPath) -> Iterator[Problem]:
    assert study.answer is not None
    factor = prediction.factor or study.answer.factor
    contrast = prediction.contrast or ()
    yield from _fault_of_level(study, (*path, "contrast"), factor, contrast)
    yield from _faults_of_places(study, (*path, "at"), prediction.at)
    if contrast and contrast[0] == contrast[1]:
        yield "contrast compares a level with itself", (*path, "contrast")
    if prediction.direction == "same" and study.answer.smallest is None:
        yield "'same' needs the answer's smallest effect", (*path, "direction")


def of_robustness(study: Study) -> Iterator[Problem]:
    """Yield reasons why the contrast cannot be repeated."""
    robustness = study.robustness
    if robustness is None:
        return
    if study.answer is None:
        yield "robustness repeats the answer's contrast; declare one", (REPEATS,)
        return
    over = study.answer.over
    if over is None:
        yield "robustness needs a factor that the answer runs over", (REPEATS,)
        return
    yield from _fault_of_level(study, (REPEATS, "at"), over, robustness.at or ())
    if robustness.strategies and STRATEGY in study.factors:
        yield f"{STRATEGY!r} is a factor already", (REPEATS, "strategies")


def of_map(study: Study) -> Iterator[Problem]:
    """Yield why the map cannot be drawn."""
    if study.map is None:
        return
    answer = study.answer
    models = study.map.models
    if answer is None or answer.over is None:
        yield "a map needs an answer that runs over a factor", ("map",)
        return
    choosing = [] if study.map.choosing is None else [study.map.choosing]
    yield from _fault_of_level(study, ("map", "models"), models, ())
    yield from _fault_of_level(study, ("map", "choosing"), models, choosing)
    if models in (answer.factor, answer.over):
        yield f"{models!r} is what the answer compares or runs over", ("map", "models")
    for name, levels in study.factors.items():
        if len(levels) > 1 and name not in (answer.factor, answer.over, models):
            yield f"a map has no room for the factor {name!r}", ("map",)
    for level in study.map.notes:
        yield from _fault_of_level(study, ("map", "notes", level), answer.over, (level,))


def _fault_of_part(study: Study, path: KeyPath, part: str) -> Iterator[Problem]:
    if part not in study.parts:
        name = ".".join(map(str, path))
        yield f"{name} {part!r} is not a part; {hint(part, study.parts, 'parts')}", path


def _fault_of_comparison(study: Study, path: KeyPath, name: str) -> Iterator[Problem]:
    if name not in study.contrasts:
        yield f"{name!r} is not a comparison; {hint(name, study.contrasts, 'there are')}", path


def _faults_of_places(
    study: Study, path: KeyPath, places: Mapping[str, Level]
) -> Iterator[Problem]:
    for name, level in places.items():
        yield from _fault_of_level(study, (*path, name), name, (level,))


def _fault_of_level(
    study: Study, path: KeyPath, factor: str, levels: Sequence[Level]
) -> Iterator[Problem]:
    if factor not in study.factors:
        yield f"{factor!r} is not a factor; {hint(factor, study.factors, 'factors')}", path
        return
    for level in levels:
        if level not in study.factors[factor]:
            suggestion = hint(str(level), map(str, study.factors[factor]), "levels")
            yield f"{level!r} is not a level of {factor!r}; {suggestion}", path
