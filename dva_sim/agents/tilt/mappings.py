"""Mappings from a filtered reading to a command: one class each, shipped or a user's.

In all mappings the phone sends absolute values: a speed and a turn rate.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from collections.abc import Mapping as Options
from pathlib import Path
from typing import Any, Final

from typing_extensions import override

from dva_sim.agents.tilt.calibration import LEVELS, MAX_TURN_DEG, NEUTRAL, Reading
from dva_sim.kernel import options
from dva_sim.kernel.plugins import FAILURES, Guard, Plugins, error_text


class Mapping(ABC):
    """Base of all mappings; derive from this to make another one.

    Attributes:
        integrates: True if a command depends on those before. If so, it gets every value of the
            filter once, with the time that it stands for, and the person watches the display. Time
            counts then, not steps: a second of a constant reading, in whole samples or in halves,
            gives the same within 2 %.
        failures: Number of missing or invalid commands; only users' mappings have any.
        first_failure: First failure, in one line.
    """

    integrates: bool = True
    failures = 0
    first_failure = ""

    @abstractmethod
    def command(self, level: float, turn: float, dt: float) -> Reading:
        """Return the command now, which is also what the display shows.

        Args:
            level: Level of the reading.
            turn: Turn of the reading [deg/s].
            dt: Time for which the reading holds [s].

        Returns:
            A level from 0 to `LEVELS`, and a turn rate of at most `MAX_TURN_DEG` either way.
        """

    @abstractmethod
    def tilt_for(self, wanted: Reading, shown: Reading, within: float) -> Reading:
        """Return the reading that a practised hand tilts to.

        Args:
            wanted: Desired command; a level below 0 means to stand for certain.
            shown: Displayed command, as the person has perceived it.
            within: Time in which to get there [s].
        """

    def begin(self) -> None:  # noqa: B027 - most mappings have nothing to forget
        """Begin a drive: reset all integrated values."""


class AbsoluteMapping(Mapping):
    """The tilt is the command.

    Args:
        gain: Gain of the turn rate.
        speed_gain: Gain of the speed.
        dead_zone: Share of the full reading around the reference that means nothing.
    """

    integrates = False

    def __init__(self, gain: float = 1.0, speed_gain: float = 1.0, dead_zone: float = 0.0) -> None:
        self._gain = options.number("gain", gain, above=0)
        self._speed_gain = options.number("speed_gain", speed_gain, above=0)
        share = options.number("dead_zone", dead_zone, least=0, below=1)
        self._dead_level = share * LEVELS
        self._dead_turn = share * MAX_TURN_DEG

    @override
    def command(self, level: float, turn: float, dt: float) -> Reading:
        return limited(
            self._speed_gain * outside(level, self._dead_level),
            self._gain * outside(turn, self._dead_turn),
        )

    @override
    def tilt_for(self, wanted: Reading, shown: Reading, within: float) -> Reading:
        level = beyond(wanted[0] / self._speed_gain, self._dead_level)
        return level, beyond(wanted[1] / self._gain, self._dead_turn)


class DifferentialMapping(AbsoluteMapping):
    """Tilting makes the turn rate grow, the faster the more, up to its limit.

    A phone held level keeps its turn rate. The speed is absolute.

    Args:
        gain: Growth of the turn rate for each degree per second of the reading [1/s].
        speed_gain: Gain of the speed.
        dead_zone: Share of the full reading around the reference that means nothing.
    """

    integrates = True

    def __init__(self, gain: float = 1.0, speed_gain: float = 1.0, dead_zone: float = 0.0) -> None:
        super().__init__(gain, speed_gain, dead_zone)
        self._turn = 0.0

    @override
    def begin(self) -> None:
        self._turn = 0.0

    @override
    def command(self, level: float, turn: float, dt: float) -> Reading:
        grown = self._turn + self._gain * outside(turn, self._dead_turn) * dt
        level, self._turn = limited(self._speed_gain * outside(level, self._dead_level), grown)
        return level, self._turn

    @override
    def tilt_for(self, wanted: Reading, shown: Reading, within: float) -> Reading:
        return super().tilt_for((wanted[0], (wanted[1] - shown[1]) / within), shown, within)


class LeakyMapping(DifferentialMapping):
    """Rate control in which the turn rate of a phone held level decays to zero.

    Args:
        gain: Growth of the turn rate for each degree per second of the reading [1/s].
        speed_gain: Gain of the speed.
        dead_zone: Share of the full reading around the reference that means nothing.
        leak_s: Time constant of the return to zero [s].
    """

    def __init__(
        self,
        gain: float = 1.0,
        speed_gain: float = 1.0,
        dead_zone: float = 0.0,
        leak_s: float = 1.0,
    ) -> None:
        super().__init__(gain, speed_gain, dead_zone)
        self._leak = options.number("leak_s", leak_s, above=0)

    @override
    def command(self, level: float, turn: float, dt: float) -> Reading:
        # Exact for a reading that is constant over `dt`.
        keep = math.exp(-dt / self._leak)
        steady = self._gain * outside(turn, self._dead_turn) * self._leak
        grown = steady + (self._turn - steady) * keep
        level, self._turn = limited(self._speed_gain * outside(level, self._dead_level), grown)
        return level, self._turn

    @override
    def tilt_for(self, wanted: Reading, shown: Reading, within: float) -> Reading:
        # One part closes the gap, the other compensates the leak.
        held = within * shown[1] / self._leak
        return super().tilt_for((wanted[0], wanted[1] + held), shown, within)


class SlewMapping(AbsoluteMapping):
    """The turn rate approaches that of the tilt, with a limited rate of change.

    A phone held level lets it go back to zero as fast. The speed is absolute.

    Args:
        gain: Gain of the turn rate that a tilt means.
        speed_gain: Gain of the speed.
        dead_zone: Share of the full reading around the reference that means nothing.
        slew_deg_s2: Fastest growth of the turn rate [deg/s^2].
    """

    integrates = True

    def __init__(
        self,
        gain: float = 1.0,
        speed_gain: float = 1.0,
        dead_zone: float = 0.0,
        slew_deg_s2: float = 30.0,
    ) -> None:
        super().__init__(gain, speed_gain, dead_zone)
        self._slew = options.number("slew_deg_s2", slew_deg_s2, above=0)
        self._turn = 0.0

    @override
    def begin(self) -> None:
        self._turn = 0.0

    @override
    def command(self, level: float, turn: float, dt: float) -> Reading:
        level, meant = super().command(level, turn, dt)
        most = self._slew * dt
        self._turn += min(max(meant - self._turn, -most), most)
        return level, self._turn


# --- parts of mappings -----------------------------------------------------------------
def outside(value: float, zone: float) -> float:
    """Return by how much a value is outside a zone around zero."""
    if zone == 0.0:
        return value
    return math.copysign(max(abs(value) - zone, 0.0), value)


def beyond(value: float, zone: float) -> float:
    """Return the inverse of `outside`; zero stays zero."""
    return value + math.copysign(zone, value) if value else 0.0


def limited(level: float, turn: float) -> Reading:
    """Return a reading clamped to valid commands: no reverse, and limited rates."""
    return (
        0.0 if level < 0.0 else LEVELS if level > LEVELS else level,
        -MAX_TURN_DEG if turn < -MAX_TURN_DEG else MAX_TURN_DEG if turn > MAX_TURN_DEG else turn,
    )


MAPPINGS: Final[dict[str, Callable[..., Mapping]]] = {
    "absolute": AbsoluteMapping,
    "differential": DifferentialMapping,
    "leaky": LeakyMapping,
    "slew": SlewMapping,
}

PLUGINS: Final = Plugins(
    "mapping",
    Mapping,  # type: ignore[type-abstract]
    MAPPINGS,
    folder="agents/mappings",
    group="dva_sim.mappings",
    key="phone.mapping",
    needs="command(level, turn, dt)",
    public="dva_sim.agents.tilt.Mapping",
)


known_mappings = PLUGINS.known


def load_mapping(
    name: str | Callable[..., Mapping],
    options: Options[str, Any] | None = None,
    base: Path | None = None,
) -> Callable[[], Mapping]:
    """Return a factory for the mapping of a name.

    Args:
        name: A shipped name, a class in a file such as `mine.py:Mine`, or the name under which
            an installed package offers one (entry point, `dva_sim.mappings`).
        options: Keyword arguments of its constructor.
        base: Folder that a file is looked for in first; then the working folder, and
            `agents/mappings`.

    Raises:
        ConfigError: there is none of that name, its file or package cannot be loaded, or it is
            not a mapping; a bad option is reported when it is made.
    """
    return PLUGINS.load(name, options, base)


def load_guarded_mapping(name: str, options: Options[str, Any] | None = None) -> Mapping:
    """Make a mapping for a run; a user's mapping is limited to valid commands.

    Raises:
        ConfigError: as `load_mapping`.
    """
    mapping = load_mapping(name, options)()
    return mapping if name in MAPPINGS else GuardedMapping(mapping)


class GuardedMapping(Guard, Mapping):
    """A mapping of a user; where it gives no answer, the command is to stand."""

    def __init__(self, mapping: Mapping) -> None:
        self._mapping = mapping
        self.integrates = bool(mapping.integrates)

    @override
    def begin(self) -> None:
        # Failures are counted by drive.
        self.failures = 0
        self.first_failure = ""
        try:
            self._mapping.begin()
        except FAILURES as error:
            self._count(error_text(error))

    @override
    def command(self, level: float, turn: float, dt: float) -> Reading:
        # Limited, as a person who wants to stand may command less than zero.
        level, turn = self._answer(self._mapping.command, level, turn, dt) or NEUTRAL
        level = self._clamp("asks for level", max(level, 0.0), 0.0, LEVELS)
        return level, self._clamp("asks for [deg/s]", turn, -MAX_TURN_DEG, MAX_TURN_DEG)

    @override
    def tilt_for(self, wanted: Reading, shown: Reading, within: float) -> Reading:
        # Without an answer the hand holds the phone at rest.
        return self._answer(self._mapping.tilt_for, wanted, shown, within) or NEUTRAL
