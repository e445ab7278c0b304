"""The real side: Linux TCP and pyzmq over an emulated link, each end in its own network namespace.

`wire` decides when a packet arrives, and a `cell` moves real packets by it between two TUN
devices; `relay` takes its place where namespaces are forbidden, without loss. It may import the
network's condition and measures, the kernel, and no model of the network. Begin reading at
`measuring`, which measures many conditions, or at `self_check`, which measures the link itself.
"""
