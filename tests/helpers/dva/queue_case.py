"""A file of one case of the evidence on dispatch: a queue of two servers."""

from dva_sim.validation.dispatch.cases import load_cases

CASE = """
cases:
  queue:
    title: A queue
    formula: {formula}
    parameters: {parameters}
    measures: {measures}
    scenario:
      model: timed
      responders: [{{name: guard, count: 2, look: {look}}}]
      demand: [{{kind: fire, between: {between}}}]
"""
GIVEN = {
    "formula": "mmc",
    "parameters": "{arrival_rate: $demand.fire.between, mean_service_s: $responders.0.look, "
    "servers: $responders.guard.count}",
    "measures": "[wait_s, delayed]",
    "look": "{law: exponential, mean_s: 3}",
    "between": "{law: exponential, mean_s: 2}",
}


def load_case(folder, **changes):
    """The case in a file, with these words of it changed."""
    path = folder / "mine.yaml"
    path.write_text(CASE.format(**(GIVEN | changes)))
    return load_cases(str(path))
