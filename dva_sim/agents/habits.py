"""Habits: every number about people that was assumed, with its band and the reason for it.

These numbers are assumed. A scenario sets one by its key, such as
`operator.habits.waiting.shortest_s`, a study varies it as a factor, and `dva-sim assumed` lists
all of them. Numbers with a source, and choices of the program itself (limits of memory,
resolutions), stay beside the code that needs them and say so.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from dva_sim.kernel.assumed import Assumed, Sparse
from dva_sim.kernel.config import Config

# --- operators -----------------------------------------------------------------------------


class SteeringHabits(Sparse):
    """Following a route in a closed loop.

    Attributes:
        nearest_look_m: Shortest look-ahead.
        farthest_look_m: Longest look-ahead.
        stops_from_rad: Bearing from which on it stops to turn on the spot.
        turns_until_rad: Bearing at which it drives on.
        in_curves: Share of the highest turn rate with which it plans a curve.
        cycle_s: Time between two corrections, with `two_point`.
    """

    nearest_look_m: Annotated[
        float, Assumed(0.5, 1.2, "from a robot's own length to the width of a corridor")
    ] = 0.8
    farthest_look_m: Annotated[
        float, Assumed(1.3, 3.0, "a building shows no farther around its corners")
    ] = 1.8
    stops_from_rad: Annotated[
        float, Assumed(0.5, 1.2, "a target nearer the edge of a 70 deg picture is out of view")
    ] = 0.9
    turns_until_rad: Annotated[float, Assumed(0.1, 0.45, "from aimed exactly to roughly ahead")] = (
        0.25
    )
    in_curves: Annotated[float, Assumed(0.6, 1.0, "some turn rate is kept for corrections")] = 0.8
    cycle_s: Annotated[
        float, Assumed(0.1, 0.35, "refractory times given for intermittent control")
    ] = 0.2


class WaitingHabits(Sparse):
    """Moving and waiting, and the choice of it.

    Attributes:
        settled_s: Time for which the picture must stand still.
        still_share: Share of a move's pace below which the picture counts as still.
        shortest_s: Minimum duration of a move; a shorter distance is driven more slowly instead.
        patience: Multiple of the usual wait after which it moves again, though it saw nothing.
        off_way_m: Accepted distance from its path after a move.
        faces_rad: Bearing within which it drives without turning first.
        least_m: Shortest move worth a wait.
        let_go: Pace, as a share of the limits, that it takes the robot to have had when it changes
            to moving and waiting.
        driven: Delay of what goes on by itself against that of aimed movements at which a person
            has the same unease.
    """

    settled_s: Annotated[float, Assumed(0.1, 1.0, "from one fixation to a careful second look")] = (
        0.3
    )
    still_share: Annotated[float, Assumed(0.05, 0.4, "slower motion is hard to see")] = 0.2
    shortest_s: Annotated[
        float, Assumed(0.3, 2.5, "from a flick of the hand to more than one period of a slow link")
    ] = 0.5
    patience: Annotated[
        float, Assumed(1.5, 6.0, "from soon after the usual wait to a minute at 10 s")
    ] = 3.0
    off_way_m: Annotated[
        float, Assumed(0.08, 0.3, "half the room beside a robot in a door or a corridor")
    ] = 0.15
    faces_rad: Annotated[float, Assumed(0.05, 0.25, "from 3 to 15 degrees off")] = 0.1
    least_m: Annotated[float, Assumed(0.05, 0.3, "from a hand's width to half a robot")] = 0.1
    let_go: Annotated[float, Assumed(0.1, 0.6, "from creeping to well under way")] = 0.25
    driven: Annotated[
        float, Assumed(1.0, 8.0, "a robot on its way may be left to it for a while")
    ] = 4.0


class CorrectingHabits(Sparse):
    """Habits in correcting the course of a vehicle.

    Attributes:
        evidence_rad: Sum of the error of the turn rate over time at which a correction begins.
        grows_s: Time for which a correction grows.
        unnoticed: Share of the last correction below which an error does not count.
    """

    evidence_rad: Annotated[
        float,
        Assumed(0.0005, 0.005, "what larger errors save in time, from 6 to 60 ms at 1 to 2 deg"),
    ] = 0.0008
    grows_s: Annotated[
        float,
        Assumed(0.15, 0.5, "quartiles of a car's first corrections, with the hand's lag or not"),
    ] = 0.2
    unnoticed: Annotated[float, Assumed(0.1, 0.4, "Weber fractions of motion and place")] = 0.3


class AimingHabits(Sparse):
    """Habits in making aimed movements; some are fitted, see the validation.

    Attributes:
        shortest_s: Duration of the shortest movement.
        per_bit_s: Time more for each bit of its difficulty.
        close_enough: Share of the tolerance within which nothing is corrected.
        careful: Share of the tolerance within which it must expect to be before it presses.
        finest_m: Lower limit of the tolerance with which a person aims.
        misses: Standard deviation of the end of a movement, as a share of its length.
        doubt: Expected miss of a movement that is not visible yet, as a share of its length.
        settles: Time from the end of a movement to a press, in time constants of the hand.
        ruffled: Share by which each movement that failed makes the delay feel longer.
        misjudges: Standard deviation of the judged delay, as a share of it.
        recalls_s: Time in which such a misjudgement changes.
        practice: Exponent of the speed-up with the number of the trial.
    """

    shortest_s: Annotated[float, Assumed(0.05, 0.3, "from a flick to a refractory time")] = 0.08
    per_bit_s: Annotated[float, Assumed(0.04, 0.15, "slopes of Fitts' law without corrections")] = (
        0.05
    )
    close_enough: Annotated[float, Assumed(0.3, 1.0, "from near the centre to anywhere inside")] = (
        0.6
    )
    careful: Annotated[float, Assumed(0.5, 1.0, "from near the centre to anywhere inside")] = 0.8
    finest_m: Annotated[float, Assumed(0.0005, 0.004, "from a pixel to a few millimetres")] = 0.002
    misses: Annotated[
        float, Assumed(0.03, 0.12, "first movements end within 5 to 10 % of their way: Meyer 1988")
    ] = 0.07
    doubt: Annotated[float, Assumed(0.05, 0.4, "misses of a first movement, 5 to 20 %")] = 0.1
    settles: Annotated[float, Assumed(0.5, 2.0, "from a click on the run to one at rest")] = 1.0
    ruffled: Annotated[float, Assumed(0.0, 1.0, "from no notice to at once")] = 0.4
    misjudges: Annotated[float, Assumed(0.05, 0.4, "Weber fractions of judged times")] = 0.2
    recalls_s: Annotated[float, Assumed(0.2, 3.0, "from one movement to several")] = 0.7
    practice: Annotated[float, Assumed(0.05, 0.3, "power laws of practice")] = 0.2


class DelayHabits(Sparse):
    """Learning the delay from commands and the motion that follows.

    Attributes:
        first_guess_s: Delay that it expects before having seen any.
        usual_s: Delay of the machines that it uses every day.
        remembers_s: Time for which it remembers its own commands.
        fades_in_s: Time in which evidence loses its weight by a factor of e.
        firmness: Misfit that stands against each second of change [1/s].
        most_misfit: Maximum misfit of one look.
        speed_scale_mps: Difference of speeds that counts one.
        turn_scale_rad_s: Difference of turn rates that counts one.
        noticed: Share of the limits by which a motion must change to be noticed.
        effects: Number of effects from which the period is judged.
    """

    usual_s: Annotated[
        float, Assumed(0.03, 0.15, "from a fast computer to a slow one, mouse to picture")
    ] = 0.1
    first_guess_s: Annotated[
        float, Assumed(0.25, 1.5, "from a game over a good link to a bad video call")
    ] = 0.6
    remembers_s: Annotated[
        float, Assumed(6.0, 20.0, "working memory without rehearsal lasts about that long")
    ] = 12.0
    fades_in_s: Annotated[
        float, Assumed(2.0, 20.0, "from one move of a slow link to a whole corridor")
    ] = 5.0
    firmness: Annotated[float, Assumed(0.001, 0.016, "a factor of four either way")] = 0.004
    most_misfit: Annotated[float, Assumed(0.25, 1.0, "a factor of two either way")] = 0.5
    speed_scale_mps: Annotated[float, Assumed(0.25, 1.0, "a factor of two either way")] = 0.5
    turn_scale_rad_s: Annotated[float, Assumed(0.5, 2.0, "a factor of two either way")] = 1.0
    noticed: Annotated[float, Assumed(0.1, 0.5, "smaller changes are hard to tell")] = 0.25
    effects: Annotated[int, Assumed(4, 16, "what is remembered of the last minute")] = 8


class CloseQuarterHabits(Sparse):
    """Driving a robot that its collision guard holds back.

    Attributes:
        look_m: Look-ahead.
        stops_from_rad: Bearing from which on it stops to turn on the spot.
        turns_until_rad: Bearing at which it drives on.
        slowly: Share of the top speed.
        crawl_mps: Lowest speed.
        understood_after_s: Time of being held back, in addition to two delays, until it
            understands.
        step_out_m: Distance that it moves to a place with room.
        clear_m: Distance after which it drives as before.
        asked_mps: Commanded speed above which it expects to move.
        held_still_mps: Speed seen below which it is held back.
    """

    look_m: Annotated[float, Assumed(0.2, 0.6, "less than a robot's length")] = 0.35
    stops_from_rad: Annotated[float, Assumed(0.1, 0.4, "more careful than in the open")] = 0.2
    turns_until_rad: Annotated[float, Assumed(0.05, 0.2, "half of where it stops to turn")] = 0.1
    slowly: Annotated[float, Assumed(0.15, 0.5, "from creeping to half speed")] = 0.3
    crawl_mps: Annotated[float, Assumed(0.05, 0.15, "slower motion is hard to see")] = 0.1
    understood_after_s: Annotated[
        float, Assumed(0.5, 5.0, "from a reaction with some choice to a puzzled look")
    ] = 1.5
    step_out_m: Annotated[float, Assumed(0.3, 1.0, "from half a robot's length to one")] = 0.5
    clear_m: Annotated[float, Assumed(0.5, 2.0, "a robot's length to the width of a corridor")] = (
        1.0
    )
    asked_mps: Annotated[float, Assumed(0.02, 0.1, "slower motion is hard to see")] = 0.05
    held_still_mps: Annotated[float, Assumed(0.01, 0.05, "slower motion is not seen")] = 0.02


class StuckHabits(Sparse):
    """Habits with a robot that seems stuck.

    Attributes:
        still: Speed [m/s] and turn rate [rad/s] below which a robot stands.
        asked_mps: Commanded speed above which it expects to see motion.
        asked_rad_s: Commanded turn rate above which it expects to see motion.
        plans_after_s: Time of standing, in addition to two delays, after which it plans another
            path.
        asked_for_s: Time for which motion must have been asked for in all; less is a touch that
            may well have no effect.
        lets_go_s: Time for which it levels the phone before it tries again.
        nearer_m: Way below which it has made no progress.
        in_smoke_m: Distance from which it looks at a place that smoke hides from farther away.
    """

    still: Annotated[float, Assumed(0.01, 0.05, "slower motion is not seen")] = 0.02
    asked_mps: Annotated[float, Assumed(0.02, 0.1, "slower motion is hard to see")] = 0.05
    asked_rad_s: Annotated[float, Assumed(0.05, 0.2, "slower motion is hard to see")] = 0.1
    plans_after_s: Annotated[
        float, Assumed(2.0, 15.0, "from a moment's doubt to a slow page on the web")
    ] = 4.0
    asked_for_s: Annotated[float, Assumed(0.3, 3.0, "from a short touch to a deliberate try")] = 1.0
    lets_go_s: Annotated[float, Assumed(0.3, 3.0, "from a twitch to a deliberate pause")] = 1.0
    nearer_m: Annotated[float, Assumed(0.2, 1.0, "less is not seen in the picture")] = 0.5
    in_smoke_m: Annotated[
        float, Assumed(0.4, 0.8, "as near as a robot gets without touching it")
    ] = 0.5


class LookingHabits(Sparse):
    """Becoming sure of an event from pictures of its place.

    Attributes:
        half_seen_rad: Visual angle at which an event is half recognisable.
        hurried: Share of the criterion that is enough in a hurry.
        discount: Power of the contrast by which unclear evidence is discounted, beside the
            half power of its noise.
        leans_from: Share of the criterion from which on it is half convinced.
        at_place_m: Distance within which it is at the place.
        nearer_after_s: Time without seeing the place after which it moves closer.
        keeps_off_m: Distance from which it looks at a place.
        same_place_m: Distance from the reported place within which a hazard is the reported one.
        wait_for_picture_s: Time without a picture after which it presumes the link lost.
    """

    half_seen_rad: Annotated[
        float, Assumed(0.015, 0.06, "a factor of two either way: 9 to 36 cm from 6 m away")
    ] = 0.03
    hurried: Annotated[
        float, Assumed(0.4, 0.9, "from a third of the usual errors to hardly more of them")
    ] = 0.65
    discount: Annotated[
        float, Assumed(0.5, 1.5, "from as rare errors in smoke as without to many more")
    ] = 1.0
    leans_from: Annotated[float, Assumed(0.3, 0.7, "around the half")] = 0.5
    at_place_m: Annotated[float, Assumed(1.3, 3.0, "a robot stops before it, in the same room")] = (
        1.5
    )
    nearer_after_s: Annotated[float, Assumed(2.0, 15.0, "from a look to a look around")] = 5.0
    keeps_off_m: Annotated[float, Assumed(0.8, 1.3, "near enough to see it, and no contact")] = 1.2
    same_place_m: Annotated[float, Assumed(2.0, 6.0, "the same room")] = 4.0
    wait_for_picture_s: Annotated[
        float, Assumed(8.0, 60.0, "from an app's time-out to a patient reload")
    ] = 20.0


class AttentionHabits(Sparse):
    """Dividing attention among the pictures of several robots.

    Attributes:
        glance_s: Time for which it looks at a robot that only drives, median.
        glance_spread: Standard deviation of the logarithm of that.
        reconsiders_s: Time between two decisions which screen to look at.
    """

    glance_s: Annotated[
        float, Assumed(3.0, 14.0, "from a few fixations to the third quartile with two vehicles")
    ] = 9.0
    glance_spread: Annotated[float, Assumed(0.5, 1.1, "0.84 with two vehicles")] = 0.84
    reconsiders_s: Annotated[float, Assumed(0.2, 2.0, "from one fixation to several")] = 0.5


class AskingHabits(Sparse):
    """Waiting for a robot that is not free.

    Attributes:
        again_after_s: Time until it repeats the request for a robot that another device holds.
        stands_after_s: Time after a stop when it takes a robot to stand.
        mission_every_s: Time between two questions how a mission stands.
    """

    again_after_s: Annotated[float, Assumed(1.0, 10.0, "from at once to after another look")] = 2.0
    stands_after_s: Annotated[
        float, Assumed(1.0, 3.0, "a robot stops within a second of the command")
    ] = 1.5
    mission_every_s: Annotated[float, Assumed(1.0, 10.0, "from at once to after another look")] = (
        2.0
    )


class OperatorHabits(Sparse):
    """All assumed habits of an operator, by subject."""

    steering: SteeringHabits = Field(default_factory=SteeringHabits)
    waiting: WaitingHabits = Field(default_factory=WaitingHabits)
    correcting: CorrectingHabits = Field(default_factory=CorrectingHabits)
    aiming: AimingHabits = Field(default_factory=AimingHabits)
    delay: DelayHabits = Field(default_factory=DelayHabits)
    close_quarters: CloseQuarterHabits = Field(default_factory=CloseQuarterHabits)
    stuck: StuckHabits = Field(default_factory=StuckHabits)
    looking: LookingHabits = Field(default_factory=LookingHabits)
    attention: AttentionHabits = Field(default_factory=AttentionHabits)
    asking: AskingHabits = Field(default_factory=AskingHabits)


# --- people on foot ------------------------------------------------------------------------


class WalkingHabits(Sparse):
    """Walking, and giving way to others.

    Attributes:
        radius_m: Radius of the disc that stands for a person, seen from above.
        sideways_m: Half the depth of a chest, of a person who squeezes through a gap.
        reach_m: Distance within which others count, indoors.
        berth_m: Gap kept to other bodies, if there is room.
        keeps_right_m2: Handicap of passing on the left, against the square of the miss.
        look_ahead_m: Look-ahead on the path.
        look_past_m: Look-ahead where others are and no wall stands between.
        astray_m: Distance from the path beyond which it plans another.
        arrived_m: Distance from the end of the path that counts as arrived.
        crowded_m: Arrival distance where others keep it from coming nearer.
        braking_s: Divisor of the remaining distance that gives the maximum speed before the end.
        nearer_m: Way below which it has made no progress.
        tired_s: Time without progress after which it looks for a way around.
        gives_up_s: Time without progress after which it gives up.
        beside_m: Gap to a robot within which it squeezes past.
        sideways_mps: Speed of squeezing past.
        standing_mps: Speed below which a person counts as standing in the way.
        narrow_m: Width of a door beyond which people do not give way.
        gives_way_from_m: Distance before a door from which on it can wait.
        gives_way_to_m: Distance before a door up to which it still can.
        waits_before_m: Distance before the door at which it waits.
        waits_aside_m: Distance from the way through the door at which it waits.
        oncoming_mps: Speed above which a person counts as approaching.
        in_door_m: Distance from its middle within which a robot is in a door.
        patience_s: Longest wait for people at a door.
        patience_with_robots_s: Longest wait for a robot that moves.
    """

    radius_m: Annotated[float, Assumed(0.18, 0.25, "as much floor as 0.46 m by 0.28 m")] = 0.2
    sideways_m: Annotated[float, Assumed(0.1, 0.15, "half the depth of a chest")] = 0.12
    reach_m: Annotated[float, Assumed(2.0, 5.0, "from arm's reach to the length of a room")] = 3.0
    berth_m: Annotated[float, Assumed(0.05, 0.3, "from touching clothes to keeping off")] = 0.1
    keeps_right_m2: Annotated[float, Assumed(0.0, 3.0, "from no preference to a clear one")] = 1.0
    look_ahead_m: Annotated[float, Assumed(0.5, 1.5, "half a second to a second's walk")] = 0.8
    look_past_m: Annotated[float, Assumed(1.5, 4.0, "one to three seconds' walk")] = 2.5
    astray_m: Annotated[float, Assumed(0.5, 2.0, "half a corridor to a whole one")] = 1.0
    arrived_m: Annotated[float, Assumed(0.1, 0.4, "less than a step")] = 0.15
    crowded_m: Annotated[float, Assumed(1.0, 3.0, "one to four people around a place")] = 1.5
    braking_s: Annotated[float, Assumed(0.5, 1.5, "one to two steps")] = 1.0
    nearer_m: Annotated[float, Assumed(0.1, 0.5, "less than a step")] = 0.25
    tired_s: Annotated[float, Assumed(2.0, 10.0, "from impatient to polite")] = 4.0
    gives_up_s: Annotated[float, Assumed(30.0, 180.0, "half a minute to a few")] = 60.0
    beside_m: Annotated[float, Assumed(0.5, 1.2, "within arm's reach")] = 0.8
    sideways_mps: Annotated[float, Assumed(0.3, 0.8, "a fraction of walking")] = 0.5
    standing_mps: Annotated[float, Assumed(0.05, 0.2, "shifting from foot to foot")] = 0.1
    narrow_m: Annotated[float, Assumed(1.2, 2.0, "two shoulders pass a wider door at once")] = 1.6
    gives_way_from_m: Annotated[float, Assumed(0.2, 0.6, "a step before the door")] = 0.3
    gives_way_to_m: Annotated[float, Assumed(1.0, 4.0, "one to three seconds' walk")] = 2.0
    waits_before_m: Annotated[float, Assumed(0.5, 1.5, "a step or two back")] = 0.8
    waits_aside_m: Annotated[float, Assumed(0.6, 1.2, "out of the way of a body")] = 0.9
    oncoming_mps: Annotated[float, Assumed(0.05, 0.3, "from creeping to a slow walk")] = 0.1
    in_door_m: Annotated[float, Assumed(0.6, 1.5, "a robot's length and more")] = 1.0
    patience_s: Annotated[float, Assumed(2.0, 10.0, "from impatient to polite")] = 5.0
    patience_with_robots_s: Annotated[float, Assumed(5.0, 40.0, "robots are slow")] = 15.0


class LeavingHabits(Sparse):
    """Habits in leaving bad air.

    Attributes:
        untenable_c: Air temperature in which people do not stay.
        untenable_water_m: Depth of water in which people do not stay.
        deadly_c: Air temperature that people do not walk through.
        deadly_water_m: Depth of water that people do not walk through.
        keeps_off_m: Distance kept to a bad place on the path.
        close_m: Maximum remaining distance walked through bad air that gets no worse.
        through_m: Distance from the middle of an exit within which it is out.
        chooses_again_s: Minimum time between two choices of a path.
        at_latest_s: Longest time between two choices that mended nothing.
        looks_ahead_m: Distance along its path that it checks for bad air.
    """

    untenable_c: Annotated[float, Assumed(50.0, 80.0, "minutes in moist to dry air")] = 60.0
    untenable_water_m: Annotated[float, Assumed(0.5, 1.2, "from the knee to the chest")] = 1.0
    deadly_c: Annotated[float, Assumed(90.0, 160.0, "pain within seconds to a minute")] = 120.0
    deadly_water_m: Annotated[float, Assumed(1.2, 1.8, "from the chest to the head")] = 1.5
    keeps_off_m: Annotated[float, Assumed(0.5, 2.0, "a step or two")] = 1.0
    close_m: Annotated[float, Assumed(5.0, 20.0, "a breath held at a run or two")] = 10.0
    through_m: Annotated[float, Assumed(0.5, 1.2, "within the frame of a door")] = 0.8
    chooses_again_s: Annotated[float, Assumed(1.0, 5.0, "a look and a thought")] = 2.0
    at_latest_s: Annotated[float, Assumed(8.0, 60.0, "nobody stands still for longer")] = 16.0
    looks_ahead_m: Annotated[float, Assumed(3.0, 12.0, "a room to a corridor")] = 6.0


class OnFootHabits(Sparse):
    """All assumed habits that guards and bystanders share."""

    walking: WalkingHabits = Field(default_factory=WalkingHabits)
    leaving: LeavingHabits = Field(default_factory=LeavingHabits)


class GuardWorkHabits(Sparse):
    """A guard's work on an event.

    Attributes:
        sees_from_m: Distance from which it recognises a hazard.
        extinguishes_from_m: Reach of a hand-held extinguisher.
        keeps_off_m: Distance that it keeps from untenable air while it shuts a valve.
        is_there_m: Distance within which it stands at a place.
        stands_off_m: Distance from an event at which it stands by.
        stands_by_s: Longest time for which it stands by without a word of the DVA.
        looks_ahead_m: Distance along its path that it checks for deadly air.
        in_sight_m: Distance from which it has seen enough if it is driven back.
    """

    sees_from_m: Annotated[float, Assumed(1.0, 5.0, "from a step away to across a room")] = 2.0
    extinguishes_from_m: Annotated[float, Assumed(2.0, 6.0, "streams of extinguishers")] = 3.0
    keeps_off_m: Annotated[float, Assumed(2.0, 10.0, "a valve is a room away, or a few")] = 5.0
    is_there_m: Annotated[float, Assumed(0.5, 2.0, "a step or two")] = 1.0
    stands_off_m: Annotated[
        float, Assumed(8.5, 15.0, "beyond the 7 m of the worst usual hazard, and an error")
    ] = 10.0
    stands_by_s: Annotated[float, Assumed(300.0, 1800.0, "five minutes to half an hour")] = 900.0
    looks_ahead_m: Annotated[float, Assumed(1.0, 3.0, "one to two seconds' walk")] = 1.5
    in_sight_m: Annotated[float, Assumed(5.0, 15.0, "a room to a corridor")] = 10.0


class GuardHabits(OnFootHabits):
    """All assumed habits of a guard."""

    work: GuardWorkHabits = Field(default_factory=GuardWorkHabits)


class NoticingHabits(Sparse):
    """Signs by which a bystander notices that something is wrong.

    Attributes:
        warm_c: Air temperature.
        heat_kw_m2: Radiant heat.
        smoke_per_m: Extinction coefficient of smoke.
        water_m: Depth of water.
        too_near_kw_m2: Radiant heat at which it leaves at once.
    """

    warm_c: Annotated[float, Assumed(30.0, 50.0, "from a hot day to a sauna's door")] = 40.0
    heat_kw_m2: Annotated[float, Assumed(0.3, 1.0, "less than the sun to as much")] = 0.5
    smoke_per_m: Annotated[float, Assumed(0.03, 0.3, "a smell to a haze: 100 to 10 m of sight")] = (
        0.1
    )
    water_m: Annotated[float, Assumed(0.005, 0.05, "a film to over the sole")] = 0.02
    too_near_kw_m2: Annotated[float, Assumed(0.7, 2.0, "the sun to below the limit of pain")] = 1.0


class BystanderHabits(OnFootHabits):
    """All assumed habits of a bystander."""

    noticing: NoticingHabits = Field(default_factory=NoticingHabits)


# --- phones, and the hands that hold them --------------------------------------------------


class PhoneHabits(Config):
    """Assumptions about a phone, its grip and its settings.

    Attributes:
        sample_jitter: Standard deviation of the time of a sample, as a share of the time between
            two.
        tremor_deg: Tremor of the hand, as apparent tilt, standard deviation.
        tremor_width_hz: Width of the tremor's resonance, between its half-power frequencies.
        max_tilt_deg: Farthest that the hand tilts the phone away from rest.
        max_tilt_speed_deg_s: Fastest that it does.
        warming_k: Standard deviation of the temperature in a session, against the calibration's.
        reference_error_mps2: Error of the neutral pose when the owner calibrated,
            standard deviation of x and y; the offset of the part itself is calibrated away.
        speed_step_mps2: Acceleration along the tilt axis for one level of speed.
        turn_step_mps2: Acceleration across it for one degree per second of turn.
    """

    sample_jitter: Annotated[
        float, Field(le=0.3), Assumed(0.0, 0.3, "from a steady sensor to one of a busy phone")
    ] = 0.1
    tremor_deg: Annotated[float, Assumed(0.0, 0.6, "from a rested hand to a tired one")] = 0.25
    tremor_width_hz: Annotated[
        float, Assumed(1.0, 4.0, "most of the power lies between 8 and 12 Hz")
    ] = 2.0
    max_tilt_deg: Annotated[
        float, Field(le=80), Assumed(30.0, 60.0, "beyond it the screen is hard to read")
    ] = 45.0
    max_tilt_speed_deg_s: Annotated[
        float, Assumed(80.0, 400.0, "while looking at a picture on the phone")
    ] = 200.0
    warming_k: Annotated[
        float, Assumed(0.0, 15.0, "from a phone at rest to one that has streamed video")
    ] = 5.0
    reference_error_mps2: Annotated[
        float, Assumed(0.0, 0.3, "half a degree to two, held by hand")
    ] = 0.08
    speed_step_mps2: Annotated[
        float, Assumed(0.2, 0.5, "full speed at 12 to 31 degrees of tilt")
    ] = 0.35
    turn_step_mps2: Annotated[
        float, Assumed(0.07, 0.17, "full turn rate at 12 to 31 degrees of tilt")
    ] = 0.12
