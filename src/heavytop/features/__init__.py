"""One package for each feature: its tables, measurement, document, charts, Python and command."""
