"""The real side: Linux TCP and pyzmq over an emulated link, each end in its own network namespace.

`wire` decides when a packet arrives, `forwarder` moves real packets by it between two TUN
devices, `nodes` and `cell` make the namespaces and end them, `programs` are the operator and the
robot, `measure` runs a condition, `campaign` many, `check` measures the link itself. Where
namespaces are forbidden, `proxy` relays TCP over the loopback without loss.
"""
