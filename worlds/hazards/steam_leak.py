"""An example of an own hazard: copy this file, change it, name it: `kind: steam_leak.py:SteamLeak`.

`dva-sim check hazard steam_leak.py:SteamLeak` tells whether it keeps what every hazard promises.

Steam leaves a hole at the speed of sound and mixes with the air as a free round jet. Which way the
jet points is not known, so that every place is taken to lie on its axis: more steam is nowhere.
Left out: the air of the room that warms up, and that walls turn the jet aside.

References:
    API Standard 520, part I, 2020: flow of saturated steam through a hole (Napier).
    A. D. Birch et al., Combustion Science and Technology 36 (1984) 249: the diameter that the jet
    seems to come from, and the share of gas on its axis.
    H. J. Hussein, S. P. Capp and W. K. George, J. Fluid Mech. 258 (1994) 31: speed on the axis.
    O. A. Alduchov and R. E. Eskridge, J. Appl. Meteorology 35 (1996) 601: water that air can hold.
"""

import math
from typing import Annotated

from pydantic import Field

from dva_sim.worlds.hazards import CLEAR, Conditions, Hazard, HazardField
from dva_sim.worlds.line_of_sight import Sight

STEAM, AIR = 0.59, 1.2  # densities at 100 and at 20 deg C [kg/m^3]
SONIC = 470.0  # speed of sound in steam of 100 deg C [m/s]
AXIS, FRONT = 5.0, 5.9  # decay of the share, and of the speed, on the axis of a round jet
WARM, BOILING = 20.0, 100.0  # [deg C]
HUMIDITY = 0.5  # of the air before; assumed
DROP = 5e-6  # radius of the drops of fog [m]; assumed
LEAST = 0.02  # a smaller share is neither warm nor foggy, and is left out
LEAST_DANGER = 2.0  # from the hole: nobody sees a jet of dry steam [m]; assumed
SCALDS = 60.0  # air that people should not be in [deg C]
SERIOUS = 1.0  # counts as severity 1 [kg/s]; assumed


class SteamLeak(Hazard):
    """A hole in a steam pipe; guards shut its valve, as of a gas leak.

    Attributes:
        hole_mm: Its diameter [mm].
        pressure_bar: In the pipe, absolute [bar].
    """

    reported_as = "gas_leak"
    title = "steam leak"
    detectors = ("heat", "smoke")
    shows = ("smoke",)
    colour = "#7d6b91"
    mark = "P"

    hole_mm: Annotated[float, Field(gt=0, le=50)] = 15.0
    pressure_bar: Annotated[float, Field(ge=2, le=40)] = 8.0

    @property
    def flow(self):
        """Steam set free [kg/s]."""
        area = math.pi / 4 * self.hole_mm**2  # [mm^2]
        return area * 100 * self.pressure_bar / 190.5 / 3600

    @property
    def nozzle(self):
        """Diameter of a hole that would set the same steam free at no pressure [m]."""
        return math.sqrt(4 * self.flow / (math.pi * STEAM * SONIC))

    def share(self, distance):
        """Of steam in the air at a distance from the hole [m], by volume."""
        whole = AXIS * self.nozzle * math.sqrt(AIR / STEAM)
        return min(1.0, whole / max(distance, 1e-6))

    def reach(self, share):
        """Where the jet has so much steam left [m]."""
        return AXIS * self.nozzle * math.sqrt(AIR / STEAM) / share

    def front(self, time):
        """How far the jet has come [m]: as fast as it is on its axis, which falls as 1 / x."""
        return math.sqrt(2 * FRONT * SONIC * self.nozzle * max(0.0, time - self.start))

    def radius(self, time):
        """What can be seen of it: its fog [m]."""
        return min(2.5, self.front(time), self.reach(LEAST))

    def danger_radius(self, time):
        """Where the air scalds, and never less than 2 m from the hole."""
        scalding = self.reach((SCALDS - WARM) / (BOILING - WARM))
        return max(LEAST_DANGER, scalding) if time > self.start else 0.0

    def severity(self, time):
        """How much steam there is, once the jet is there."""
        return min(1.0, self.flow / SERIOUS, self.front(time))

    def field(self, site):
        """Of the jet on a site."""
        return SteamField(self, site)


class SteamField(HazardField):
    """Warm, wet air in sight of the hole; gone as soon as the valve is shut."""

    def __init__(self, hazard, site):
        super().__init__(hazard, site)
        self.sight = Sight(site.walls)

    def at(self, x, y, time):
        """The air at a place: its steam drives oxygen out, warms it, and condenses."""
        leak, place = self.hazard, (x, y)
        far = math.dist(leak.position, place)
        share = leak.share(far)
        if not leak.start < time < self.until or far > leak.front(time) or share < LEAST:
            return CLEAR
        if not self.sight.between(leak.position, place):
            return CLEAR
        warm = WARM + share * (BOILING - WARM)
        return Conditions(temperature=warm, gas=share, extinction=fog(share, warm))


def fog(share, temperature):
    """Extinction by the drops of fog in air with a share of steam [1/m]: twice their shadow."""
    water = share * STEAM + (1 - share) * HUMIDITY * holds(WARM) - holds(temperature)  # [kg/m^3]
    return 1.5 * max(0.0, water) / (1000 * DROP)


def holds(temperature):
    """Most water that air can hold as vapour [kg/m^3]."""
    pressure = 610.94 * math.exp(17.625 * temperature / (temperature + 243.04))  # [Pa]
    return pressure / (461.5 * (temperature + 273.15))
