"""Measurements: drift, errors against references, rounding noise and growth laws."""
