"""The figures of a report in words, by name: what `dva-sim list` says of them.

They stand here since the figures themselves bring all that studies are analysed with.
"""

from typing import Final

WORDS: Final = {
    "map": "The cost of each choice in each situation, beyond the best one, over all persons.",
    "claims": "Registered hypotheses: what was found, beside what was claimed.",
    "answer": "The difference that answers the question.",
    "distributions": "Every run as a dot, with median and middle half.",
    "differences": (
        "Each level minus the baseline, paired, with the band that covers all stops at once."
    ),
    "heat_map": "The declared contrast over two factors.",
    "factorial_effects": (
        "Main effects and two-way interactions of a full factorial, with simultaneous intervals."
    ),
    "scatter": "A panel for each factor: a dot for each point, the mean over all its runs.",
    "sobol": "A panel for each cloud: how much of the variance over the ranges is each factor's.",
    "robustness": (
        "Effect and interval of every repeat, by strategy, sorted; the study's own as a band."
    ),
    "delay_budget": (
        "The delay from a picture to its effect, as the sum it is and as it was measured."
    ),
    "command_age": "The age of commands when they take effect, as quantile ranges.",
    "command_rate": "Commands applied per second, beside what arithmetic allows request/reply.",
    "tradeoff": (
        "Response over exposure, a line for each level of the compared factor through its stops."
    ),
    "endings": "Ends of runs and events over time: cumulative incidence of each kind, stacked.",
    "trajectories": (
        "One person, one trial: the ways taken under each line, at the first and the last stop."
    ),
    "time_lapse_typical": "Places of all robots and people at moments of the run in the middle.",
    "time_lapse_worst": "Places of all robots and people at moments of the slowest run.",
    "story_times": "Times of the events that were reached, guards and robots apart.",
    "story_outcomes": "The fate of every event, as shares that add up to one.",
    "trade": "Response against exposure, a mark for each policy, a panel for each load.",
    "stages": "Response against containment: who looks first contains later.",
    "fates": "Cumulative incidence by cause, stacked, for some policies at every load.",
    "way": "The share of what can be gained in response that each policy gains.",
    "percentiles": (
        "The time after which half, nine tenths and 95 % of all events had somebody on scene."
    ),
    "burden": "The workload of each person, and how evenly work and service are spread.",
    "brought": "The service a session gets over each transport, and how the drive over it went.",
    "taken": "The share of the line that a session takes, and the rest that is left to others.",
}
