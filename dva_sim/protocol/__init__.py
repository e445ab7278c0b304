"""The wire protocol: XML messages validated by `protocol/dva.xsd` when sent and when received."""

from dva_sim.protocol.codec import decode, encode, timestamp
from dva_sim.protocol.errors import ProtocolError
from dva_sim.protocol.messages import Message
from dva_sim.protocol.schema import MAX_BYTES

__all__ = ["MAX_BYTES", "Message", "ProtocolError", "decode", "encode", "timestamp"]
