"""Guards whom people play."""
