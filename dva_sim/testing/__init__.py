"""Tell of files whether they are valid, and where they are not; print the schemas they follow."""
