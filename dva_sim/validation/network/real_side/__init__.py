"""The real side: Linux TCP and pyzmq over an emulated link, each end in its own network namespace.

A `cell` runs two real programs over the network's emulator and collects what they noted. It may
import the emulator, the network's condition and measures, and the kernel. Begin reading at
`measuring`, which measures many conditions, or at `self_check`, which measures the link itself.
"""
