"""Formulas against each other, against brute force, and against published numbers."""

import math

import numpy as np
import pytest

from dva_sim.simulation.timed.distributions import (
    Constant,
    Erlang,
    Exponential,
    Gamma,
    Hyperexponential,
    Lognormal,
    Uniform,
    Weibull,
)
from dva_sim.validation.dispatch import exact
from dva_sim.validation.dispatch.queues import erlang_b
from dva_sim.validation.dispatch.transforms import laplace


def gamma(mean, shape=1.0):
    """Shape 1 is exponential, a large shape almost constant."""
    return Gamma(law="gamma", mean_s=mean, shape=shape)


def fixed(mean):
    return Constant(mean_s=mean)


def stationary(states, moves):
    """Chances of the states of a Markov chain; `moves(state)` gives (next state, rate)."""
    place = {state: i for i, state in enumerate(states)}
    flow = np.zeros((len(place), len(place)))
    for state, i in place.items():
        for target, rate in moves(state):
            if target in place:
                flow[i, place[target]] += rate
    balance = (flow - np.diag(flow.sum(axis=1))).T
    balance[-1] = 1.0
    chances = np.linalg.solve(balance, np.eye(len(place))[-1])
    return dict(zip(states, chances, strict=True))


def close(value, expected, rel=1e-9):
    return value == pytest.approx(expected, rel=rel, abs=1e-12)


def test_one_exponential_server_has_the_waits_of_the_textbook():
    m = exact.mmc(arrival_rate=0.8, mean_service_s=1, servers=1)
    assert close(m["delayed"], 0.8)
    assert close(m["wait_s"], 4.0)
    assert close(m["stay_s"], 5.0)
    assert close(m["wait_90_s"], math.log(8) / 0.2)


def test_the_quantiles_of_the_wait_are_those_of_its_distribution():
    m = exact.mmc(2.4, 1, 3)
    for percent in (50, 90, 95):
        quantile = m[f"wait_{percent}_s"]
        (beyond,) = (
            v for k, v in exact.mmc(2.4, 1, 3, at_s=[quantile]).items() if k.startswith("beyond")
        )
        assert close(beyond, 1 - percent / 100)


def test_the_median_wait_is_zero_where_most_do_not_wait():
    assert exact.mmc(0.3, 1, 1)["wait_50_s"] == 0.0


def test_poisson_arrivals_and_exponential_service_are_special_cases_of_any_law():
    m = exact.mmc(0.7, 1, 1)
    assert close(exact.mg1(0.7, gamma(1.0))["wait_s"], m["wait_s"])
    assert close(exact.gm1(gamma(1 / 0.7), 1.0)["wait_s"], m["wait_s"], 1e-7)
    assert close(exact.cobham([0.7], [gamma(1.0)])["wait_1_s"], m["wait_s"])
    assert close(exact.priorities([0.7], 1, 1)["wait_1_s"], m["wait_s"])
    assert close(exact.sqm(0.7, gamma(1.0), side_m=1e-9)["wait_s"], m["wait_s"], 1e-6)


def test_a_constant_service_halves_the_wait():
    wait = exact.mg1(0.5, fixed(1.0))["wait_s"]
    assert close(wait, exact.mmc(0.5, 1, 1)["wait_s"] / 2)


def test_regular_arrivals_at_half_load_wait_with_probability_0_2032():
    assert exact.gm1(fixed(2.0), 1.0)["delayed"] == pytest.approx(0.203188, abs=1e-6)


def test_little_room_is_a_loss_system_and_much_room_is_none():
    loss = exact.mmck(1.5, 1, servers=3, places=0)
    assert close(loss["lost"], exact.mgcc(1.5, 1, 3)["lost"])
    assert loss["wait_s"] == pytest.approx(0, abs=1e-12)
    endless, roomy = exact.mmc(1.5, 1, 3), exact.mmck(1.5, 1, 3, places=400)
    for name in ("wait_s", "delayed", "utilisation"):
        assert close(roomy[name], endless[name])


def test_one_server_with_room_for_k_is_full_with_the_geometric_share():
    m = exact.mmck(0.5, 1, servers=1, places=3)
    assert close(m["lost"], 0.5**4 * 0.5 / (1 - 0.5**5))


def test_patience_without_end_is_no_abandonment_and_none_at_all_is_loss():
    patient, endless = exact.erlang_a(2.4, 1, 3, 1e6), exact.mmc(2.4, 1, 3)
    assert patient["delayed"] == pytest.approx(endless["delayed"], rel=1e-4)
    assert patient["wait_s"] == pytest.approx(endless["wait_s"], rel=1e-4)
    hasty = exact.erlang_a(1.5, 1, 3, 1e-6)
    assert hasty["abandoned"] == pytest.approx(erlang_b(3, 1.5), rel=1e-4)


def test_patience_as_long_as_service_makes_as_many_servers_as_customers():
    """With theta = mu the number inside is Poisson, whatever the number of servers."""
    m = exact.erlang_a(3.0, 1, 3, 1.0)
    chances = [math.exp(-3) * 3**n / math.factorial(n) for n in range(60)]
    assert close(m["delayed"], sum(chances[3:]))
    assert close(m["abandoned"], sum(p * (n - 3) for n, p in enumerate(chances) if n > 3) / 3)


