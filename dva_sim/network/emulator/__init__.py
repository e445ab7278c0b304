"""A modelled link between real programs: TUN devices of two network namespaces, and a forwarder.

The forwarder passes real packets from one device to the other when a `Link` of the model says so;
`relay` takes its place where namespaces are forbidden, without loss. It may import links, and
nothing else of the network. Begin with `forwarder`, then `linux_calls`.
"""
