"""Assumed numbers as keys: of scenarios, of populations, and as factors of studies."""

from dva_sim.agents.population import Population, draw_person
from dva_sim.simulation.labels import with_unit
from dva_sim.simulation.scenario import Scenario, build
from dva_sim.simulation.scenario.assumptions import all_assumptions
from dva_sim.simulation.scenario.parts import OperatorConfig
from dva_sim.simulation.scenario.scenario import population


def test_a_scenario_sets_one_habit_and_leaves_the_others():
    scenario = build({}, {"operator.habits.waiting.shortest_s": 2.2})
    person = draw_person(population(scenario.operator), 1, 0)
    assert person.habits.waiting.shortest_s == 2.2
    usual = draw_person(Population(), 1, 0).habits
    assert person.habits.waiting.settled_s == usual.waiting.settled_s
    assert person.habits.attention == usual.attention


def test_a_scenario_is_written_with_the_habits_that_it_was_given_and_no_others():
    assert "habits" not in build({}).model_dump()["operator"]
    given = {"attention": {"glance_s": 3.0}}
    written = build({}, {"operator.habits": given}).model_dump(mode="json")
    assert written["operator"]["habits"] == given
    assert Scenario.model_validate(written).operator.habits.attention.model_fields_set


def test_a_scenario_changes_the_habits_of_its_population_key_by_key():
    people = Population.model_validate(
        {"habits": {"attention": {"glance_s": 9.0, "reconsiders_s": 1.0}}}
    )
    operator = OperatorConfig.model_validate({"habits": {"attention": {"glance_s": 3.0}}})
    habits = people.habits.changed_by(operator.habits).attention
    assert (habits.glance_s, habits.reconsiders_s) == (3.0, 1.0)


def test_a_habit_is_called_by_what_it_is_about():
    assert with_unit("operator.habits.waiting.shortest_s") == "waiting shortest [s]"


def test_every_listed_key_can_be_set_to_both_ends_of_its_band():
    for each in all_assumptions():
        for end in (each.low, each.high):
            value = int(end) if each.is_whole else end
            assert build({}, {each.key: value})