def test_the_wait_of_the_served_agrees_with_the_chain_of_a_tagged_customer():
    """Brute force: the tagged customer's place goes down, or it gives up."""
    rate, mu, c, theta = 3.0, 1.0, 2, 0.5
    states = list(range(120))
    chance = stationary(
        states,
        lambda n: [(n + 1, rate), (n - 1, min(n, c) * mu + max(0, n - c) * theta)],
    )
    served, waited = [1.0], [0.0]  # with 0, 1, 2 ... places to go
    for place in range(1, 120):
        total = c * mu + place * theta
        on = (total - theta) / total
        served.append(on * served[-1])
        waited.append(on * waited[-1] + served[-1] / total)
    come = [(chance[n], max(0, n - c + 1)) for n in states if n < 110]
    share = sum(p * served[j] for p, j in come)
    wait = sum(p * waited[j] for p, j in come) / share
    m = exact.erlang_a(rate, 1 / mu, c, 1 / theta)
    assert close(1 - m["abandoned"], share, 1e-7)
    assert close(m["wait_s"], wait, 1e-7)


def test_priorities_share_out_the_wait_but_do_not_change_it():
    m = exact.priorities([0.6, 0.7, 0.8], 1, 3)
    assert m["wait_1_s"] < m["wait_2_s"] < m["wait_3_s"]
    assert close(m["wait_s"], exact.mmc(2.1, 1, 3)["wait_s"])


def test_the_work_that_waits_is_the_same_in_whatever_order_classes_are_served():
    """Kleinrock's conservation law: the waits weighted by load add up to the same."""
    rates, laws = [0.2, 0.1, 0.3], [gamma(1.0, 2), fixed(2.0), gamma(0.5)]
    loads = [r * law.mean for r, law in zip(rates, laws, strict=True)]
    forwards = exact.cobham(rates, laws)
    backwards = exact.cobham(rates[::-1], laws[::-1])
    one = sum(load * forwards[f"wait_{k}_s"] for k, load in enumerate(loads, 1))
    other = sum(load * backwards[f"wait_{k}_s"] for k, load in enumerate(loads[::-1], 1))
    assert close(one, other)


def test_a_finite_source_agrees_with_the_published_case():
    m = exact.finite_source(4, 1, 60, 20)
    assert m["utilisation"] == pytest.approx(0.7939, abs=5e-5)
    assert m["autonomous"] == pytest.approx(2.3817, abs=5e-5)
    assert m["wait_s"] == pytest.approx(20.769, abs=5e-4)


def test_a_server_for_each_source_leaves_nobody_waiting():
    m = exact.finite_source(5, 5, 60, 20)
    assert m["wait_s"] == pytest.approx(0, abs=1e-12)
    assert close(m["autonomous"], 5 * 60 / 80)


def test_many_sources_that_seldom_ask_are_random_arrivals():
    m = exact.finite_source(20_000, 3, 20_000 / 2.4, 1)
    assert m["wait_s"] == pytest.approx(exact.mmc(2.4, 1, 3)["wait_s"], rel=4e-3)


def test_the_operator_has_no_pause_left_at_the_fan_out():
    assert exact.fan_out(60, 20)["fan_out"] == 4
    assert exact.fan_out(60, 20, robots=3)["utilisation"] == pytest.approx(0.75)
    full = exact.fan_out(60, 20, robots=4)
    assert full["utilisation"] == 1
    assert full["wait_s"] == 0
    assert exact.fan_out(60, 20, robots=6)["wait_s"] == 40


def test_the_second_station_waits_as_if_it_were_alone():
    m = exact.tandem(0.5, 2.0, 2, 1.5, 1)
    assert close(m["wait_1_s"], exact.mmc(0.5, 2.0, 2)["wait_s"])
    assert close(m["wait_2_s"], exact.mmc(0.5, 1.5, 1)["wait_s"])


LISTS = [[1, 2, 3], [1, 3, 2], [2, 1, 3], [3, 1, 2]]


def test_a_hypercube_of_equal_units_is_as_busy_as_a_queue_of_nameless_ones():
    queue = exact.hypercube([0.5, 0.25, 0.35, 0.4], LISTS, 1)
    nameless = exact.mmc(1.5, 1, 3)
    for name in ("utilisation", "delayed", "wait_s"):
        assert close(queue[name], nameless[name])
    loss = exact.hypercube([0.5, 0.25, 0.35, 0.4], LISTS, 1, queue="none")
    assert close(loss["lost"], erlang_b(3, 1.5))


@pytest.mark.parametrize("queue", ["infinite", "none"])
def test_who_serves_whom_adds_up_to_the_calls(queue):
    rates = [0.5, 0.25, 0.35, 0.4]
    m = exact.hypercube(rates, LISTS, [1.0, 0.7, 1.4], queue=queue)
    for k, rate in enumerate(rates, 1):
        assert close(sum(m[f"share_{n}_{k}"] for n in (1, 2, 3)), rate / 1.5)
    accepted = 1.5 * (1 - m.get("lost", 0))
    for n, service in enumerate([1.0, 0.7, 1.4], 1):
        served = accepted * sum(m[f"share_{n}_{k}"] for k in (1, 2, 3, 4))
        assert close(m[f"workload_{n}"], served * service)


