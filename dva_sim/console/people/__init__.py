"""Actions that people at pages ask of a console's own run."""
