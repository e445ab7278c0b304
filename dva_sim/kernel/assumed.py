"""Assumed numbers, which nobody has measured: each is a key with a default, a band and a reason.

A field is marked beside its type: `Annotated[float, Assumed(0.2, 0.6, "reason")]`. The list of all
assumptions and the factors of a screening come from these marks.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

from pydantic import BaseModel, GetCoreSchemaHandler, model_serializer
from pydantic_core import CoreSchema

from dva_sim.kernel.config import Config, fields_below
from dva_sim.kernel.units import unit_of


@dataclass(frozen=True)
class Assumed:
    """A band of plausible values, with the reason for it.

    A value outside of the band is accepted if it has the sign of the band.

    Attributes:
        low: Lower end of the band; zero or above.
        high: Upper end of the band.
        why: Reason for the band, in one sentence.
    """

    low: float
    high: float
    why: str

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Return the schema of the field.

        A number must be positive; zero is allowed if the band contains it.
        """
        schema = handler(source)
        if schema["type"] in ("float", "int"):
            schema = {**schema, "gt" if self.low > 0 else "ge": 0}
        return schema


@dataclass(frozen=True)
class Assumption:
    """One assumed number, under the key that sets it.

    Attributes:
        key: Dotted key of a scenario, as for `--set` and for a factor of a study.
        default: Value if the key is not set.
        low: Lower end of its band.
        high: Upper end.
        why: Reason for the band.
        is_whole: True if the number is a count.
    """

    key: str
    default: float
    low: float
    high: float
    why: str
    is_whole: bool = False

    @property
    def unit(self) -> str:
        """Unit as printed; empty for a plain number."""
        return unit_of(self.key.removesuffix(".median"))


def assumptions_in(model: type[BaseModel], above: str = "", depth: int = 4) -> Iterator[Assumption]:
    """Yield all assumptions of a model and its parts, in order; a trait counts by its median.

    In a scenario a median has a key of its own; in a profile (`depth` 1) it is the trait's key.

    Args:
        model: Model of a file, or of a part of one.
        above: Key of that part, with the dot at its end.
        depth: Depth of nested keys.
    """
    for key, info in fields_below(model, above, depth):
        for note in (note for note in info.metadata if isinstance(note, Assumed)):
            default = info.get_default(call_default_factory=True)
            whole = isinstance(default, int)
            value = getattr(default, "median", default)
            is_trait = hasattr(default, "median")
            key_of_median = f"{key}.median" if is_trait and depth > 1 else key
            yield Assumption(key_of_median, float(value), note.low, note.high, note.why, whole)


class OmitsUnset(Config):
    """A configuration that is written without parts in which no key was set.

    Attributes:
        omitted: Further keys that are left out if empty.
    """

    omitted: ClassVar[tuple[str, ...]] = ()

    @model_serializer(mode="wrap")
    def _with_set(self, handler: Any) -> dict[str, Any]:
        unset = {n for n, part in self if isinstance(part, Sparse) and not part.model_fields_set}
        unset.update(name for name in self.omitted if not getattr(self, name))
        return {key: value for key, value in handler(self).items() if key not in unset}


class Sparse(Config):
    """Configuration of which only explicitly set keys are written.

    Keys that are left out take the default of the program, or of the profile that is changed.
    """

    @model_serializer(mode="wrap")
    def _given(self, handler: Any) -> dict[str, Any]:
        return {key: value for key, value in handler(self).items() if key in self.model_fields_set}

    def changed_by(self, other: Sparse) -> Sparse:
        """Return a copy with every key that is set in `other`."""
        changes = {name: getattr(other, name) for name in other.model_fields_set}
        inner = {
            name: getattr(self, name).changed_by(value)
            for name, value in changes.items()
            if isinstance(value, Sparse)
        }
        return self.model_copy(update=changes | inner) if changes else self
