"""Which policy should send whom: measures, bounds, figures and page of studies of dispatch."""
