"""Network: links, reliable streams on them, and the messaging patterns on top.

It may import the protocol and the kernel. Begin with `messaging`, which says what every transport
promises, then `virtual_network` and `sockets`, which keep it; `patterns` is how commands make use
of it.
"""
