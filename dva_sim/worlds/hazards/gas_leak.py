"""Gas leaks: which gas, how much, how far it is dangerous, and where it is on a site."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from typing_extensions import override

from dva_sim.worlds.hazards.air_mesh import MIXED_HEIGHT, mesh_in
from dva_sim.worlds.hazards.building import NO_SPACE, Floats, SitePoints
from dva_sim.worlds.hazards.conditions import BREATHING_HEIGHT, Conditions
from dva_sim.worlds.hazards.detectors import DetectorAlarm, alarm_in
from dva_sim.worlds.hazards.gas_dispersion import Air, Draught, air_in
from dva_sim.worlds.hazards.gas_plume import plume
from dva_sim.worlds.hazards.hazard import LARGEST, Hazard, March, SolvedField, Step
from dva_sim.worlds.site import Site

if TYPE_CHECKING:
    from dva_sim.worlds.camera.sprites import Sprite

HOUR = 3600.0
EDDY_DIFFUSIVITY = 0.05  # diffusivity of air stirred by ventilation [m^2/s]; assumed
AIR_CHANGES = 2.0  # air changes per hour [1/h]; assumed
MIN_DANGER = 1.0  # minimum dangerous distance from the leak [m]; assumed
FULL_CLOUD = 50.0  # volume at the danger level of severity 1: a small room [m^3]; assumed


class Gas(NamedTuple):
    """A gas that leaks; shares of the volume, 0 to 1.

    Attributes:
        lower: Lower explosive limit.
        upper: Upper explosive limit.
        danger: People should not be where there is more.
        leak: A serious leak in a building [m^3/s]; assumed.

    References:
        ISO/IEC 80079-20-1:2017: explosive limits.
        NIOSH, Immediately Dangerous to Life or Health values: carbon monoxide 1200 ppm.
    """

    lower: float
    upper: float
    danger: float
    leak: float


# Fuel gases are dangerous from 20 % of the lower explosive limit on: the second of the two levels
# that fixed gas detectors are usually set to.
GASES = {
    "methane": Gas(0.044, 0.17, 0.0088, 0.010),
    "propane": Gas(0.017, 0.109, 0.0034, 0.004),
    "carbon_monoxide": Gas(0.109, 0.74, 1200e-6, 1e-4),
}


# The most is assumed: beyond any building, and beyond what the field is made for.
_Flow = Annotated[float, Field(ge=0, le=10)]  # [m^3/s]
_Draught = Annotated[float, Field(ge=0, le=100)]  # [m^3/s]
_Wind = Annotated[float, Field(gt=0, le=50)]  # [m/s]
_Positive = Annotated[float, Field(gt=0)]


class GasLeak(Hazard):
    """A leak that goes on at a steady rate until it is stopped.

    Attributes:
        gas: One of `GASES`.
        rate: Gas set free [m^3/s]; 0 stands for a serious leak of that gas.
        diffusivity: Eddy diffusivity of the air [m^2/s].
        air_changes: Fresh air per hour, in volumes of the room.
        draught: Air blown in at one place indoors and sucked off at another [m^3/s].
        supply_x: Position of the supply [m]; the same for y.
        exhaust_x: Position of the exhaust [m]; the same for y.
        wind: Outdoors [m/s].
        wind_heading: Direction that the wind blows to, counter-clockwise from east [rad].
        stability: Stability class of the air outdoors, A to F.

    References:
        K.-C. Cheng et al., Environ. Sci. Technol. 45 (2011) 4016: 0.001 to 0.013 m^2/s in calm
        rooms, more with more fresh air.
    """

    reported_as = "gas_leak"
    title = "gas leak"
    detectors = ("gas",)
    shows = ("gas",)
    colour = "#b59a00"
    mark = "D"

    gas: Literal["methane", "propane", "carbon_monoxide"] = "methane"
    rate: _Flow = 0.0
    diffusivity: _Positive = EDDY_DIFFUSIVITY
    air_changes: _Positive = AIR_CHANGES
    draught: _Draught = 0.0
    supply_x: float = 0.0
    supply_y: float = 0.0
    exhaust_x: float = 0.0
    exhaust_y: float = 0.0
    wind: _Wind = 2.0
    wind_heading: float = 0.0
    stability: Literal["A", "B", "C", "D", "E", "F"] = "D"

    @property
    def kind_of_gas(self) -> Gas:
        """Its limits."""
        return GASES[self.gas]

    @property
    def release(self) -> float:
        """Gas set free [m^3/s]."""
        return self.rate or self.kind_of_gas.leak

    def radius(self, time: float) -> float:
        """See `Hazard`: the front of a spreading puff.

        References:
            J. Crank, The Mathematics of Diffusion, 2nd ed., Oxford 1975, chapter 3.
        """
        return min(LARGEST, math.sqrt(4.0 * self.diffusivity * max(0.0, time - self.start)))

    def danger_radius(self, time: float) -> float:
        """See `Hazard`: where the gas would exceed its danger level, at least 1 m and at most 20 m.

        Under a ceiling without walls. Outdoors it is the same: farther than the plume needs at the
        height of a mouth, but near the leak there is the jet, which is left out.
        """
        if time < self.start:
            return 0.0
        loss = self.air_changes / HOUR
        ages, radii = _reach(self.release, self.kind_of_gas.danger, self.diffusivity, loss)
        return max(MIN_DANGER, float(np.interp(time - self.start, ages, radii)))

    @override
    def severity(self, time: float) -> float:
        # How much air the gas can bring to its danger level.
        cloud = self.release * max(0.0, time - self.start) / self.kind_of_gas.danger
        return min(1.0, cloud / FULL_CLOUD)

    @override
    def field(self, site: Site) -> LeakField:
        return LeakField(self, site)

    @override
    def noticed_by(self) -> tuple[str, ...]:
        # Carbon monoxide has detectors of its own.
        return ("co",) if self.gas == "carbon_monoxide" else self.detectors

    @override
    def explodes_at(self) -> float:
        return self.kind_of_gas.lower

    @override
    def sprite(self, time: float, ceiling: float) -> Sprite | None:
        # A bottle.
        from dva_sim.worlds.camera.sprites import bottle  # late: start-up

        return bottle()


@lru_cache(maxsize=64)
def _reach(release: float, level: float, diffusivity: float, loss: float) -> tuple[Floats, Floats]:
    """Return how far from a steady source the gas exceeds a level: ages [s] and radii [m].

    A line source from floor to ceiling in the open, diffusing and thinned by fresh air: the
    solution that hydrologists call the leaky aquifer.

    References:
        M. S. Hantush and C. E. Jacob, Trans. Am. Geophys. Union 36 (1955) 95.
    """
    ages = np.geomspace(0.1, 1e5, 150)
    radii = np.linspace(0.05, 20.0, 400)
    rate = np.exp(-(radii[:, None] ** 2) / (4.0 * diffusivity * ages) - loss * ages)
    steps = np.diff(np.log(ages))
    total = np.cumsum(0.5 * (rate[:, 1:] + rate[:, :-1]) * steps, axis=1)
    share = release / (4.0 * math.pi * diffusivity * MIXED_HEIGHT) * total
    reached = (share >= level).sum(axis=0)  # it falls with the distance
    return np.r_[0.0, ages[1:]], np.r_[0.0, np.r_[0.0, radii][reached]]


LARGE_MESH = 20_000  # nodes of a large mesh, of 5000 m^2 of floor
GAS_PACES = ((120.0, 2.0), (600.0, 10.0), (math.inf, 30.0))


@lru_cache(maxsize=16)
def _gas(air: Air, node: int, rate: float) -> March:
    return March(air.still(), lambda state, _, dt: air.step(state, node, rate, dt), GAS_PACES)


class LeakField(SolvedField):
    """Gas from a leak: on the mesh indoors, a plume outdoors."""

    def __init__(self, leak: GasLeak, site: Site) -> None:
        super().__init__(leak, site)
        self._leak = leak
        self._indoors = self.room != NO_SPACE
        self._nodes: tuple[SitePoints, NDArray[np.int64]] | None = None

    @override
    def at(self, x: float, y: float, time: float) -> Conditions:
        # Carbon monoxide kills long before it could explode.
        return self._air_with(self.share(x, y, time))

    def _air_with(self, share: float) -> Conditions:
        if self._leak.gas == "carbon_monoxide":
            return Conditions(co=1e6 * share)
        return Conditions(gas=share, explosive=share / self._leak.kind_of_gas.lower)

    def share(self, x: float, y: float, time: float) -> float:
        """Return the share of the gas in the air, 0 to 1."""
        if time <= self._leak.start:
            return 0.0
        if not self._indoors:
            return self._outdoors(x, y, time)
        node = mesh_in(self.building).node_at(x, y)
        if node < 0:
            return 0.0
        before, after, weight = self.states(time)
        return min(1.0, float(before[node]) * (1.0 - weight) + float(after[node]) * weight)

    def seen_from(self, x: float, y: float) -> Callable[[float], float]:
        """Return the share of gas at a place [m] by the age of a leak that goes on [s].

        In still air as much gas comes from one place to another as would come back from there:
        one solution, with the source at this place, serves leaks wherever they are. In a large
        house that would be slow, for every detector, and the leak's own serves them all.
        """
        if not self._indoors or self._leak.draught > 0.0:
            return lambda age: self.share(x, y, self._leak.start + age)
        mesh = mesh_in(self.building)
        leak = self._leak
        here = mesh.nearest(x, y)
        there = mesh.nearest(*leak.position)
        source = here
        cells = there
        rate = 1.0
        if len(mesh.area) > LARGE_MESH:
            source = there
            cells = here
            rate = leak.release
        march = _gas(self._air, source, rate)

        def share(age: float) -> float:
            before, after, weight = march.around(age)
            gas = float(before[cells] + weight * (after[cells] - before[cells]))
            return leak.release / rate * gas

        return share

    @override
    def alarm(self, detector: str, x: float, y: float) -> DetectorAlarm:
        # Of the leak as it is seen from there.
        share = self.seen_from(x, y)
        return alarm_in(detector, lambda age: self._air_with(share(age)))

    def _outdoors(self, x: float, y: float, time: float) -> float:
        """Return the plume: gas at a place was released as long ago as the wind takes to it."""
        leak = self._leak
        if self._indoors or self.building.space_at(x, y) != NO_SPACE:
            return 0.0
        dx = x - leak.position[0]
        dy = y - leak.position[1]
        cos = math.cos(leak.wind_heading)
        sin = math.sin(leak.wind_heading)
        downwind = dx * cos + dy * sin
        across = dy * cos - dx * sin
        if not leak.start <= time - downwind / leak.wind < self.until:
            return 0.0
        rate = leak.release
        wind = leak.wind
        height = BREATHING_HEIGHT
        return plume(rate, wind, leak.stability, downwind, y=across, z=height)

    @cached_property
    def _air(self) -> Air:
        """The air that it leaks into."""
        leak = self._leak
        mesh = mesh_in(self.building)
        draught = None
        if leak.draught > 0.0:
            supply = mesh.nearest(leak.supply_x, leak.supply_y)
            exhaust = mesh.nearest(leak.exhaust_x, leak.exhaust_y)
            draught = Draught(supply, exhaust, leak.draught)
        return air_in(self.building, leak.diffusivity, leak.air_changes / HOUR, draught)

    @override
    def picture(self, what: str, places: SitePoints, time: float) -> Floats | None:
        if what != "gas":
            return None
        if time <= self._leak.start:
            return np.zeros(places.spaces.shape)
        if not self._indoors:
            shares = [self._outdoors(x, y, time) for x, y in places.points.reshape(-1, 2).tolist()]
            return np.array(shares).reshape(places.spaces.shape)
        share = self.state(time)
        share[-1] = 0.0  # what was carried out is nowhere
        if self._nodes is None or self._nodes[0] is not places:
            self._nodes = places, places.of(mesh_in(self.building).nodes)
        return np.minimum(1.0, share[self._nodes[1]])

    @override
    def solve(self) -> tuple[March, Step]:
        air = self._air
        node = mesh_in(self.building).nearest(*self._leak.position)
        march = _gas(air, node, self._leak.release)
        return march, lambda state, _, dt: air.step(state, node, 0.0, dt)
