"""Drift of the first integrals and distance to the true motion, over one run."""
