"""Smoke in the rooms of a building: a layer under each ceiling that fills, spills and cools.

Each space holds one well-mixed hot layer over clean air (a zone model). The fire's plume pumps
air into the layer of its room; where a layer reaches below a lintel it spills into the next
space, entrains air as it rises there, or leaves the building.

Left out: the pressure of the fire and of wind, smoke that cools and sinks to the floor, lack of
oxygen, shut doors.

References:
    NFPA 92:2018, chapter 5: plumes (Heskestad's correlation).
    J. G. Quintiere, Fundamentals of Fire Phenomena, Wiley 2006: zone models, flow in doorways.
    A. Tewarson, in: SFPE Handbook of Fire Protection Engineering: yields of soot and CO.
    G. W. Mulholland and C. Croarkin, Fire and Materials 24 (2000) 227: 8.7 m^2 per g of soot.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from dva_sim.worlds.hazards.building import Spaces
from dva_sim.worlds.hazards.conditions import AMBIENT

Floats = NDArray[np.float64]

GRAVITY = 9.81  # acceleration of gravity [m/s^2]
KELVIN = AMBIENT + 273.15  # temperature of the air outside the smoke [K]
DENSITY = 353.0 / KELVIN  # of that air at sea level [kg/m^3]
HEAT_CAPACITY = 1.005  # specific heat of air [kJ/kg/K]
WALL_LOSS = 0.03  # heat loss to ceiling and walls [kW/m^2/K]; assumed: plaster board after minutes
DISCHARGE = 0.7  # discharge coefficient of doorways
SLICES = 10  # slices of a doorway
HALVINGS = 10  # bisections for the height at which the flow turns
MAX_LEAVING_SHARE = 0.5  # share of a layer that may leave in one step
LOWEST = 0.05  # height below a layer on the floor in which air is still drawn in [m]
SOOT_EXTINCTION = 8700.0  # specific extinction of soot [m^2/kg]
CO_RATIO = 28.96 / 28.01 * 1e6  # ppm per mass fraction

RADIATIVE_FRACTION = 0.3  # radiated share of a fire's heat release; assumed, 0.3 to 0.4 is usual
HEAT_OF_COMBUSTION = 20e3  # heat of combustion of wood and plastics mixed [kJ/kg]; assumed
SOOT_YIELD = 0.05  # soot per fuel [kg/kg]; assumed: wood 0.015, polyurethane foam 0.13 to 0.23
CO_YIELD = 0.02  # carbon monoxide per fuel [kg/kg]; assumed: wood 0.004, polyurethane 0.01 to 0.04

MASS, HEAT, SOOT, CO = range(4)  # columns of a state: [kg], [kJ] above ambient, [kg], [kg]


def plume(convective: float, height: float) -> float:
    """Return air that a fire pumps up to a height [m] above its base, in [kg/s].

    Args:
        convective: Heat that rises [kW].
        height: [m]

    References:
        NFPA 92:2018, equations 5.5.1.1: above and below the flame's limiting height.
    """
    if convective <= 0.0:
        return 0.0
    if height < 0.166 * convective**0.4:
        return float(0.032 * convective**0.6 * height)
    return float(0.071 * convective ** (1 / 3) * height ** (5 / 3) + 0.0018 * convective)


class SmokeLayers:
    """One fire in one space of a building.

    Args:
        spaces: The building.
        heat: Heat release of the fire at an age [s], in [kW].
        room: Index of the space that it burns in.
    """

    def __init__(self, spaces: Spaces, heat: Callable[[float], float], room: int) -> None:
        self._heat = heat
        self._room = room
        self._spaces = spaces
        self._area = np.r_[spaces.area, np.inf]
        self._ceiling = np.r_[spaces.ceiling, 1e3]
        self._around = 4.0 * np.sqrt(spaces.area)  # of a square room [m]
        self._heights = spaces.top[:, None] * (np.arange(SLICES) + 0.5) / SLICES
        self._slice = DISCHARGE * spaces.width[:, None] * spaces.top[:, None] / SLICES

    def empty(self) -> Floats:
        """Clean air: a row for each space and, last, the smoke that has left; columns as above."""
        return np.zeros((self._spaces.count + 1, 4))

    def step(self, state: Floats, age: float, dt: float) -> Floats:
        """Return the state `dt` [s] later."""
        return self._move(state, self._heat(age + dt / 2), dt)

    def step_without_fire(self, state: Floats, age: float, dt: float) -> Floats:
        """Advance a step after the fire has been put out."""
        return self._move(state, 0.0, dt)

    def _move(self, state: Floats, heat: float, dt: float) -> Floats:
        bottom, kelvin = self.layers(state)
        new = state + self._spilt(state, bottom, kelvin, dt)
        new[self._room] += dt * self._risen(heat, float(bottom[self._room]))
        # Heat is lost to the ceiling and to the walls within the layer.
        depth = self._spaces.ceiling - bottom[:-1]
        surface = self._spaces.area + self._around * depth
        rate = WALL_LOSS * surface / (HEAT_CAPACITY * np.maximum(new[:-1, MASS], 1e-9))
        new[:-1, HEAT] /= 1.0 + rate * dt
        self._overflow(new)
        return new

    def layers(self, state: Floats) -> tuple[Floats, Floats]:
        """Height of each layer's lower face [m] and its temperature [K]; outdoors last."""
        kelvin = KELVIN + state[:, HEAT] / (HEAT_CAPACITY * np.maximum(state[:, MASS], 1e-9))
        depth = volumes(state) / self._area
        return self._ceiling - np.minimum(depth, self._ceiling), kelvin

    def _risen(self, heat: float, bottom: float) -> Floats:
        """Return the mass, heat, soot and CO that the plume adds to the layer each second."""
        convective = (1.0 - RADIATIVE_FRACTION) * heat
        fuel = heat / HEAT_OF_COMBUSTION
        air = plume(convective, max(LOWEST, bottom))
        return np.array([air + fuel, convective, SOOT_YIELD * fuel, CO_YIELD * fuel])

    def _spilt(self, state: Floats, bottom: Floats, kelvin: Floats, dt: float) -> Floats:
        """Return the flow through doors in a step."""
        spaces = self._spaces
        change = np.zeros_like(state)
        low = np.minimum(bottom[spaces.a], bottom[spaces.b])
        open_ = np.flatnonzero(low < spaces.top)
        if len(open_) == 0:
            return change
        sides = np.stack([spaces.a[open_], spaces.b[open_]])
        out, height = self._doorways(open_, bottom[sides], kelvin[sides])
        mass = np.maximum(state[:, MASS], 1e-9)
        leaving = np.bincount(sides.ravel(), out.ravel(), len(state)) * dt / mass
        out = out / np.maximum(1.0, leaving / MAX_LEAVING_SHARE)[sides]
        moved = (out * dt / mass[sides])[..., None] * state[sides]
        into = sides[::-1]
        rise = np.maximum(0.0, bottom[into] - height) * (into < spaces.count)
        hot = np.maximum(out * HEAT_CAPACITY * (kelvin[sides] - KELVIN), 1e-6)
        np.subtract.at(change, sides, moved)
        moved[..., MASS] += dt * _entrained(out, hot, rise)
        np.add.at(change, into, moved)
        return change

    def _doorways(
        self, open_: NDArray[np.int64], bottom: Floats, kelvin: Floats
    ) -> tuple[Floats, Floats]:
        """Return the smoke that leaves each side of each doorway [kg/s], and at which height [m].

        As much air flows in as smoke flows out (Rockett): the pressure at the floor differs
        by what makes it so.
        """
        heights = self._heights[open_]
        share = self._slice[open_]
        inside = heights > bottom[..., None]
        density = np.where(inside, (DENSITY * KELVIN / kelvin)[..., None], DENSITY)
        lift = (DENSITY * (1.0 - KELVIN / kelvin))[..., None] * GRAVITY
        lift = lift * np.maximum(0.0, heights - bottom[..., None])
        push = lift[0] - lift[1]
        low = push.min(axis=1)
        high = push.max(axis=1)
        from_a = np.sqrt(2.0 * density[0])
        from_b = np.sqrt(2.0 * density[1])
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            over = push - middle[:, None]
            root = np.sqrt(np.abs(over))
            net = (np.where(over > 0.0, from_a, -from_b) * root).sum(axis=1)
            low = np.where(net > 0.0, middle, low)
            high = np.where(net > 0.0, high, middle)
        over = push - 0.5 * (low + high)[:, None]
        flow = np.stack([from_a * (over > 0.0), from_b * (over < 0.0)])
        flow *= share * np.sqrt(np.abs(over)) * inside
        out = flow.sum(axis=2)
        return out, (flow * heights).sum(axis=2) / np.maximum(out, 1e-12)

    def _overflow(self, state: Floats) -> None:
        """Push smoke from full spaces into neighbours with room, or out through cracks."""
        room = self._area[:-1] * self._ceiling[:-1]
        volume = volumes(state[:-1])
        full = np.append(volume > room, False)
        for space in np.flatnonzero(full):
            excess = state[space] * (1.0 - room[space] / volume[space])
            state[space] -= excess
            a = self._spaces.a
            b = self._spaces.b
            there = np.where(a == space, b, a)
            ways = np.flatnonzero(((a == space) | (b == space)) & ~full[there])
            if len(ways) == 0:
                state[-1] += excess
                continue
            size = self._spaces.width[ways] * self._spaces.top[ways]
            np.add.at(state, there[ways], excess * (size / size.sum())[:, None])


def volumes(state: Floats) -> Floats:
    """Return the volume of each layer [m^3]: at one pressure, mass and heat add to it alike."""
    return (state[:, MASS] + state[:, HEAT] / (HEAT_CAPACITY * KELVIN)) / DENSITY


def _entrained(mass: Floats, heat: Floats, rise: Floats) -> Floats:
    """Return air that smoke draws in as it rises from a doorway [kg/s].

    It goes on as the plume of a fire would that had drawn in so much already.
    """
    strength = 0.071 * np.cbrt(heat)
    below = (mass / strength) ** 0.6
    return np.asarray(strength * (below + rise) ** (5 / 3) - mass)
