"""Mistakes in plans of storms, their profiles and their journals."""

from pathlib import Path

from helpers.mistakes import check_mistake, each_mistake, mistakes, of_file
from helpers.mutation.bugs import named

from dva_sim.storms.campaign import Journal
from dva_sim.storms.drawing import draw
from dva_sim.storms.plan import load_plan

MISTAKES = [
    *mistakes(draw, (1, "massages", "massages messages")),
    *mistakes(
        of_file(lambda name: load_plan(Path(name)), "plan.yaml"),
        ("seed: 1\n", "plan.yaml"),
        ("seed: 1\nfaults: [{kind: x}]\ncalm_s: 2\n", "plan.yaml at_s"),
        ("[]\n", "plan.yaml"),
    ),
    *mistakes(of_file(lambda name: Journal(Path(name)), "storms.jsonl"), ("{}\n", "storms.jsonl")),
    *mistakes(named, ("stop-ignore", "stop-ignore stop-ignored")),
]


@each_mistake(MISTAKES)
def test_a_mistake_ends_in_one_line_with_its_names(tmp_path, act, error, names):
    check_mistake(tmp_path, act, error, names)