def test_a_hypercube_with_unequal_units_agrees_with_a_chain_that_has_its_queue():
    calls, rates, orders = [0.5, 0.6], [1.0, 0.8], [[0, 1], [1, 0]]
    states = [(0, 0, 0), (1, 0, 0), (0, 1, 0)] + [(1, 1, q) for q in range(200)]

    def moves(s):
        *busy, queue = s
        if busy == [1, 1]:
            down = [((1, 1, queue - 1), sum(rates))]
            if not queue:
                down = [((0, 1, 0), rates[0]), ((1, 0, 0), rates[1])]
            return [((1, 1, queue + 1), sum(calls)), *down]
        out = [((0, 0, 0), rates[busy.index(1)])] if 1 in busy else []
        for rate, order in zip(calls, orders, strict=True):
            unit = next(n for n in order if not busy[n])
            after = [*busy]
            after[unit] = 1
            out.append(((*after, 0), rate))
        return out

    chance = stationary(states, moves)
    m = exact.hypercube(calls, [[1, 2], [2, 1]], [1.0, 1.25])
    for n in (0, 1):
        assert close(m[f"workload_{n + 1}"], sum(p for s, p in chance.items() if s[n]), 1e-7)
    assert close(m["wait_s"], sum(p * s[2] for s, p in chance.items()) / 1.1, 1e-7)


def test_the_mean_way_from_the_centre_of_a_square_agrees_with_a_grid():
    grid = (np.arange(1000) + 0.5) / 1000 - 0.5
    ways = np.hypot(grid[:, None], grid)
    assert exact.square_centre()["distance_m"] == pytest.approx(ways.mean(), rel=1e-6)
    assert exact.square_centre(3.0)["square_m2"] == pytest.approx(9 * (ways**2).mean(), rel=1e-5)


def test_the_formulas_give_the_published_numbers():
    """Hypercube: R. C. Larson, A. R. Odoni, Urban Operations Research (1981), 5.4.4."""
    m = exact.mmc(2.4, 1.0, 3)
    assert [m["delayed"], m["wait_s"]] == pytest.approx([0.647191, 1.078652], abs=1e-6)
    assert erlang_b(3, 1.5) == pytest.approx(0.134328, abs=1e-6)
    m = exact.priorities([0.6, 1.5], 1, 3)
    waits = [m["wait_1_s"], m["wait_2_s"], m["wait_s"]]
    assert waits == pytest.approx([0.205144, 0.683812, 0.547049], abs=1e-6)
    m = exact.hypercube([0.5, 0.25, 0.35, 0.4], LISTS, 1)
    workloads = [m[f"workload_{n}"] for n in (1, 2, 3)]
    assert workloads == pytest.approx([0.5574, 0.4734, 0.4693], abs=5e-5)
    for count, way in ((1, 0.52141), (3, 0.32171), (10, 0.17393)):
        assert exact.square_nearest(count)["distance_m"] == pytest.approx(way, abs=1e-5)
    for size, totals in (((5, 5), [1.463611, 2.283333]), ((3, 5), [0.686111, 0.783333])):
        m = exact.assignment(*size)
        assert [m["optimal_s"], m["greedy_s"]] == pytest.approx(totals, abs=1e-6)
    m = exact.sqm(0.5, gamma(0.2))
    assert [m["utilisation"], m["response_s"]] == pytest.approx([0.482598, 0.891266], abs=1e-5)


EVERY_LAW = [
    fixed(2.0),
    Exponential(law="exponential", mean_s=2.0),
    Uniform(law="uniform", low_s=1.0, high_s=3.0),
    Erlang(law="erlang", mean_s=2.0, phases=3),
    Hyperexponential(law="hyperexponential", mean_s=2.0, squared_cv=4.0),
    Lognormal(law="lognormal", mean_s=2.0, spread=0.5),
    gamma(2.0, 0.7),
    Weibull(law="weibull", mean_s=2.0, shape=0.8),
]


@pytest.mark.parametrize("law", EVERY_LAW, ids=lambda law: law.law)
def test_a_transform_is_1_at_zero_and_falls_there_by_the_mean(law):
    assert laplace(law, 0.0) == pytest.approx(1.0, abs=1e-7)
    slope = (laplace(law, 1e-4) - laplace(law, 0.0)) / 1e-4
    assert -slope == pytest.approx(law.mean, rel=1e-3)


@pytest.mark.parametrize("law", EVERY_LAW, ids=lambda law: law.law)
def test_a_transform_is_the_mean_over_draws(law):
    times = law.sample(np.random.default_rng(6), 200_000)
    values = np.exp(-0.7 * times)
    assert abs(values.mean() - laplace(law, 0.7)) <= 3.5 * values.std() / math.sqrt(200_000) + 1e-9
