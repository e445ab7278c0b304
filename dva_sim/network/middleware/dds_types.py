"""The type that travels over DDS; its annotations are read when the class is made."""

from dataclasses import dataclass

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import sequence, uint8


@dataclass
class Bytes(IdlStruct):  # type: ignore[misc]
    """A message of ours.

    Attributes:
        data: Its bytes.
    """

    data: sequence[uint8]
