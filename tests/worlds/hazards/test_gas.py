"""Gas in the air, against what can be worked out by hand: puffs, walls, fresh air, draughts."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from dva_sim.worlds.geo import Pose
from dva_sim.worlds.hazards.air_mesh import MIXED_HEIGHT, Mesh, make_mesh, side_for
from dva_sim.worlds.hazards.gas_dispersion import Air, Draught
from dva_sim.worlds.maps import FREE, OCCUPIED, OccupancyGrid

RESOLUTION = 0.1  # of the grids below [m]


def floor(width: float, height: float, walls: tuple[tuple[slice, slice], ...] = ()) -> Mesh:
    """A free rectangle [m], with walls as blocks of cells."""
    cells = np.full((round(height / RESOLUTION), round(width / RESOLUTION)), FREE, np.uint8)
    for rows, columns in walls:
        cells[rows, columns] = OCCUPIED
    grid = OccupancyGrid(RESOLUTION, Pose(0.0, 0.0, 0.0), cells)
    return make_mesh(grid, cells == FREE)


def middles(mesh: Mesh) -> NDArray[np.float64]:
    """Positions of the nodes, shape `(n, 2)` [m]."""
    rows, columns = np.nonzero(mesh.nodes >= 0)
    node, points = mesh.nodes[rows, columns], mesh.grid.to_xy(rows + 0.5, columns + 0.5)
    count = np.bincount(node)
    return np.stack([np.bincount(node, points[:, i]) / count for i in (0, 1)], axis=1)


def puff(air: Air, node: int, amount: float, seconds: int) -> NDArray[np.float64]:
    """The air so long after an amount of gas [m^3] was set free at once."""
    state = air.step(air.still(), node, amount / 1e-3, 1e-3)
    for _ in range(2 * seconds):
        state = air.step(state, node, 0.0, 0.5)
    return state[:-1]


# --- meshes ----------------------------------------------------------------------------


def test_a_floor_of_more_nodes_than_32_bits_can_pair_has_a_mesh():
    """60 000 nodes in a row of 6 km: 3.6e9 pairs, each node joined to the next."""
    cells = np.full((1, 60_000), FREE, np.uint8)
    mesh = make_mesh(OccupancyGrid(0.1, Pose(0.0, 0.0, 0.0), cells), cells == FREE, 0.1)
    assert np.array_equal(mesh.b - mesh.a, np.ones(59_999))
    assert mesh.area.sum() == pytest.approx(600.0)


@pytest.mark.parametrize(("floor_m2", "side"), [(100, 0.5), (10_000, 0.5), (40_000, 1.0)])
def test_cells_are_half_a_metre_wide_up_to_10_000_square_metres(floor_m2, side):
    assert side_for(floor_m2) == pytest.approx(side)


# --- puffs -----------------------------------------------------------------------------


def test_a_puff_in_the_open_is_gaussian():
    """1 m3 under a ceiling of 3 m, 0.05 m2/s: after 60 s it is exp(-r2/12)/(12 pi) / 3 m."""
    mesh = floor(20.5, 20.5)
    air = Air(mesh, 0.05, 0.0)
    share = puff(air, mesh.node_at(10.25, 10.25), 1.0, 60)
    r2 = ((middles(mesh) - 10.25) ** 2).sum(axis=1)
    exact = np.exp(-r2 / 12.0) / (12.0 * math.pi) / 3.0
    assert np.abs(share - exact).max() < 0.02 * exact.max()
    variance = (share @ (mesh.area * r2)) / (share @ mesh.area) / 2.0
    assert variance == pytest.approx(2.0 * 0.05 * 60.0, rel=0.01)


def test_a_wall_throws_a_puff_back_as_a_source_behind_it_would():
    mesh = floor(20.5, 15.0)
    air = Air(mesh, 0.05, 0.0)
    share = puff(air, mesh.node_at(10.25, 1.25), 1.0, 120)  # the wall is at y = 0
    x, y = middles(mesh).T
    there, image = (np.exp(-((x - 10.25) ** 2 + (y - s) ** 2) / 24.0) for s in (1.25, -1.25))
    exact = (there + image) / (24.0 * math.pi) / 3.0
    assert np.abs(share - exact).max() < 0.02 * exact.max()


def test_a_draught_carries_a_puff_along_while_it_spreads():
    """0.15 m3/s through a passage of 0.5 m x 3 m are 0.1 m/s: 10 m in 100 s."""
    mesh = floor(40.0, 0.5)
    ends = mesh.node_at(0.25, 0.25), mesh.node_at(39.75, 0.25)
    air = Air(mesh, 0.05, 0.0, Draught(*ends, 0.15))
    share = puff(air, mesh.node_at(8.25, 0.25), 1.0, 100)
    x = middles(mesh)[:, 0]
    mean = share @ x / share.sum()
    assert mean - 8.25 == pytest.approx(10.0, rel=0.01)
    exact = np.exp(-((x - 18.25) ** 2) / 20.0) / math.sqrt(20.0 * math.pi) / 1.5
    assert np.abs(share - exact).max() < 0.08 * exact.max()  # the scheme adds some spread
    assert share.min() >= 0.0


# --- conservation ----------------------------------------------------------------------


def test_what_is_set_free_is_in_the_air_or_was_carried_out():
    wall = (slice(0, 70), slice(48, 50))
    mesh = floor(10.0, 8.0, (wall,))
    draught = Draught(mesh.node_at(1.0, 1.0), mesh.node_at(9.0, 1.0), 0.2)
    air = Air(mesh, 0.05, 2.0 / 3600.0, draught)
    state = air.still()
    for step in range(600):
        state = air.step(state, mesh.node_at(2.0, 6.0), 0.01, 1.0)
        released = 0.01 * (step + 1)
        assert MIXED_HEIGHT * (state[:-1] * air.mesh.area).sum() + state[-1] == pytest.approx(
            released, rel=1e-9
        )
    assert state[-1] > 0.5


def test_a_draught_loses_no_air_on_its_way():
    wall = (slice(0, 70), slice(48, 50))
    mesh = floor(10.0, 8.0, (wall,))
    supply, exhaust = mesh.node_at(1.0, 1.0), mesh.node_at(9.0, 1.0)
    flow = Air(mesh, 0.05, 0.0, Draught(supply, exhaust, 0.2)).flow
    count = len(mesh.area)
    gained = np.bincount(mesh.b, flow, count) - np.bincount(mesh.a, flow, count)
    gained[supply] += 0.2 / 3.0
    gained[exhaust] -= 0.2 / 3.0
    assert np.abs(gained).max() < 1e-12


def test_fresh_air_bounds_what_a_leak_brings_into_a_room_that_is_well_mixed():
    """G = 1 L/s into V = 75 m3 with Q = 6 air changes per hour: G/Q (1 - exp(-Q t / V))."""
    mesh = floor(5.0, 5.0)
    air = Air(mesh, 100.0, 6.0 / 3600.0)
    state, flow = air.still(), 75.0 * 6.0 / 3600.0
    for second in range(1, 1801):
        state = air.step(state, 0, 1e-3, 1.0)
        if second in (60, 600, 1800):
            exact = 1e-3 / flow * (1.0 - math.exp(-flow * second / 75.0))
            assert state[:-1].mean() == pytest.approx(exact, rel=0.003)


# --- walls -----------------------------------------------------------------------------


def test_no_gas_passes_a_wall_wherever_it_stands_in_the_mesh():
    for column in (50, 52, 53):  # on a border of the coarse cells, and within them
        mesh = floor(10.0, 4.0, ((slice(None), slice(column, column + 1)),))
        air = Air(mesh, 0.05, 0.0)
        state = air.still()
        for _ in range(100):
            state = air.step(state, mesh.node_at(4.0, 2.0), 0.01, 10.0)
        behind = middles(mesh)[:, 0] > 0.1 * column
        assert state[:-1][behind].max() == 0.0
        assert state[:-1][~behind].min() > 0.0


def test_a_door_lets_through_as_much_as_it_is_wide():
    """In a passage 8 m long that is 2 m wide and narrows to 1 m half-way, the gas falls twice
    as steeply behind the narrowing, once it flows steadily to where it is sucked off."""
    mesh = floor(16.0, 2.0, ((slice(10, 20), slice(80, 160)),))
    end = mesh.node_at(15.75, 0.25)
    air = Air(mesh, 0.5, 0.0)
    air._out[mesh.node_at(15.75, 0.25)] = air._out[mesh.node_at(15.75, 0.75)] = 1.0
    state = air.still()
    for _ in range(200):
        state = air.step(state, mesh.node_at(0.25, 0.25), 0.01, 60.0)

    def along(x: float) -> float:
        return float(state[mesh.node_at(x, 0.75)])

    assert end >= 0
    wide, narrow = along(3.25) - along(6.25), along(10.25) - along(13.25)
    assert narrow / wide == pytest.approx(2.0, rel=0.01)
    assert wide == pytest.approx(0.01 / 3.0 / 0.5 * 3.0 / 2.0, rel=0.01)  # q L / (D w)


def test_as_much_gas_comes_from_one_place_to_another_as_back():
    mesh = floor(10.0, 8.0, ((slice(0, 70), slice(48, 50)),))
    air = Air(mesh, 0.05, 2.0 / 3600.0)
    there, here = mesh.node_at(2.0, 1.0), mesh.node_at(8.0, 2.0)
    forth, back = air.still(), air.still()
    for _ in range(120):
        forth, back = air.step(forth, there, 0.01, 5.0), air.step(back, here, 0.01, 5.0)
    assert forth[here] == pytest.approx(back[there], rel=1e-9)
    assert forth[here] > 0.0
