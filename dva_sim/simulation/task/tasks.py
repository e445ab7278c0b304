"""Tasks of the literature: pointing, steering, tracking, driving and reaching.

Tasks and their geometry are what a publication lays before its subjects. A value may be one
number or several: several are crossed with those of the other keys, and each condition is given
its trials in turn.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field, model_validator

from dva_sim.kernel.config import Config

Length = Annotated[float, Field(gt=0, le=1000)]  # nobody does a task that is longer
NonNegative = Annotated[float, Field(ge=0)]
Several = Annotated[tuple[Length, ...], Field(min_length=1, max_length=50)]
Values = Length | Several


def values_of(value: float | tuple[float, ...]) -> tuple[float, ...]:
    """Return one value or several, as several."""
    return value if isinstance(value, tuple) else (value,)


class Pointing(Config):
    """Bring a cursor onto a target.

    Attributes:
        amplitude_m: Distance from the start to the centre of the target.
        width_m: Width of the target along the path; in two dimensions its diameter.
        axes: 1: the cursor moves on a line. 2: targets lie on a circle and are taken across it.
        targets: Number of targets on that circle (two dimensions).
        cursor_m: Diameter of the cursor, which must be inside the target as a whole.
        selection: `first_entry`: inside once. `dwell`: inside for `dwell_s`. `click`: when the
            person presses a button; a press outside the target is an error.
        dwell_s: Time that it must stay inside.
        misses: A press outside ends the trial (`over`), or another one is made (`again`).
        errors: A press outside is a failure for the person (`count`), or costs nothing (`free`),
            so that it is in a hurry.
        target_mps: Speed of the target, which turns back one amplitude and a half from the start.
        turns_every_s: Mean time after which a moving target takes another way; 0: never.
        cue: `known`: where the next target will be is known, so one sets off as soon as one
            sees it. `unexpected`: one acts a reaction time after the first frame is on the screen.
            Who drives a vehicle always does.
        timed_from: Start of the movement time: with the `target`, or the first `movement`.
    """

    kind: Literal["pointing"] = "pointing"
    amplitude_m: Values = 0.1
    width_m: Values = 0.01
    axes: Literal[1, 2] = 1
    targets: Annotated[int, Field(ge=3, le=99)] = 15
    cursor_m: NonNegative = 0.0
    selection: Literal["first_entry", "dwell", "click"] = "first_entry"
    dwell_s: NonNegative = 0.5
    misses: Literal["over", "again"] = "over"
    errors: Literal["count", "free"] = "count"
    target_mps: NonNegative = 0.0
    turns_every_s: NonNegative = 0.0
    cue: Literal["known", "unexpected"] = "known"
    timed_from: Literal["target", "movement"] = "target"

    def conditions(self) -> Iterator[tuple[float, float]]:
        """Yield the amplitude and width [m] of each condition."""
        yield from itertools.product(values_of(self.amplitude_m), values_of(self.width_m))

    @model_validator(mode="after")
    def _cursor_fits(self) -> Pointing:
        if self.cursor_m >= min(values_of(self.width_m)):
            raise ValueError(
                f"cursor_m {self.cursor_m:g} should be below the smallest width_m "
                f"{min(values_of(self.width_m)):g}, or no target can be entered"
            )
        return self


class Tunnel(Config):
    """Steer a cursor through a tunnel without touching its walls.

    Attributes:
        shape: A straight tunnel, or once around a circle.
        length_m: Along its middle.
        width_m: Width from wall to wall.
        on_error: Effect of crossing a wall: the error is `counted` and the trial goes on, or it is
            `over`.
    """

    kind: Literal["tunnel"] = "tunnel"
    shape: Literal["straight", "circular"] = "straight"
    length_m: Values = 0.2
    width_m: Values = 0.01
    on_error: Literal["counted", "over"] = "counted"

    def conditions(self) -> Iterator[tuple[float, float]]:
        """Yield the length and width [m] of each condition."""
        yield from itertools.product(values_of(self.length_m), values_of(self.width_m))

    @model_validator(mode="after")
    def _goes_around(self) -> Tunnel:
        for length, width in self.conditions():
            if self.shape == "circular" and width * math.pi >= length:
                raise ValueError(
                    f"width_m {width:g} leaves no middle of a circle of length_m {length:g}; it "
                    "should be below its diameter"
                )
        return self


class Tracking(Config):
    """Follow a target that moves as a sum of sines, on a line, or resist a push of that form.

    Attributes:
        record_s: Length of the measured part; sines are rounded to whole periods in it.
        warm_up_s: Before that, not measured.
        frequencies_rad_s: Frequencies of the sines.
        amplitudes_m: Amplitudes of the sines.
        moves: Moving part: the `target`, or the `cursor`. With `cursor` the sines are added to its
            input, in seconds of its motion, and the target is stationary.
    """

    kind: Literal["tracking"] = "tracking"
    record_s: Annotated[float, Field(ge=10, le=1000)] = 120.0
    warm_up_s: NonNegative = 10.0
    frequencies_rad_s: Several = (0.2, 0.5, 1.0, 2.0, 4.0)
    amplitudes_m: Several = (0.02, 0.02, 0.02, 0.002, 0.002)
    moves: Literal["target", "cursor"] = "target"

    def conditions(self) -> Iterator[tuple[float, float]]:
        """Yield one: the largest excursion and the highest frequency."""
        yield sum(self.amplitudes_m), max(self.frequencies_rad_s)

    @property
    def frequencies(self) -> tuple[float, ...]:
        """Frequencies of the sines, whole numbers of which fill the record [rad/s]."""
        base = 2.0 * math.pi / self.record_s
        return tuple(base * max(1, round(w / base)) for w in self.frequencies_rad_s)

    @model_validator(mode="after")
    def _sines_differ(self) -> Tracking:
        if len(self.amplitudes_m) != len(self.frequencies_rad_s):
            raise ValueError("amplitudes_m and frequencies_rad_s should be equally many")
        if list(self.frequencies) != sorted(set(self.frequencies)):
            raise ValueError(
                "frequencies_rad_s should rise, by more than one period in record_s each"
            )
        return self


class Corner(Config):
    """Drive around a right-angled corner of a corridor.

    Attributes:
        leg_m: Before the corner, and after it, along the middle.
        width_m: Width of the corridor.
    """

    kind: Literal["corner"] = "corner"
    leg_m: Values = 4.0
    width_m: Values = 1.5

    def conditions(self) -> Iterator[tuple[float, float]]:
        """Yield the length and width [m] of each condition."""
        for leg, width in itertools.product(values_of(self.leg_m), values_of(self.width_m)):
            yield 2.0 * leg, width


class Slalom(Config):
    """Drive around cones in a row, to their left and right by turns.

    Attributes:
        cones: Number of cones.
        spacing_m: Between neighbours.
        swing_m: Distance from the row at which the middle of the path passes a cone.
        width_m: Width of the path; a vehicle farther off its middle touches something.
    """

    kind: Literal["slalom"] = "slalom"
    cones: Annotated[int, Field(ge=1, le=100)] = 6
    spacing_m: Values = 4.0
    swing_m: Length = 1.0
    width_m: Values = 1.5

    def conditions(self) -> Iterator[tuple[float, float]]:
        """Yield the spacing and width [m] of each condition."""
        yield from itertools.product(values_of(self.spacing_m), values_of(self.width_m))

    @model_validator(mode="after")
    def _cones_stand_beside(self) -> Slalom:
        widest = max(values_of(self.width_m))
        if widest > 2.0 * self.swing_m:
            raise ValueError(
                f"width_m {widest:g} is above twice swing_m {self.swing_m:g}: the cones would "
                "stand in the way"
            )
        return self


class Course(Config):
    """Drive along a course to its end.

    Attributes:
        points_m: Its corners, `[x, y]` each.
        width_m: Width of the path.
    """

    kind: Literal["course"] = "course"
    points_m: Annotated[tuple[tuple[float, float], ...], Field(min_length=2, max_length=500)]
    width_m: Values = 1.5

    def conditions(self) -> Iterator[tuple[float, float]]:
        """Yield the length and width [m] of each condition."""
        steps = itertools.pairwise(self.points_m)
        length = sum(math.dist(a, b) for a, b in steps)
        for width in values_of(self.width_m):
            yield length, width

    @model_validator(mode="after")
    def _leads_somewhere(self) -> Course:
        for number, (a, b) in enumerate(itertools.pairwise(self.points_m)):
            if a == b:
                raise ValueError(f"points_m {number} and {number + 1} are the same place")
        return self


class HeadingStep(Config):
    """Keep a vehicle on a straight way whose heading is wrong when the picture appears.

    The machine holds the top speed; only the steering is the person's.

    Attributes:
        error_deg: Error of the heading, alternately to the left and to the right.
        width_m: Width of the path.
        watched_s: Time for which the steering is watched.
    """

    kind: Literal["heading_step"] = "heading_step"
    error_deg: Values = 1.0
    width_m: Length = 3.0
    watched_s: Annotated[float, Field(gt=0, le=60)] = 2.5

    def conditions(self) -> Iterator[tuple[float, float]]:
        """Yield the error [deg] and width [m] of each condition."""
        for error in values_of(self.error_deg):
            yield error, self.width_m


class Stop(Config):
    """Goal of the arm's tip, and the work to be done there.

    Attributes:
        swing_m: Along the arc of the swing at the arm's middle reach.
        reach_m: Outwards.
        work_s: Time for the work there, regardless of the operator (digging, emptying).
    """

    swing_m: float
    reach_m: float
    work_s: NonNegative = 0.0


class ReachTask(Config):
    """Bring the tip of a slow arm from place to place, as an excavator loads a truck.

    Attributes:
        stops: Places of the tip, in this order.
        tolerance_m: Tolerance of the position, either way.
        settle_s: Time that it must stay within the tolerance before the work begins.
    """

    kind: Literal["reach"] = "reach"
    stops: Annotated[tuple[Stop, ...], Field(min_length=1, max_length=50)]
    tolerance_m: Values = 0.2
    settle_s: NonNegative = 0.3

    def conditions(self) -> Iterator[tuple[float, float]]:
        """Yield the whole way and width of a target [m] of each condition."""
        places = [(0.0, 0.0), *((stop.swing_m, stop.reach_m) for stop in self.stops)]
        distance = sum(math.dist(a, b) for a, b in itertools.pairwise(places))
        for tolerance in values_of(self.tolerance_m):
            yield distance, 2.0 * tolerance


Task = Annotated[
    Pointing | Tunnel | Tracking | Corner | Slalom | Course | HeadingStep | ReachTask,
    Field(discriminator="kind"),
]
VEHICLES = (Corner, Slalom, Course, HeadingStep)
