"""The wire protocol: XML messages validated by `protocol/dva.xsd` when sent and when received.

Begin with `messages`, then `codec`, whose `encode` and `decode` all bytes go through.
"""
